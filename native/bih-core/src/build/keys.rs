//! What the global heuristic sorts: one number a triangle, the code of its cell above its row.

use std::ops::Range;

use rayon::prelude::*;

use super::extent::{CHUNK, Extent};
use super::grid::Grid;
use super::source::{Coordinate, Reading, Source, box_of, doubled_centre, least, most, read};
use crate::control::{Cancelled, Control};
use crate::geometry::Triangles;
use crate::simd::FloatEnvironment;

/// How many low bits of a key hold the row.
pub fn row_bits(triangles: usize) -> u32 {
    usize::BITS - triangles.saturating_sub(1).leading_zeros()
}

/// Makes keys on a grid over the whole scene.
pub struct Keys<'a> {
    pub triangles: &'a Triangles<'a>,
    pub grid: Grid,
    /// Ascending rows without a key.
    pub rejected: &'a [u32],
}

impl<'a> Keys<'a> {
    pub fn new(triangles: &'a Triangles<'a>, extent: &'a Extent) -> Self {
        let grid = read(triangles, SceneGrid { extent, row_bits: row_bits(triangles.len()) });
        Self { triangles, grid, rejected: &extent.rejected }
    }

    /// How many keys there are.
    pub fn len(&self) -> usize {
        self.triangles.len() - self.rejected.len()
    }

    /// The keys of these rows, at the front of `keys`; answers how many.
    pub fn fill(&self, rows: Range<usize>, keys: &mut [u64]) -> usize {
        let [start, end] = [rows.start, rows.end].map(|row| self.rejected.partition_point(|&r| (r as usize) < row));
        let mut rejected = &self.rejected[start..end];
        let mut next = rows.start;
        let mut filled = 0;
        // Runs of rows between the rejected ones.
        loop {
            let stop = rejected.first().map_or(rows.end, |&row| row as usize);
            let run = stop - next;
            read(self.triangles, Fill { grid: &self.grid, first: next, keys: &mut keys[filled..filled + run] });
            filled += run;
            match rejected.split_first() {
                Some((_, rest)) => rejected = rest,
                None => return filled,
            }
            next = stop + 1;
        }
    }

    /// All keys in the order of their rows.
    pub fn in_order(&self, control: &Control) -> Result<Vec<u64>, Cancelled> {
        let mut keys = vec![0; self.triangles.len()];
        let counts: Vec<_> = keys
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, keys)| {
                let _standard = FloatEnvironment::standard();
                control.check()?;
                let first = chunk * CHUNK;
                Ok(self.fill(first..first + keys.len(), keys))
            })
            .collect::<Result<_, Cancelled>>()?;
        if !self.rejected.is_empty() {
            let mut end = 0;
            for (chunk, count) in counts.into_iter().enumerate() {
                keys.copy_within(chunk * CHUNK..chunk * CHUNK + count, end);
                end += count;
            }
            keys.truncate(end);
        }
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
            let centre = doubled_centre(&box_of(&source.corners((key & mask(self.row_bits)) as usize)));
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
            let row = *key & mask(self.row_bits);
            *key = self.grid.code(doubled_centre(&box_of(&source.corners(row as usize)))) | row;
        }
    }
}

/// The bits of a key that are its row.
#[inline(always)]
pub fn mask(row_bits: u32) -> u64 {
    (1 << row_bits) - 1
}
