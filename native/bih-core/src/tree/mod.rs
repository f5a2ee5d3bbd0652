//! The tree itself: 12-byte nodes, the references in leaf order, and the bounds they lie in.

mod binary;
mod compact;
mod node;
mod stats;
mod table;
mod validate;
mod visitor;
mod wide;

pub use binary::BinaryTree;
pub use compact::CompactRecord;
pub use node::{Kind, Node};
pub use stats::Stats;
pub use table::{NodeRow, node_table};
pub use validate::validate;
pub use visitor::{Visit, Visitor};
pub use wide::{Child, Orders, Record, Records, Target, WIDTH, Wide};

use crate::build::{Heuristic, Precision, Structure};
use crate::geometry::Bounds;
use crate::kd_tree::KdTree;

/// Depth up to which a cell is halved; below it, ranges are split by object median.
pub const MAX_SPATIAL_DEPTH: u32 = 96;

/// The deepest node there can be: 2^29 references are halved at most 29 times more.
pub const MAX_DEPTH: u32 = MAX_SPATIAL_DEPTH + 29;

/// A Bounding Interval Hierarchy, or one of its rivals, over triangles that it does not hold: every query is given the same view of them.
#[derive(Debug, Clone)]
pub struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// Instead of the nodes.
    pub(crate) wide: Option<Wide>,
    /// Instead of both, with an order of its own.
    pub(crate) kd_tree: Option<KdTree>,
    /// Triangle rows in leaf order, then the rejected rows.
    pub(crate) order: Vec<u32>,
    pub(crate) rejected: usize,
    pub(crate) bounds: Bounds,
    pub(crate) structure: Structure,
    pub(crate) precision: Precision,
    pub(crate) heuristic: Heuristic,
    pub(crate) leaf_size: usize,
    pub(crate) stats: Stats,
}

impl Tree {
    /// The nodes of the hierarchy's classic layout; the root is the first, children stand side by side. Otherwise empty.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Triangle rows in leaf order, then those that no ray can hit. A kd-tree may name a row several times.
    pub fn order(&self) -> &[u32] {
        self.kd_tree.as_ref().map_or(&self.order, KdTree::order)
    }

    /// Triangle rows that leaves refer to, in leaf order.
    pub fn references(&self) -> &[u32] {
        let order = self.order();
        &order[..order.len() - self.rejected]
    }

    /// The records of the wide and compact layouts.
    pub fn wide(&self) -> Option<&Wide> {
        self.wide.as_ref()
    }

    /// Bounds of all triangles that can be hit; empty where there is none.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// The nodes of a kd-tree.
    pub fn kd_tree(&self) -> Option<&KdTree> {
        self.kd_tree.as_ref()
    }

    /// Which structure it is.
    pub fn structure(&self) -> Structure {
        self.structure
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
