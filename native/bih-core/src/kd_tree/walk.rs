//! The way of rays through a binary tree: one loop for single rays and packets, for the kd-tree and the classic nodes of the
//! Bounding Interval Hierarchy.

use std::ops::ControlFlow;

use super::MAX_DEPTH;
use super::packet::{Packet, any, in_order, larger, smaller};
use crate::geometry::Ray;
use crate::traverse::{Aim, Counter};
use crate::tree::{self, BinaryTree, Kind};

/// The plane at which a ray leaves the child that it meets first, and the one at which it enters the other.
#[inline(always)]
pub(super) fn planes<T: BinaryTree>(clip: [f32; 2], backwards: usize) -> [f32; 2] {
    if T::ONE_PLANE { clip } else { [clip[backwards], clip[1 - backwards]] }
}

/// A step down puts off at most one child, and no node of either tree is deeper than this.
pub(super) const DEEPEST: usize =
    if MAX_DEPTH > tree::MAX_DEPTH { MAX_DEPTH as usize } else { tree::MAX_DEPTH as usize };

/// A node to visit later, and the part of each ray that lies in it; of a ray that misses it the part is empty.
#[derive(Debug, Clone, Copy)]
struct Entry<const N: usize> {
    node: usize,
    near: [f64; N],
    far: [f64; N],
}

/// Room for one node a level, for single rays or packets, from the first walk on. Made once for many.
#[derive(Debug, Clone, Default)]
pub struct Stack<const N: usize = 1> {
    entries: Vec<Entry<N>>,
}

impl<const N: usize> Stack<N> {
    #[inline(always)]
    fn room(&mut self) -> &mut [Entry<N>; DEEPEST] {
        if self.entries.len() < DEEPEST {
            self.entries = vec![Entry { node: 0, near: [0.0; N], far: [0.0; N] }; DEEPEST];
        }
        self.entries.first_chunk_mut().expect("it was made as long")
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
    leaf: impl FnMut(&[u32]) -> ControlFlow<(), f64>,
) {
    walk_around(tree, &Aim::exact(ray), stack, counter, leaf);
}

/// The same for a ray that is known up to its spread.
#[inline(always)]
pub(crate) fn walk_around<T: BinaryTree, C: Counter>(
    tree: &T,
    aim: &Aim,
    stack: &mut Stack,
    counter: &mut C,
    mut leaf: impl FnMut(&[u32]) -> ControlFlow<(), f64>,
) {
    if let Some(packet) = Packet::<1>::around(aim) {
        walk_packet(tree, &packet, stack, counter, |rows, _| match leaf(rows) {
            ControlFlow::Continue(limit) => [limit],
            ControlFlow::Break(()) => [f64::NEG_INFINITY],
        });
    }
}

/// Visit the leaves that any ray of the packet crosses, front to back. `leaf` is told which rays cross it, and answers
/// how far each ray still matters: negative infinity where it is done.
#[inline(always)]
pub fn walk_packet<const N: usize, T: BinaryTree, C: Counter>(
    tree: &T,
    packet: &Packet<N>,
    stack: &mut Stack<N>,
    counter: &mut C,
    mut leaf: impl FnMut(&[u32], [bool; N]) -> [f64; N],
) {
    if tree.is_empty() {
        return;
    }
    let entries = stack.room();
    let (near, far) = packet.clip(tree.bounds());
    let mut waiting = 0;
    let mut entry = Entry { node: 0, near, far };
    let mut limit = packet.far;
    loop {
        let active = in_order(&entry.near, &entry.far);
        if any(&active) {
            counter.visit_node();
            match tree.kind(entry.node) {
                Kind::Inner { axis, left, clip } => {
                    let backwards = usize::from(packet.is_negative(axis));
                    let [exit, entrance] = planes::<T>(clip, backwards);
                    let first_ends = packet.crossings(axis, exit).1;
                    let second_starts = packet.crossings(axis, entrance).0;
                    let first =
                        Entry { node: left + backwards, near: entry.near, far: smaller(&first_ends, &entry.far) };
                    let second =
                        Entry { node: left + 1 - backwards, near: larger(&second_starts, &entry.near), far: entry.far };
                    if !any(&in_order(&second.near, &second.far)) {
                        entry = first;
                    } else if !any(&in_order(&first.near, &first.far)) {
                        entry = second;
                    } else {
                        entries[waiting] = second;
                        waiting += 1;
                        entry = first;
                    }
                    continue;
                }
                Kind::Leaf { first, count } => {
                    counter.test_triangles(count);
                    if count > 0 {
                        limit = leaf(&tree.references()[first..first + count], active);
                    }
                }
            }
        }
        if waiting == 0 {
            return;
        }
        waiting -= 1;
        entry = entries[waiting];
        entry.far = smaller(&limit, &entry.far);
    }
}
