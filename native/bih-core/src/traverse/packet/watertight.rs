//! Leaves whose decisions are exact: in single precision wherever that is sure, else as for a single ray.

use super::bundle::Bundle;
use super::fast::are_few;
use super::rays::{Group, Rows, T_MAX, T_MIN};
use super::slabs::Slabs;
use super::triangles::Meeting;
use super::walk::{Query, Triangles};
use super::{Column, GROUPS, PACKET, bits};
use crate::geometry::{Bounds, Ray, round_down};
use crate::intersect::RayTest;
use crate::simd::{Lanes, Mask};
use crate::traverse::Hit;
use crate::traverse::closest::{Nearest, distance_within};
use crate::traverse::known::{Errors, Known, Met};
use crate::traverse::scene::{Leaf, Scene};
use crate::traverse::watertight::{Place, single};
use crate::tree::WIDTH;

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

/// The bounds on the errors of a group's tests: docs/accuracy.md, section 4.
///
/// The factors are one more than those derived: that covers the roundings made here.
#[inline(always)]
fn errors<L: Lanes>(rays: &Group<L>, bounds: &Bounds) -> Errors<L> {
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
    Errors {
        edge: moment.fused(L::splat(23.0 * U), L::splat(2e-36)),
        square: sum.times(L::splat(39.0 * U)),
        above: extent.times(L::splat(20.0 * U)),
        below: sum.times(L::splat(20.0 * U)),
        least_above: extent.fused(L::splat(2e-37), L::splat(2e-36)),
    }
}

/// The rays, and what single precision may be wrong by.
struct Filter<'a, L> {
    rays: &'a [Ray],
    rows: &'a Rows,
    groups: &'a [Group<L>; GROUPS],
    scene: &'a Scene<'a>,
    edge: Column,
    square: Column,
    above: Column,
    below: Column,
    least_above: Column,
}

impl<'a, L: Lanes> Filter<'a, L> {
    #[inline(always)]
    fn new(rays: &'a [Ray], rows: &'a Rows, groups: &'a [Group<L>; GROUPS], scene: &'a Scene<'a>) -> Self {
        let [mut edge, mut square, mut above, mut below, mut least_above] = [[[0.0; WIDTH]; GROUPS]; 5];
        for (i, group) in groups.iter().enumerate() {
            let errors = errors(group, scene.tree.bounds());
            edge[i] = errors.edge.store();
            square[i] = errors.square.store();
            above[i] = errors.above.store();
            below[i] = errors.below.store();
            least_above[i] = errors.least_above.store();
        }
        Self { rays, rows, groups, scene, edge, square, above, below, least_above }
    }

    /// Some rays of a group and one triangle.
    #[inline(always)]
    fn known(&self, triangles: &Triangles, lane: usize, group: usize, rays: u8, limit: L) -> Option<Known<L>> {
        let errors = Errors {
            edge: L::load(&self.edge[group]),
            square: L::load(&self.square[group]),
            above: L::load(&self.above[group]),
            below: L::load(&self.below[group]),
            least_above: L::load(&self.least_above[group]),
        };
        let Group { origin, direction, t_min, .. } = &self.groups[group];
        let triangle = triangles.stored.one(lane);
        let Meeting { size, u, v, t } = Meeting::new(origin, direction, &triangle);
        errors.known(&Met { size, u, v, t, longest: triangle.longest }, *t_min, limit, rays)
    }

    /// One ray and some triangles.
    #[inline(always)]
    fn known_of_one(&self, triangles: &Triangles, group: usize, ray: usize, limit: f32) -> Option<Known<L>> {
        let errors = Errors {
            edge: L::splat(self.edge[group][ray]),
            square: L::splat(self.square[group][ray]),
            above: L::splat(self.above[group][ray]),
            below: L::splat(self.below[group][ray]),
            least_above: L::splat(self.least_above[group][ray]),
        };
        let row = &self.rows[WIDTH * group + ray];
        let [x, y, z, dx, dy, dz, ..] = *row;
        let origin = [L::splat(x), L::splat(y), L::splat(z)];
        let direction = [L::splat(dx), L::splat(dy), L::splat(dz)];
        let eight = triangles.stored.all();
        let Meeting { size, u, v, t } = Meeting::new(&origin, &direction, &eight);
        let met = Met { size, u, v, t, longest: eight.longest };
        errors.known(&met, L::splat(row[T_MIN]), L::splat(limit), triangles.lanes)
    }
}

/// The leaf of some triangles, as single rays have it.
#[inline(always)]
fn leaf(triangles: &Triangles) -> Leaf {
    Leaf { first: triangles.leaf.first, count: triangles.leaf.count }
}

/// The nearest hits.
pub(super) struct Closest<'a, L> {
    filter: Filter<'a, L>,
    /// t of the nearest hit so far is no less than this; t_max before there is any.
    low: Column,
    /// That triangle.
    best: [Place; PACKET],
}

impl<'a, L: Lanes> Closest<'a, L> {
    #[inline(always)]
    pub fn new(rays: &'a [Ray], rows: &'a Rows, groups: &'a [Group<L>; GROUPS], scene: &'a Scene<'a>) -> Self {
        let mut low = [[0.0; WIDTH]; GROUPS];
        for (low, row) in low.as_flattened_mut().iter_mut().zip(rows) {
            *low = row[T_MAX];
        }
        Self { filter: Filter::new(rays, rows, groups, scene), low, best: [Place::NONE; PACKET] }
    }

    #[inline(always)]
    pub fn collect(&self, active: u64, mut answer: impl FnMut(usize, Option<Hit>)) {
        for ray in bits(active) {
            answer(ray, self.best[ray].hit(self.filter.scene, f32::MAX));
        }
    }

    #[inline(always)]
    fn nearest(&self, ray: usize) -> Nearest {
        let Filter { rays, scene, .. } = &self.filter;
        Nearest::resumed(&rays[ray], scene.tree, self.best[ray].triangle(scene))
    }

    #[inline(always)]
    fn test_triangle(
        &mut self,
        limits: &mut Column,
        triangles: &Triangles,
        lane: usize,
        group: usize,
        rays: u8,
    ) -> bool {
        let limit = L::load(&limits[group]);
        let Some(known) = self.filter.known(triangles, lane, group, rays, limit) else { return false };
        let low = L::load(&self.low[group]);
        let nearer = known.high.below(low).and(L::mask(known.sure));
        if nearer.bits() != 0 {
            self.low[group] = known.low.select(nearer, low).store();
            limits[group] = known.high.select(nearer, limit).store();
            for ray in bits(nearer.bits()) {
                self.best[WIDTH * group + ray] = Place::new(leaf(triangles), lane);
            }
        }
        // Those that are behind the nearest so far are done with, too.
        let doubtful = known.possible & !nearer.or(limit.below(known.low)).bits();
        for ray in bits(doubtful) {
            self.decide(limits, triangles, group, ray, 1 << lane);
        }
        nearer.bits() | doubtful != 0
    }

    #[inline(always)]
    fn test_ray(&mut self, limits: &mut Column, triangles: &Triangles, group: usize, ray: usize) -> bool {
        let Some(known) = self.filter.known_of_one(triangles, group, ray, limits[group][ray]) else { return false };
        match known.first(self.low[group][ray]) {
            Some((lane, low, high)) => {
                (self.low[group][ray], limits[group][ray]) = (low, high);
                self.best[WIDTH * group + ray] = Place::new(leaf(triangles), lane);
            }
            None => self.decide(limits, triangles, group, ray, known.possible),
        }
        true
    }

    /// Offer some triangles to what decides exactly.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, limits: &mut Column, triangles: &Triangles, group: usize, ray: usize, lanes: u8) {
        let (scene, leaf) = (self.filter.scene, leaf(triangles));
        let mut nearest = self.nearest(WIDTH * group + ray);
        for lane in bits(lanes) {
            if nearest.offer((leaf.first + lane) as u32, scene.corners(leaf, lane), |place| scene.row(place as usize)) {
                self.best[WIDTH * group + ray] = Place::new(leaf, lane);
            }
        }
        let [low, limit] = nearest.interval();
        (self.low[group][ray], limits[group][ray]) = (round_down(low), single(limit));
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
        if are_few(rays, triangles) {
            for ray in bits(rays) {
                is_shorter |= self.test_ray(&mut bundle.limits, triangles, group, ray);
            }
        } else {
            for lane in bits(triangles.lanes) {
                is_shorter |= self.test_triangle(&mut bundle.limits, triangles, lane, group, rays);
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
    /// One bit a ray.
    pub hidden: u64,
}

impl<'a, L: Lanes> Occluded<'a, L> {
    #[inline(always)]
    pub fn new(rays: &'a [Ray], rows: &'a Rows, groups: &'a [Group<L>; GROUPS], scene: &'a Scene<'a>) -> Self {
        Self { filter: Filter::new(rays, rows, groups, scene), hidden: 0 }
    }

    /// Whether a ray hits one of some triangles, exactly.
    #[cold]
    #[inline(never)]
    fn decide(&self, triangles: &Triangles, ray: usize, lanes: u8) -> bool {
        let (scene, ray) = (self.filter.scene, &self.filter.rays[ray]);
        let test = RayTest::new(ray, scene.tree.bounds());
        bits(lanes).any(|lane| distance_within(ray, &test, &scene.corners(leaf(triangles), lane)).is_some())
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
        let mut hidden = 0;
        if are_few(rays, triangles) {
            for ray in bits(rays) {
                let limit = bundle.limits[group][ray];
                let Some(known) = self.filter.known_of_one(triangles, group, ray, limit) else { continue };
                let t_max = L::splat(self.filter.rows[WIDTH * group + ray][T_MAX]);
                let is_hidden = known.high.at_most(t_max).bits() & known.sure != 0
                    || self.decide(triangles, WIDTH * group + ray, known.possible);
                hidden |= u8::from(is_hidden) << ray;
            }
        } else {
            let t_max = self.filter.groups[group].t_max;
            for lane in bits(triangles.lanes) {
                let alive = rays & !hidden;
                let Some(known) = self.filter.known(triangles, lane, group, alive, limits) else { continue };
                let surely = known.high.at_most(t_max).bits() & known.sure;
                hidden |= surely;
                for ray in bits(known.possible & !surely) {
                    hidden |= u8::from(self.decide(triangles, WIDTH * group + ray, 1 << lane)) << ray;
                }
                if hidden == rays {
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
