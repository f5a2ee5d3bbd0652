//! What is asked of a ray on its way from instance to instance.

use std::cmp::Ordering;

use super::affine::Affine;
use super::scene::Instance;
use crate::geometry::{Bounds, Corners, Ray};
use crate::intersect::{Distance, RayTest};
use crate::traverse::{Hit, Visitor, distance_within, hit_at};

/// A question about one ray. Between two calls of `enter` the triangles are those of one instance.
pub(super) trait Query: Visitor {
    /// The answer.
    type Answer;

    fn new(ray: &Ray) -> Self;

    /// What follows are triangles of this instance.
    fn enter(&mut self, row: u32, instance: &Instance);

    fn answer(&self) -> Self::Answer;
}

/// The triangles of an instance as its ray meets them.
#[derive(Debug, Clone, Copy)]
struct Place {
    row: u32,
    place: Affine,
    test: RayTest,
}

impl Place {
    /// Before the first instance.
    fn none(ray: &Ray) -> Self {
        let place = Affine { linear: [[0.0; 3]; 3], shift: [0.0; 3] };
        Self { row: 0, place, test: RayTest::new(ray, &Bounds::EMPTY) }
    }

    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance, ray: &Ray) {
        *self = Self { row, place: instance.place, test: RayTest::new(ray, &instance.bounds) };
    }
}

/// A hit and the row of its instance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneHit {
    /// Where, and which triangle of the model.
    pub hit: Hit,
    /// Row of the instance.
    pub instance: u32,
}

/// The nearest image so far.
#[derive(Debug, Clone, Copy)]
struct Best {
    instance: u32,
    row: u32,
    corners: Corners,
    distance: Distance,
    test: RayTest,
}

/// The nearest hit; of equal distances that of the lower instance, and there the lower row.
pub(super) struct Nearest {
    ray: Ray,
    place: Place,
    best: Option<Best>,
}

impl Visitor for Nearest {
    #[inline(always)]
    fn visit(&mut self, row: u32, corners: &Corners) -> bool {
        let Place { row: instance, place, test } = &self.place;
        let corners = place.corners(corners);
        if let Some(distance) = distance_within(&self.ray, test, &corners) {
            let order = match &self.best {
                Some(best) => distance
                    .compare(&corners, &best.distance, &best.corners, test)
                    .then((*instance, row).cmp(&(best.instance, best.row))),
                None => Ordering::Less,
            };
            if order == Ordering::Less {
                self.best = Some(Best { instance: *instance, row, corners, distance, test: *test });
            }
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.best.as_ref().map_or(self.ray.t_max, |best| best.distance.upper())
    }
}

impl Query for Nearest {
    type Answer = Option<SceneHit>;

    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        Self { ray: *ray, place: Place::none(ray), best: None }
    }

    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.place.enter(row, instance, &self.ray);
    }

    fn answer(&self) -> Option<SceneHit> {
        let Best { instance, row, corners, distance, test } = self.best.as_ref()?;
        Some(SceneHit { hit: hit_at(test, *row, corners, distance), instance: *instance })
    }
}

/// Whether anything is hit.
pub(super) struct Any {
    ray: Ray,
    place: Place,
    found: bool,
}

impl Visitor for Any {
    #[inline(always)]
    fn visit(&mut self, _: u32, corners: &Corners) -> bool {
        let Place { place, test, .. } = &self.place;
        self.found = distance_within(&self.ray, test, &place.corners(corners)).is_some();
        self.found
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ray.t_max
    }
}

impl Query for Any {
    type Answer = bool;

    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        Self { ray: *ray, place: Place::none(ray), found: false }
    }

    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.place.enter(row, instance, &self.ray);
    }

    fn answer(&self) -> bool {
        self.found
    }
}
