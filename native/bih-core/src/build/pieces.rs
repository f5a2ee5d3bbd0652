//! The pieces that a division leaves to the rays, and how one is split when its items are gone.

use std::ops;
use std::sync::PoisonError;

use super::frame::{Emission, Frame, Range, Split};
use super::global::{Coding, Global, Grids};
use super::grid::Grid;
use super::keys::keys_of_rows;
use super::leaves::Places;
use super::local::Local;
use super::reference::collect_rows;
use super::sah::Sah;
use crate::control::Control;
use crate::geometry::Triangles;

/// A piece that is left to the rays.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub first: u32,
    pub count: u32,
    /// Which of the grids its keys were made on: 0 the scene's, then the others.
    grid: u32,
    /// How deep it hangs, in the binary tree.
    depth: u16,
    /// The same in what is traced.
    pub level: u16,
}

impl Place {
    pub fn new<T>(range: &Range<T>, grid: u32) -> Self {
        let (first, count, depth) = (range.first as u32, range.count as u32, range.depth as u16);
        Self { first, count, grid, depth, level: depth }
    }

    /// Where its references are.
    pub fn references(&self) -> ops::Range<usize> {
        let first = self.first as usize;
        first..first + self.count as usize
    }

    fn range<T>(&self, state: T) -> Range<T> {
        Range { first: self.first as usize, count: self.count as usize, depth: self.depth.into(), state }
    }
}

/// What a division leaves to the rays: its pieces, and the rows of all of them, piece after piece.
pub struct Pieces {
    pub ranges: Ranges,
    pub order: Vec<u32>,
}

/// The pieces of a division, and what is needed to split them as if the items were still there.
#[derive(Debug)]
pub struct Ranges {
    pub places: Box<[Place]>,
    items: Items,
}

/// What pieces are made of.
#[derive(Debug)]
enum Items {
    /// The grid is the scene's; of others the boxes are kept.
    Keys { grid: Box<Grid>, others: Vec<[[f64; 3]; 2]>, row_bits: u32 },
    /// For the local heuristic.
    Local,
    /// For the surface area heuristic.
    Sah,
}

impl Ranges {
    pub fn of_keys(ranges: &[Range<Coding>], grids: Grids, row_bits: u32) -> Self {
        let Grids { scene, others } = grids;
        let others = others.into_inner().unwrap_or_else(PoisonError::into_inner);
        let places = ranges.iter().map(|range| Place::new(range, range.state.grid)).collect();
        Self { places, items: Items::Keys { grid: Box::new(scene), others, row_bits } }
    }

    pub fn local(ranges: &[Range<()>]) -> Self {
        Self { places: ranges.iter().map(|range| Place::new(range, 0)).collect(), items: Items::Local }
    }

    pub fn sah(ranges: &[Range<()>]) -> Self {
        Self { items: Items::Sah, ..Self::local(ranges) }
    }

    /// Never exceeded by `bytes`.
    pub fn bound_bytes(pieces: usize) -> usize {
        size_of::<Grid>() + pieces * (size_of::<Place>() + size_of::<[[f64; 3]; 2]>())
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        let grids = match &self.items {
            Items::Keys { others, .. } => size_of::<Grid>() + size_of_val(&others[..]),
            Items::Local | Items::Sah => 0,
        };
        size_of_val(&self.places[..]) + grids
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
        let place = &self.places[piece];
        match &self.items {
            Items::Keys { grid, others, row_bits } => {
                let recoded = (place.grid as usize).checked_sub(1).map(|other| {
                    let [lower, upper] = others[other];
                    Grid::new(lower, upper, *row_bits)
                });
                let grid = recoded.as_ref().unwrap_or(grid);
                let items = keys_of_rows(triangles, grid, places.order);
                let split = Global { triangles, row_bits: *row_bits, grids: None };
                // In no order by now, which only makes the first cuts slower.
                let range = place.range(Coding::new(grid.axes, 0));
                finish(split, emission, range, items, triangles, leaf_size, places)
            }
            Items::Local => {
                let items = collect_rows(triangles, places.order);
                finish(Local, emission, place.range(()), items, triangles, leaf_size, places)
            }
            Items::Sah => {
                let items = collect_rows(triangles, places.order);
                finish(Sah::QUICK, emission, place.range(()), items, triangles, leaf_size, places)
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
