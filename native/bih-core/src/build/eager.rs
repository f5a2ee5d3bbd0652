//! The whole tree at once, sorted in place as by quicksort.

use super::reference::Reference;
use super::split::{Cell, Cut};
use crate::control::{Cancelled, Control};
use crate::geometry::Bounds;
use crate::tree::{MAX_SPATIAL_DEPTH, Node};

/// What construction makes of the references, which it leaves in leaf order.
pub struct Built {
    pub nodes: Vec<Node>,
    pub bounds: Bounds,
    pub leaves: usize,
    pub depth: usize,
    pub left_out: Vec<(&'static str, String)>,
}

/// A node that waits for its record: its place, its references, its cell.
struct Task {
    node: usize,
    first: usize,
    end: usize,
    cell: Cell,
    depth: u32,
}

pub fn build(references: &mut [Reference], leaf_size: usize, control: &Control) -> Result<Built, Cancelled> {
    let bounds = references.iter().fold(Bounds::EMPTY, |bounds, reference| bounds.union(&reference.bounds));
    let mut built = Built { nodes: Vec::new(), bounds, leaves: 0, depth: 0, left_out: Vec::new() };
    if references.is_empty() {
        return Ok(built);
    }
    // The bound known before the build: pages that no node is written to are never taken from the system.
    built.nodes.reserve_exact(2 * references.len() - 1);
    built.nodes.push(Node::leaf(0, 0));
    let mut empty_halves = 0usize;
    let mut tasks = vec![Task { node: 0, first: 0, end: references.len(), cell: Cell::new(&bounds), depth: 0 }];
    while let Some(task) = tasks.pop() {
        let range = &mut references[task.first..task.end];
        built.depth = built.depth.max(task.depth as usize);
        if range.len() <= leaf_size {
            // The order within a leaf is no accident of the partition.
            range.sort_unstable_by_key(|reference| reference.row);
            built.nodes[task.node] = Node::leaf(task.first, range.len());
            built.leaves += 1;
            control.advance(range.len())?;
            continue;
        }
        let Division { axis, count, clip, cells } = divide(range, &task, &mut empty_halves);
        let left = built.nodes.len();
        built.nodes[task.node] = Node::inner(axis, left, clip);
        built.nodes.extend([Node::leaf(0, 0); 2]);
        let middle = task.first + count;
        let [lower, upper] = cells;
        let depth = task.depth + 1;
        tasks.push(Task { node: left + 1, first: middle, end: task.end, cell: upper, depth });
        tasks.push(Task { node: left, first: task.first, end: middle, cell: lower, depth });
    }
    built.nodes.shrink_to_fit();
    if empty_halves > 0 {
        let saved = 2 * Node::BYTES * empty_halves;
        let reason = format!(
            "{empty_halves} halvings had all objects on one side; a node and an empty leaf each: {saved} bytes"
        );
        built.left_out.push(("nodes of empty halves", reason));
    }
    Ok(built)
}

/// How a range was divided: `count` references come first, within `clip[0]`; the rest lie above `clip[1]`.
struct Division {
    axis: usize,
    count: usize,
    clip: [f32; 2],
    cells: [Cell; 2],
}

fn divide(range: &mut [Reference], task: &Task, empty_halves: &mut usize) -> Division {
    if task.depth < MAX_SPATIAL_DEPTH {
        if let Some(cut) = task.cell.cut() {
            let (count, clip) = partition(range, &cut);
            if 0 < count && count < range.len() {
                return Division { axis: cut.axis, count, clip, cells: task.cell.halves(&cut) };
            }
        }
        if let Some((cell, cut, empty)) = task.cell.first_separating_cut(range) {
            *empty_halves += empty;
            let (count, clip) = partition(range, &cut);
            return Division { axis: cut.axis, count, clip, cells: cell.halves(&cut) };
        }
    }
    by_object_median(range, task)
}

/// Move the references left of the cut to the front; return how many there are, the largest coordinate among them and
/// the smallest among the others.
fn partition(range: &mut [Reference], cut: &Cut) -> (usize, [f32; 2]) {
    let axis = cut.axis;
    let (mut low, mut high) = (0, range.len());
    let mut clip = [f32::NEG_INFINITY, f32::INFINITY];
    while low < high {
        if cut.is_left(&range[low]) {
            clip[0] = clip[0].max(range[low].bounds.upper[axis]);
            low += 1;
        } else {
            high -= 1;
            clip[1] = clip[1].min(range[low].bounds.lower[axis]);
            range.swap(low, high);
        }
    }
    (low, clip)
}

/// For objects that no plane separates: the lower half of the rows, on the axis where the objects are longest.
fn by_object_median(range: &mut [Reference], task: &Task) -> Division {
    range.sort_unstable_by_key(|reference| reference.row);
    let count = range.len() / 2;
    let bounds = range.iter().fold(Bounds::EMPTY, |bounds, reference| bounds.union(&reference.bounds));
    let side = |axis: usize| bounds.upper[axis] - bounds.lower[axis];
    let axis = (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest });
    let upper = |part: &[Reference]| part.iter().fold(f32::NEG_INFINITY, |x, r| x.max(r.bounds.upper[axis]));
    let lower = |part: &[Reference]| part.iter().fold(f32::INFINITY, |x, r| x.min(r.bounds.lower[axis]));
    let clip = [upper(&range[..count]), lower(&range[count..])];
    Division { axis, count, clip, cells: [task.cell; 2] }
}
