//! The same tree over vertices that moved: boxes and planes again, from the leaves up.

use std::time::Instant;

use rayon::prelude::*;

use super::build;
use super::extent::Extent;
use super::leaves::box_of_rows;
use super::options::{Build, BuildOptions, Layout};
use super::structure::Structure;
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::memory;
use crate::pages;
use crate::simd::{FloatEnvironment, Scalar};
use crate::tree::{Kind, Node, Record, Records, Shared, Target, Tree, WIDTH, Wide};

/// Nodes that a thread takes at a time.
const CHUNK: usize = 1 << 10;

/// A tree over as many triangles as this one has, of the same rows of vertices that moved. Where other triangles than
/// before can be hit, because some have an area now or have none any more, it is built anew.
///
/// A kd-tree cuts space, not the triangles, and pieces that are built on demand have triangles that nobody looked at: both
/// are refused.
pub fn refit(tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Tree, Error> {
    let wrong = |argument: &'static str, value: String| {
        let advice = "its nodes cannot be fitted to moved vertices, build it again";
        Err(Error::Incompatible { structure: tree.structure.name(), argument, value, advice })
    };
    if tree.structure == Structure::KdTree {
        return wrong("refit", "of a tree that cuts space".to_owned());
    }
    if tree.build == Build::OnDemand {
        return wrong("build", format!("{:?} and refit", tree.build.name()));
    }
    assert_eq!(triangles.len(), tree.stats.triangles);
    // All of it anew, and a box or a record apart for each.
    memory::room("the construction", tree.stats.tree_bytes + tree.used() * (size_of::<Bounds>() + Record::BYTES))?;
    let start = Instant::now();
    let _standard = FloatEnvironment::standard();
    let extent = Extent::of(triangles, control)?;
    let references = tree.order.len() - tree.stats.rejected;
    if tree.order.slice(references..tree.order.len()) != extent.rejected {
        return build(triangles, &options(tree), control);
    }
    control.start(references);
    let (nodes, wide) = match &tree.wide {
        None => (nodes(tree, triangles, control)?, None),
        Some(wide) => (Vec::new(), Some(records(tree, wide, triangles, control)?)),
    };
    let mut stats = tree.stats.clone();
    stats.build_seconds = start.elapsed().as_secs_f64();
    Ok(Tree {
        nodes: Shared::whole(nodes),
        wide,
        kd_tree: None,
        order: Shared::whole(tree.order.slice(0..tree.order.len()).to_vec()),
        structure: tree.structure,
        bounds: extent.bounds(),
        precision: tree.precision,
        heuristic: tree.heuristic,
        leaf_size: tree.leaf_size,
        build: tree.build,
        stats,
        on_demand: None,
    })
}

/// Those that the tree was built by.
fn options(tree: &Tree) -> BuildOptions {
    let layout = match &tree.wide {
        None => Layout::Classic,
        Some(wide) if wide.records.are_ordered() => Layout::Wide,
        Some(_) => Layout::Compact,
    };
    BuildOptions {
        structure: tree.structure,
        layout,
        build: tree.build,
        piece: None,
        heuristic: tree.heuristic,
        presort: None,
        precision: tree.precision,
        leaf_size: Some(tree.leaf_size),
    }
}

fn nodes(tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Node>, Cancelled> {
    let mut nodes = tree.nodes().to_vec();
    let mut boxes = vec![Bounds::EMPTY; nodes.len()];
    nodes.par_chunks(CHUNK).zip(boxes.par_chunks_mut(CHUNK)).try_for_each(|(nodes, boxes)| {
        for (node, bounds) in nodes.iter().zip(boxes) {
            if let Kind::Leaf { first, count } = node.kind() {
                control.advance(count)?;
                *bounds = box_of_rows(triangles, tree.order.slice(first..first + count));
            }
        }
        Ok(())
    })?;
    // Children stand behind their parents.
    for index in (0..nodes.len()).rev() {
        if let Kind::Inner { axis, left, .. } = nodes[index].kind() {
            let [lower, upper] = [boxes[left], boxes[left + 1]];
            boxes[index] = lower.union(&upper);
            nodes[index] = Node::inner(axis, left, [lower.upper[axis], upper.lower[axis]]);
        }
    }
    Ok(nodes)
}

fn records(tree: &Tree, wide: &Wide, triangles: &Triangles, control: &Control) -> Result<Wide, Cancelled> {
    let indices = 0..wide.records.len();
    let mut records: Vec<Record> = Vec::new();
    let copy = |index: usize| {
        let mut space = Record::EMPTY;
        *wide.records.get::<Scalar>(index, &mut space)
    };
    indices.into_par_iter().with_min_len(CHUNK).map(copy).collect_into_vec(&mut records);
    records.par_iter_mut().with_min_len(CHUNK).try_for_each(|record| {
        for lane in lanes(record) {
            if let Target::Leaf { first, count } = record.child(lane).target() {
                control.advance(count)?;
                let bounds = box_of_rows(triangles, tree.order.slice(first..first + count));
                record.set(lane, &bounds, record.child(lane));
            }
        }
        Ok(())
    })?;
    // Children stand behind their parents.
    for index in (0..records.len()).rev() {
        for lane in lanes(&records[index]) {
            let child = records[index].child(lane);
            if let Target::Record(below) = child.target() {
                let bounds =
                    lanes(&records[below]).fold(Bounds::EMPTY, |all, lane| all.union(&records[below].bounds(lane)));
                records[index].set(lane, &bounds, child);
            }
        }
    }
    let rows = rows(tree, wide, &records, triangles);
    let records = match &wide.records {
        Records::Full(_) => Records::Full(Shared::whole(records)),
        Records::Compact(_) => Records::Compact(Shared::whole(Records::compacted(&records))),
    };
    Ok(Wide { records, rows: Shared::whole(rows), copies: None, depth: wide.depth })
}

/// Those with a child.
fn lanes(record: &Record) -> impl Iterator<Item = usize> + use<> {
    let record = *record;
    (0..WIDTH).filter(move |&lane| record.bounds(lane) != Bounds::EMPTY)
}

/// The vertices that leaves hold, if they do.
fn rows(tree: &Tree, wide: &Wide, records: &[Record], triangles: &Triangles) -> Vec<f32> {
    let mut rows: Vec<f32> = pages::zeroed(wide.rows.len());
    if rows.is_empty() {
        return rows;
    }
    for record in records {
        for lane in lanes(record) {
            let Target::Leaf { first, count } = record.child(lane).target() else { continue };
            let rows = &mut rows[9 * first..9 * (first + count)];
            for (place, &row) in tree.order.slice(first..first + count).iter().enumerate() {
                let corners = triangles.single_corners(row);
                for (number, &value) in corners.as_flattened().iter().enumerate() {
                    rows[number * count + place] = value;
                }
            }
        }
    }
    rows
}
