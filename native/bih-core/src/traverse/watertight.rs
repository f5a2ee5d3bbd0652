//! Searches whose decisions are exact: in single precision wherever that is sure, else in double precision and beyond.

use super::Hit;
use super::closest::{Nearest, distance_within};
use super::filter::Filter;
use super::known::Known;
use super::scene::{Leaf, Scene, bits};
use super::search::{Search, Walker};
use super::slab::{Slab, TINY};
use crate::build::Precision;
use crate::geometry::{Corners, Ray, round_down, round_up};
use crate::intersect::{RayTest, SingleRay, clamped, located_quickly};
use crate::simd::{Lanes, Mask};

/// None where single precision cannot tell.
#[inline(always)]
pub(super) fn filter(ray: &Ray, scene: &Scene) -> Option<Filter> {
    Filter::new(ray, &scene.tree.bounds, scene.triangles.is_double())
}

/// The triangles of a leaf that may be hit before `limit`.
#[inline(always)]
pub(super) fn candidates<L: Lanes>(filter: &Option<Filter>, scene: &Scene, ray: &Ray, leaf: Leaf, limit: f32) -> u8 {
    match filter {
        Some(filter) => filter.known::<L>(scene, ray, leaf, limit).map_or(0, |known| known.possible),
        None => leaf.lanes(),
    }
}

/// One number more than the limit: t and the limit are rounded to single precision.
#[inline(always)]
pub(super) fn single(limit: f64) -> f32 {
    round_up(limit + f64::from(TINY))
}

/// The nearest hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct WatertightClosest {
    filter: Option<Filter>,
    /// t of the nearest hit so far is no less than this; t_max before there is any.
    low: f32,
    /// It is no more than this.
    limit: f32,
    best: Place,
    /// Read where single precision does not suffice, and at the end.
    ray: Ray,
}

/// A triangle of a leaf.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    first: u32,
    /// 0 for none.
    count: u8,
    lane: u8,
}

impl Place {
    pub(super) const NONE: Self = Self { first: 0, count: 0, lane: 0 };

    #[inline(always)]
    pub(super) fn new(leaf: Leaf, lane: usize) -> Self {
        Self { first: leaf.first as u32, count: leaf.count as u8, lane: lane as u8 }
    }

    /// The hit, none for none; t, which is no more than `limit`, and the weights are left to `Tracer::closest`, which a weight
    /// that is NaN tells.
    #[inline(always)]
    pub(super) fn hit(self, scene: &Scene, limit: f32) -> Option<Hit> {
        let row = || scene.row(self.first as usize + usize::from(self.lane));
        (self.count > 0).then(|| Hit { t: f64::from(limit), triangle: row(), u: f64::NAN, v: 0.0 })
    }

    /// Its reference and corners; none for none.
    #[inline(always)]
    pub(super) fn triangle(self, scene: &Scene) -> Option<(u32, Corners)> {
        let (leaf, lane) = (Leaf { first: self.first as usize, count: self.count.into() }, usize::from(self.lane));
        (self.count > 0).then(|| ((leaf.first + lane) as u32, scene.corners(leaf, lane)))
    }
}

impl WatertightClosest {
    /// Whether single precision was asked, and the triangles of a leaf that it cannot decide: none, or all that it does not
    /// leave out. What it decides is taken.
    #[inline(always)]
    pub(super) fn doubtful<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf) -> (bool, u8) {
        let Some(filter) = &self.filter else { return (false, leaf.lanes()) };
        let doubtful = match filter.known::<L>(scene, &self.ray, leaf, self.limit) {
            Some(known) if self.take(&known, scene, leaf) => 0,
            Some(known) => known.possible,
            None => 0,
        };
        (true, doubtful)
    }

    /// The nearest hit so far, in double precision.
    #[inline(always)]
    pub(super) fn nearest(&self, scene: &Scene) -> Nearest {
        Nearest::resumed(&self.ray, scene.tree, self.best.triangle(scene))
    }

    /// The hit with t and weights, where its corners are at hand in its leaf and double precision is enough for them.
    #[inline(always)]
    fn located(&self, hit: Hit, scene: &Scene) -> Hit {
        let leaf = Leaf { first: self.best.first as usize, count: self.best.count.into() };
        let Some(rows) = scene.rows(leaf).filter(|_| scene.is_small) else { return hit };
        let corners = rows.corners(self.best.lane.into());
        let [t, u, v] = located_quickly(&self.ray.origin, &self.ray.direction, &corners);
        if t.is_nan() {
            return hit;
        }
        let [u, v] = clamped([u, v]);
        Hit { t, u, v, ..hit }
    }

    /// Whether what is known tells which triangle is the nearest now. If so, it is taken.
    #[inline(always)]
    fn take<L: Lanes>(&mut self, known: &Known<L>, scene: &Scene, leaf: Leaf) -> bool {
        let Some((lane, low, high)) = known.first(self.low) else { return false };
        (self.low, self.limit) = (low, high);
        self.best = Place::new(leaf, lane);
        scene.prefetch_row(leaf.first + lane);
        true
    }

    /// Offer some triangles of a leaf to what decides exactly.
    #[cold]
    #[inline(never)]
    pub(super) fn decide(&mut self, scene: &Scene, leaf: Leaf, lanes: u8) {
        let mut nearest = self.nearest(scene);
        for lane in bits(lanes) {
            if nearest.offer((leaf.first + lane) as u32, scene.corners(leaf, lane), |place| scene.row(place as usize)) {
                self.best = Place::new(leaf, lane);
                scene.prefetch_row(leaf.first + lane);
            }
        }
        let [low, limit] = nearest.interval();
        (self.low, self.limit) = (round_down(low), single(limit));
    }
}

/// As the boxes see it: a ray that is all of single precision, as most are, takes no division in double precision.
#[inline(always)]
fn slab(ray: &Ray, scene: &Scene) -> Option<Slab> {
    let (origin, direction) = (ray.origin.map(|x| x as f32), ray.direction.map(|x| x as f32));
    let are_same = (0..3).fold(true, |all, axis| {
        all & (f64::from(origin[axis]) == ray.origin[axis]) & (f64::from(direction[axis]) == ray.direction[axis])
    });
    if are_same {
        return Slab::single(&SingleRay { origin, direction, t_min: round_down(ray.t_min), t_max: f32::MAX }, scene);
    }
    Slab::new(ray, scene)
}

impl Walker for WatertightClosest {
    #[inline(always)]
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        slab(ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        let (_, doubtful) = self.doubtful::<L>(scene, leaf);
        if doubtful != 0 {
            self.decide(scene, leaf, doubtful);
        }
        false
    }
}

impl Search for WatertightClosest {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn new(ray: &Ray, scene: &Scene) -> Self {
        let (low, limit) = (round_down(ray.t_max), single(ray.t_max));
        Self { filter: filter(ray, scene), low, limit, best: Place::NONE, ray: *ray }
    }

    #[inline(always)]
    fn answer(&self, scene: &Scene) -> Option<Hit> {
        let hit = self.best.hit(scene, self.limit)?;
        Some(if scene.tree.precision == Precision::Watertight { self.located(hit, scene) } else { hit })
    }
}

/// Whether anything is hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct WatertightOccluded {
    filter: Option<Filter>,
    /// t_max rounded down and, for the boxes, up.
    low: f32,
    limit: f32,
    found: bool,
    /// Read where single precision does not suffice.
    ray: Ray,
}

impl WatertightOccluded {
    /// Whether some triangles of a leaf are hit, exactly.
    #[cold]
    #[inline(never)]
    fn decide(&self, scene: &Scene, leaf: Leaf, lanes: u8) -> bool {
        let test = RayTest::new(&self.ray, scene.tree.bounds());
        bits(lanes).any(|lane| distance_within(&self.ray, &test, &scene.corners(leaf, lane)).is_some())
    }
}

impl Walker for WatertightOccluded {
    #[inline(always)]
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        slab(ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        let Some(filter) = &self.filter else {
            self.found = self.decide(scene, leaf, leaf.lanes());
            return self.found;
        };
        if let Some(known) = filter.known::<L>(scene, &self.ray, leaf, self.limit) {
            let before_end = known.high.at_most(L::splat(self.low)).bits();
            self.found = known.sure & before_end != 0 || self.decide(scene, leaf, known.possible);
        }
        self.found
    }
}

impl Search for WatertightOccluded {
    type Answer = bool;

    #[inline(always)]
    fn new(ray: &Ray, scene: &Scene) -> Self {
        let (low, limit) = (round_down(ray.t_max), single(ray.t_max));
        Self { filter: filter(ray, scene), low, limit, found: false, ray: *ray }
    }

    #[inline(always)]
    fn answer(&self, _: &Scene) -> bool {
        self.found
    }
}
