//! The rays of a packet in single precision, in groups of eight lanes.

use super::{GROUPS, PACKET};
use crate::geometry::{Bounds, Ray};
use crate::simd::{Lanes, Mask};
use crate::tree::WIDTH;

/// Coordinates of rays and boxes below this in sum: products of three distances do not overflow.
const RANGE: f32 = 1e12;
/// The largest component of a direction lies within these.
const DIRECTIONS: [f32; 2] = [1e-6, 1e6];

/// The smallest component of a direction that is not zero.
const LEAST_DIRECTION: f32 = 1e-30;

/// Origin, direction, t_min and t_max of each ray in single precision: the nearest, but no t before t_min or behind t_max.
pub(super) type Rows = [[f32; WIDTH]; PACKET];

/// Where t_min and t_max stand in a row.
pub(super) const T_MIN: usize = 6;
pub(super) const T_MAX: usize = 7;

/// All zero where there are fewer.
#[inline(always)]
pub(super) fn rows<L: Lanes>(rays: &[Ray]) -> Rows {
    let mut rows = [[0.0; WIDTH]; PACKET];
    for (row, ray) in rows.iter_mut().zip(rays) {
        *row = L::rounded(bytemuck::cast_ref(ray)).store();
        row[T_MIN] = no_less(row[T_MIN], ray.t_min);
        row[T_MAX] = no_more(row[T_MAX], ray.t_max);
    }
    rows
}

/// The next number if `rounded` is below `x`, without a branch; of negative numbers, which do not matter, another one.
#[inline(always)]
fn no_less(rounded: f32, x: f64) -> f32 {
    f32::from_bits(rounded.to_bits() + u32::from(f64::from(rounded) < x))
}

/// The number before if `rounded` is above `x`; likewise.
#[inline(always)]
fn no_more(rounded: f32, x: f64) -> f32 {
    f32::from_bits(rounded.to_bits() - u32::from(f64::from(rounded) > x))
}

/// Eight rays.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group<L> {
    pub origin: [L; 3],
    pub direction: [L; 3],
    pub t_min: L,
    pub t_max: L,
}

impl<L: Lanes> Group<L> {
    #[inline(always)]
    pub fn new(rows: &Rows, group: usize) -> Self {
        let first = WIDTH * group;
        let [x, y, z, dx, dy, dz, t_min, t_max] = L::transposed([
            L::load(&rows[first]),
            L::load(&rows[first + 1]),
            L::load(&rows[first + 2]),
            L::load(&rows[first + 3]),
            L::load(&rows[first + 4]),
            L::load(&rows[first + 5]),
            L::load(&rows[first + 6]),
            L::load(&rows[first + 7]),
        ]);
        Self { origin: [x, y, z], direction: [dx, dy, dz], t_min, t_max }
    }

    /// The rays for which single precision neither overflows nor underflows unseen, t_min and t_max at least 0; none
    /// of the invalid ones.
    #[inline(always)]
    pub fn in_range(&self, bounds: &Bounds) -> u8 {
        let reach = |axis: usize| bounds.lower[axis].abs().max(bounds.upper[axis].abs());
        let [x, y, z] = [self.origin[0].magnitude(), self.origin[1].magnitude(), self.origin[2].magnitude()];
        // The sums are NaN where anything is.
        let extent = x.plus(y).plus(z).plus(L::splat(reach(0) + reach(1) + reach(2)));
        let [x, y, z] = [self.direction[0].magnitude(), self.direction[1].magnitude(), self.direction[2].magnitude()];
        let longest = x.maximum(y).maximum(z);
        let is_small = extent.below(L::splat(RANGE)).and(x.plus(y).plus(z).below(L::splat(DIRECTIONS[1])));
        let is_long = L::splat(DIRECTIONS[0]).below(longest);
        let zero = L::splat(0.0);
        let is_ahead = zero.at_most(self.t_min).and(self.t_min.at_most(L::splat(f32::MAX)));
        let is_ahead = is_ahead.and(zero.at_most(self.t_max));
        // Reciprocals of what is nearly zero are not monotone.
        let least = L::splat(LEAST_DIRECTION);
        let tiny = x.below(least).and(zero.below(x));
        let tiny = tiny.or(y.below(least).and(zero.below(y))).or(z.below(least).and(zero.below(z)));
        is_small.and(is_long).and(is_ahead).and_not(tiny).bits()
    }

    /// The rays that run towards smaller coordinates, one bit each; −0 counts as smaller.
    #[inline(always)]
    fn negative(&self, axis: usize) -> u8 {
        L::splat(1.0).turned_by(self.direction[axis]).below(L::splat(0.0)).bits()
    }
}

#[inline(always)]
pub(super) fn groups<L: Lanes>(rows: &Rows) -> [Group<L>; GROUPS] {
    let mut groups = [Group::new(rows, 0); GROUPS];
    for (i, group) in groups.iter_mut().enumerate().skip(1) {
        *group = Group::new(rows, i);
    }
    groups
}

/// The same with an active ray in place of those that are not.
pub(super) fn filled(rows: &Rows, active: u64) -> Rows {
    let some = rows[active.trailing_zeros() as usize % PACKET];
    let mut filled = *rows;
    for (i, row) in filled.iter_mut().enumerate() {
        if active >> i & 1 == 0 {
            *row = some;
        }
    }
    filled
}

/// The active rays of each octant that has any.
#[inline(always)]
pub(super) fn octants<L: Lanes>(
    groups: &[Group<L>; GROUPS],
    active: u64,
) -> impl Iterator<Item = (usize, u64)> + use<L> {
    let mut negative = [0; 3];
    for (i, group) in groups.iter().enumerate() {
        for (axis, negative) in negative.iter_mut().enumerate() {
            *negative |= u64::from(group.negative(axis)) << (WIDTH * i);
        }
    }
    (0..8).filter_map(move |octant| {
        let along = |axis: usize| if octant >> axis & 1 != 0 { negative[axis] } else { !negative[axis] };
        let there = active & along(0) & along(1) & along(2);
        (there != 0).then_some((octant, there))
    })
}
