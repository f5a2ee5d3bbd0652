//! Construction: one function outside, one file a strategy inside.

mod eager;
mod reference;
mod split;

use std::time::Instant;

use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::simd::FloatEnvironment;
use crate::tree::{Node, Stats, Tree};

/// What a person can choose about the construction.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuildOptions {
    /// Ranges of at most this many triangles become leaves; none: `DEFAULT_LEAF_SIZE`.
    pub leaf_size: Option<usize>,
}

/// Measured in docs/decisions/leaf-size.md.
pub const DEFAULT_LEAF_SIZE: usize = 4;

/// Bytes that a tree over `triangles` never exceeds: a binary tree of one leaf a triangle, and one reference each.
///
/// Known before the build, because an object is referred to once (Wächter and Keller 2006, section 3).
pub fn bound_bytes(triangles: usize) -> usize {
    Node::BYTES * (2 * triangles).saturating_sub(1) + size_of::<u32>() * triangles
}

/// Build the whole tree by the global heuristic.
pub fn build(triangles: &Triangles, options: &BuildOptions, control: &Control) -> Result<Tree, Error> {
    let start = Instant::now();
    let _standard = FloatEnvironment::standard();
    let leaf_size = options.leaf_size.unwrap_or(DEFAULT_LEAF_SIZE).max(1);
    let (mut references, rejected) = reference::collect(triangles);
    let scratch_bytes = references.capacity() * size_of::<reference::Reference>();
    control.start(references.len());
    let built = eager::build(&mut references, leaf_size, control)?;

    let mut order = Vec::with_capacity(triangles.len());
    order.extend(references.iter().map(|reference| reference.row));
    order.extend_from_slice(&rejected);
    let tree_bytes = built.nodes.len() * Node::BYTES + order.len() * size_of::<u32>();
    let stats = Stats {
        triangles: triangles.len(),
        nodes: built.nodes.len(),
        leaves: built.leaves,
        depth: built.depth,
        tree_bytes,
        bound_bytes: bound_bytes(triangles.len()),
        peak_build_bytes: tree_bytes + scratch_bytes + rejected.len() * size_of::<u32>(),
        build_seconds: start.elapsed().as_secs_f64(),
        rejected: rejected.len(),
        left_out: built.left_out,
    };
    Ok(Tree { nodes: built.nodes, order, rejected: rejected.len(), bounds: built.bounds, stats })
}
