//! The way of a ray through a binary tree.

use std::ops::ControlFlow;

use super::interval::Crossing;
use super::{KdTree, MAX_DEPTH};
use crate::geometry::{Bounds, Ray};
use crate::traverse::Counter;
use crate::tree::{self, Kind, Tree};

/// Nodes whose children lie below and above planes across one axis.
pub trait BinaryTree {
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

impl BinaryTree for KdTree {
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
        self.nodes[node].kind()
    }
    #[inline(always)]
    fn references(&self) -> &[u32] {
        &self.references
    }
}

/// The classic layout.
impl BinaryTree for Tree {
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
        self.references()
    }
}

/// A step down puts off at most one child, and no node of either tree is deeper than this.
pub(super) const DEEPEST: usize =
    if MAX_DEPTH > tree::MAX_DEPTH { MAX_DEPTH as usize } else { tree::MAX_DEPTH as usize };

/// A node to visit later, and the part of the ray that lies in it.
#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    node: usize,
    near: f64,
    far: f64,
}

/// Room for one node a level. Made once for many rays.
#[derive(Debug, Clone)]
pub struct Stack {
    entries: [Entry; DEEPEST],
}

impl Default for Stack {
    fn default() -> Self {
        Self { entries: [Entry::default(); DEEPEST] }
    }
}

/// Visit the leaves that the ray crosses, front to back. `leaf` answers how far the ray still matters, or that it is done.
///
/// In a kd-tree a leaf's triangle may be hit outside its cell, and is offered again in other leaves: the nearest hit is
/// known once the next cell begins behind it.
#[inline(always)]
pub fn walk<T: BinaryTree, C: Counter>(
    tree: &T,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
    mut leaf: impl FnMut(&[u32]) -> ControlFlow<(), f64>,
) {
    if tree.is_empty() {
        return;
    }
    let crossing = Crossing::new(ray);
    let (near, far) = crossing.clip(tree.bounds(), ray.t_min, ray.t_max);
    let mut limit = ray.t_max;
    let mut waiting = 0;
    let mut entry = Entry { node: 0, near, far };
    loop {
        if entry.near <= entry.far {
            counter.visit_node();
            match tree.kind(entry.node) {
                Kind::Inner { axis, left, clip } => {
                    let backwards = usize::from(crossing.is_negative(axis));
                    let first_ends = crossing.latest(axis, clip[backwards]);
                    let second_starts = crossing.earliest(axis, clip[1 - backwards]);
                    // Written so that NaN changes nothing.
                    let far = if first_ends < entry.far { first_ends } else { entry.far };
                    let near = if second_starts > entry.near { second_starts } else { entry.near };
                    let first = Entry { node: left + backwards, near: entry.near, far };
                    let second = Entry { node: left + 1 - backwards, near, far: entry.far };
                    if second.near > second.far {
                        entry = first;
                    } else if first.near > first.far {
                        entry = second;
                    } else {
                        stack.entries[waiting] = second;
                        waiting += 1;
                        entry = first;
                    }
                    continue;
                }
                Kind::Leaf { first, count } => {
                    counter.test_triangles(count);
                    if count > 0 {
                        match leaf(&tree.references()[first..first + count]) {
                            ControlFlow::Continue(t) => limit = t,
                            ControlFlow::Break(()) => return,
                        }
                    }
                }
            }
        }
        if waiting == 0 {
            return;
        }
        waiting -= 1;
        entry = stack.entries[waiting];
        entry.far = if limit < entry.far { limit } else { entry.far };
    }
}
