//! All hits of a ray among instances, and how often it crosses their surfaces.

use std::marker::PhantomData;

use super::queries::{Met, Place, Query};
use super::scene::Instance;
use super::shape::Shape;
use crate::geometry::{Corners, Ray};
use crate::render::Seen;
use crate::simd::Lanes;
use crate::traverse::Visitor;

/// All hits, nearest first, at most so many.
pub(super) struct All<S> {
    ray: Ray,
    place: Place,
    met: Vec<Met<S>>,
    most: usize,
    /// How many there may be before all but the nearest are dropped: so seldom that sorting costs no more than they do.
    room: usize,
    limit: f64,
}

impl<S: Shape> All<S> {
    pub fn new(ray: &Ray, most: usize) -> Self {
        let place = Place::none::<S>(ray);
        Self { ray: *ray, place, met: Vec::new(), most, room: most, limit: ray.t_max }
    }

    /// Keep the nearest, in order, and one of those that are the same.
    fn arrange(&mut self) {
        let Self { place: Place { test, .. }, met, most, .. } = self;
        // Nearly everything is in order after this, which costs less.
        met.sort_unstable_by(|a, b| a.distance.t.total_cmp(&b.distance.t).then(a.rows().cmp(&b.rows())));
        met.sort_by(|a, b| a.order(b, test));
        met.dedup_by_key(|met| met.rows());
        met.truncate(*most);
        self.room = met.len().saturating_mul(2).max(*most);
        if let Some(last) = met.last().filter(|_| met.len() == *most) {
            self.limit = last.distance.upper();
        }
    }

    /// Append the hits.
    pub fn finish(mut self, hits: &mut Vec<Seen>) {
        self.arrange();
        hits.extend(self.met.iter().map(|met| met.hit(&self.place.test)));
    }
}

impl<S: Shape> Visitor for All<S> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        let shape = S::of(&self.place.place, corners);
        if let Some(distance) = shape.distance_within(&self.ray, &self.place.test) {
            self.met.push(Met { instance: self.place.row, row, shape, distance });
            if self.met.len() >= self.room {
                self.arrange();
            }
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.limit
    }
}

impl<S: Shape> Query for All<S> {
    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.place = Place::new::<S>(row, instance, &self.ray);
    }
}

/// How many images the ray crosses.
pub(super) struct Crossings<S> {
    ray: Ray,
    place: Place,
    number: usize,
    /// Those of the instance that is visited: a kd-tree offers some of them several times.
    rows: Vec<u32>,
    shape: PhantomData<S>,
}

impl<S: Shape> Crossings<S> {
    pub fn new(ray: &Ray) -> Self {
        Self { ray: *ray, place: Place::none::<S>(ray), number: 0, rows: Vec::new(), shape: PhantomData }
    }

    pub fn total(mut self) -> usize {
        self.count();
        self.number
    }

    fn count(&mut self) {
        self.rows.sort_unstable();
        self.rows.dedup();
        self.number += self.rows.len();
        self.rows.clear();
    }
}

impl<S: Shape> Visitor for Crossings<S> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        if S::of(&self.place.place, corners).is_crossed_within(&self.ray, &self.place.test) {
            self.rows.push(row);
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ray.t_max
    }
}

impl<S: Shape> Query for Crossings<S> {
    #[inline(always)]
    fn enter(&mut self, row: u32, instance: &Instance) {
        self.count();
        self.place = Place::new::<S>(row, instance, &self.ray);
    }
}
