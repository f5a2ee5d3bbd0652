//! The rays of a packet in single precision, in groups of eight lanes.

use super::shaft::Shaft;
use super::slabs::{Sides, Slabs, is_negative};
use super::{GROUPS, PACKET};
use crate::geometry::{Bounds, Ray};
use crate::simd::{Lanes, Mask};
use crate::tree::{Record, Tree, WIDTH};

/// One number of each ray, group by group.
pub(super) type Column = [[f32; WIDTH]; GROUPS];

/// Coordinates of rays and boxes below this in sum: products of two distances and a direction do not overflow.
const RANGE: f32 = 1e15;
/// The largest component of a direction lies within these.
const DIRECTIONS: [f32; 2] = [1e-6, 1e6];

/// Origin, direction, t_min and t_max of each ray, rounded to nearest.
pub(super) type Rows = [[f32; WIDTH]; PACKET];

/// All zero where there are fewer.
#[inline(always)]
pub(super) fn rows<L: Lanes>(rays: &[Ray]) -> Rows {
    let mut rows = [[0.0; WIDTH]; PACKET];
    for (row, ray) in rows.iter_mut().zip(rays) {
        *row = L::rounded(bytemuck::cast_ref(ray)).store();
    }
    rows
}

/// The same of eight rays in lanes.
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
        is_small.and(is_long).and(is_ahead).and(zero.at_most(self.t_max)).bits()
    }
}

/// Rays of one octant, and what holds for all of a group of them and for all of them.
pub(super) struct Packet<'a, L> {
    pub octant: usize,
    pub rays: &'a [Slabs<L>; GROUPS],
    /// How far each ray still matters; inactive ones nowhere.
    pub limits: Column,
    /// A lane is a group.
    pub groups: Slabs<L>,
    pub group_limits: [f32; GROUPS],
    /// All lanes are the same.
    pub whole: Slabs<L>,
    pub limit: f32,
    pub shaft: Shaft<L>,
}

impl<'a, L: Lanes> Packet<'a, L> {
    /// Only the active rays, all of the octant, count. None if they all miss what is in a record.
    #[inline(always)]
    pub fn new(
        rays: &'a [Slabs<L>; GROUPS],
        limits: &Column,
        active: u64,
        octant: usize,
        tree: &Tree,
        record: &Record,
    ) -> Option<Self> {
        let mut masked = [[0.0; WIDTH]; GROUPS];
        let mut longest = L::splat(f32::NEG_INFINITY);
        for group in 0..GROUPS {
            let limits = L::load(&limits[group]).select(mask::<L>(active, group), L::splat(f32::NEG_INFINITY));
            masked[group] = limits.store();
            longest = longest.maximum(limits);
        }
        let limit = longest.largest();
        let whole = enclosed(rays, active, octant);
        let (near, far) = whole.clip(&Sides::all(record, octant), L::splat(limit));
        if near.at_most(far).bits() == 0 {
            return None;
        }
        let mut of_groups = [longest; GROUPS];
        for group in 0..GROUPS {
            of_groups[group] = L::load(&masked[group]);
        }
        let group_limits = largest_each(of_groups).store();
        let groups = enclosed_each(rays, active, octant);
        let shaft = Shaft::new(&whole, tree.bounds());
        Some(Self { octant, rays, limits: masked, groups, group_limits, whole, limit, shaft })
    }

    /// Of the groups, the first of which a ray meets the box, and all behind it.
    #[inline(always)]
    pub fn confirmed(&self, sides: &Sides<L>, mut groups: u8) -> u8 {
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            let (near, far) = self.rays[group].clip(sides, L::load(&self.limits[group]));
            crate::count!(12, 1);
            if near.at_most(far).bits() != 0 {
                break;
            }
            groups &= groups - 1;
        }
        groups
    }

    /// The rays of a group matter less far.
    #[inline(always)]
    pub fn shorten(&mut self, group: usize, limits: L) {
        self.limits[group] = limits.store();
        self.group_limits[group] = limits.largest();
    }
}

#[inline(always)]
fn mask<L: Lanes>(active: u64, group: usize) -> L::Mask {
    L::mask((active >> (WIDTH * group)) as u8)
}

/// One number of the boxes' test along an axis, of the rays of a group that are active.
#[derive(Clone, Copy)]
enum Number {
    NearOrigin,
    NearReciprocal,
    FarOrigin,
    FarReciprocal,
}

impl Number {
    /// Whether the largest of many encloses them; else the smallest.
    #[inline(always)]
    fn is_largest(self, octant: usize, axis: usize) -> bool {
        matches!(self, Self::NearOrigin | Self::FarReciprocal) != is_negative(octant, axis)
    }

    #[inline(always)]
    fn of<L: Lanes>(self, slabs: &Slabs<L>, axis: usize) -> L {
        match self {
            Self::NearOrigin => slabs.near_origin[axis],
            Self::NearReciprocal => slabs.near_reciprocal[axis],
            Self::FarOrigin => slabs.far_origin[axis],
            Self::FarReciprocal => slabs.far_reciprocal[axis],
        }
    }

    /// The one that encloses those of all rays, in all lanes.
    #[inline(always)]
    fn whole<L: Lanes>(self, rays: &[Slabs<L>; GROUPS], active: u64, octant: usize, axis: usize) -> L {
        if self.is_largest(octant, axis) {
            let mut largest = L::splat(f32::NEG_INFINITY);
            for (group, slabs) in rays.iter().enumerate() {
                largest = self.of(slabs, axis).select(mask::<L>(active, group), largest).maximum(largest);
            }
            L::splat(largest.largest())
        } else {
            let mut smallest = L::splat(f32::INFINITY);
            for (group, slabs) in rays.iter().enumerate() {
                smallest = self.of(slabs, axis).select(mask::<L>(active, group), smallest).minimum(smallest);
            }
            L::splat(smallest.smallest())
        }
    }

    /// Those that enclose the rays of each group.
    #[inline(always)]
    fn each<L: Lanes>(self, rays: &[Slabs<L>; GROUPS], active: u64, octant: usize, axis: usize) -> L {
        let is_largest = self.is_largest(octant, axis);
        let none = L::splat(if is_largest { f32::NEG_INFINITY } else { f32::INFINITY });
        let mut numbers = [none; GROUPS];
        for (group, slabs) in rays.iter().enumerate() {
            numbers[group] = self.of(slabs, axis).select(mask::<L>(active, group), none);
        }
        if is_largest { largest_each(numbers) } else { smallest_each(numbers) }
    }
}

/// One ray, in all lanes, that meets what any of the active rays meets.
#[inline(always)]
fn enclosed<L: Lanes>(rays: &[Slabs<L>; GROUPS], active: u64, octant: usize) -> Slabs<L> {
    let mut whole = rays[0];
    let mut t_min = L::splat(f32::INFINITY);
    for (group, slabs) in rays.iter().enumerate() {
        t_min = slabs.t_min.select(mask::<L>(active, group), t_min).minimum(t_min);
    }
    whole.t_min = L::splat(t_min.smallest());
    for axis in 0..3 {
        whole.near_origin[axis] = Number::NearOrigin.whole(rays, active, octant, axis);
        whole.near_reciprocal[axis] = Number::NearReciprocal.whole(rays, active, octant, axis);
        whole.far_origin[axis] = Number::FarOrigin.whole(rays, active, octant, axis);
        whole.far_reciprocal[axis] = Number::FarReciprocal.whole(rays, active, octant, axis);
    }
    whole
}

/// One ray a group, in its lane, that meets what any of its active rays meets.
#[inline(always)]
fn enclosed_each<L: Lanes>(rays: &[Slabs<L>; GROUPS], active: u64, octant: usize) -> Slabs<L> {
    let mut groups = rays[0];
    let mut t_min = [L::splat(f32::INFINITY); GROUPS];
    for (group, slabs) in rays.iter().enumerate() {
        t_min[group] = slabs.t_min.select(mask::<L>(active, group), t_min[group]);
    }
    groups.t_min = smallest_each(t_min);
    for axis in 0..3 {
        groups.near_origin[axis] = Number::NearOrigin.each(rays, active, octant, axis);
        groups.near_reciprocal[axis] = Number::NearReciprocal.each(rays, active, octant, axis);
        groups.far_origin[axis] = Number::FarOrigin.each(rays, active, octant, axis);
        groups.far_reciprocal[axis] = Number::FarReciprocal.each(rays, active, octant, axis);
    }
    groups
}

/// The smallest of each.
#[inline(always)]
fn smallest_each<L: Lanes>(rows: [L; WIDTH]) -> L {
    let [a, b, c, d, e, f, g, h] = L::transposed(rows);
    a.minimum(b).minimum(c.minimum(d)).minimum(e.minimum(f).minimum(g.minimum(h)))
}

/// The largest of each.
#[inline(always)]
fn largest_each<L: Lanes>(rows: [L; WIDTH]) -> L {
    let [a, b, c, d, e, f, g, h] = L::transposed(rows);
    a.maximum(b).maximum(c.maximum(d)).maximum(e.maximum(f).maximum(g.maximum(h)))
}
