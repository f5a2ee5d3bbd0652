//! The binary tree of a short range, with the boxes of all its nodes. It lives in the cache until it is emitted.

use super::collapse::Collapse;
use super::frame::{Cut, Split};
use crate::geometry::Bounds;
use crate::simd::Lanes;

/// A node: an inner one has its children side by side, a leaf a range of references.
#[derive(Debug, Clone, Copy)]
pub struct Branch {
    pub bounds: Bounds,
    /// Its first reference, counted from the treelet's own.
    pub first: u32,
    pub count: u32,
    /// Index of the lower child; 0 in a leaf.
    pub left: u32,
    axis: u32,
}

/// On the longest axis of the bounds, once these are known.
const LONGEST: u32 = 3;

impl Branch {
    fn new(first: u32, count: u32) -> Self {
        Self { bounds: Bounds::EMPTY, first, count, left: 0, axis: 0 }
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
    /// Indices of the inner nodes, children behind their parents.
    pub inner: Vec<u32>,
    /// Indices of the leaves in the order of their references.
    pub leaves: Vec<u32>,
    /// Place of its first reference in the whole tree.
    pub first: usize,
    /// Halvings that had all objects on one side.
    pub skipped: usize,
}

impl Treelet {
    /// What it takes in memory, and what planning its records takes.
    pub fn bytes(&self) -> usize {
        self.branches.len() * (size_of::<Branch>() + Collapse::BYTES)
            + (self.inner.len() + self.leaves.len()) * size_of::<u32>()
    }

    /// A single leaf.
    pub fn start(&mut self, count: usize) {
        self.branches.clear();
        self.inner.clear();
        self.leaves.clear();
        self.skipped = 0;
        self.branches.push(Branch::new(0, count as u32));
    }

    /// Give a node its two children; answers the index of the lower one.
    #[inline(always)]
    pub fn open(&mut self, index: usize, cut: Cut) -> usize {
        self.inner.push(index as u32);
        let left = self.branches.len();
        let branch = &mut self.branches[index];
        branch.left = left as u32;
        branch.axis = cut.axis.map_or(LONGEST, |axis| axis as u32);
        let (first, count, lower) = (branch.first, branch.count, cut.count as u32);
        self.branches.extend([Branch::new(first, lower), Branch::new(first + lower, count.wrapping_sub(lower))]);
        self.skipped += cut.skipped as usize;
        left
    }

    /// Split the items until ranges of `leaf_size` are reached.
    #[inline(always)]
    pub fn plan<S: Split, L: Lanes>(
        &mut self,
        split: &S,
        items: &mut [S::Item],
        state: S::State,
        depth: u32,
        leaf_size: usize,
    ) {
        self.start(items.len());
        let mut waiting = vec![(0usize, depth, state)];
        while let Some((index, depth, mut state)) = waiting.pop() {
            let Branch { first, count, .. } = self.branches[index];
            let (first, count) = (first as usize, count as usize);
            if count <= leaf_size {
                self.leaves.push(index as u32);
                continue;
            }
            let cut = split.split::<L>(&mut items[first..first + count], &mut state, depth);
            let left = self.open(index, cut);
            waiting.push((left + 1, depth + 1, state));
            waiting.push((left, depth + 1, state));
        }
    }

    /// The bounds of inner nodes from those of the leaves.
    pub fn unite(&mut self) {
        for &index in self.inner.iter().rev() {
            let left = self.branches[index as usize].left as usize;
            let bounds = self.branches[left].bounds.union(&self.branches[left + 1].bounds);
            let branch = &mut self.branches[index as usize];
            branch.bounds = bounds;
            if branch.axis == LONGEST {
                branch.axis = longest_axis(&bounds);
            }
        }
    }
}

fn longest_axis(bounds: &Bounds) -> u32 {
    let side = |axis: u32| bounds.upper[axis as usize] - bounds.lower[axis as usize];
    (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest })
}
