//! Leaves whose triangles single precision only leaves out: what is left is decided as for a single ray.

use super::bundle::Bundle;
use super::rays::Group;
use super::slabs::Slabs;
use super::triangles::{Meeting, corners};
use super::walk::{Query, Triangles};
use super::{GROUPS, PACKET, bits};
use crate::geometry::{Bounds, Ray, round_up};
use crate::intersect::RayTest;
use crate::simd::{Lanes, Mask};
use crate::traverse::Hit;
use crate::traverse::closest::{Nearest, distance_within};
use crate::tree::{Tree, WIDTH};

/// Half a unit in the last place of 1.
const U: f32 = f32::EPSILON / 2.0;
/// Directions below this are taken for zero where that is further, for this where it is nearer.
const LEAST_DIRECTION: f32 = 1e-30;

/// The rays as the boxes see them, rounded outward.
#[inline(always)]
fn slabs<L: Lanes>(rays: &Group<L>) -> Slabs<L> {
    let nearest = rays.origin;
    let mut slabs = Slabs {
        near_origin: nearest,
        near_reciprocal: nearest,
        far_origin: nearest,
        far_reciprocal: nearest,
        // Rounded to nearest, and back.
        t_min: rays.t_min.times(L::splat(1.0 - 4.0 * U)).minus(L::splat(f32::MIN_POSITIVE)).maximum(L::splat(0.0)),
    };
    for (axis, &direction) in rays.direction.iter().enumerate() {
        // The sign of a direction that is zero, too.
        let backwards = L::splat(1.0).turned_by(direction);
        let spread = nearest[axis].magnitude().fused(L::splat(2.0 * U), L::splat(f32::MIN_POSITIVE)).times(backwards);
        slabs.near_origin[axis] = nearest[axis].plus(spread);
        slabs.far_origin[axis] = nearest[axis].minus(spread);
        let size = direction.magnitude();
        let least = L::splat(LEAST_DIRECTION);
        let near = L::splat(1.0 - 8.0 * U).over(size.maximum(least));
        let far = L::splat(f32::INFINITY).select(size.below(least), L::splat(1.0 + 8.0 * U).over(size));
        slabs.near_reciprocal[axis] = near.turned_by(direction);
        slabs.far_reciprocal[axis] = far.turned_by(direction);
    }
    slabs
}

/// How far each ray matters, rounded up.
#[inline(always)]
fn limits<L: Lanes>(rays: &Group<L>) -> L {
    rays.t_max.fused(L::splat(1.0 + 4.0 * U), L::splat(2.0 * f32::MIN_POSITIVE))
}

/// A limit in double precision, rounded up, as the walk of a single ray has it.
#[inline(always)]
fn single(limit: f64) -> f32 {
    round_up(limit + f64::from(f32::MIN_POSITIVE))
}

/// Bounds on the errors of a ray's test: docs/accuracy.md, section 4.
#[derive(Debug, Clone, Copy)]
struct Errors<L> {
    edge: L,
    square: L,
    above: L,
    below: L,
    least_above: L,
}

impl<L: Lanes> Errors<L> {
    /// The factors are one more than those derived: that covers the roundings made here.
    #[inline(always)]
    fn new(rays: &Group<L>, bounds: &Bounds) -> Self {
        let Group { origin, direction, .. } = rays;
        let mut reach = *origin;
        for axis in 0..3 {
            let to_lower = origin[axis].minus(L::splat(bounds.lower[axis])).magnitude();
            let to_upper = origin[axis].minus(L::splat(bounds.upper[axis])).magnitude();
            reach[axis] = to_lower.maximum(to_upper).plus(origin[axis].magnitude());
        }
        let [x, y, z] = reach;
        let [dx, dy, dz] = [direction[0].magnitude(), direction[1].magnitude(), direction[2].magnitude()];
        let (sum, extent) = (dx.plus(dy).plus(dz), x.plus(y).plus(z));
        let moment = x.times(dy.plus(dz)).plus(y.times(dx.plus(dz))).plus(z.times(dx.plus(dy)));
        Self {
            edge: moment.fused(L::splat(23.0 * U), L::splat(2e-36)),
            square: sum.times(L::splat(39.0 * U)),
            above: extent.times(L::splat(20.0 * U)),
            below: sum.times(L::splat(20.0 * U)),
            least_above: extent.fused(L::splat(2e-37), L::splat(2e-36)),
        }
    }
}

/// The exact tests of all rays, and the filter before them.
struct Filter<'a, L> {
    rays: &'a [Ray],
    groups: &'a [Group<L>; GROUPS],
    tree: &'a Tree,
    errors: [Errors<L>; GROUPS],
}

impl<'a, L: Lanes> Filter<'a, L> {
    #[inline(always)]
    fn new(rays: &'a [Ray], groups: &'a [Group<L>; GROUPS], tree: &'a Tree) -> Self {
        let mut errors = [Errors::new(&groups[0], tree.bounds()); GROUPS];
        for (errors, group) in errors.iter_mut().zip(groups) {
            *errors = Errors::new(group, tree.bounds());
        }
        Self { rays, groups, tree, errors }
    }

    /// The rays that may hit a triangle before their limits.
    #[inline(always)]
    fn candidates(&self, triangles: &Triangles, lane: usize, group: usize, rays: u8, limit: L) -> u8 {
        let errors = &self.errors[group];
        let Group { origin, direction, .. } = &self.groups[group];
        let triangle = triangles.stored.one(lane);
        let Meeting { size, u, v, t } = Meeting::new(origin, direction, &triangle);
        let (longest, square) = (triangle.longest, triangle.longest.times(triangle.longest));
        let least = L::splat(2e-36);
        let error = longest.times(errors.edge).plus(square.times(errors.square)).plus(least);
        let zero = L::splat(0.0);
        let outside = u.plus(error).below(zero).or(v.plus(error).below(zero)).or(size.plus(error).below(u.plus(v)));
        // Beyond the limit: t, both parts of it at their nearest, still exceeds it.
        let nearest = t.minus(square.times(errors.above)).minus(errors.least_above);
        let size = size.plus(square.times(errors.below)).plus(least).times(L::splat(1.0 + 8.0 * f32::EPSILON));
        let beyond = size.times(limit).below(nearest);
        rays & !outside.or(beyond).bits()
    }
}

/// The nearest hits.
pub(super) struct Closest<'a, L> {
    filter: Filter<'a, L>,
    /// Of the rays that had a candidate.
    nearest: Vec<Nearest>,
    /// Where a ray's stands; past the end for none.
    slots: [u8; PACKET],
}

impl<'a, L: Lanes> Closest<'a, L> {
    #[inline(always)]
    pub fn new(rays: &'a [Ray], groups: &'a [Group<L>; GROUPS], tree: &'a Tree) -> Self {
        let filter = Filter::new(rays, groups, tree);
        Self { filter, nearest: Vec::with_capacity(PACKET), slots: [u8::MAX; PACKET] }
    }

    #[inline(always)]
    pub fn collect(&self, active: u64, mut answer: impl FnMut(usize, Option<Hit>)) {
        for ray in bits(active) {
            answer(ray, self.nearest.get(self.slots[ray] as usize).and_then(Nearest::hit));
        }
    }

    #[inline(always)]
    fn nearest(&mut self, ray: usize) -> &mut Nearest {
        if self.slots[ray] == u8::MAX {
            self.slots[ray] = self.nearest.len() as u8;
            self.nearest.push(Nearest::new(&self.filter.rays[ray], self.filter.tree));
        }
        &mut self.nearest[self.slots[ray] as usize]
    }
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
    fn test(&mut self, bundle: &mut Bundle<L>, triangles: &Triangles, group: usize, rays: u8, _: L) -> bool {
        let mut is_shorter = false;
        for lane in bits(triangles.lanes) {
            let limit = L::load(&bundle.limits[group]);
            let candidates = self.filter.candidates(triangles, lane, group, rays, limit);
            for ray in bits(candidates) {
                let row = *self.filter.tree.order.get(triangles.leaf.first + lane);
                let nearest = self.nearest(WIDTH * group + ray);
                nearest.offer(row, corners(&triangles.leaf, lane));
                let limit = single(nearest.limit());
                is_shorter |= limit < bundle.limits[group][ray];
                bundle.limits[group][ray] = limit.min(bundle.limits[group][ray]);
            }
        }
        if is_shorter {
            bundle.shorten(group, L::load(&bundle.limits[group]));
        }
        is_shorter
    }
}

/// Whether anything is hit.
pub(super) struct Occluded<'a, L> {
    filter: Filter<'a, L>,
    tests: [Option<RayTest>; PACKET],
    /// One bit a ray.
    pub hidden: u64,
}

impl<'a, L: Lanes> Occluded<'a, L> {
    #[inline(always)]
    pub fn new(rays: &'a [Ray], groups: &'a [Group<L>; GROUPS], tree: &'a Tree) -> Self {
        Self { filter: Filter::new(rays, groups, tree), tests: [None; PACKET], hidden: 0 }
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
    fn test(&mut self, bundle: &mut Bundle<L>, triangles: &Triangles, group: usize, rays: u8, _: L) -> bool {
        let limits = L::load(&bundle.limits[group]);
        let mut alive = rays;
        for lane in bits(triangles.lanes) {
            for ray in bits(self.filter.candidates(triangles, lane, group, alive, limits)) {
                let index = WIDTH * group + ray;
                let (ray_there, tree) = (&self.filter.rays[index], self.filter.tree);
                let test = self.tests[index].get_or_insert_with(|| RayTest::new(ray_there, tree.bounds()));
                if distance_within(ray_there, test, &corners(&triangles.leaf, lane)).is_some() {
                    alive &= !(1 << ray);
                }
            }
            if alive == 0 {
                break;
            }
        }
        let hidden = rays & !alive;
        if hidden == 0 {
            return false;
        }
        self.hidden |= u64::from(hidden) << (WIDTH * group);
        bundle.shorten(group, L::splat(f32::NEG_INFINITY).select(L::mask(hidden), limits));
        true
    }
}
