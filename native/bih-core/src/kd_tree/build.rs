//! Construction in O(N log N) (Wald and Havran 2006): sort once, then split in linear time a level.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::lists::{Lists, Mark, Reference, Sorting};
use super::split::{Costs, Split, cheapest, cheapest_on_axis};
use super::{KdNode, KdStats, KdTree, MAX_DEPTH};
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::intersect::has_no_area;
use crate::memory;
use crate::simd::FloatEnvironment;
use crate::tree::{Kind, Shared};

/// Leaves and references a triangle at most, one reference counted for an empty leaf: without a bound, N triangles
/// through one point could make N² references. Measured in docs/decisions/kd-tree.md.
const ENTRIES: usize = 16;

/// The most there can be: nodes are counted in 30 bits.
const MOST_ENTRIES: usize = 1 << 29;

/// Nodes of this many triangles and more are split by several threads; their children are built side by side.
const SHARED: usize = 1 << 13;

/// Nodes between two looks at the control.
const BATCH: usize = 1 << 10;

/// Nodes and references of a subtree; the root comes first, and children are counted from it.
#[derive(Debug, Default)]
struct Subtree {
    nodes: Vec<KdNode>,
    references: Vec<u32>,
    depth: u32,
}

/// A node to build: its cell, and how many leaves and references may be below it.
#[derive(Debug, Clone, Copy)]
struct Task {
    cell: Bounds,
    depth: u32,
    entries: usize,
}

/// Bytes of lists on all threads.
#[derive(Debug, Default)]
struct Memory {
    held: AtomicUsize,
    peak: AtomicUsize,
}

impl Memory {
    fn hold(&self, bytes: usize) {
        let held = self.held.fetch_add(bytes, Ordering::Relaxed) + bytes;
        self.peak.fetch_max(held, Ordering::Relaxed);
    }

    fn release(&self, bytes: usize) {
        self.held.fetch_sub(bytes, Ordering::Relaxed);
    }
}

/// What all nodes are built with.
struct Builder<'a> {
    triangles: &'a Triangles<'a>,
    costs: &'a Costs,
    control: &'a Control,
    memory: &'a Memory,
}

/// Entries that a tree over so many triangles has at most.
fn most_entries(triangles: usize) -> usize {
    (ENTRIES * triangles).clamp(1, MOST_ENTRIES)
}

/// Bytes that a tree over so many triangles never exceeds: an entry is a leaf or a reference, and there are fewer inner
/// nodes than leaves.
pub fn bound_bytes(triangles: usize) -> usize {
    most_entries(triangles) * (2 * KdNode::BYTES + size_of::<u32>()) + triangles * size_of::<u32>()
}

/// A triangle's share of what the construction may hold at once: the lists of both halves beside those of the whole. More
/// than any mesh took; how often triangles are referred to is not known before.
const WORKING_BYTES: usize = 320;

/// Build the whole tree.
pub fn build(triangles: &Triangles, costs: &Costs, control: &Control) -> Result<KdTree, Error> {
    if triangles.len() > MOST_ENTRIES {
        return Err(Error::TooManyTriangles { triangles: triangles.len(), limit: MOST_ENTRIES });
    }
    memory::room("the construction", WORKING_BYTES * triangles.len())?;
    let start = Instant::now();
    let _standard = FloatEnvironment::standard();
    let (references, rejected) = collect(triangles);
    let bounds = references.iter().fold(Bounds::EMPTY, |bounds, reference| bounds.union(&reference.bounds));
    let entries = most_entries(references.len());
    control.start(entries);
    let memory = Memory::default();
    let Subtree { nodes, references: mut order, depth } = if references.is_empty() {
        Subtree::default()
    } else {
        let builder = Builder { triangles, costs, control, memory: &memory };
        let lists = Lists::new(references);
        memory.hold(lists.bytes());
        builder.subtree(lists, Task { cell: bounds, depth: 0, entries })?
    };
    let references = order.len();
    order.extend_from_slice(&rejected);
    let tree_bytes = nodes.len() * KdNode::BYTES + size_of_val(&order[..]);
    let stats = KdStats {
        triangles: triangles.len(),
        rejected: rejected.len(),
        nodes: nodes.len(),
        leaves: nodes.len().div_ceil(2),
        empty_leaves: nodes.iter().filter(|node| matches!(node.kind(), Kind::Leaf { count: 0, .. })).count(),
        references,
        depth: depth as usize,
        tree_bytes,
        bound_bytes: bound_bytes(triangles.len()),
        peak_build_bytes: memory.peak.into_inner() + tree_bytes,
        build_seconds: start.elapsed().as_secs_f64(),
    };
    Ok(KdTree::new(Shared::whole(nodes), Shared::whole(order), bounds, stats))
}

/// References of the triangles that a ray can hit, and the rows of those that none can: a coordinate that is not
/// finite, or no area.
fn collect(triangles: &Triangles) -> (Vec<Reference>, Vec<u32>) {
    let mut references = Vec::with_capacity(triangles.len());
    let mut rejected = Vec::new();
    for row in 0..triangles.len() as u32 {
        let corners = triangles.corners(row);
        if corners.iter().flatten().all(|x| x.is_finite()) && !has_no_area(&corners) {
            references.push(Reference { bounds: Bounds::of_triangle(&corners), row });
        } else {
            rejected.push(row);
        }
    }
    (references, rejected)
}

impl Task {
    /// What is left for the children once each has one entry a triangle, or one for an empty leaf.
    fn spare(&self, counts: [usize; 2]) -> Option<usize> {
        self.entries.checked_sub(counts[0].max(1) + counts[1].max(1))
    }

    /// The children, the spare entries shared in proportion to their triangles.
    fn children(&self, cells: [Bounds; 2], counts: [usize; 2]) -> [Self; 2] {
        let [left, right] = counts.map(|count| count.max(1));
        let spare = self.entries - left - right;
        let to_left = (spare as u128 * left as u128 / (left + right) as u128) as usize;
        let entries = [left + to_left, right + spare - to_left];
        [0, 1].map(|side| Self { cell: cells[side], depth: self.depth + 1, entries: entries[side] })
    }
}

impl Builder<'_> {
    /// Where to split the last node of the lists, if a split is worth it and allowed.
    fn split(&self, lists: &Lists, mark: Mark, task: &Task) -> Option<Split> {
        let count = lists.references_from(mark).len();
        if task.depth == MAX_DEPTH || task.entries < 2 || count == 0 {
            return None;
        }
        let on_axis = |axis| cheapest_on_axis(lists.events_from(mark, axis), count, &task.cell, axis, self.costs);
        let of_axes = if count < SHARED {
            [on_axis(0), on_axis(1), on_axis(2)]
        } else {
            let (x, (y, z)) = rayon::join(|| on_axis(0), || rayon::join(|| on_axis(1), || on_axis(2)));
            [x, y, z]
        };
        cheapest(of_axes, count, self.costs).filter(|split| task.spare(split.counts).is_some())
    }

    /// Split nodes of many triangles on several threads, and hand the others to one.
    fn subtree(&self, lists: Lists, task: Task) -> Result<Subtree, Cancelled> {
        let _standard = FloatEnvironment::standard();
        if lists.references.len() < SHARED {
            return self.small_subtree(lists, task);
        }
        self.control.check()?;
        let mark = Mark::default();
        let Some(split) = self.split(&lists, mark, &task) else {
            self.control.advance(task.entries)?;
            self.memory.release(lists.bytes());
            return Ok(Subtree::leaf(&lists.references, task.depth));
        };
        let cells = split.halves(&task.cell);
        let mut children = [Lists::default(), Lists::default()];
        lists.split(mark, &split, &cells, self.triangles, &mut Sorting::default(), &mut children);
        self.memory.hold(children.iter().map(Lists::bytes).sum());
        self.memory.release(lists.bytes());
        drop(lists);
        let tasks = task.children(cells, [0, 1].map(|side: usize| children[side].references.len()));
        let [left, right] = children;
        let (left, right) = rayon::join(|| self.subtree(left, tasks[0]), || self.subtree(right, tasks[1]));
        Ok(Subtree::joined(&split, [left?, right?]))
    }

    /// Depth first, the lists of all nodes that wait one behind the other.
    fn small_subtree(&self, mut lists: Lists, task: Task) -> Result<Subtree, Cancelled> {
        let mut subtree = Subtree { nodes: vec![KdNode::leaf(0, 0)], references: Vec::new(), depth: task.depth };
        self.memory.release(lists.bytes());
        let mut sorting = Sorting::default();
        let mut children = [Lists::default(), Lists::default()];
        let mut waiting = vec![(0, Mark::default(), task)];
        let (mut done, mut since) = (0, 0);
        while let Some((node, mark, task)) = waiting.pop() {
            since += 1;
            if since == BATCH {
                self.control.advance(done)?;
                (done, since) = (0, 0);
            }
            let Some(split) = self.split(&lists, mark, &task) else {
                subtree.put_leaf(node, lists.references_from(mark), task.depth);
                lists.truncate(mark);
                done += task.entries;
                continue;
            };
            let cells = split.halves(&task.cell);
            children.iter_mut().for_each(|child| child.truncate(Mark::default()));
            lists.split(mark, &split, &cells, self.triangles, &mut sorting, &mut children);
            lists.truncate(mark);
            let left = subtree.nodes.len();
            subtree.nodes[node] = KdNode::inner(split.axis, left, split.plane);
            subtree.nodes.extend([KdNode::leaf(0, 0); 2]);
            let tasks = task.children(cells, [0, 1].map(|side: usize| children[side].references.len()));
            for side in [1, 0] {
                waiting.push((left + side, lists.end(), tasks[side]));
                lists.append(&children[side]);
            }
        }
        // What the lists grew to is not given back before the end.
        let bytes = lists.bytes() + children.iter().map(Lists::bytes).sum::<usize>();
        self.memory.hold(bytes);
        self.memory.release(bytes);
        self.control.advance(done)?;
        Ok(subtree)
    }
}

impl Subtree {
    fn leaf(references: &[Reference], depth: u32) -> Self {
        let mut subtree = Self { nodes: vec![KdNode::leaf(0, 0)], references: Vec::new(), depth };
        subtree.put_leaf(0, references, depth);
        subtree
    }

    fn put_leaf(&mut self, node: usize, references: &[Reference], depth: u32) {
        self.nodes[node] = KdNode::leaf(self.references.len(), references.len());
        self.references.extend(references.iter().map(|reference| reference.row));
        self.depth = self.depth.max(depth);
    }

    /// A root over two subtrees: their roots stand side by side behind it, then come their other nodes.
    fn joined(split: &Split, [left, right]: [Self; 2]) -> Self {
        let mut joined = left;
        let root = KdNode::inner(split.axis, 1, split.plane);
        // Nodes but the root go from i to i + 2 on the left, and behind all of those on the right.
        let (shift, references) = (joined.nodes.len() + 1, joined.references.len());
        let left_root = joined.nodes[0].moved(2, 0);
        let right_root = right.nodes[0].moved(shift, references);
        joined.nodes.iter_mut().for_each(|node| *node = node.moved(2, 0));
        joined.nodes.splice(..1, [root, left_root, right_root]);
        joined.nodes.extend(right.nodes[1..].iter().map(|node| node.moved(shift, references)));
        joined.references.extend_from_slice(&right.references);
        joined.depth = joined.depth.max(right.depth);
        joined
    }
}
