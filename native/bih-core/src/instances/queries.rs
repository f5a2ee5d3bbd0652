//! What is asked of a ray on its way from instance to instance.

use std::cmp::Ordering;
use std::marker::PhantomData;

use super::affine::Affine;
use super::scene::Instance;
use super::shape::Shape;
use crate::geometry::{Bounds, Corners, Ray};
use crate::intersect::{Distance, RayTest};
use crate::render::Seen;
use crate::simd::Lanes;
use crate::traverse::Visitor;

/// A question about one ray. Between two calls of `enter` the triangles are those of one instance.
pub(super) trait Query: Visitor {
    /// What follows are triangles of this instance.
    fn enter(&mut self, row: u32, instance: &Instance);
}

/// The triangles of an instance as its ray meets them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub row: u32,
    pub place: Affine,
    pub test: RayTest,
}

impl Place {
    /// Before the first instance.
    pub fn none<S: Shape>(ray: &Ray) -> Self {
        let place = Affine { linear: [[0.0; 3]; 3], shift: [0.0; 3] };
        Self { row: 0, place, test: S::test(ray, &Bounds::EMPTY) }
    }

    #[inline(always)]
    pub fn new<S: Shape>(row: u32, instance: &Instance, ray: &Ray) -> Self {
        Self { row, place: instance.place, test: S::test(ray, &instance.bounds) }
    }
}

/// An image that is met.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met<S> {
    pub instance: u32,
    pub row: u32,
    pub shape: S,
    pub distance: Distance,
}

impl<S: Shape> Met<S> {
    /// Of the instance and of the triangle.
    #[inline(always)]
    pub fn rows(&self) -> (u32, u32) {
        (self.instance, self.row)
    }

    /// The nearer one first; of equal distances that of the lower instance, and there the lower row.
    #[inline(always)]
    pub fn order(&self, other: &Self, test: &RayTest) -> Ordering {
        let order = self.shape.compare(&self.distance, &other.shape, &other.distance, test);
        order.then(self.rows().cmp(&other.rows()))
    }

    pub fn hit(&self, test: &RayTest) -> Seen {
        Seen { hit: self.shape.hit(self.row, &self.distance, test), instance: self.instance }
    }
}

/// The nearest hit.
pub(super) struct Nearest<S> {
    ray: Ray,
    place: Place,
    best: Option<Met<S>>,
}

impl<S: Shape> Visitor for Nearest<S> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        let Place { row: instance, place, test } = &self.place;
        let shape = S::of(place, corners);
        if let Some(distance) = shape.distance_within(&self.ray, test) {
            let met = Met { instance: *instance, row, shape, distance };
            if self.best.as_ref().is_none_or(|best| met.order(best, test) == Ordering::Less) {
                self.best = Some(met);
            }
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.best.as_ref().map_or(self.ray.t_max, |best| best.distance.upper())
    }
}

impl<S: Shape> Query for Nearest<S> {
    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.place = Place::new::<S>(row, instance, &self.ray);
    }
}

impl<S: Shape> Nearest<S> {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Self { ray: *ray, place: Place::none::<S>(ray), best: None }
    }

    pub fn answer(&self) -> Option<Seen> {
        self.best.as_ref().map(|best| best.hit(&self.place.test))
    }
}

/// Whether anything is hit.
pub(super) struct Any<S> {
    ray: Ray,
    place: Place,
    found: bool,
    shape: PhantomData<S>,
}

impl<S: Shape> Visitor for Any<S> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, _: u32, corners: &Corners) -> bool {
        let Place { place, test, .. } = &self.place;
        self.found = S::of(place, corners).distance_within(&self.ray, test).is_some();
        self.found
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ray.t_max
    }
}

impl<S: Shape> Query for Any<S> {
    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.place = Place::new::<S>(row, instance, &self.ray);
    }
}

impl<S: Shape> Any<S> {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Self { ray: *ray, place: Place::none::<S>(ray), found: false, shape: PhantomData }
    }

    pub fn answer(&self) -> bool {
        self.found
    }
}
