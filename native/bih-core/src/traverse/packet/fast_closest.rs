//! The nearest hits in single precision alone.

use super::bundle::Bundle;
use super::fast::{are_few, limits, one_ray, slabs, within};
use super::rays::{Group, Rows, T_MIN};
use super::slabs::Slabs;
use super::triangles::Meeting;
use super::walk::{Query, Triangles};
use super::{Column, GROUPS, bits};
use crate::simd::{Lanes, Mask};
use crate::traverse::Hit;
use crate::tree::{Shared, WIDTH};

/// Of no triangle.
const NO_PLACE: u32 = u32::MAX;

/// The nearest hits.
pub(super) struct FastClosest<'a, L> {
    rows: &'a Rows,
    groups: &'a [Group<L>; GROUPS],
    /// Rows of triangles in leaf order.
    order: &'a Shared<u32>,
    t: Column,
    u: Column,
    v: Column,
    size: Column,
    /// Where the triangle stands in the order, as bits.
    place: Column,
}

impl<'a, L: Lanes> FastClosest<'a, L> {
    #[inline(always)]
    pub fn new(rows: &'a Rows, groups: &'a [Group<L>; GROUPS], order: &'a Shared<u32>) -> Self {
        let none = [[f32::from_bits(NO_PLACE); WIDTH]; GROUPS];
        let one = [[1.0; WIDTH]; GROUPS];
        Self { rows, groups, order, t: one, u: one, v: one, size: one, place: none }
    }

    /// The row of a triangle; that of none is above all.
    #[inline(always)]
    fn row(&self, place: f32) -> u32 {
        self.order.try_get(place.to_bits() as usize).copied().unwrap_or(u32::MAX)
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
        group: usize,
        rays: L::Mask,
        near: L,
    ) -> bool {
        let place = triangles.place(lane);
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
    fn test_ray(&mut self, limits: &mut Column, triangles: &Triangles, group: usize, ray: usize, near: f32) -> bool {
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
            let place = triangles.place(lane);
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
                let triangle = self.order.try_get(self.place[group][lane].to_bits() as usize).copied();
                let [t, u, v] = [self.t[group][lane], u[lane], v[lane]].map(f64::from);
                answer(WIDTH * group + lane, triangle.map(|triangle| Hit { t, triangle, u, v }));
            }
        }
    }
}

impl<L: Lanes> Query<L> for FastClosest<'_, L> {
    #[inline(always)]
    fn slabs(rays: &Group<L>) -> Slabs<L> {
        slabs(rays)
    }

    #[inline(always)]
    fn limits(rays: &Group<L>) -> L {
        limits(rays)
    }

    #[inline(always)]
    fn test(&mut self, bundle: &mut Bundle<L>, triangles: &Triangles, group: usize, rays: u8, near: L) -> bool {
        let mut is_shorter = false;
        if are_few(rays, triangles) {
            let near = near.store();
            for ray in bits(rays) {
                is_shorter |= self.test_ray(&mut bundle.limits, triangles, group, ray, near[ray]);
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
                is_shorter |= self.test_triangle(&mut bundle.limits, triangles, lane, group, rays, near);
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
