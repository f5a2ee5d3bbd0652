//! The binary tree of a short range, with the boxes of all its nodes. It lives in the cache until it is emitted.

use super::frame::{Cut, Split};
use crate::geometry::Bounds;

/// A node: an inner one has its children side by side, a leaf a range of references.
#[derive(Debug, Clone, Copy)]
pub struct Branch {
    pub bounds: Bounds,
    /// First reference of a leaf, counted from the treelet's own.
    pub first: u32,
    pub count: u32,
    /// Index of the lower child; 0 in a leaf.
    pub left: u32,
    axis: u32,
}

/// On the longest axis of the bounds, once these are known.
const LONGEST: u32 = 3;

impl Branch {
    pub fn leaf(first: usize, count: usize) -> Self {
        Self { bounds: Bounds::EMPTY, first: first as u32, count: count as u32, left: 0, axis: 0 }
    }

    pub fn open(&mut self, left: usize, axis: Option<usize>) {
        self.left = left as u32;
        self.axis = axis.map_or(LONGEST, |axis| axis as u32);
    }

    #[inline(always)]
    pub fn is_leaf(&self) -> bool {
        self.left == 0
    }

    #[inline(always)]
    pub fn axis(&self) -> usize {
        self.axis as usize
    }
}

/// Nodes, the root first, children behind their parents.
#[derive(Debug, Default)]
pub struct Treelet {
    pub branches: Vec<Branch>,
    /// Place of its first reference in the whole tree.
    pub first: usize,
}

impl Treelet {
    /// Split the items until ranges of `leaf_size` are reached.
    pub fn plan<S: Split>(&mut self, split: &S, items: &mut [S::Item], state: S::State, depth: u32, leaf_size: usize) {
        self.branches.clear();
        self.branches.push(Branch::leaf(0, items.len()));
        let mut waiting = vec![(0usize, depth, state)];
        while let Some((index, depth, mut state)) = waiting.pop() {
            let Branch { first, count, .. } = self.branches[index];
            let (first, count) = (first as usize, count as usize);
            if count <= leaf_size {
                continue;
            }
            let cut = split.split(&mut items[first..first + count], &mut state, depth);
            let Cut { count: lower, axis } = cut;
            let left = self.branches.len();
            self.branches[index].open(left, axis);
            self.branches.extend([Branch::leaf(first, lower), Branch::leaf(first + lower, count - lower)]);
            waiting.push((left + 1, depth + 1, state));
            waiting.push((left, depth + 1, state));
        }
    }

    /// The bounds of inner nodes from those of the leaves.
    pub fn unite(&mut self) {
        for index in (0..self.branches.len()).rev() {
            let branch = self.branches[index];
            if branch.is_leaf() {
                continue;
            }
            let left = branch.left as usize;
            let bounds = self.branches[left].bounds.union(&self.branches[left + 1].bounds);
            let branch = &mut self.branches[index];
            branch.bounds = bounds;
            if branch.axis == LONGEST {
                let side = |axis: usize| bounds.upper[axis] - bounds.lower[axis];
                branch.axis =
                    (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest }) as u32;
            }
        }
    }
}
