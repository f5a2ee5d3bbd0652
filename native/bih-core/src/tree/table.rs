//! The nodes as rows of a table, for drawing and for study.

use bytemuck::{Pod, Zeroable};

use super::{Kind, Tree, Visit, Visitor};
use crate::build::{BuildOptions, Layout, Structure, build_in_frame};
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::memory;

/// One row, packed as the structured array that Python sees.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, packed)]
pub struct NodeRow {
    /// Row of the parent, -1 for the root.
    pub parent: i32,
    /// Distance from the root.
    pub depth: i32,
    /// 0 inner, 1 leaf, 2 not yet subdivided.
    pub kind: u8,
    /// 0 x, 1 y, 2 z; -1 where not inner, and in a bounding volume hierarchy.
    pub axis: i8,
    /// Upper plane of the left child and lower plane of the right child; NaN where not inner.
    pub clip: [f32; 2],
    /// Lower corner of the node's box.
    pub lower: [f32; 3],
    /// Upper corner of the node's box.
    pub upper: [f32; 3],
    /// First reference below the node.
    pub first: i64,
    /// Number of references below the node.
    pub count: i64,
}

/// Rows of the binary tree's nodes down to `max_depth`, at most `limit` of them, breadth first.
///
/// Wide records do not hold the splits that they collapsed, and of a tree that is built on demand not all are there: these
/// are found again by the same construction. What is below an unbuilt node is left out.
pub fn node_table(
    tree: &Tree,
    triangles: &Triangles,
    max_depth: u32,
    limit: usize,
    control: &Control,
) -> Result<Vec<NodeRow>, Error> {
    if let Some(kd_tree) = &tree.kd_tree {
        memory::room("the rows of nodes", 2 * size_of::<NodeRow>() * kd_tree.nodes().len().min(limit))?;
        return Ok(Visitor::new(kd_tree, max_depth).take(limit).map(row).collect());
    }
    let built;
    let binary = if tree.wide.is_none() && tree.on_demand.is_none() {
        tree
    } else {
        let options = BuildOptions {
            structure: tree.structure,
            layout: Layout::Classic,
            heuristic: tree.heuristic,
            leaf_size: Some(tree.leaf_size),
            ..Default::default()
        };
        built = build_in_frame(triangles, &options, control)?;
        &built
    };
    memory::room("the rows of nodes", 2 * size_of::<NodeRow>() * binary.nodes().len().min(limit))?;
    if let Some(on_demand) = &tree.on_demand {
        let visitor = binary.visit(max_depth).ending_at(on_demand.unbuilt());
        return Ok(with_unbuilt(visitor, limit));
    }
    let visits = binary.visit(max_depth).take(limit);
    if tree.structure == Structure::Bvh {
        let boxes = boxes(binary, triangles);
        return Ok(visits.map(|visit| boxed_row(visit, &boxes)).collect());
    }
    Ok(visits.map(row).collect())
}

/// The nodes that a visitor ends at are not yet subdivided.
fn with_unbuilt(mut visitor: Visitor, limit: usize) -> Vec<NodeRow> {
    let mut rows = Vec::new();
    while rows.len() < limit
        && let Some(visit) = visitor.next()
    {
        let unbuilt = NodeRow { kind: 2, axis: -1, clip: [f32::NAN; 2], ..row(visit) };
        rows.push(if visitor.ends_at(&visit) { unbuilt } else { row(visit) });
    }
    rows
}

/// The box of what lies below each node.
fn boxes(tree: &Tree, triangles: &Triangles) -> Vec<Bounds> {
    let mut boxes = vec![Bounds::EMPTY; tree.nodes().len()];
    for (node, record) in tree.nodes().iter().enumerate().rev() {
        boxes[node] = match record.kind() {
            Kind::Inner { left, .. } => boxes[left].union(&boxes[left + 1]),
            Kind::Leaf { first, count } => {
                let rows = tree.order.slice(first..first + count).iter();
                rows.map(|&row| Bounds::of_triangle(&triangles.corners(row)))
                    .fold(Bounds::EMPTY, |all, bounds| all.union(&bounds))
            }
        };
    }
    boxes
}

/// A node of a bounding volume hierarchy has a box of its own and no plane.
fn boxed_row(visit: Visit, boxes: &[Bounds]) -> NodeRow {
    let Bounds { lower, upper } = boxes[visit.node];
    NodeRow { axis: -1, clip: [f32::NAN; 2], lower, upper, ..row(visit) }
}

fn row(visit: Visit) -> NodeRow {
    let (kind, axis, clip) = match visit.kind {
        Kind::Inner { axis, clip, .. } => (0, axis as i8, clip),
        Kind::Leaf { .. } => (1, -1, [f32::NAN; 2]),
    };
    NodeRow {
        parent: visit.parent.map_or(-1, |row| row as i32),
        depth: visit.depth as i32,
        kind,
        axis,
        clip,
        lower: visit.bounds.lower,
        upper: visit.bounds.upper,
        first: visit.first as i64,
        count: visit.count as i64,
    }
}
