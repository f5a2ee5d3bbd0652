//! Searches whose decisions are exact, behind a filter in single precision.

use super::Hit;
use super::closest::{Nearest, distance_within};
use super::filter::Filter;
use super::scene::{Leaf, Scene, bits};
use super::search::{Search, Walker};
use super::slab::{Slab, TINY};
use crate::geometry::{Ray, round_up};
use crate::intersect::RayTest;
use crate::simd::Lanes;

/// What a ray does not meet before `limit`, none where single precision cannot tell.
#[inline(always)]
pub(super) fn filter(ray: &Ray, scene: &Scene) -> Option<Filter> {
    if scene.triangles.is_double() { None } else { Filter::new(ray, &scene.tree.bounds) }
}

#[inline(always)]
pub(super) fn candidates<L: Lanes>(filter: &Option<Filter>, scene: &Scene, leaf: Leaf, limit: f32) -> u8 {
    match filter {
        Some(filter) => filter.candidates::<L>(scene, leaf, limit),
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
    nearest: Nearest,
    filter: Option<Filter>,
    limit: f32,
}

impl Walker for WatertightClosest {
    #[inline(always)]
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::new(ray, scene)
    }

    fn ray(&self) -> Ray {
        *self.nearest.ray()
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        for lane in bits(candidates::<L>(&self.filter, scene, leaf, self.limit)) {
            self.nearest.offer(scene.row(leaf.first + lane), scene.corners(leaf, lane));
            self.limit = single(self.nearest.limit());
        }
        false
    }
}

impl Search for WatertightClosest {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn new(ray: &Ray, scene: &Scene) -> Self {
        let nearest = Nearest::new(ray, scene.tree);
        Self { nearest, filter: filter(ray, scene), limit: single(ray.t_max) }
    }

    #[inline(always)]
    fn answer(&self, _: &Scene) -> Option<Hit> {
        self.nearest.hit()
    }
}

/// Whether anything is hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct WatertightOccluded {
    ray: Ray,
    test: RayTest,
    filter: Option<Filter>,
    limit: f32,
    found: bool,
}

impl Walker for WatertightOccluded {
    #[inline(always)]
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::new(ray, scene)
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
        for lane in bits(candidates::<L>(&self.filter, scene, leaf, self.limit)) {
            if distance_within(&self.ray, &self.test, &scene.corners(leaf, lane)).is_some() {
                self.found = true;
                return true;
            }
        }
        false
    }
}

impl Search for WatertightOccluded {
    type Answer = bool;

    #[inline(always)]
    fn new(ray: &Ray, scene: &Scene) -> Self {
        let test = RayTest::new(ray, scene.tree.bounds());
        Self { ray: *ray, test, filter: filter(ray, scene), limit: single(ray.t_max), found: false }
    }

    #[inline(always)]
    fn answer(&self, _: &Scene) -> bool {
        self.found
    }
}
