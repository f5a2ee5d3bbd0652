//! Walking over a tree from outside, level by level.

use std::collections::VecDeque;

use super::{Kind, Tree};
use crate::geometry::Bounds;

/// One node as the visitor meets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Index of the node in `Tree::nodes`.
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
pub struct Visitor<'a, F> {
    tree: &'a Tree,
    max_depth: u32,
    is_end: F,
    visited: usize,
    queue: VecDeque<(usize, Option<usize>, u32, Bounds)>,
}

impl Tree {
    /// Visit the nodes of a tree that was built at once, breadth first, the left child before the right one.
    pub fn visit(&self, max_depth: u32) -> impl Iterator<Item = Visit> {
        self.visit_down_to(max_depth, |_| false)
    }

    /// The same without what is below some nodes.
    pub fn visit_down_to<F: Fn(&Visit) -> bool>(&self, max_depth: u32, is_end: F) -> Visitor<'_, F> {
        let root = (!self.nodes.is_empty()).then_some((0, None, 0, self.bounds));
        Visitor { tree: self, max_depth, is_end, visited: 0, queue: root.into_iter().collect() }
    }

    /// The outermost leaf below `node`: its first and last reference on that side.
    fn outermost_leaf(&self, mut node: usize, right: usize) -> (usize, usize) {
        loop {
            match self.nodes.get(node).kind() {
                Kind::Inner { left, .. } => node = left + right,
                Kind::Leaf { first, count } => return (first, first + count),
            }
        }
    }
}

impl<F: Fn(&Visit) -> bool> Iterator for Visitor<'_, F> {
    type Item = Visit;

    fn next(&mut self) -> Option<Visit> {
        let (node, parent, depth, bounds) = self.queue.pop_front()?;
        let kind = self.tree.nodes.get(node).kind();
        let row = self.visited;
        self.visited += 1;
        let (first, _) = self.tree.outermost_leaf(node, 0);
        let (_, end) = self.tree.outermost_leaf(node, 1);
        let visit = Visit { node, parent, depth, bounds, kind, first, count: end - first };
        if let Kind::Inner { axis, left, clip } = kind
            && depth < self.max_depth
            && !(self.is_end)(&visit)
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
