//! What the walks over wide records read.

use super::slab;
use crate::geometry::{Corners, Triangles};
use crate::simd::{Lanes, prefetch_at};
use crate::tree::{Child, LeafRows, Record, Target, Tree, WIDTH, Wide};

/// Numbers from the start of a leaf that whole vectors are read from, at most.
pub(super) const ROWS: usize = 9 * WIDTH;

/// A wide tree and its triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub wide: &'a Wide,
    pub tree: &'a Tree,
    pub triangles: &'a Triangles<'a>,
    /// Whether single precision has room for the coordinates.
    pub is_small: bool,
    /// Whether the records know in which order a ray meets their children.
    pub is_ordered: bool,
    /// Whether the corners of its triangles are read from the caller's arrays.
    pub is_gathered: bool,
    /// What is asked for ahead: records, then what is read of leaves.
    ahead: [Ahead; 2],
}

/// Where things are, and how many bytes each of them takes.
#[derive(Debug, Clone, Copy)]
struct Ahead {
    start: *const u8,
    stride: usize,
}

/// A leaf's range of references, 1 to 8 of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaf {
    pub first: usize,
    pub count: usize,
}

impl Leaf {
    #[inline(always)]
    pub(super) fn new(word: u32) -> Self {
        match Child::from_word(word).target() {
            Target::Leaf { first, count } => Self { first, count },
            Target::Record(_) | Target::Piece(_) => unreachable!("asked of leaves only"),
        }
    }

    /// One bit for each triangle.
    #[inline(always)]
    pub(super) fn lanes(&self) -> u8 {
        ((1u16 << self.count) - 1) as u8
    }
}

impl<'a> Scene<'a> {
    pub(super) fn new(wide: &'a Wide, tree: &'a Tree, triangles: &'a Triangles<'a>) -> Self {
        let Wide { records, rows, copies, .. } = wide;
        let leaves = match copies {
            Some(copies) => Ahead { start: copies.visits_start(), stride: size_of::<u32>() },
            None if rows.is_empty() => Ahead { start: tree.order.start().cast(), stride: size_of::<u32>() },
            None => Ahead { start: rows.start().cast(), stride: 9 * size_of::<f32>() },
        };
        Self {
            wide,
            tree,
            triangles,
            is_small: slab::is_small(&tree.bounds),
            is_ordered: records.are_ordered(),
            is_gathered: !wide.has_rows(),
            ahead: [Ahead { start: records.start(), stride: records.stride() }, leaves],
        }
    }

    #[inline(always)]
    pub(super) fn record<'s, L: Lanes>(&'s self, word: u32, space: &'s mut Record) -> &'s Record {
        self.wide.records.get::<L>(word as usize, space)
    }

    /// The caller's row of a reference.
    #[inline(always)]
    pub(super) fn row(&self, reference: usize) -> u32 {
        *self.tree.order.get(reference)
    }

    /// The corners of a triangle of a leaf in double precision.
    #[inline(always)]
    pub(super) fn corners(&self, leaf: Leaf, lane: usize) -> Corners {
        // In single precision the corners are at hand.
        if let Some(rows) = self.rows(leaf) {
            return rows.corners(lane);
        }
        let row = self.row(leaf.first + lane);
        if self.wide.has_rows() {
            self.triangles.single_corners(row).map(|corner| corner.map(f64::from))
        } else {
            self.triangles.corners(row)
        }
    }

    /// The rows of a leaf, each a whole vector, if the tree holds them.
    #[inline(always)]
    pub(super) fn rows(&self, leaf: Leaf) -> Option<LeafRows<'_>> {
        self.wide.leaf_rows(leaf.first, leaf.count)
    }

    /// The first, second and third vertices of the triangles of a leaf; lanes without one hold anything.
    #[inline(always)]
    pub(super) fn vertices<L: Lanes>(&self, leaf: Leaf) -> [[L; 3]; 3] {
        let gathered;
        let rows = match self.rows(leaf) {
            Some(rows) => rows,
            None => {
                gathered = self.gathered(leaf);
                LeafRows::new(&gathered, leaf.count)
            }
        };
        vertices(rows)
    }

    /// The rows of a leaf whose vertices the tree does not hold, or not yet; those of double precision are rounded.
    #[inline(never)]
    pub(super) fn gathered(&self, leaf: Leaf) -> [f32; ROWS] {
        let mut rows = [0.0; ROWS];
        if self.wide.copies.is_some() {
            // The triangles lie anywhere: ask for all of them before the first one is waited for.
            self.prefetch_rows(leaf);
            self.prefetch_corners(leaf);
        }
        for lane in 0..leaf.count {
            let corners = self.triangles.single_corners(self.row(leaf.first + lane));
            for (row, &value) in corners.as_flattened().iter().enumerate() {
                rows[row * leaf.count + lane] = value;
            }
        }
        if let Some(copies) = &self.wide.copies {
            copies.visit(leaf.first, leaf.count, &rows);
        }
        rows
    }

    /// The corners of the triangles of a leaf as the caller has them.
    #[inline(always)]
    pub(super) fn all_corners(&self, leaf: Leaf) -> impl Iterator<Item = Corners> {
        (leaf.first..leaf.first + leaf.count).map(|reference| self.triangles.corners(self.row(reference)))
    }

    /// Tell the processor what is read next; by a table, since a branch on what it is could not be predicted.
    #[inline(always)]
    pub(super) fn prefetch(&self, word: u32) {
        let Ahead { start, stride } = self.ahead[usize::from(Child::is_leaf(word))];
        prefetch_at::<4>(start.wrapping_add(stride * Child::index(word)));
    }

    /// The same of the leaf's copy, when it is known where it is.
    #[inline(always)]
    pub(super) fn prefetch_copy(&self, word: u32) {
        if let Some(copies) = &self.wide.copies {
            copies.prefetch(Child::index(word));
        }
    }

    /// The same of the vertices' numbers of a leaf's triangles, of which the references are near.
    #[inline(always)]
    pub(super) fn prefetch_rows(&self, leaf: Leaf) {
        for reference in leaf.first..leaf.first + leaf.count {
            self.triangles.prefetch_row(self.row(reference));
        }
    }

    /// The same of their vertices, of which the numbers are near.
    #[inline(always)]
    pub(super) fn prefetch_corners(&self, leaf: Leaf) {
        for reference in leaf.first..leaf.first + leaf.count {
            self.triangles.prefetch_corners(self.row(reference));
        }
    }

    /// The same of the row of a reference.
    #[inline(always)]
    pub(super) fn prefetch_row(&self, reference: usize) {
        prefetch_at::<1>(self.tree.order.start().wrapping_add(reference).cast());
    }

    /// The root of a piece; none while another thread builds it. Built here if nobody does.
    #[inline(always)]
    pub(super) fn enter(&self, word: u32) -> Option<u32> {
        self.tree.enter(Child::index(word), self.triangles)
    }

    /// Whether a piece has no root yet.
    #[inline(always)]
    pub(super) fn is_unbuilt(&self, piece: usize) -> bool {
        self.tree.on_demand.as_ref().is_some_and(|on_demand| on_demand.is_unbuilt(piece))
    }

    /// Depth of the deepest leaf that there is, in records.
    #[inline(always)]
    pub(super) fn depth(&self) -> usize {
        self.tree.depth()
    }
}

#[inline(always)]
fn vertices<L: Lanes>(rows: LeafRows) -> [[L; 3]; 3] {
    // No closure: it would hold lanes.
    [
        [L::load(rows.get(0)), L::load(rows.get(1)), L::load(rows.get(2))],
        [L::load(rows.get(3)), L::load(rows.get(4)), L::load(rows.get(5))],
        [L::load(rows.get(6)), L::load(rows.get(7)), L::load(rows.get(8))],
    ]
}

/// The places of the bits that are set.
#[inline(always)]
pub(super) fn bits(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < 8).then_some(lane)
    })
}
