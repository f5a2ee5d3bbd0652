//! What the walks over wide records read.

use super::slab;
use crate::geometry::{Corners, Triangles};
use crate::simd::{Lanes, prefetch_at};
use crate::tree::{Child, Record, Target, Tree, WIDTH, Wide};

/// Numbers from the start of a leaf that whole vectors are read from.
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
        Self { wide, tree, triangles, is_small: slab::is_small(&tree.bounds), is_ordered: wide.records.are_ordered() }
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
        let stored = self.wide.corners(leaf.first, leaf.count, lane);
        stored.unwrap_or_else(|| self.triangles.corners(self.row(leaf.first + lane)))
    }

    /// The rows of a leaf, and what follows them; `space` is where they may be gathered.
    #[inline(always)]
    pub(super) fn rows<'s>(&'s self, leaf: Leaf, space: &'s mut [f32; ROWS]) -> &'s [f32] {
        if self.wide.rows.is_empty() {
            *space = self.gathered(leaf);
            return space;
        }
        let rows = &self.wide.rows;
        rows.slice(9 * leaf.first..rows.len().min(9 * leaf.first + ROWS))
    }

    /// The first, second and third vertices of the triangles of a leaf; lanes without one hold anything.
    #[inline(always)]
    pub(super) fn vertices<L: Lanes>(&self, leaf: Leaf) -> [[L; 3]; 3] {
        let start = 9 * leaf.first;
        let gathered;
        let is_there = start + ROWS <= self.wide.rows.len();
        let rows = match is_there.then(|| self.wide.rows.slice(start..start + ROWS)).and_then(<[f32]>::first_chunk) {
            Some(rows) => rows,
            None => {
                gathered = self.gathered(leaf);
                &gathered
            }
        };
        vertices(rows, leaf.count)
    }

    /// The rows of a leaf whose vertices the tree does not hold; those of double precision are rounded.
    #[inline(never)]
    pub(super) fn gathered(&self, leaf: Leaf) -> [f32; ROWS] {
        let mut rows = [0.0; ROWS];
        for lane in 0..leaf.count {
            let corners = self.triangles.single_corners(self.row(leaf.first + lane));
            for (row, &value) in corners.as_flattened().iter().enumerate() {
                rows[row * leaf.count + lane] = value;
            }
        }
        rows
    }

    /// The corners of the triangles of a leaf as the caller has them.
    #[inline(always)]
    pub(super) fn all_corners(&self, leaf: Leaf) -> impl Iterator<Item = Corners> {
        (leaf.first..leaf.first + leaf.count).map(|reference| self.triangles.corners(self.row(reference)))
    }

    /// Tell the processor what is read next; without a branch, which could not be predicted.
    #[inline(always)]
    pub(super) fn prefetch(&self, word: u32) {
        let Wide { records, rows, .. } = self.wide;
        let (start, stride) = if Child::is_leaf(word) {
            // Which of both it is, is the same for all leaves.
            if rows.is_empty() {
                (self.tree.order.start().cast(), size_of::<u32>())
            } else {
                (rows.start().cast(), 9 * size_of::<f32>())
            }
        } else {
            (records.start(), records.stride())
        };
        prefetch_at::<4>(start.wrapping_add(stride * Child::index(word)));
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

    /// Depth of the deepest leaf that there is, in records.
    #[inline(always)]
    pub(super) fn depth(&self) -> usize {
        self.tree.depth()
    }
}

#[inline(always)]
fn vertices<L: Lanes>(rows: &[f32; ROWS], count: usize) -> [[L; 3]; 3] {
    // No closure: it would hold lanes.
    [
        [row(rows, 0, count), row(rows, 1, count), row(rows, 2, count)],
        [row(rows, 3, count), row(rows, 4, count), row(rows, 5, count)],
        [row(rows, 6, count), row(rows, 7, count), row(rows, 8, count)],
    ]
}

#[inline(always)]
fn row<L: Lanes>(rows: &[f32; ROWS], row: usize, count: usize) -> L {
    // Never past the end: `count` is at most `WIDTH`.
    let start = (row * count).min(ROWS - WIDTH);
    L::load(rows[start..].first_chunk().unwrap_or(&[0.0; WIDTH]))
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
