//! The kd-tree by the surface area heuristic: the rival that the Bounding Interval Hierarchy is measured against.
//!
//! Wald and Havran, "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)", 2006. Space is split,
//! not the triangles: a leaf refers to all that reach into its cell, so a triangle may be referred to several times.

mod build;
mod clip;
mod cost;
mod event;
mod lists;
mod node;
mod packet;
mod split;
mod validate;
mod walk;

pub use build::{bound_bytes, build};
pub use cost::ExpectedCost;
pub use node::KdNode;
pub use packet::{LANES, Packet};
pub use split::Costs;
pub(crate) use walk::walk_around;
pub use walk::{Stack, walk, walk_packet};

use crate::geometry::Bounds;
use crate::tree::{BinaryTree, Kind, Shared};

/// The deepest node there can be: no split is made below. Measured in docs/decisions/kd-tree.md.
pub const MAX_DEPTH: u32 = 64;

/// A kd-tree over triangles that it does not hold: every query is given the same view of them.
#[derive(Debug, PartialEq)]
pub struct KdTree {
    nodes: Shared<KdNode>,
    /// Triangle rows, leaf after leaf, in order within a leaf; then those that no ray can hit.
    order: Shared<u32>,
    bounds: Bounds,
    stats: KdStats,
}

/// What a tree is and what it cost. Times in seconds, sizes in bytes.
#[derive(Debug, Clone, Default)]
pub struct KdStats {
    /// Rows of the mesh.
    pub triangles: usize,
    /// Triangles that no ray can hit: non-finite coordinates or zero area.
    pub rejected: usize,
    /// Inner nodes and leaves.
    pub nodes: usize,
    /// Leaves alone.
    pub leaves: usize,
    /// Leaves without triangles.
    pub empty_leaves: usize,
    /// Triangles of all leaves.
    pub references: usize,
    /// Depth of the deepest node; the root has 0.
    pub depth: usize,
    /// Nodes, references and rejected rows.
    pub tree_bytes: usize,
    /// What `tree_bytes` was known before the build never to exceed.
    pub bound_bytes: usize,
    /// Memory of the construction at its peak, the tree included and the caller's mesh not.
    pub peak_build_bytes: usize,
    /// Wall-clock time of the build.
    pub build_seconds: f64,
}

/// What the construction cost is left out: it differs from build to build.
impl PartialEq for KdStats {
    fn eq(&self, other: &Self) -> bool {
        let counts = |stats: &Self| {
            let Self { triangles, rejected, nodes, leaves, empty_leaves, references, depth, .. } = *stats;
            [triangles, rejected, nodes, leaves, empty_leaves, references, depth]
        };
        counts(self) == counts(other)
    }
}

impl KdStats {
    /// How often a triangle that can be hit is referred to, on average.
    pub fn references_per_triangle(&self) -> f64 {
        self.references as f64 / (self.triangles - self.rejected).max(1) as f64
    }
}

impl KdTree {
    /// Of parts that belong together.
    pub(crate) fn new(nodes: Shared<KdNode>, order: Shared<u32>, bounds: Bounds, stats: KdStats) -> Self {
        Self { nodes, order, bounds, stats }
    }

    /// The nodes; the root is the first, children stand side by side. Empty where no triangle can be hit.
    pub fn nodes(&self) -> &[KdNode] {
        self.nodes.slice(0..self.nodes.len())
    }

    /// Triangle rows in leaf order, those in several leaves several times; then those that no ray can hit.
    pub fn order(&self) -> &[u32] {
        self.order.slice(0..self.order.len())
    }

    /// Triangle rows that leaves refer to, in leaf order.
    pub fn references(&self) -> &[u32] {
        self.order.slice(0..self.stats.references)
    }

    /// Rows of the triangles that no ray can hit.
    pub fn rejected(&self) -> &[u32] {
        self.order.slice(self.stats.references..self.order.len())
    }

    /// Bounds of all triangles that can be hit; empty where there is none.
    pub fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// What the tree is and what it cost.
    pub fn stats(&self) -> &KdStats {
        &self.stats
    }
}

impl BinaryTree for KdTree {
    const ONE_PLANE: bool = true;
    #[inline(always)]
    fn bounds(&self) -> &Bounds {
        &self.bounds
    }
    #[inline(always)]
    fn len(&self) -> usize {
        self.nodes.len()
    }
    #[inline(always)]
    fn kind(&self, node: usize) -> Kind {
        self.nodes.get(node).kind()
    }
    #[inline(always)]
    fn references(&self) -> &[u32] {
        self.references()
    }
}
