//! The tree itself: 12-byte nodes, the references in leaf order, and the bounds they lie in.

mod compact;
mod node;
mod stats;
mod table;
mod validate;
mod visitor;
mod wide;

pub use compact::CompactRecord;
pub use node::{Kind, Node};
pub use stats::Stats;
pub use table::{NodeRow, node_table};
pub use validate::validate;
pub use visitor::{Visit, Visitor};
pub use wide::{Child, Orders, Record, Records, Target, WIDTH, Wide};

use crate::build::{Heuristic, Precision};
use crate::geometry::Bounds;

/// Depth up to which a cell is halved; below it, ranges are split by object median.
pub const MAX_SPATIAL_DEPTH: u32 = 96;

/// The deepest node there can be: 2^29 references are halved at most 29 times more.
pub const MAX_DEPTH: u32 = MAX_SPATIAL_DEPTH + 29;

/// A Bounding Interval Hierarchy over triangles that it does not hold: every query is given the same view of them.
#[derive(Debug, Clone)]
pub struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// Instead of the nodes.
    pub(crate) wide: Option<Wide>,
    /// Triangle rows in leaf order, then the rejected rows.
    pub(crate) order: Vec<u32>,
    pub(crate) rejected: usize,
    pub(crate) bounds: Bounds,
    pub(crate) precision: Precision,
    pub(crate) heuristic: Heuristic,
    pub(crate) leaf_size: usize,
    pub(crate) stats: Stats,
}

impl Tree {
    /// The nodes of the classic layout; the root is the first, children stand side by side. Empty in the wide layout.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Triangle rows in leaf order, then those that no ray can hit.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Triangle rows that leaves refer to, in leaf order.
    pub fn references(&self) -> &[u32] {
        &self.order[..self.order.len() - self.rejected]
    }

    /// The records of the wide and compact layouts.
    pub fn wide(&self) -> Option<&Wide> {
        self.wide.as_ref()
    }

    /// Bounds of all triangles that can be hit; empty where there is none.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// How rays are tested against its triangles.
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Where ranges of triangles were split.
    pub fn heuristic(&self) -> Heuristic {
        self.heuristic
    }

    /// What the tree is and what it cost.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }
}
