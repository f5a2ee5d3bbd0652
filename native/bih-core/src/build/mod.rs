//! Construction: one function outside, one file a step inside.

mod classic;
mod collapse;
mod extent;
mod frame;
mod global;
mod grid;
mod keys;
mod leaves;
mod presort;
mod source;
mod treelet;
mod wide;

use std::time::Instant;

use self::classic::ClassicNodes;
use self::extent::Extent;
use self::frame::{Frame, Places};
use self::global::{Coding, Global};
use self::keys::{Keys, row_bits};
use self::wide::WideRecords;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::simd::FloatEnvironment;
use crate::tree::{Node, Record, Stats, Tree, WIDTH, Wide};

/// What a person can choose about the construction.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuildOptions {
    /// What the tree is traced as.
    pub layout: Layout,
    /// How rays are tested against triangles.
    pub precision: Precision,
    /// Whether the bucket sort comes first; none: where it pays. The tree is the same.
    pub presort: Option<bool>,
    /// Ranges of at most this many triangles become leaves, of wide records `WIDTH` at most; none: the layout's default.
    pub leaf_size: Option<usize>,
}

/// What is traced. The construction is the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Layout {
    /// The 12-byte nodes of the paper.
    #[default]
    Classic,
    /// Records of eight boxes, several levels of the tree in one.
    Wide,
}

/// How a ray is tested against a triangle.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Precision {
    /// In single precision: for previews.
    Fast,
    /// No ray passes between two triangles that share an edge or a vertex.
    #[default]
    Watertight,
}

impl Layout {
    /// The most triangles that its records can refer to.
    fn limit(self) -> usize {
        match self {
            Self::Classic => Triangles::LIMIT,
            Self::Wide => Wide::LIMIT,
        }
    }
}

/// Measured in docs/decisions/leaf-size.md.
pub const DEFAULT_LEAF_SIZE: usize = 4;

/// The same for wide records: docs/decisions/wide-records.md.
pub const DEFAULT_WIDE_LEAF_SIZE: usize = 8;

/// Bytes that a tree over `triangles` never exceeds: one leaf a triangle, and one reference each.
///
/// Known before the build, because an object is referred to once (Wächter and Keller 2006, section 3).
pub fn bound_bytes(options: &BuildOptions, triangles: &Triangles) -> usize {
    match options.layout {
        Layout::Classic => classic_bound(triangles.len()),
        Layout::Wide => wide_bound(triangles.len(), has_rows(options, triangles)),
    }
}

/// Whether leaves hold their vertices: single precision has no room for those of double precision, where it decides.
fn has_rows(options: &BuildOptions, triangles: &Triangles) -> bool {
    options.layout == Layout::Wide && (!triangles.is_double() || options.precision == Precision::Fast)
}

/// A record has two children or more, and each record but the root is a child: of l leaves there are at most l − 1
/// records, or one for a single leaf.
fn wide_bound(triangles: usize, has_rows: bool) -> usize {
    if triangles == 0 {
        return 0;
    }
    let rows = if has_rows { (9 * triangles + WIDTH) * size_of::<f32>() } else { 0 };
    Record::BYTES * (triangles - 1).max(1) + rows + size_of::<u32>() * triangles
}

fn classic_bound(triangles: usize) -> usize {
    Node::BYTES * (2 * triangles).saturating_sub(1) + size_of::<u32>() * triangles
}

/// Build the whole tree by the global heuristic.
pub fn build(triangles: &Triangles, options: &BuildOptions, control: &Control) -> Result<Tree, Error> {
    let limit = options.layout.limit();
    if triangles.len() > limit {
        return Err(Error::TooManyTriangles { triangles: triangles.len(), limit });
    }
    let start = Instant::now();
    let _standard = FloatEnvironment::standard();
    let leaf_size = match options.layout {
        Layout::Classic => options.leaf_size.unwrap_or(DEFAULT_LEAF_SIZE).max(1),
        Layout::Wide => options.leaf_size.unwrap_or(DEFAULT_WIDE_LEAF_SIZE).clamp(1, WIDTH),
    };
    let extent = Extent::of(triangles, control)?;
    let references = triangles.len() - extent.rejected.len();
    control.start(references);
    let mut rows = vec![0f32; if has_rows(options, triangles) && references > 0 { 9 * references + WIDTH } else { 0 }];
    let mut order = vec![0u32; triangles.len()];
    order[references..].copy_from_slice(&extent.rejected);
    let presorted = options.presort.unwrap_or(references > presort::WORTHWHILE);

    let keys = Keys::new(triangles, &extent);
    let axes = keys.grid.axes;
    let mut items = if presorted {
        let mut scratch = vec![0u64; triangles.len()];
        presort::bucket_sort(&keys, &mut scratch, control)?
    } else {
        keys.in_order(control)?
    };
    let split = Global { triangles, row_bits: row_bits(triangles.len()) };
    let state = Coding { axes, sorted: if presorted { presort::SORTED } else { 0 }, is_point: false };
    let places = Places { order: &mut order[..references], rows: &mut rows };
    let mut nodes = Vec::new();
    let (mut leaves, mut depth, mut node_count, mut peak) = (0, 0, 0, 0);
    let mut wide = None;
    if references > 0 {
        match options.layout {
            Layout::Classic => {
                let frame = Frame { split, emission: ClassicNodes, triangles, leaf_size, control };
                let built = frame.construct(&mut items, state, places)?;
                (leaves, depth, node_count, peak) = (built.leaves, built.depth, built.nodes.len(), built.peak_bytes);
                nodes = built.nodes;
            }
            Layout::Wide => {
                let frame = Frame { split, emission: WideRecords, triangles, leaf_size, control };
                let built = frame.construct(&mut items, state, places)?;
                (leaves, depth, peak) = (built.leaves, built.depth, built.peak_bytes);
                node_count = built.records.len() + leaves;
                wide = Some(Wide { records: built.records, rows, depth });
            }
        }
    } else if options.layout == Layout::Wide {
        wide = Some(Wide { records: Vec::new(), rows, depth: 0 });
    }
    let layout_bytes = wide.as_ref().map_or(nodes.len() * Node::BYTES, Wide::bytes);
    let tree_bytes = layout_bytes + order.len() * size_of::<u32>();
    let stats = Stats {
        triangles: triangles.len(),
        nodes: node_count,
        leaves,
        depth,
        tree_bytes,
        bound_bytes: bound_bytes(options, triangles),
        peak_build_bytes: tree_bytes + peak + 8 * references,
        build_seconds: start.elapsed().as_secs_f64(),
        rejected: extent.rejected.len(),
        left_out: Vec::new(),
    };
    Ok(Tree {
        nodes,
        wide,
        order,
        rejected: extent.rejected.len(),
        bounds: extent.bounds(),
        precision: options.precision,
        leaf_size,
        stats,
    })
}
