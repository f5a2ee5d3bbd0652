//! Leaves in single precision alone.

use super::rays::{Column, Group, Packet, Rows};
use super::slabs::Slabs;
use super::walk::{Leaf, Query};
use super::{GROUPS, Hits, bits, load_rows};
use crate::simd::{Lanes, Mask};
use crate::traverse::Hit;
use crate::tree::WIDTH;

/// Of no triangle.
const NO_PLACE: u32 = u32::MAX;
/// Where t_min stands in a row.
const T_MIN: usize = 6;

/// The rays as the boxes see them.
#[inline(always)]
pub(super) fn slabs<L: Lanes>(rays: &Group<L>) -> Slabs<L> {
    let origin = rays.origin;
    let mut slabs = Slabs {
        near_origin: origin,
        near_reciprocal: origin,
        far_origin: origin,
        far_reciprocal: origin,
        t_min: rays.t_min,
    };
    for (axis, &direction) in rays.direction.iter().enumerate() {
        let reciprocal = L::splat(1.0).over(direction);
        slabs.near_reciprocal[axis] = reciprocal.times(L::splat(1.0 - 2.0 * f32::EPSILON));
        slabs.far_reciprocal[axis] = reciprocal.times(L::splat(1.0 + 3.0 * f32::EPSILON));
        let magnitude = reciprocal.magnitude();
        let is_regular =
            L::splat(2.0 * f32::MIN_POSITIVE).at_most(magnitude).and(magnitude.below(L::splat(f32::MAX / 2.0)));
        if is_regular.bits() != u8::MAX {
            let [near, far] = irregular(direction.store());
            slabs.near_reciprocal[axis] = slabs.near_reciprocal[axis].select(is_regular, L::load(&near));
            slabs.far_reciprocal[axis] = slabs.far_reciprocal[axis].select(is_regular, L::load(&far));
        }
    }
    slabs
}

/// Reciprocals of directions that are zero, or nearly.
#[cold]
fn irregular(directions: [f32; WIDTH]) -> [[f32; WIDTH]; 2] {
    let near = directions.map(|d| if d == 0.0 { f32::INFINITY } else { f32::MAX }.copysign(d));
    [near, directions.map(|d| f32::INFINITY.copysign(d))]
}

/// The triangles of a leaf in lanes.
pub(super) struct LeafTriangles {
    v0: [[f32; WIDTH]; 3],
    e1: [[f32; WIDTH]; 3],
    e2: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
}

#[inline(always)]
fn prepare<L: Lanes>(leaf: &Leaf) -> LeafTriangles {
    let [v0, v1, v2] = load_rows::<L>(leaf);
    let (e1, e2) = (minus(&v0, &v1), minus(&v2, &v0));
    LeafTriangles { v0: store(&v0), e1: store(&e1), e2: store(&e2), normal: store(&cross(&e2, &e1)) }
}

#[inline(always)]
fn store<L: Lanes>(v: &[L; 3]) -> [[f32; WIDTH]; 3] {
    [v[0].store(), v[1].store(), v[2].store()]
}

#[inline(always)]
fn load<L: Lanes>(v: &[[f32; WIDTH]; 3]) -> [L; 3] {
    [L::load(&v[0]), L::load(&v[1]), L::load(&v[2])]
}

#[inline(always)]
fn splat<L: Lanes>(v: &[[f32; WIDTH]; 3], lane: usize) -> [L; 3] {
    let lane = lane % WIDTH;
    [L::splat(v[0][lane]), L::splat(v[1][lane]), L::splat(v[2][lane])]
}

#[inline(always)]
fn minus<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0].minus(b[0]), a[1].minus(b[1]), a[2].minus(b[2])]
}

#[inline(always)]
fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [component(a[1], b[2], a[2], b[1]), component(a[2], b[0], a[0], b[2]), component(a[0], b[1], a[1], b[0])]
}

/// a · b − c · d; −0 less a number is its negative, whatever it is.
#[inline(always)]
fn component<L: Lanes>(a: L, b: L, c: L, d: L) -> L {
    a.fused(b, L::splat(-0.0).minus(c.times(d)))
}

#[inline(always)]
fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].fused(b[0], a[1].fused(b[1], a[2].times(b[2])))
}

/// Where lines meet planes of triangles.
struct Meeting<L> {
    size: L,
    u: L,
    v: L,
    above: L,
}

impl<L: Lanes> Meeting<L> {
    /// One ray and eight triangles, or eight rays and one.
    #[inline(always)]
    fn new(origin: &[L; 3], direction: &[L; 3], v0: &[L; 3], e1: &[L; 3], e2: &[L; 3], normal: &[L; 3]) -> Self {
        let to_vertex = minus(v0, origin);
        let moment = cross(&to_vertex, direction);
        let below = dot(normal, direction);
        Self {
            size: below.magnitude(),
            u: dot(&moment, e2).turned_by(below),
            v: dot(&moment, e1).turned_by(below),
            above: dot(normal, &to_vertex).turned_by(below),
        }
    }

    #[inline(always)]
    fn is_inside(&self) -> L::Mask {
        let zero = L::splat(0.0);
        let weights = zero.at_most(self.u).and(zero.at_most(self.v));
        weights.and(self.u.plus(self.v).at_most(self.size)).and(zero.below(self.size))
    }

    /// t where it is no less than `t_min` and no more than `limit`, and for which lanes that is.
    ///
    /// A ray meets no triangle before it enters the leaf's box at `near`, so what rounding put before is moved there: a
    /// box beyond the nearest hit then holds no nearer one, and the answer does not depend on the order of boxes.
    #[inline(always)]
    fn within(&self, t_min: L, limit: L, near: L) -> (L, L::Mask) {
        let met = self.above.over(self.size);
        let t = met.maximum(near);
        (t, t_min.at_most(met).and(t.at_most(limit)))
    }
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
        triangles: &LeafTriangles,
        lane: usize,
        place: f32,
        group: usize,
        rays: L::Mask,
        near: L,
    ) -> bool {
        let Group { origin, direction, .. } = &self.groups[group];
        let meeting = Meeting::new(
            origin,
            direction,
            &splat(&triangles.v0, lane),
            &splat(&triangles.e1, lane),
            &splat(&triangles.e2, lane),
            &splat(&triangles.normal, lane),
        );
        let inside = meeting.is_inside().and(rays);
        if inside.bits() == 0 {
            return false;
        }
        let limit = L::load(&limits[group]);
        let (t, within) = meeting.within(self.groups[group].t_min, limit, near);
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
        triangles: &LeafTriangles,
        leaf: &Leaf,
        group: usize,
        ray: usize,
        near: f32,
    ) -> bool {
        let row = &self.rows[WIDTH * group + ray];
        let (meeting, inside) = one_ray::<L>(row, triangles, leaf);
        if inside == 0 {
            return false;
        }
        let t_min = L::splat(row[T_MIN]);
        let (t, within) = meeting.within(t_min, L::splat(limits[group][ray]), L::splat(near));
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

    /// The distances of some rays' hits, if any, are their limits.
    #[inline(always)]
    pub fn keep(&mut self, limits: &Column, active: u64) {
        for group in 0..GROUPS {
            let mask = L::mask((active >> (WIDTH * group)) as u8);
            self.t[group] = L::load(&limits[group]).select(mask, L::load(&self.t[group])).store();
        }
    }

    /// The hits of all rays but those that were answered otherwise.
    #[inline(always)]
    pub fn collect(&self, active: u64, hits: Hits) {
        for (group, hits) in hits.chunks_mut(WIDTH).enumerate() {
            let size = L::load(&self.size[group]);
            let u = L::load(&self.u[group]).over(size).store();
            let v = L::load(&self.v[group]).over(size).store();
            let active = active >> (WIDTH * group);
            for (lane, hit) in hits.iter_mut().enumerate() {
                if active >> lane & 1 != 0 {
                    let triangle = self.order.get(self.place[group][lane].to_bits() as usize).copied();
                    let [t, u, v] = [self.t[group][lane], u[lane], v[lane]].map(f64::from);
                    *hit = triangle.map(|triangle| Hit { t, triangle, u, v });
                }
            }
        }
    }
}

/// One ray against the triangles of a leaf: where it meets their planes, and which it meets inside.
#[inline(always)]
fn one_ray<L: Lanes>(row: &[f32; WIDTH], triangles: &LeafTriangles, leaf: &Leaf) -> (Meeting<L>, u8) {
    let [x, y, z, dx, dy, dz, ..] = *row;
    let origin = [L::splat(x), L::splat(y), L::splat(z)];
    let direction = [L::splat(dx), L::splat(dy), L::splat(dz)];
    let meeting = Meeting::new(
        &origin,
        &direction,
        &load(&triangles.v0),
        &load(&triangles.e1),
        &load(&triangles.e2),
        &load(&triangles.normal),
    );
    let inside = meeting.is_inside().bits() & ((1u16 << leaf.count) - 1) as u8;
    (meeting, inside)
}

/// Whether it takes fewer steps to test the rays one by one.
#[inline(always)]
fn are_few(rays: u8, leaf: &Leaf) -> bool {
    rays.count_ones() as usize <= leaf.count / 2
}

impl<L: Lanes> Query<L> for Closest<'_, L> {
    type Triangles = LeafTriangles;

    #[inline(always)]
    fn prepare(&self, leaf: &Leaf) -> LeafTriangles {
        prepare::<L>(leaf)
    }

    #[inline(always)]
    fn test(
        &mut self,
        packet: &mut Packet<'_, L>,
        leaf: &Leaf,
        triangles: &LeafTriangles,
        group: usize,
        rays: u8,
        near: L,
    ) -> bool {
        let mut is_shorter = false;
        if are_few(rays, leaf) {
            let near = near.store();
            for ray in bits(rays) {
                is_shorter |= self.test_ray(&mut packet.limits, triangles, leaf, group, ray, near[ray]);
            }
        } else {
            let rays = L::mask(rays);
            for lane in 0..leaf.count {
                let place = f32::from_bits((leaf.first + lane) as u32);
                is_shorter |= self.test_triangle(&mut packet.limits, triangles, lane, place, group, rays, near);
            }
        }
        if is_shorter {
            packet.shorten(group, L::load(&packet.limits[group]));
        }
        is_shorter
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
    type Triangles = LeafTriangles;

    #[inline(always)]
    fn prepare(&self, leaf: &Leaf) -> LeafTriangles {
        prepare::<L>(leaf)
    }

    #[inline(always)]
    fn test(
        &mut self,
        packet: &mut Packet<'_, L>,
        leaf: &Leaf,
        triangles: &LeafTriangles,
        group: usize,
        rays: u8,
        near: L,
    ) -> bool {
        let limits = L::load(&packet.limits[group]);
        let t_min = self.groups[group].t_min;
        let mut hidden = 0;
        if are_few(rays, leaf) {
            let near = near.store();
            for ray in bits(rays) {
                let row = &self.rows[WIDTH * group + ray];
                let (meeting, inside) = one_ray::<L>(row, triangles, leaf);
                if inside != 0 {
                    let t_min = L::splat(row[T_MIN]);
                    let limit = L::splat(packet.limits[group][ray]);
                    let (_, within) = meeting.within(t_min, limit, L::splat(near[ray]));
                    hidden |= u8::from(within.bits() & inside != 0) << ray;
                }
            }
        } else {
            let Group { origin, direction, .. } = &self.groups[group];
            let mut alive = L::mask(rays);
            for lane in 0..leaf.count {
                let meeting = Meeting::new(
                    origin,
                    direction,
                    &splat(&triangles.v0, lane),
                    &splat(&triangles.e1, lane),
                    &splat(&triangles.e2, lane),
                    &splat(&triangles.normal, lane),
                );
                let inside = meeting.is_inside().and(alive);
                if inside.bits() == 0 {
                    continue;
                }
                let (_, within) = meeting.within(t_min, limits, near);
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
        packet.shorten(group, L::splat(f32::NEG_INFINITY).select(L::mask(hidden), limits));
        true
    }
}
