//! Walking over a tree from outside, level by level.

use std::collections::{HashMap, VecDeque};

use super::{BinaryTree, Kind, Tree};
use crate::geometry::Bounds;

/// One node as the visitor meets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Index of the node in the tree.
    pub node: usize,
    /// How manyeth visit the parent was; none for the root.
    pub parent: Option<usize>,
    /// Distance from the root.
    pub depth: u32,
    /// The box that the clip planes on the way down cut from the tree's bounds.
    pub bounds: Bounds,
    /// The record, unpacked.
    pub kind: Kind,
    /// First reference below the node.
    pub first: usize,
    /// Number of references below the node.
    pub count: usize,
}

/// Breadth-first iterator over the nodes down to a depth.
#[derive(Debug)]
pub struct Visitor<'a, T = Tree> {
    tree: &'a T,
    max_depth: u32,
    /// Ranges of references below which nothing is shown: their first ones, and how many.
    ends: HashMap<usize, usize>,
    visited: usize,
    queue: VecDeque<(usize, Option<usize>, u32, Bounds)>,
}

impl Tree {
    /// Visit the nodes of a tree that was built at once, breadth first, the left child before the right one.
    pub fn visit(&self, max_depth: u32) -> Visitor<'_> {
        Visitor::new(self, max_depth)
    }
}

impl<'a, T: BinaryTree> Visitor<'a, T> {
    /// Of the nodes at most so deep.
    pub fn new(tree: &'a T, max_depth: u32) -> Self {
        let root = (!tree.is_empty()).then_some((0, None, 0, *tree.bounds()));
        Self { tree, max_depth, ends: HashMap::new(), visited: 0, queue: root.into_iter().collect() }
    }

    /// The same without what is below the nodes of some ranges of references: their first ones, and how many.
    pub fn ending_at(self, ends: impl IntoIterator<Item = (usize, usize)>) -> Self {
        Self { ends: ends.into_iter().collect(), ..self }
    }

    /// Whether nothing is shown below a node, though there is.
    pub fn ends_at(&self, visit: &Visit) -> bool {
        self.ends.get(&visit.first) == Some(&visit.count)
    }

    /// The outermost leaf below `node`: its first and last reference on that side.
    fn outermost_leaf(&self, mut node: usize, right: usize) -> (usize, usize) {
        loop {
            match self.tree.kind(node) {
                Kind::Inner { left, .. } => node = left + right,
                Kind::Leaf { first, count } => return (first, first + count),
            }
        }
    }
}

impl<T: BinaryTree> Iterator for Visitor<'_, T> {
    type Item = Visit;

    fn next(&mut self) -> Option<Visit> {
        let (node, parent, depth, bounds) = self.queue.pop_front()?;
        let kind = self.tree.kind(node);
        let row = self.visited;
        self.visited += 1;
        let (first, _) = self.outermost_leaf(node, 0);
        let (_, end) = self.outermost_leaf(node, 1);
        let visit = Visit { node, parent, depth, bounds, kind, first, count: end - first };
        if let Kind::Inner { axis, left, clip } = kind
            && depth < self.max_depth
            && !self.ends_at(&visit)
        {
            let [mut lower_part, mut upper_part] = [bounds; 2];
            lower_part.upper[axis] = clip[0];
            upper_part.lower[axis] = clip[1];
            self.queue.push_back((left, Some(row), depth + 1, lower_part));
            self.queue.push_back((left + 1, Some(row), depth + 1, upper_part));
        }
        Some(visit)
    }
}
