//! All hits of a ray among instances, and how often it crosses their surfaces.

use std::marker::PhantomData;

use super::queries::{Met, Place, Query};
use super::scene::Instance;
use super::shape::Shape;
use crate::error::Error;
use crate::geometry::{Corners, Ray};
use crate::memory::Allowance;
use crate::render::Seen;
use crate::simd::Lanes;
use crate::traverse::{Kept, Visitor};

/// All hits, nearest first, at most so many.
pub(super) struct All<'a, 'b, S> {
    ray: Ray,
    place: Place,
    kept: Kept<'a, 'b, Met<S>>,
    limit: f64,
}

impl<'a, 'b, S: Shape> All<'a, 'b, S> {
    pub fn new(ray: &Ray, most: usize, allowance: &'a mut Allowance<'b>) -> Self {
        Self { ray: *ray, place: Place::none::<S>(ray), kept: Kept::new(most, allowance), limit: ray.t_max }
    }

    /// Keep the nearest, in order, and one of those that are the same.
    fn arrange(&mut self) {
        let Self { place: Place { test, .. }, kept, .. } = self;
        let sort = |met: &mut [Met<S>]| {
            // Nearly everything is in order after this, which costs less. Neither asks for memory.
            met.sort_unstable_by(|a, b| a.distance.t.total_cmp(&b.distance.t).then(a.rows().cmp(&b.rows())));
            met.sort_unstable_by(|a, b| a.order(b, test));
        };
        kept.arrange(sort, |a, b| a.rows() == b.rows());
        if let Some(last) = kept.last() {
            self.limit = last.distance.upper();
        }
    }

    /// The hits in order, made of what was met; an error if there was no memory for all.
    pub fn finish(mut self) -> Result<impl ExactSizeIterator<Item = Seen> + use<S>, Error> {
        self.arrange();
        let test = self.place.test;
        Ok(self.kept.all()?.into_iter().map(move |met| met.hit(&test)))
    }
}

impl<S: Shape> Visitor for All<'_, '_, S> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        let shape = S::of(&self.place.place, corners);
        if let Some(distance) = shape.distance_within(&self.ray, &self.place.test) {
            let met = Met { instance: self.place.row, row, shape, distance };
            if self.kept.add(met) {
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

impl<S: Shape> Query for All<'_, '_, S> {
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
