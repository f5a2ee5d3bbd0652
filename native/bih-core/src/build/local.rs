//! The local heuristic: halve the longest side of the box that holds the centres.

use super::frame::{Cut, Range, Split};
use super::pieces::Ranges;
use super::reference::Reference;
use super::source::{least, most};
use crate::simd::Lanes;
use crate::tree::MAX_SPATIAL_DEPTH;

/// Splits ranges of references.
pub struct Local;

impl Split for Local {
    type Item = Reference;
    type State = ();

    fn row(&self, reference: &Reference) -> u32 {
        reference.row
    }

    fn kept(self, ranges: Vec<Range<()>>) -> Ranges {
        Ranges::local(&ranges)
    }

    fn in_rows(rows: &mut [f32]) -> &mut [Reference] {
        bytemuck::cast_slice_mut(rows)
    }

    #[inline(always)]
    fn split<L: Lanes>(&self, references: &mut [Reference], (): &mut (), depth: u32) -> Cut {
        let centres = Centres::of(references, 1);
        if depth < MAX_SPATIAL_DEPTH && !centres.is_point() {
            halve(references, &centres)
        } else {
            by_median(references)
        }
    }
}

/// Bounds of half the centres.
#[derive(Debug, Clone, Copy)]
pub struct Centres {
    pub lower: [f32; 4],
    pub upper: [f32; 4],
}

impl Centres {
    /// Of the references at every `stride`-th place.
    #[inline(always)]
    pub fn of(references: &[Reference], stride: usize) -> Self {
        let mut lower = [f32::INFINITY; 4];
        let mut upper = [f32::NEG_INFINITY; 4];
        for reference in references.iter().step_by(stride) {
            let centre = reference.half_centre();
            for axis in 0..4 {
                lower[axis] = least(centre[axis], lower[axis]);
                upper[axis] = most(centre[axis], upper[axis]);
            }
        }
        Self { lower, upper }
    }

    #[inline(always)]
    pub fn is_point(&self) -> bool {
        (0..3).all(|axis| self.lower[axis] == self.upper[axis])
    }

    #[inline(always)]
    pub fn longest_axis(&self) -> usize {
        let side = |axis: usize| self.upper[axis] - self.lower[axis];
        (1..3).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest })
    }
}

/// Centres that do not all coincide, below and above the middle.
#[inline(always)]
pub fn halve(references: &mut [Reference], centres: &Centres) -> Cut {
    let axis = centres.longest_axis();
    let (lower, upper) = (centres.lower[axis], centres.upper[axis]);
    let middle = 0.5 * (lower + upper);
    // Between neighbours there is no middle.
    let plane = if middle > lower { middle } else { upper };
    let count = partition(references, |reference| reference.half_centre()[axis] < plane);
    Cut::along(axis, count)
}

/// Move the references that are below to the front; answers how many. Without a branch that depends on a reference.
#[inline(always)]
pub fn partition(references: &mut [Reference], is_below: impl Fn(&Reference) -> bool) -> usize {
    let mut count = 0;
    for i in 0..references.len() {
        let below = is_below(&references[i]);
        references.swap(i, count);
        count += usize::from(below);
    }
    count
}

/// For triangles that no plane separates: the lower half of the rows.
#[cold]
pub fn by_median(references: &mut [Reference]) -> Cut {
    let count = references.len() / 2;
    references.select_nth_unstable_by_key(count, |reference| reference.row);
    Cut::by_row(count)
}
