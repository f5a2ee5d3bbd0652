//! The tree itself: 12-byte nodes, the references in leaf order, and the bounds they lie in.

mod binary;
mod compact;
mod copies;
mod hand_over;
mod node;
mod shared;
mod stats;
mod table;
mod validate;
mod visitor;
mod wide;

pub use binary::BinaryTree;
pub use compact::CompactRecord;
pub use copies::Copies;
pub(crate) use hand_over::{Claim, Found, Roots};
pub use node::{Kind, Node};
pub(crate) use shared::LeafRows;
pub use shared::Shared;
pub use stats::Stats;
pub use table::{NodeRow, node_table};
pub use validate::validate;
pub use visitor::{Visit, Visitor};
pub use wide::{Child, Orders, Record, Records, Target, WIDTH, Wide};

use crate::build::{Build, Heuristic, OnDemand, Precision, Structure};
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::kd_tree::KdTree;
use crate::memory;

/// Depth up to which a cell is halved; below it, ranges are split by object median.
pub const MAX_SPATIAL_DEPTH: u32 = 96;

/// The deepest node there can be: 2^29 references are halved at most 29 times more.
pub const MAX_DEPTH: u32 = MAX_SPATIAL_DEPTH + 29;

/// A Bounding Interval Hierarchy, or one of its rivals, over triangles that it does not hold: every query is given the same
/// view of them.
#[derive(Debug)]
pub struct Tree {
    pub(crate) nodes: Shared<Node>,
    /// Instead of the nodes.
    pub(crate) wide: Option<Wide>,
    /// Instead of both, with an order of its own.
    pub(crate) kd_tree: Option<KdTree>,
    /// Triangle rows in leaf order, then the rejected rows.
    pub(crate) order: Shared<u32>,
    pub(crate) bounds: Bounds,
    pub(crate) structure: Structure,
    pub(crate) precision: Precision,
    pub(crate) heuristic: Heuristic,
    pub(crate) leaf_size: usize,
    pub(crate) build: Build,
    pub(crate) stats: Stats,
    /// The pieces that are built when rays come to them; none where all was built at once.
    pub(crate) on_demand: Option<OnDemand>,
}

impl Tree {
    /// The nodes of the classic layout that were built at once; the root is the first, children stand side by side. Empty
    /// in the other layouts.
    pub fn nodes(&self) -> &[Node] {
        let top = self.on_demand.as_ref().map_or(usize::MAX, OnDemand::top);
        self.nodes.slice(0..self.nodes.len().min(top))
    }

    /// Triangle rows in leaf order, then those that no ray can hit. A kd-tree may name a row several times.
    pub fn order(&self) -> Vec<u32> {
        match (&self.on_demand, &self.kd_tree) {
            (Some(on_demand), _) => on_demand.order(self),
            (None, Some(kd_tree)) => kd_tree.order().to_vec(),
            (None, None) => self.order.slice(0..self.order.len()).to_vec(),
        }
    }

    /// Triangle rows that leaves refer to, in leaf order.
    pub fn references(&self) -> Vec<u32> {
        let mut order = self.order();
        order.truncate(order.len() - self.stats.rejected);
        order
    }

    /// Build all that is not built yet, on all threads of the pool that the caller runs in.
    pub fn build_all(&self, triangles: &Triangles, control: &Control) -> Result<(), Error> {
        self.room("the construction", 0)?;
        self.on_demand.as_ref().map_or(Ok(()), |on_demand| Ok(on_demand.build_all(self, triangles, control)?))
    }

    /// Ask for memory before rays are traced: for answers of so many bytes, and for the pieces that are built meanwhile.
    pub(crate) fn room(&self, what: &'static str, bytes: usize) -> Result<(), Error> {
        memory::room(what, bytes + self.piece_bytes())
    }

    /// What pieces that are built meanwhile may hold at once.
    pub(crate) fn piece_bytes(&self) -> usize {
        self.on_demand.as_ref().map_or(0, OnDemand::working_bytes)
    }

    /// The root of a piece; none while another thread builds it. Built here if nobody does.
    #[inline(always)]
    pub(crate) fn enter(&self, piece: usize, triangles: &Triangles) -> Option<u32> {
        self.on_demand.as_ref()?.enter(self, piece, triangles)
    }

    /// How many records or nodes there are.
    pub(crate) fn used(&self) -> usize {
        match (&self.on_demand, &self.wide) {
            (Some(on_demand), _) => on_demand.used(),
            (None, Some(wide)) => wide.records.len(),
            (None, None) => self.nodes.len(),
        }
    }

    /// Depth of the deepest leaf that there is, in records.
    #[inline(always)]
    pub(crate) fn depth(&self) -> usize {
        match &self.on_demand {
            Some(on_demand) => on_demand.depth(),
            None => self.wide.as_ref().map_or(0, |wide| wide.depth),
        }
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

    /// Whether all was to be built at once.
    pub fn build(&self) -> Build {
        self.build
    }

    /// What the tree is and what it cost, so far.
    pub fn stats(&self) -> Stats {
        match &self.on_demand {
            Some(on_demand) => on_demand.stats(self),
            None => self.stats.clone(),
        }
    }
}
