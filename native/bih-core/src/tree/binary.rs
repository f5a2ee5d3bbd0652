//! Trees of nodes with two children each, whatever their records.

use super::{Kind, Tree};
use crate::geometry::Bounds;

/// Nodes whose children lie below and above planes across one axis.
pub trait BinaryTree {
    /// Whether the two planes of a node are always the same one.
    const ONE_PLANE: bool;
    /// The box of all triangles.
    fn bounds(&self) -> &Bounds;
    /// How many nodes there are; the root has number 0.
    fn len(&self) -> usize;
    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// A node.
    fn kind(&self, node: usize) -> Kind;
    /// Triangle rows, leaf after leaf.
    fn references(&self) -> &[u32];
}

/// The classic layout.
impl BinaryTree for Tree {
    const ONE_PLANE: bool = false;
    #[inline(always)]
    fn bounds(&self) -> &Bounds {
        self.bounds()
    }
    #[inline(always)]
    fn len(&self) -> usize {
        self.nodes().len()
    }
    #[inline(always)]
    fn kind(&self, node: usize) -> Kind {
        self.nodes()[node].kind()
    }
    #[inline(always)]
    fn references(&self) -> &[u32] {
        self.order.all().expect("a tree that was built at once")
    }
}
