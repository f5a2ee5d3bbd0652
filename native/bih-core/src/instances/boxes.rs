//! Trees over boxes, by the construction of trees over triangles: each box is that of a triangle of its own.

use crate::build::{BuildOptions, Heuristic, Layout, build};
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Triangles, Vector, Vertices};
use crate::tree::{NodeRow, Tree, node_table};

/// Lower and upper corner; one that is NaN stands for nothing.
pub(super) type Extent = [Vector; 2];

/// Nothing.
pub(super) const NOTHING: Extent = [[f64::NAN; 3]; 2];

/// The options of a tree over boxes: each has a leaf of its own, so that it is looked at before what is in it.
fn options() -> BuildOptions {
    BuildOptions { layout: Layout::Compact, heuristic: Heuristic::Sah, leaf_size: Some(1), ..Default::default() }
}

/// A tree whose rows are those of the boxes.
pub(super) fn tree_over(boxes: impl Iterator<Item = Extent>, control: &Control) -> Result<Tree, Error> {
    let corners: Vec<_> = boxes.flat_map(triangle).collect();
    build(&Triangles::new(Vertices::F64(&corners), None)?, &options(), control)
}

/// The nodes of such a tree.
pub(super) fn nodes_over(
    tree: &Tree,
    boxes: impl Iterator<Item = Extent>,
    max_depth: u32,
    limit: usize,
    control: &Control,
) -> Result<Vec<NodeRow>, Error> {
    let corners: Vec<_> = boxes.flat_map(triangle).collect();
    node_table(tree, &Triangles::new(Vertices::F64(&corners), None)?, max_depth, limit, control)
}

/// A triangle with this box, and with an area unless the box has none.
fn triangle([lower, upper]: Extent) -> [Vector; 3] {
    let mut third = upper;
    let longest =
        (0..3).fold(
            0,
            |longest, axis| {
                if upper[axis] - lower[axis] > upper[longest] - lower[longest] { axis } else { longest }
            },
        );
    third[longest] = lower[longest];
    [lower, upper, third]
}
