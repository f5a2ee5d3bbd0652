//! The rays of a packet in single precision, in groups of eight lanes.

use super::slabs::{Slabs, is_negative};
use super::{GROUPS, PACKET};
use crate::geometry::{Bounds, Ray};
use crate::simd::{Lanes, Mask};
use crate::tree::WIDTH;

/// One number of each ray, group by group.
pub(super) type Column = [[f32; WIDTH]; GROUPS];

/// Coordinates of rays and boxes below this in sum: no distance between them is above 10^18.
const RANGE: f32 = 5e17;
/// The largest component of a direction lies within these.
const DIRECTIONS: [f32; 2] = [1e-6, 1e6];

/// All numbers of the rays, rounded to nearest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns {
    pub origin: [Column; 3],
    pub direction: [Column; 3],
    pub t_min: Column,
    pub t_max: Column,
}

impl Columns {
    #[inline(always)]
    pub fn new(rays: &[Ray]) -> Self {
        let zero = [[0.0; WIDTH]; GROUPS];
        let mut columns = Self { origin: [zero; 3], direction: [zero; 3], t_min: zero, t_max: zero };
        for (i, ray) in rays.iter().enumerate().take(PACKET) {
            let (group, lane) = (i / WIDTH, i % WIDTH);
            for axis in 0..3 {
                columns.origin[axis][group][lane] = ray.origin[axis] as f32;
                columns.direction[axis][group][lane] = ray.direction[axis] as f32;
            }
            columns.t_min[group][lane] = ray.t_min as f32;
            columns.t_max[group][lane] = ray.t_max as f32;
        }
        columns
    }

    #[inline(always)]
    pub fn origin<L: Lanes>(&self, group: usize) -> [L; 3] {
        load(&self.origin, group)
    }

    #[inline(always)]
    pub fn direction<L: Lanes>(&self, group: usize) -> [L; 3] {
        load(&self.direction, group)
    }

    /// The rays for which single precision neither overflows nor underflows unseen, t_min and t_max at least 0; none
    /// of the invalid ones.
    #[inline(always)]
    pub fn in_range<L: Lanes>(&self, bounds: &Bounds, group: usize) -> u8 {
        let (origin, direction) = (self.origin::<L>(group), self.direction::<L>(group));
        let reach = |axis: usize| bounds.lower[axis].abs().max(bounds.upper[axis].abs());
        let [x, y, z] = [origin[0].magnitude(), origin[1].magnitude(), origin[2].magnitude()];
        // The sums are NaN where anything is.
        let extent = x.plus(y).plus(z).plus(L::splat(reach(0) + reach(1) + reach(2)));
        let [x, y, z] = [direction[0].magnitude(), direction[1].magnitude(), direction[2].magnitude()];
        let longest = x.maximum(y).maximum(z);
        let is_small = extent.below(L::splat(RANGE)).and(x.plus(y).plus(z).below(L::splat(DIRECTIONS[1])));
        let is_long = L::splat(DIRECTIONS[0]).below(longest);
        let zero = L::splat(0.0);
        let is_ahead =
            zero.at_most(L::load(&self.t_min[group])).and(L::load(&self.t_min[group]).at_most(L::splat(f32::MAX)));
        is_small.and(is_long).and(is_ahead).and(zero.at_most(L::load(&self.t_max[group]))).bits()
    }
}

#[inline(always)]
fn load<L: Lanes>(columns: &[Column; 3], group: usize) -> [L; 3] {
    [L::load(&columns[0][group]), L::load(&columns[1][group]), L::load(&columns[2][group])]
}

/// Rays of one octant, and what holds for all of a group of them and for all of them.
pub(super) struct Packet<L> {
    pub octant: usize,
    pub rays: [Slabs<L>; GROUPS],
    /// How far each ray still matters; inactive ones nowhere.
    pub limits: Column,
    /// A lane is a group.
    pub groups: Slabs<L>,
    pub group_limits: [f32; GROUPS],
    /// All lanes are the same.
    pub whole: Slabs<L>,
    pub limit: f32,
}

impl<L: Lanes> Packet<L> {
    /// Only the active rays, all of the octant, count.
    #[inline(always)]
    pub fn new(rays: [Slabs<L>; GROUPS], limits: &Column, active: u64, octant: usize) -> Self {
        let none = L::splat(f32::NEG_INFINITY);
        let mut packet = Self {
            octant,
            rays,
            limits: *limits,
            groups: rays[0],
            group_limits: [f32::NEG_INFINITY; GROUPS],
            whole: rays[0],
            limit: f32::NEG_INFINITY,
        };
        for group in 0..GROUPS {
            let mask = L::mask((active >> (WIDTH * group)) as u8);
            let limits = L::load(&limits[group]).select(mask, none);
            packet.limits[group] = limits.store();
            packet.group_limits[group] = limits.largest();
        }
        packet.limit = L::load(&packet.group_limits).largest();
        packet.enclose(active);
        packet
    }

    /// The extremes of the active rays.
    #[inline(always)]
    fn enclose(&mut self, active: u64) {
        let (least, most) = (L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY));
        let mut t_min = [0.0; GROUPS];
        for group in 0..GROUPS {
            let mask = L::mask((active >> (WIDTH * group)) as u8);
            t_min[group] = self.rays[group].t_min.select(mask, most).smallest();
        }
        self.groups.t_min = L::load(&t_min);
        self.whole.t_min = L::splat(self.groups.t_min.smallest());
        for axis in 0..3 {
            let mut extremes = [[0.0; GROUPS]; 4];
            for group in 0..GROUPS {
                let mask = L::mask((active >> (WIDTH * group)) as u8);
                let rays = &self.rays[group];
                let smallest = [rays.near_reciprocal[axis], rays.far_origin[axis]];
                let largest = [rays.near_origin[axis], rays.far_reciprocal[axis]];
                let [smallest, largest] =
                    if is_negative(self.octant, axis) { [largest, smallest] } else { [smallest, largest] };
                extremes[0][group] = smallest[0].select(mask, most).smallest();
                extremes[1][group] = smallest[1].select(mask, most).smallest();
                extremes[2][group] = largest[0].select(mask, least).largest();
                extremes[3][group] = largest[1].select(mask, least).largest();
            }
            let [a, b, c, d] =
                [L::load(&extremes[0]), L::load(&extremes[1]), L::load(&extremes[2]), L::load(&extremes[3])];
            let (groups, whole) = (&mut self.groups, &mut self.whole);
            let all = [a.smallest(), b.smallest(), c.largest(), d.largest()];
            if is_negative(self.octant, axis) {
                [groups.near_origin[axis], groups.far_reciprocal[axis]] = [a, b];
                [groups.near_reciprocal[axis], groups.far_origin[axis]] = [c, d];
                [whole.near_origin[axis], whole.far_reciprocal[axis]] = [L::splat(all[0]), L::splat(all[1])];
                [whole.near_reciprocal[axis], whole.far_origin[axis]] = [L::splat(all[2]), L::splat(all[3])];
            } else {
                [groups.near_reciprocal[axis], groups.far_origin[axis]] = [a, b];
                [groups.near_origin[axis], groups.far_reciprocal[axis]] = [c, d];
                [whole.near_reciprocal[axis], whole.far_origin[axis]] = [L::splat(all[0]), L::splat(all[1])];
                [whole.near_origin[axis], whole.far_reciprocal[axis]] = [L::splat(all[2]), L::splat(all[3])];
            }
        }
    }

    /// The rays of a group matter less far.
    #[inline(always)]
    pub fn shorten(&mut self, group: usize, limits: L) {
        self.limits[group] = limits.store();
        self.group_limits[group] = limits.largest();
    }
}
