//! Construction: one function outside, one file a strategy inside.

mod eager;
mod reference;
mod split;

use std::time::Instant;

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
pub fn bound_bytes(layout: Layout, triangles: &Triangles) -> usize {
    match layout {
        Layout::Classic => classic_bound(triangles.len()),
        Layout::Wide => wide_bound(triangles.len(), triangles.is_double()),
    }
}

/// One record for each seven leaves that it adds, where it is full; one that is not full has leaves alone, two at least.
/// So of r records with one triangle a leaf at most (T + 1) · 4 / 7 are needed, and one more for a root with one leaf.
fn wide_bound(triangles: usize, is_double: bool) -> usize {
    if triangles == 0 {
        return 0;
    }
    let rows = if is_double { 0 } else { (9 * triangles + WIDTH) * size_of::<f32>() };
    Record::BYTES * (4 * (triangles + 1) / 7 + 1) + rows + size_of::<u32>() * triangles
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
    let (mut references, rejected) = reference::collect(triangles);
    let scratch_bytes = references.capacity() * size_of::<reference::Reference>();
    control.start(references.len());
    let built = eager::build(&mut references, leaf_size, control)?;

    let mut order = Vec::with_capacity(triangles.len());
    order.extend(references.iter().map(|reference| reference.row));
    order.extend_from_slice(&rejected);
    let references = &order[..order.len() - rejected.len()];
    let wide = match options.layout {
        Layout::Classic => None,
        Layout::Wide => Some(Wide::collapse(&built.nodes, references, triangles, control)?),
    };
    let binary_bytes = built.nodes.len() * Node::BYTES;
    let (nodes, depth, layout_bytes) = match &wide {
        None => (built.nodes.len(), built.depth, binary_bytes),
        Some(wide) => (wide.records.len() + built.leaves, wide.depth, wide.bytes()),
    };
    let tree_bytes = layout_bytes + order.len() * size_of::<u32>();
    let stats = Stats {
        triangles: triangles.len(),
        nodes,
        leaves: built.leaves,
        depth,
        tree_bytes,
        bound_bytes: bound_bytes(options.layout, triangles),
        peak_build_bytes: tree_bytes + binary_bytes + scratch_bytes + rejected.len() * size_of::<u32>(),
        build_seconds: start.elapsed().as_secs_f64(),
        rejected: rejected.len(),
        left_out: built.left_out,
    };
    let nodes = if wide.is_some() { Vec::new() } else { built.nodes };
    Ok(Tree {
        nodes,
        wide,
        order,
        rejected: rejected.len(),
        bounds: built.bounds,
        precision: options.precision,
        leaf_size,
        stats,
    })
}
