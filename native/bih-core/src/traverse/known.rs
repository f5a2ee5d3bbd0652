//! What bounds on the errors of tests in single precision tell: docs/accuracy.md, section 4.

use super::scene::bits;
use super::slab::TINY;
use crate::simd::{Lanes, Mask};

const LEAST_ERROR: f32 = 1e-36;
const MORE: f32 = 1.0 + 8.0 * f32::EPSILON;
/// Makes up for the roundings of a quotient of two bounds, of both of these, and of the product with this.
const DOWN: f32 = 1.0 - 3.0 * f32::EPSILON;
const UP: f32 = 1.0 + 3.0 * f32::EPSILON;

/// Bounds on the errors of tests.
#[derive(Debug, Clone, Copy)]
pub(super) struct Errors<L> {
    /// Of edge values, in units of the largest edge component and of its square.
    pub edge: L,
    pub square: L,
    /// Of both parts of t in units of that square.
    pub above: L,
    pub below: L,
    pub least_above: L,
}

/// Where lines meet the planes of triangles, as in `Meeting`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met<L> {
    pub size: L,
    pub u: L,
    pub v: L,
    pub t: L,
    /// The largest edge component.
    pub longest: L,
}

/// What is known of rays and triangles, of which some may hit each other. One bit a lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<L> {
    /// In all other lanes there is no hit, or none before the limit.
    pub possible: u8,
    /// The line surely meets the triangle, and not before t_min.
    pub sure: u8,
    /// What is hit is not hit before this.
    pub low: L,
    /// What is sure is not hit behind this.
    pub high: L,
}

impl<L: Lanes> Errors<L> {
    /// None if no lane has a hit before its limit.
    #[inline(always)]
    pub(super) fn known(&self, met: &Met<L>, t_min: L, limit: L, lanes: u8) -> Option<Known<L>> {
        let Met { size, u, v, t, longest } = *met;
        let square = longest.times(longest);
        let (zero, least) = (L::splat(0.0), L::splat(LEAST_ERROR));
        let error = square.fused(self.square, longest.fused(self.edge, least));
        let both = u.plus(v);
        let outside = u.minimum(v).plus(error).below(zero).or(size.plus(error).below(both));
        // Beyond the limit: t / size, each at its nearest, still exceeds it.
        let above_error = square.fused(self.above, self.least_above);
        let below_error = square.fused(self.below, least);
        let (nearest, most) = (t.minus(above_error), size.plus(below_error));
        let beyond = most.times(L::splat(MORE)).times(limit).below(nearest);
        let possible = !outside.or(beyond).bits() & lanes;
        if possible == 0 {
            return None;
        }
        let low = nearest.over(most).fused(L::splat(DOWN), L::splat(-TINY));
        let rest = size.minus(below_error);
        let high = t.plus(above_error).over(rest).fused(L::splat(UP), L::splat(TINY));
        let behind = high.below(t_min).and(zero.below(rest));
        let inside = error.below(u).and(error.below(v)).and(both.plus(error).below(size));
        let possible = possible & !behind.bits();
        let sure = inside.and(t_min.at_most(low)).bits() & possible;
        (possible != 0).then_some(Known { possible, sure, low, high })
    }
}

impl<L: Lanes> Known<L> {
    /// The lane that is surely hit first, before all others and before a number, and between which numbers.
    #[inline(always)]
    pub(super) fn first(&self, before: f32) -> Option<(usize, f32, f32)> {
        let (low, high) = (self.low.store(), self.high.store());
        let mut lanes = bits(self.sure);
        let mut first = lanes.next()?;
        if self.possible.is_power_of_two() {
            // There is nothing to compare it with.
            return (high[first] < before).then_some((first, low[first], high[first]));
        }
        for lane in lanes {
            if high[lane] < high[first] {
                first = lane;
            }
        }
        let others = self.possible & !(1 << first);
        let is_clear = high[first] < before && bits(others).all(|lane| high[first] < low[lane]);
        is_clear.then_some((first, low[first], high[first]))
    }
}
