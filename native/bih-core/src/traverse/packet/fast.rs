//! Leaves in single precision alone.

use super::bundle::Bundle;
use super::rays::{Group, Rows, T_MIN};
use super::slabs::Slabs;
use super::triangles::Meeting;
use super::walk::{Leaf, Query, Triangles};
use super::{GROUPS, bits};
use crate::simd::{Lanes, Mask};
use crate::traverse::Hit;
use crate::tree::WIDTH;

/// One number of each ray, group by group.
type Column = [[f32; WIDTH]; GROUPS];

/// Of no triangle.
const NO_PLACE: u32 = u32::MAX;

/// The rays as the boxes see them.
#[inline(always)]
fn slabs<L: Lanes>(rays: &Group<L>) -> Slabs<L> {
    let Group { origin, t_min, .. } = *rays;
    let (mut near_reciprocal, mut far_reciprocal) = (rays.direction, rays.direction);
    for axis in 0..3 {
        let reciprocal = L::splat(1.0).over(rays.direction[axis]);
        near_reciprocal[axis] = reciprocal.times(L::splat(1.0 - 2.0 * f32::EPSILON));
        far_reciprocal[axis] = reciprocal.times(L::splat(1.0 + 3.0 * f32::EPSILON));
    }
    Slabs { near_origin: origin, near_reciprocal, far_origin: origin, far_reciprocal, t_min }
}

/// How far the rays matter: to a finite number.
#[inline(always)]
fn limits<L: Lanes>(rays: &Group<L>) -> L {
    rays.t_max.minimum(L::splat(f32::MAX))
}

/// t where it is no less than `t_min` and no more than `limit`, and for which lanes that is.
///
/// A ray meets no triangle before it enters the leaf's box at `near`, so what rounding put before is moved there: a box
/// beyond the nearest hit then holds no nearer one, and the answer does not depend on the order of boxes.
#[inline(always)]
fn within<L: Lanes>(meeting: &Meeting<L>, t_min: L, limit: L, near: L) -> (L, L::Mask) {
    let met = meeting.t.over(meeting.size);
    let t = met.maximum(near);
    (t, t_min.at_most(met).and(t.at_most(limit)))
}

/// The nearest hits.
pub(super) struct Closest<'a, L> {
    rows: &'a Rows,
    groups: &'a [Group<L>; GROUPS],
    /// Rows of triangles in leaf order.
    order: &'a [u32],
    t: Column,
    u: Column,
    v: Column,
    size: Column,
    /// Where the triangle stands in the order, as bits.
    place: Column,
}

impl<'a, L: Lanes> Closest<'a, L> {
    #[inline(always)]
    pub fn new(rows: &'a Rows, groups: &'a [Group<L>; GROUPS], order: &'a [u32]) -> Self {
        let none = [[f32::from_bits(NO_PLACE); WIDTH]; GROUPS];
        let one = [[1.0; WIDTH]; GROUPS];
        Self { rows, groups, order, t: one, u: one, v: one, size: one, place: none }
    }

    /// The row of a triangle; that of none is above all.
    #[inline(always)]
    fn row(&self, place: f32) -> u32 {
        self.order.get(place.to_bits() as usize).copied().unwrap_or(u32::MAX)
    }

    /// Of rays that meet a triangle at the distance of the nearest so far, those for which it has the lower row.
    #[cold]
    #[inline(never)]
    fn lower(&self, group: usize, rays: u8, place: f32) -> u8 {
        let row = self.row(place);
        let mut lower = 0;
        for lane in bits(rays) {
            lower |= u8::from(row < self.row(self.place[group][lane])) << lane;
        }
        lower
    }

    #[inline(always)]
    fn test_triangle(
        &mut self,
        limits: &mut Column,
        triangles: &Triangles,
        lane: usize,
        place: f32,
        group: usize,
        rays: L::Mask,
        near: L,
    ) -> bool {
        let Group { origin, direction, .. } = &self.groups[group];
        let meeting = Meeting::new(origin, direction, &triangles.stored.one(lane));
        let inside = meeting.is_inside().and(rays);
        if inside.bits() == 0 {
            return false;
        }
        let limit = L::load(&limits[group]);
        let (t, within) = within(&meeting, self.groups[group].t_min, limit, near);
        let within = within.and(inside);
        let mut nearer = t.below(limit).and(within);
        let equal = within.and_not(nearer).bits();
        if equal != 0 {
            nearer = nearer.or(L::mask(self.lower(group, equal, place)));
        }
        if nearer.bits() == 0 {
            return false;
        }
        limits[group] = t.select(nearer, limit).store();
        self.u[group] = meeting.u.select(nearer, L::load(&self.u[group])).store();
        self.v[group] = meeting.v.select(nearer, L::load(&self.v[group])).store();
        self.size[group] = meeting.size.select(nearer, L::load(&self.size[group])).store();
        self.place[group] = L::splat(place).select(nearer, L::load(&self.place[group])).store();
        true
    }

    #[inline(always)]
    fn test_ray(
        &mut self,
        limits: &mut Column,
        triangles: &Triangles,
        leaf: &Leaf,
        group: usize,
        ray: usize,
        near: f32,
    ) -> bool {
        let row = &self.rows[WIDTH * group + ray];
        let (meeting, inside) = one_ray::<L>(row, triangles);
        if inside == 0 {
            return false;
        }
        let t_min = L::splat(row[T_MIN]);
        let (t, within) = within(&meeting, t_min, L::splat(limits[group][ray]), L::splat(near));
        let candidates = within.bits() & inside;
        if candidates == 0 {
            return false;
        }
        let [t, u, v, size] = [t.store(), meeting.u.store(), meeting.v.store(), meeting.size.store()];
        let mut is_shorter = false;
        for lane in bits(candidates) {
            let place = f32::from_bits((leaf.first + lane) as u32);
            let limit = limits[group][ray];
            if t[lane] < limit || t[lane] == limit && self.row(place) < self.row(self.place[group][ray]) {
                limits[group][ray] = t[lane];
                self.u[group][ray] = u[lane];
                self.v[group][ray] = v[lane];
                self.size[group][ray] = size[lane];
                self.place[group][ray] = place;
                is_shorter = true;
            }
        }
        is_shorter
    }

    /// The hits of the active rays.
    #[inline(always)]
    pub fn collect(&self, active: u64, mut answer: impl FnMut(usize, Option<Hit>)) {
        for group in 0..GROUPS {
            let size = L::load(&self.size[group]);
            let u = L::load(&self.u[group]).over(size).store();
            let v = L::load(&self.v[group]).over(size).store();
            for lane in bits((active >> (WIDTH * group)) as u8) {
                let triangle = self.order.get(self.place[group][lane].to_bits() as usize).copied();
                let [t, u, v] = [self.t[group][lane], u[lane], v[lane]].map(f64::from);
                answer(WIDTH * group + lane, triangle.map(|triangle| Hit { t, triangle, u, v }));
            }
        }
    }
}

/// One ray against the triangles of a leaf: where it meets their planes, and which it meets inside.
#[inline(always)]
fn one_ray<L: Lanes>(row: &[f32; WIDTH], triangles: &Triangles) -> (Meeting<L>, u8) {
    let [x, y, z, dx, dy, dz, ..] = *row;
    let origin = [L::splat(x), L::splat(y), L::splat(z)];
    let direction = [L::splat(dx), L::splat(dy), L::splat(dz)];
    let meeting = Meeting::new(&origin, &direction, &triangles.stored.all());
    let inside = meeting.is_inside().bits() & triangles.lanes;
    (meeting, inside)
}

/// Whether it takes fewer steps to test the rays one by one.
#[inline(always)]
fn are_few(rays: u8, triangles: &Triangles) -> bool {
    2 * rays.count_ones() <= triangles.lanes.count_ones()
}

impl<L: Lanes> Query<L> for Closest<'_, L> {
    #[inline(always)]
    fn slabs(rays: &Group<L>) -> Slabs<L> {
        slabs(rays)
    }

    #[inline(always)]
    fn limits(rays: &Group<L>) -> L {
        limits(rays)
    }

    #[inline(always)]
    fn test(
        &mut self,
        bundle: &mut Bundle<L>,
        leaf: &Leaf,
        triangles: &Triangles,
        group: usize,
        rays: u8,
        near: L,
    ) -> bool {
        let mut is_shorter = false;
        if are_few(rays, triangles) {
            let near = near.store();
            for ray in bits(rays) {
                is_shorter |= self.test_ray(&mut bundle.limits, triangles, leaf, group, ray, near[ray]);
            }
        } else {
            let rays = L::mask(rays);
            let Group { origin, direction, .. } = &self.groups[group];
            let mut met = 0u8;
            for lane in bits(triangles.lanes) {
                let meeting = Meeting::new(origin, direction, &triangles.stored.one(lane));
                met |= u8::from(meeting.is_inside().and(rays).bits() != 0) << lane;
            }
            for lane in bits(met) {
                let place = f32::from_bits((leaf.first + lane) as u32);
                is_shorter |= self.test_triangle(&mut bundle.limits, triangles, lane, place, group, rays, near);
            }
        }
        if is_shorter {
            bundle.shorten(group, L::load(&bundle.limits[group]));
        }
        is_shorter
    }

    /// The distances of hits are the limits.
    #[inline(always)]
    fn end(&mut self, bundle: &Bundle<L>, active: u64) {
        for group in 0..GROUPS {
            let mask = L::mask((active >> (WIDTH * group)) as u8);
            self.t[group] = L::load(&bundle.limits[group]).select(mask, L::load(&self.t[group])).store();
        }
    }
}

/// Whether anything is hit.
pub(super) struct Occluded<'a, L> {
    rows: &'a Rows,
    groups: &'a [Group<L>; GROUPS],
    /// One bit a ray.
    pub hidden: u64,
}

impl<'a, L: Lanes> Occluded<'a, L> {
    #[inline(always)]
    pub fn new(rows: &'a Rows, groups: &'a [Group<L>; GROUPS]) -> Self {
        Self { rows, groups, hidden: 0 }
    }
}

impl<L: Lanes> Query<L> for Occluded<'_, L> {
    #[inline(always)]
    fn slabs(rays: &Group<L>) -> Slabs<L> {
        slabs(rays)
    }

    #[inline(always)]
    fn limits(rays: &Group<L>) -> L {
        limits(rays)
    }

    #[inline(always)]
    fn test(
        &mut self,
        bundle: &mut Bundle<L>,
        _: &Leaf,
        triangles: &Triangles,
        group: usize,
        rays: u8,
        near: L,
    ) -> bool {
        let limits = L::load(&bundle.limits[group]);
        let t_min = self.groups[group].t_min;
        let mut hidden = 0;
        if are_few(rays, triangles) {
            let near = near.store();
            for ray in bits(rays) {
                let row = &self.rows[WIDTH * group + ray];
                let (meeting, inside) = one_ray::<L>(row, triangles);
                if inside != 0 {
                    let t_min = L::splat(row[T_MIN]);
                    let limit = L::splat(bundle.limits[group][ray]);
                    let (_, within) = within(&meeting, t_min, limit, L::splat(near[ray]));
                    hidden |= u8::from(within.bits() & inside != 0) << ray;
                }
            }
        } else {
            let Group { origin, direction, .. } = &self.groups[group];
            let mut alive = L::mask(rays);
            for lane in bits(triangles.lanes) {
                let meeting = Meeting::new(origin, direction, &triangles.stored.one(lane));
                let inside = meeting.is_inside().and(alive);
                if inside.bits() == 0 {
                    continue;
                }
                let (_, within) = within(&meeting, t_min, limits, near);
                let within = within.and(inside);
                hidden |= within.bits();
                alive = alive.and_not(within);
                if alive.bits() == 0 {
                    break;
                }
            }
        }
        if hidden == 0 {
            return false;
        }
        self.hidden |= u64::from(hidden) << (WIDTH * group);
        bundle.shorten(group, L::splat(f32::NEG_INFINITY).select(L::mask(hidden), limits));
        true
    }
}
