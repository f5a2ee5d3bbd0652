//! What the global heuristic sorts: one number a triangle, the code of its cell above its row.

use std::ops::Range;

use rayon::prelude::*;

use super::accepted::{Accepted, CHUNK};
use super::extent::Extent;
use super::grid::Grid;
use super::source::{Coordinate, Reading, Source, box_of, doubled_centre, each_row, least, most, read};
use crate::control::{Cancelled, Control};
use crate::geometry::Triangles;
use crate::pages;
use crate::simd::FloatEnvironment;

/// How many low bits of a key hold the row.
pub fn row_bits(triangles: usize) -> u32 {
    usize::BITS - triangles.saturating_sub(1).leading_zeros()
}

/// The bits of a key that are its row.
#[inline(always)]
pub fn row_mask(row_bits: u32) -> u64 {
    (1 << row_bits) - 1
}

/// Makes keys on a grid over the whole scene.
pub struct Keys<'a> {
    pub accepted: Accepted<'a>,
    pub grid: Grid,
}

impl<'a> Keys<'a> {
    pub fn new(accepted: Accepted<'a>, extent: &Extent) -> Self {
        let row_bits = row_bits(accepted.triangles.len());
        Self { accepted, grid: read(accepted.triangles, SceneGrid { extent, row_bits }) }
    }

    /// The keys of the accepted ones among these rows.
    pub fn fill(&self, rows: Range<usize>, mut keys: &mut [u64]) {
        for run in self.accepted.runs(rows) {
            let (mine, rest) = keys.split_at_mut(run.len());
            read(self.accepted.triangles, Fill { grid: &self.grid, first: run.start, keys: mine });
            keys = rest;
        }
    }

    /// All keys in the order of their rows.
    pub fn in_order(&self, control: &Control) -> Result<Vec<u64>, Cancelled> {
        let mut keys = pages::zeroed(self.accepted.len());
        self.accepted.chunks(CHUNK, &mut keys).into_par_iter().try_for_each(|(rows, keys)| {
            let _standard = FloatEnvironment::standard();
            control.check()?;
            self.fill(rows, keys);
            Ok(())
        })?;
        Ok(keys)
    }
}

struct SceneGrid<'a> {
    extent: &'a Extent,
    row_bits: u32,
}

impl Reading for SceneGrid<'_> {
    type Output = Grid;

    #[inline(always)]
    fn run<S: Source>(self, _: S) -> Grid {
        let doubled = |x: f64| S::Scalar::CENTRE_SCALE * 2.0 * x;
        Grid::new(self.extent.lower.map(doubled), self.extent.upper.map(doubled), self.row_bits)
    }
}

struct Fill<'a> {
    grid: &'a Grid,
    first: usize,
    keys: &'a mut [u64],
}

impl Reading for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        for (row, key) in (self.first..).zip(self.keys) {
            *key = self.grid.code(doubled_centre(&box_of(&source.corners(row)))) | row as u64;
        }
    }
}

/// The keys of these rows on a grid, in their order.
pub fn keys_of_rows(triangles: &Triangles, grid: &Grid, rows: &[u32]) -> Vec<u64> {
    let mut keys = vec![0; rows.len()];
    read(triangles, KeysOfRows { grid, rows, keys: &mut keys });
    keys
}

struct KeysOfRows<'a> {
    grid: &'a Grid,
    rows: &'a [u32],
    keys: &'a mut [u64],
}

impl Reading for KeysOfRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        for ((corners, &row), key) in each_row(source, self.rows).zip(self.rows).zip(self.keys) {
            *key = self.grid.code(doubled_centre(&box_of(&corners))) | u64::from(row);
        }
    }
}

/// Code again, on a grid over the centres of these keys alone. None where all centres coincide.
pub fn recode(triangles: &Triangles, keys: &mut [u64], row_bits: u32) -> Option<Grid> {
    let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let union = |a: [[f64; 3]; 2], b: [[f64; 3]; 2]| {
        [std::array::from_fn(|i| least(b[0][i], a[0][i])), std::array::from_fn(|i| most(b[1][i], a[1][i]))]
    };
    let [lower, upper] = keys
        .par_chunks(CHUNK)
        .map(|keys| {
            let _standard = FloatEnvironment::standard();
            read(triangles, Centres { keys, row_bits })
        })
        .reduce(|| empty, union);
    if (0..3).all(|axis| lower[axis] >= upper[axis]) {
        return None;
    }
    let grid = Grid::new(lower, upper, row_bits);
    keys.par_chunks_mut(CHUNK).for_each(|keys| {
        let _standard = FloatEnvironment::standard();
        read(triangles, Recode { grid: &grid, keys, row_bits });
    });
    Some(grid)
}

struct Centres<'a> {
    keys: &'a [u64],
    row_bits: u32,
}

impl Reading for Centres<'_> {
    type Output = [[f64; 3]; 2];

    #[inline(always)]
    fn run<S: Source>(self, source: S) -> [[f64; 3]; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for key in self.keys {
            let row = key & row_mask(self.row_bits);
            let centre = doubled_centre(&box_of(&source.corners(row as usize)));
            for axis in 0..3 {
                bounds[0][axis] = least(centre[axis], bounds[0][axis]);
                bounds[1][axis] = most(centre[axis], bounds[1][axis]);
            }
        }
        bounds
    }
}

struct Recode<'a> {
    grid: &'a Grid,
    keys: &'a mut [u64],
    row_bits: u32,
}

impl Reading for Recode<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        for key in self.keys {
            let row = *key & row_mask(self.row_bits);
            *key = self.grid.code(doubled_centre(&box_of(&source.corners(row as usize)))) | row;
        }
    }
}
