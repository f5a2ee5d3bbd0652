//! The surface area heuristic, binned (Wald 2007): of the planes between bins on all axes, the one of least expected cost.

use std::ops::Range;

use super::frame::{Cut, Range as Piece, Split};
use super::local::{Centres, by_median, halve, partition};
use super::pieces::Ranges;
use super::reference::Reference;
use crate::simd::Lanes;
use crate::tree::{MAX_SPATIAL_DEPTH, WIDTH};

/// Bins an axis.
const BINS: usize = 16;

/// Ranges below this many have half as many bins; below the second number, on their longest axis alone.
const FEW: usize = 64;
const FEWER: usize = 16;

/// Of longer ranges about as many as this, evenly spread, stand for all.
const SAMPLE: usize = 1024;

/// Splits ranges of references.
pub struct Sah;

impl Split for Sah {
    type Item = Reference;
    type State = ();

    fn row(&self, reference: &Reference) -> u32 {
        reference.row
    }

    fn kept(self, ranges: Vec<Piece<()>>) -> Ranges {
        Ranges::Sah(ranges)
    }

    fn in_rows(rows: &mut [f32]) -> &mut [Reference] {
        bytemuck::cast_slice_mut(rows)
    }

    #[inline(always)]
    fn split<L: Lanes>(&self, references: &mut [Reference], (): &mut (), depth: u32) -> Cut {
        if depth >= MAX_SPATIAL_DEPTH {
            return by_median(references);
        }
        let stride = references.len().div_ceil(SAMPLE);
        let centres = Centres::of(references, stride);
        let grid = BinGrid::new(&centres, if references.len() < FEW { BINS / 2 } else { BINS });
        if let Some((axis, plane)) = best_plane::<L>(references, stride, &grid, axes(references.len(), &centres)) {
            let count = partition(references, |reference| grid.bin(reference, axis) < plane);
            return Cut::along(axis, count);
        }
        let centres = if stride == 1 { centres } else { Centres::of(references, 1) };
        if centres.is_point() { by_median(references) } else { halve(references, &centres) }
    }
}

/// The axes that are looked at.
#[inline(always)]
fn axes(count: usize, centres: &Centres) -> Range<usize> {
    let longest = centres.longest_axis();
    if count < FEWER { longest..longest + 1 } else { 0..3 }
}

/// Equal bins over the bounds of the centres.
struct BinGrid {
    lower: [f32; 4],
    scale: [f32; 4],
    count: usize,
}

impl BinGrid {
    #[inline(always)]
    fn new(centres: &Centres, count: usize) -> Self {
        // A little less, so that the last centre falls into the last bin.
        let bins = count as f32 * (1.0 - 1e-5);
        let scale = std::array::from_fn(|axis| {
            let side = centres.upper[axis] - centres.lower[axis];
            if side > 0.0 { bins / side } else { 0.0 }
        });
        Self { lower: centres.lower, scale, count }
    }

    /// Centres beyond the ends fall into the outermost bins.
    #[inline(always)]
    fn bin(&self, reference: &Reference, axis: usize) -> usize {
        let bin = ((reference.half_centre()[axis] - self.lower[axis]) * self.scale[axis]) as i32;
        bin.clamp(0, self.count as i32 - 1) as usize
    }
}

/// The axis and the first bin of the upper part. None where no plane has a cost that can be
/// compared.
#[inline(always)]
fn best_plane<L: Lanes>(
    references: &[Reference],
    stride: usize,
    grid: &BinGrid,
    axes: Range<usize>,
) -> Option<(usize, usize)> {
    let mut boxes = [[L::splat(f32::NEG_INFINITY); BINS]; 3];
    let mut counts = [[0u32; BINS]; 3];
    for reference in references.iter().step_by(stride) {
        let lanes = reference.lanes::<L>();
        for axis in axes.clone() {
            let bin = grid.bin(reference, axis) & (BINS - 1);
            boxes[axis][bin] = boxes[axis][bin].maximum(lanes);
            counts[axis][bin] += 1;
        }
    }
    let total: u32 = counts[axes.start].iter().sum();
    let mut best = f32::INFINITY;
    let mut plane = None;
    for axis in axes {
        if grid.scale[axis] == 0.0 {
            continue;
        }
        // The upper parts from the last bin down, then the lower ones from the first up.
        let mut upper_costs = [0f32; BINS];
        let (mut part, mut count) = (L::splat(f32::NEG_INFINITY), 0);
        for bin in (1..grid.count).rev() {
            part = part.maximum(boxes[axis][bin]);
            count += counts[axis][bin];
            upper_costs[bin] = cost(part, count);
        }
        let (mut part, mut count) = (L::splat(f32::NEG_INFINITY), 0);
        for bin in 1..grid.count {
            part = part.maximum(boxes[axis][bin - 1]);
            count += counts[axis][bin - 1];
            let sum = cost(part, count) + upper_costs[bin];
            if sum < best && 0 < count && count < total {
                best = sum;
                plane = Some((axis, bin));
            }
        }
    }
    // Costs that are all 0 say nothing.
    plane.filter(|_| best > 0.0)
}

/// Half the surface of the box times the number of leaves that the triangles fill, each tested at once.
#[inline(always)]
fn cost<L: Lanes>(part: L, count: u32) -> f32 {
    let [x0, y0, z0, _, x1, y1, z1, _] = part.store();
    let (x, y, z) = (x0 + x1, y0 + y1, z0 + z1);
    (x * (y + z) + y * z) * count.div_ceil(WIDTH as u32) as f32
}
