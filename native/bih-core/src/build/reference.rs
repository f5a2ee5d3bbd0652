//! What the heuristics without a grid sort: the box of a triangle and its row.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::accepted::{Accepted, CHUNK};
use super::source::{Coordinate, Reading, Source, box_of, each_row, least, most, read};
use crate::control::{Cancelled, Control};
use crate::geometry::Triangles;
use crate::simd::{FloatEnvironment, Lanes};

/// Nine numbers, as many as a triangle has in the rows of the leaves: references are sorted in the place of the rows that
/// they are replaced by.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Reference {
    /// The lower corner with its signs turned, so that boxes are united by maxima alone; 0; the upper corner; 0.
    numbers: [f32; 8],
    pub row: u32,
}

impl Reference {
    #[inline(always)]
    fn of<T: Coordinate>(corners: &[[T; 3]; 3], row: u32) -> Self {
        let [lower, upper] = box_of(corners);
        let lower = lower.map(|x| finite(x.below()));
        let upper = upper.map(|x| finite(x.above()));
        let numbers = [-lower[0], -lower[1], -lower[2], 0.0, upper[0], upper[1], upper[2], 0.0];
        Self { numbers, row }
    }

    #[inline(always)]
    pub fn lanes<L: Lanes>(&self) -> L {
        L::load(&self.numbers)
    }

    /// Half the centre of the box, which no coordinate is too large for; 0.
    #[inline(always)]
    pub fn half_centre(&self) -> [f32; 4] {
        std::array::from_fn(|axis| 0.25 * self.numbers[axis + 4] - 0.25 * self.numbers[axis])
    }
}

/// One for each accepted row, in their order.
pub fn collect(accepted: &Accepted, references: &mut [Reference], control: &Control) -> Result<(), Cancelled> {
    accepted.chunks(CHUNK, references).into_par_iter().try_for_each(|(rows, mut references)| {
        let _standard = FloatEnvironment::standard();
        control.check()?;
        for run in accepted.runs(rows) {
            let (mine, rest) = references.split_at_mut(run.len());
            read(accepted.triangles, Collect { first: run.start, references: mine });
            references = rest;
        }
        Ok(())
    })
}

/// One for each of these rows, in their order.
pub fn collect_rows(triangles: &Triangles, rows: &[u32]) -> Vec<Reference> {
    read(triangles, CollectRows { rows })
}

struct CollectRows<'a> {
    rows: &'a [u32],
}

impl Reading for CollectRows<'_> {
    type Output = Vec<Reference>;

    #[inline(always)]
    fn run<S: Source>(self, source: S) -> Vec<Reference> {
        let mut references = Vec::with_capacity(self.rows.len());
        for (corners, &row) in each_row(source, self.rows).zip(self.rows) {
            references.push(Reference::of(&corners, row));
        }
        references
    }
}

struct Collect<'a> {
    first: usize,
    references: &'a mut [Reference],
}

impl Reading for Collect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        for (row, reference) in (self.first..).zip(self.references) {
            *reference = Reference::of(&source.corners(row), row as u32);
        }
    }
}

/// Boxes rounded outward from doubles may be infinite; centres may not.
#[inline(always)]
fn finite(x: f32) -> f32 {
    least(most(x, f32::MIN), f32::MAX)
}
