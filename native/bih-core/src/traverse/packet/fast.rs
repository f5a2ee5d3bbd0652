//! Leaves in single precision alone.

use super::bundle::Bundle;
use super::rays::{Group, Rows, T_MIN};
use super::slabs::Slabs;
use super::triangles::Meeting;
use super::walk::{Query, Triangles};
use super::{GROUPS, bits};
use crate::simd::{Lanes, Mask};
use crate::tree::WIDTH;

/// The rays as the boxes see them.
#[inline(always)]
pub(super) fn slabs<L: Lanes>(rays: &Group<L>) -> Slabs<L> {
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
pub(super) fn limits<L: Lanes>(rays: &Group<L>) -> L {
    rays.t_max.minimum(L::splat(f32::MAX))
}

/// t where it is no less than `t_min` and no more than `limit`, and for which lanes that is.
///
/// A ray meets no triangle before it enters the leaf's box at `near`, so what rounding put before is moved there: a box
/// beyond the nearest hit then holds no nearer one, and the answer does not depend on the order of boxes.
#[inline(always)]
pub(super) fn within<L: Lanes>(meeting: &Meeting<L>, t_min: L, limit: L, near: L) -> (L, L::Mask) {
    let met = meeting.t.over(meeting.size);
    let t = met.maximum(near);
    (t, t_min.at_most(met).and(t.at_most(limit)))
}

/// One ray against the triangles of a leaf: where it meets their planes, and which it meets inside.
#[inline(always)]
pub(super) fn one_ray<L: Lanes>(row: &[f32; WIDTH], triangles: &Triangles) -> (Meeting<L>, u8) {
    let [x, y, z, dx, dy, dz, ..] = *row;
    let origin = [L::splat(x), L::splat(y), L::splat(z)];
    let direction = [L::splat(dx), L::splat(dy), L::splat(dz)];
    let meeting = Meeting::new(&origin, &direction, &triangles.stored.all());
    let inside = meeting.is_inside().bits() & triangles.lanes;
    (meeting, inside)
}

/// Whether it takes fewer steps to test the rays one by one.
#[inline(always)]
pub(super) fn are_few(rays: u8, triangles: &Triangles) -> bool {
    2 * rays.count_ones() <= triangles.lanes.count_ones()
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
    fn test(&mut self, bundle: &mut Bundle<L>, triangles: &Triangles, group: usize, rays: u8, near: L) -> bool {
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
