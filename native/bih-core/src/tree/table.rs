//! The nodes as rows of a table, for drawing and for study.

use bytemuck::{Pod, Zeroable};

use std::collections::HashMap;

use super::{Kind, Tree, Visit};
use crate::build::{BuildOptions, Layout, OnDemand, build};
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;

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
    /// 0 x, 1 y, 2 z; -1 where not inner.
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
/// are found again by the same construction. Nodes below an unbuilt one are left out.
pub fn node_table(
    tree: &Tree,
    triangles: &Triangles,
    max_depth: u32,
    limit: usize,
    control: &Control,
) -> Result<Vec<NodeRow>, Error> {
    let built;
    let unbuilt: HashMap<_, _> = tree.on_demand.as_ref().map(OnDemand::unbuilt).into_iter().flatten().collect();
    let binary = if tree.wide.is_none() && tree.on_demand.is_none() {
        tree
    } else {
        let options = BuildOptions {
            layout: Layout::Classic,
            heuristic: tree.heuristic,
            leaf_size: Some(tree.leaf_size),
            ..Default::default()
        };
        built = build(triangles, &options, control)?;
        &built
    };
    let is_unbuilt = |visit: &Visit| unbuilt.get(&visit.first) == Some(&visit.count);
    Ok(binary.visit_down_to(max_depth, is_unbuilt).take(limit).map(|visit| row(&visit, is_unbuilt(&visit))).collect())
}

fn row(visit: &Visit, is_unbuilt: bool) -> NodeRow {
    let (kind, axis, clip) = match visit.kind {
        _ if is_unbuilt => (2, -1, [f32::NAN; 2]),
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
