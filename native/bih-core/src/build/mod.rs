//! Construction: one function outside, one file a step inside.

mod accepted;
mod classic;
mod collapse;
mod construction;
mod extent;
mod frame;
mod global;
mod grid;
mod kd_tree;
mod keys;
mod leaves;
mod local;
mod options;
mod presort;
mod reference;
mod sah;
mod source;
mod structure;
mod treelet;
mod wide;

use std::time::Instant;

use self::accepted::Accepted;
use self::classic::ClassicNodes;
use self::construction::Construction;
use self::extent::Extent;
use self::leaves::Places;
pub use self::options::{BuildOptions, DEFAULT_LEAF_SIZE, DEFAULT_WIDE_LEAF_SIZE, Heuristic, Layout, Precision};
pub use self::structure::Structure;
use self::wide::WideRecords;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::pages;
use crate::simd::FloatEnvironment;
use crate::tree::{Node, Records, Stats, Tree, Wide};

/// Build the whole tree.
pub fn build(triangles: &Triangles, options: &BuildOptions, control: &Control) -> Result<Tree, Error> {
    options.check()?;
    match options.structure {
        Structure::KdTree => kd_tree::build(triangles, options, control),
        Structure::Bih | Structure::Bvh => build_in_frame(triangles, options, control),
    }
}

/// Build a tree that refers to each triangle once, in any layout.
pub(crate) fn build_in_frame(triangles: &Triangles, options: &BuildOptions, control: &Control) -> Result<Tree, Error> {
    let limit = options.layout.limit();
    if triangles.len() > limit {
        return Err(Error::TooManyTriangles { triangles: triangles.len(), limit });
    }
    let start = Instant::now();
    let _standard = FloatEnvironment::standard();
    let extent = Extent::of(triangles, control)?;
    let accepted = Accepted { triangles, rejected: &extent.rejected };
    control.start(accepted.len());
    let mut construction = Construction {
        accepted,
        extent: &extent,
        options,
        control,
        presorted: false,
        left_out: Vec::new(),
        peak_bytes: 0,
    };
    let mut order = pages::zeroed(triangles.len());
    let (references, rejected) = order.split_at_mut(accepted.len());
    rejected.copy_from_slice(&extent.rejected);
    let mut rows = pages::zeroed(construction.numbers());
    let bytes_held = size_of_val(references) + 2 * size_of_val(rejected) + size_of_val(&rows[..]);
    let places = Places { order: references, rows: &mut rows };

    let mut stats = Stats {
        triangles: triangles.len(),
        references: accepted.len(),
        rejected: rejected.len(),
        ..Default::default()
    };
    let (mut nodes, mut wide) = (Vec::new(), None);
    match options.layout {
        Layout::Classic => {
            let built = construction.run(ClassicNodes, places)?;
            (stats.nodes, stats.leaves, stats.depth) = (built.nodes.len(), built.leaves, built.depth);
            stats.tree_bytes = Node::BYTES * built.nodes.len();
            nodes = built.nodes;
        }
        Layout::Wide | Layout::Compact => {
            let built = construction.run(WideRecords, places)?;
            (stats.nodes, stats.leaves, stats.depth) = (built.records.len() + built.leaves, built.leaves, built.depth);
            let mut records = Records::Full(built.records);
            if options.layout == Layout::Compact {
                let full = records.bytes();
                records = records.compacted();
                construction.peak_bytes = construction.peak_bytes.max(full + records.bytes());
            }
            let built = Wide { records, rows, depth: built.depth };
            stats.tree_bytes = built.bytes();
            wide = Some(built);
        }
    }
    stats.tree_bytes += size_of_val(&order[..]);
    stats.bound_bytes = options.bound_bytes(triangles);
    stats.peak_build_bytes = bytes_held + construction.peak_bytes;
    stats.presorted = construction.presorted;
    stats.left_out = construction.left_out;
    stats.build_seconds = start.elapsed().as_secs_f64();
    Ok(Tree {
        nodes,
        wide,
        kd_tree: None,
        order,
        rejected: extent.rejected.len(),
        bounds: extent.bounds(),
        structure: options.structure,
        precision: options.precision,
        heuristic: options.heuristic,
        leaf_size: options.largest_leaf(),
        stats,
    })
}
