//! The kd-tree among the other trees.

use super::options::BuildOptions;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::kd_tree::{Costs, KdTree, build as build_kd_tree};
use crate::tree::{Shared, Stats, Tree};

/// Build the whole tree.
pub fn build(triangles: &Triangles, options: &BuildOptions, control: &Control) -> Result<Tree, Error> {
    let kd_tree = build_kd_tree(triangles, &Costs::default(), control)?;
    Ok(Tree {
        nodes: Shared::whole(Vec::new()),
        wide: None,
        order: Shared::whole(Vec::new()),
        build: options.build,
        on_demand: None,
        bounds: *kd_tree.bounds(),
        structure: options.structure,
        precision: options.precision,
        heuristic: options.heuristic,
        leaf_size: options.largest_leaf(),
        stats: stats(&kd_tree),
        kd_tree: Some(kd_tree),
    })
}

fn stats(kd_tree: &KdTree) -> Stats {
    let stats = kd_tree.stats();
    let reason = "it sorts by the cells of the global heuristic".to_owned();
    Stats {
        triangles: stats.triangles,
        nodes: stats.nodes,
        leaves: stats.leaves,
        references: stats.references,
        unbuilt: 0,
        depth: stats.depth,
        tree_bytes: stats.tree_bytes,
        // How often triangles are referred to is not known before.
        bound_bytes: 0,
        peak_build_bytes: stats.peak_build_bytes,
        build_seconds: stats.build_seconds,
        presorted: false,
        rejected: stats.rejected,
        left_out: vec![("presort".to_owned(), reason)],
    }
}
