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
mod on_demand;
mod options;
mod pieces;
mod presort;
mod reference;
mod refit;
mod sah;
mod source;
mod structure;
mod treelet;
mod wide;

use std::time::Instant;

use self::accepted::Accepted;
use self::classic::ClassicNodes;
use self::construction::Construction;
pub(crate) use self::extent::Extent;
use self::leaves::Places;
pub(crate) use self::on_demand::OnDemand;
pub use self::options::{Build, BuildOptions, DEFAULT_LEAF_SIZE, DEFAULT_WIDE_LEAF_SIZE, Heuristic, Layout, Precision};
use self::pieces::Pieces;
pub use self::refit::refit;
pub use self::structure::Structure;
use self::wide::WideRecords;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::memory;
use crate::pages;
use crate::simd::FloatEnvironment;
use crate::tree::{Copies, Node, Records, Shared, Stats, Tree, Wide};

/// Build the tree; on demand the upper part of it.
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
    memory::room("the construction", options.working_bytes(triangles))?;
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
        pieces: None,
        peak_bytes: 0,
    };
    let mut stats = Stats {
        triangles: triangles.len(),
        references: accepted.len(),
        rejected: extent.rejected.len(),
        ..Default::default()
    };
    let Parts { nodes, wide, order, on_demand } = if construction.is_on_demand() {
        unfinished(&mut construction, &mut stats)?
    } else {
        finished(&mut construction, &mut stats)?
    };
    if options.build == Build::OnDemand && on_demand.is_none() {
        let reason = format!("{} triangles or fewer are finished at once", options.largest_piece());
        construction.left_out.push(("unbuilt nodes", reason));
    }
    stats.bound_bytes = options.bound_bytes(triangles);
    stats.peak_build_bytes += construction.peak_bytes;
    stats.presorted = construction.presorted;
    stats.left_out = construction.left_out.into_iter().map(|(part, reason)| (part.to_owned(), reason)).collect();
    stats.build_seconds = start.elapsed().as_secs_f64();
    Ok(Tree {
        nodes,
        wide,
        kd_tree: None,
        order,
        structure: options.structure,
        bounds: extent.bounds(),
        precision: options.precision,
        heuristic: options.heuristic,
        leaf_size: options.largest_leaf(),
        build: options.build,
        stats,
        on_demand,
    })
}

/// What a tree is made of.
struct Parts {
    nodes: Shared<Node>,
    wide: Option<Wide>,
    order: Shared<u32>,
    on_demand: Option<OnDemand>,
}

/// All at once.
fn finished(construction: &mut Construction, stats: &mut Stats) -> Result<Parts, Error> {
    let Construction { accepted, extent, options, .. } = *construction;
    let mut order = pages::zeroed(accepted.triangles.len());
    let (references, rejected) = order.split_at_mut(accepted.len());
    rejected.copy_from_slice(&extent.rejected);
    let mut rows = pages::zeroed(construction.numbers());
    stats.peak_build_bytes = size_of_val(references) + 2 * size_of_val(rejected) + size_of_val(&rows[..]);
    let places = Places { order: references, rows: &mut rows };
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
            let full = size_of_val(&built.records[..]);
            let records = if options.layout == Layout::Compact {
                let compact = Records::compacted(&built.records);
                construction.peak_bytes = construction.peak_bytes.max(full + size_of_val(&compact[..]));
                Records::Compact(Shared::whole(compact))
            } else {
                Records::Full(Shared::whole(built.records))
            };
            let built = Wide { records, rows: Shared::whole(rows), copies: None, depth: built.depth };
            stats.tree_bytes = built.bytes();
            wide = Some(built);
        }
    }
    stats.tree_bytes += size_of_val(&order[..]);
    Ok(Parts { nodes: Shared::whole(nodes), wide, order: Shared::whole(order), on_demand: None })
}

/// The upper nodes, and room for the pieces that rays will come to.
fn unfinished(construction: &mut Construction, stats: &mut Stats) -> Result<Parts, Error> {
    let Construction { accepted, extent, options, .. } = *construction;
    let places = Places { order: &mut [], rows: &mut [] };
    let (mut nodes, mut records) = (Vec::new(), Vec::new());
    match options.layout {
        Layout::Classic => nodes = construction.run(ClassicNodes, places)?.nodes,
        Layout::Wide | Layout::Compact => records = construction.run(WideRecords, places)?.records,
    }
    let Pieces { ranges, mut order } = construction.pieces.take().expect("a construction on demand leaves pieces");
    let mut on_demand = OnDemand::new(ranges, options.largest_leaf());
    let (mut room, mut wide) = (0, None);
    if options.layout == Layout::Classic {
        on_demand.start_nodes(nodes.len());
        room = 2 * accepted.len() + on_demand.pieces();
    } else {
        on_demand.start_records(&records);
        let room = options::most_records(accepted.len(), on_demand.pieces());
        let records = if options.layout == Layout::Compact {
            Records::Compact(Shared::growing(&Records::compacted(&records), room))
        } else {
            Records::Full(Shared::growing(&records, room))
        };
        let copies = options.has_rows(accepted.triangles).then(|| Copies::new(accepted.len()));
        wide = Some(Wide { records, rows: Shared::whole(Vec::new()), copies, depth: on_demand.depth() });
    }
    order.reserve_exact(extent.rejected.len());
    order.extend_from_slice(&extent.rejected);
    stats.peak_build_bytes = size_of_val(&extent.rejected[..]);
    Ok(Parts { nodes: Shared::growing(&nodes, room), wide, order: Shared::partly(order), on_demand: Some(on_demand) })
}
