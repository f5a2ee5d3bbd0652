//! The pieces that a division leaves to the rays, and how one is split when its items are gone.

use std::ops;

use super::frame::{Emission, Frame, Range, Split};
use super::global::{Coding, Global};
use super::grid::Grid;
use super::keys::keys_of_rows;
use super::leaves::Places;
use super::local::Local;
use super::reference::collect_rows;
use super::sah::Sah;
use crate::control::Control;
use crate::geometry::Triangles;
use crate::tree::WIDTH;

/// Places between the references of two pieces: whole vectors that begin in the rows of a leaf end before those of the
/// next piece, which may be in the making.
pub const GAP: usize = WIDTH - 1;

/// What a division leaves to the rays: its pieces, and the rows of all of them, piece after piece.
pub struct Pieces {
    pub ranges: Ranges,
    pub order: Vec<u32>,
}

/// The pieces of a division, and what is needed to split them as if the items were still there.
#[derive(Debug)]
pub enum Ranges {
    /// Of keys. The grid is the scene's; of others the boxes are kept.
    Global { ranges: Vec<Range<Coding>>, grid: Box<Grid>, others: Vec<[[f64; 3]; 2]>, row_bits: u32 },
    /// Of references.
    Local(Vec<Range<()>>),
    /// Of references.
    Sah(Vec<Range<()>>),
}

impl Ranges {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Global { ranges, .. } => ranges.len(),
            Self::Local(ranges) | Self::Sah(ranges) => ranges.len(),
        }
    }

    /// Where the references of a piece are, and how deep it hangs.
    pub fn place(&self, piece: usize) -> (ops::Range<usize>, u32) {
        fn place<T>(range: &Range<T>) -> (ops::Range<usize>, u32) {
            (range.first..range.first + range.count, range.depth)
        }
        match self {
            Self::Global { ranges, .. } => place(&ranges[piece]),
            Self::Local(ranges) | Self::Sah(ranges) => place(&ranges[piece]),
        }
    }

    /// Never exceeded by `bytes`.
    pub fn bound_bytes(pieces: usize) -> usize {
        size_of::<Grid>() + pieces * (size_of::<Range<Coding>>() + size_of::<[[f64; 3]; 2]>())
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Global { ranges, others, .. } => {
                size_of::<Grid>() + size_of_val(&ranges[..]) + size_of_val(&others[..])
            }
            Self::Local(ranges) | Self::Sah(ranges) => size_of_val(&ranges[..]),
        }
    }

    /// Split a piece all the way down, over the items that it had in the division.
    pub fn finish<E: Emission>(
        &self,
        emission: E,
        piece: usize,
        triangles: &Triangles,
        leaf_size: usize,
        places: Places,
    ) -> E::Piece {
        match self {
            Self::Global { ranges, grid, others, row_bits } => {
                let range = ranges[piece];
                let recoded = (range.state.grid as usize).checked_sub(1).map(|other| {
                    let [lower, upper] = others[other];
                    Grid::new(lower, upper, *row_bits)
                });
                let items = keys_of_rows(triangles, recoded.as_ref().unwrap_or(grid), places.order);
                let split = Global { triangles, row_bits: *row_bits, grids: None };
                finish(split, emission, range, items, triangles, leaf_size, places)
            }
            Self::Local(ranges) => {
                let items = collect_rows(triangles, places.order);
                finish(Local, emission, ranges[piece], items, triangles, leaf_size, places)
            }
            Self::Sah(ranges) => {
                let items = collect_rows(triangles, places.order);
                finish(Sah::QUICK, emission, ranges[piece], items, triangles, leaf_size, places)
            }
        }
    }
}

fn finish<S: Split, E: Emission>(
    split: S,
    emission: E,
    range: Range<S::State>,
    mut items: Vec<S::Item>,
    triangles: &Triangles,
    leaf_size: usize,
    places: Places,
) -> E::Piece {
    let control = &Control::default();
    let frame = Frame { split, emission, triangles, leaf_size, longest: items.len(), control };
    frame.finish(range, &mut items, places)
}
