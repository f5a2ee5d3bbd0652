//! The surface area heuristic, binned (Wald 2007): of the planes between bins on all axes, the one of least expected cost.

use std::ops::Range;

use super::frame::{Cut, Range as Piece, Split};
use super::local::{Centres, by_median, halve, partition};
use super::pieces::Ranges;
use super::reference::Reference;
use super::source::{least, most};
use crate::simd::Lanes;
use crate::tree::{MAX_SPATIAL_DEPTH, WIDTH};

/// Bins an axis.
const BINS: usize = 16;

/// Ranges below this many have half as many bins.
const FEW: usize = 64;

/// Splits ranges of references.
pub struct Sah {
    /// Of ranges below this many only the longest axis is looked at.
    fewer: usize,
    /// Of longer ranges about as many as this, evenly spread, stand for all.
    sample: usize,
}

impl Sah {
    /// Nearly as good: docs/decisions/heuristics.md.
    pub const QUICK: Self = Self { fewer: 16, sample: 256 };

    /// Every reference, every axis: docs/decisions/bvh.md.
    pub const THOROUGH: Self = Self { fewer: 0, sample: usize::MAX };
}

impl Split for Sah {
    type Item = Reference;
    type State = ();

    fn row(&self, reference: &Reference) -> u32 {
        reference.row
    }

    fn kept(self, ranges: Vec<Piece<()>>) -> Ranges {
        Ranges::sah(&ranges)
    }

    fn in_rows(rows: &mut [f32]) -> &mut [Reference] {
        bytemuck::cast_slice_mut(rows)
    }

    #[inline(always)]
    fn split<L: Lanes>(&self, references: &mut [Reference], (): &mut (), depth: u32) -> Cut {
        if depth >= MAX_SPATIAL_DEPTH {
            return by_median(references);
        }
        let stride = references.len().div_ceil(self.sample);
        let centres = Centres::of(references, stride);
        let grid = BinGrid::new(&centres, if references.len() < FEW { BINS / 2 } else { BINS });
        let best = if references.len() < self.fewer {
            let longest = centres.longest_axis();
            best_plane::<L>(references, stride, &grid, longest..longest + 1)
        } else {
            best_plane::<L>(references, stride, &grid, 0..3)
        };
        if let Some((axis, plane)) = best {
            let count = partition(references, |reference| grid.place(reference.half_centre()[axis], axis) < plane);
            return Cut::along(axis, count);
        }
        let centres = if stride == 1 { centres } else { Centres::of(references, 1) };
        if centres.is_point() { by_median(references) } else { halve(references, &centres) }
    }
}

/// From this number up there are whole ones alone, and the last bits are theirs: no conversion, which costs more.
const FIRST_BIN: f32 = (1 << 23) as f32;

/// Equal bins over the bounds of the centres.
struct BinGrid {
    lower: [f32; 4],
    scale: [f32; 4],
    count: usize,
    last_bin: f32,
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
        Self { lower: centres.lower, scale, count, last_bin: FIRST_BIN + (count - 1) as f32 }
    }

    /// The bin of half a centre along an axis, added to `FIRST_BIN`; centres may lie beyond the ends.
    #[inline(always)]
    fn place(&self, half_centre: f32, axis: usize) -> f32 {
        // Half a bin less, because the sum is rounded to the nearest one.
        (half_centre - self.lower[axis]) * self.scale[axis] - 0.5 + FIRST_BIN
    }

    /// The bins along each axis, and one that means nothing. Centres beyond the ends fall into the outermost bins.
    #[inline(always)]
    fn bins(&self, reference: &Reference) -> [u32; 4] {
        let half_centre = reference.half_centre();
        std::array::from_fn(|axis| {
            let place = most(self.place(half_centre[axis], axis), FIRST_BIN);
            least(place, self.last_bin).to_bits() & (BINS as u32 - 1)
        })
    }
}

/// The axis and the place of the first bin of the upper part. None where no plane has a cost that can be
/// compared.
#[inline(always)]
fn best_plane<L: Lanes>(
    references: &[Reference],
    stride: usize,
    grid: &BinGrid,
    axes: Range<usize>,
) -> Option<(usize, f32)> {
    let mut boxes = [[L::splat(f32::NEG_INFINITY); BINS]; 3];
    let mut counts = [[0u32; BINS]; 3];
    for reference in references.iter().step_by(stride) {
        let lanes = reference.lanes::<L>();
        let bins = grid.bins(reference);
        for axis in axes.clone() {
            let bin = bins[axis] as usize;
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
                plane = Some((axis, FIRST_BIN + bin as f32));
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
