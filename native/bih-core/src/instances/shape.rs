//! The images of triangles in the two forms that are decided about: corners rounded once, or as they are.

use std::cmp::Ordering;

use super::affine::Affine;
use crate::geometry::{Bounds, Corners, Ray};
use crate::intersect::{Distance, Image, RayTest};
use crate::traverse::{Hit, distance_within, hit_at, is_between};

/// An image of a triangle.
pub(super) trait Shape: Copy {
    /// A ray, prepared for images within some bounds.
    fn test(ray: &Ray, bounds: &Bounds) -> RayTest;

    fn of(place: &Affine, corners: &Corners) -> Self;

    /// Where the ray meets it, if between its ends.
    fn distance_within(&self, ray: &Ray, test: &RayTest) -> Option<Distance>;

    /// Whether the ray, moved by less than any number, crosses it between its ends.
    fn is_crossed_within(&self, ray: &Ray, test: &RayTest) -> bool;

    /// The order of the distances of two; exact.
    fn compare(&self, distance: &Distance, other: &Self, others: &Distance, test: &RayTest) -> Ordering;

    fn hit(&self, row: u32, distance: &Distance, test: &RayTest) -> Hit;
}

impl Shape for Corners {
    #[inline(always)]
    fn test(ray: &Ray, bounds: &Bounds) -> RayTest {
        RayTest::new(ray, bounds)
    }

    #[inline(always)]
    fn of(place: &Affine, corners: &Corners) -> Self {
        place.corners(corners)
    }

    #[inline(always)]
    fn distance_within(&self, ray: &Ray, test: &RayTest) -> Option<Distance> {
        distance_within(ray, test, self)
    }

    #[inline(always)]
    fn is_crossed_within(&self, ray: &Ray, test: &RayTest) -> bool {
        test.crosses(self) && is_between(&Distance::new(test, self), ray, test, self)
    }

    #[inline(always)]
    fn compare(&self, distance: &Distance, other: &Self, others: &Distance, test: &RayTest) -> Ordering {
        distance.compare(self, others, other, test)
    }

    fn hit(&self, row: u32, distance: &Distance, test: &RayTest) -> Hit {
        hit_at(test, row, self, distance)
    }
}

impl Shape for Image {
    #[inline(always)]
    fn test(ray: &Ray, bounds: &Bounds) -> RayTest {
        RayTest::of_images(ray, bounds)
    }

    #[inline(always)]
    fn of(place: &Affine, corners: &Corners) -> Self {
        place.real(corners)
    }

    #[inline(always)]
    fn distance_within(&self, ray: &Ray, test: &RayTest) -> Option<Distance> {
        if !self.is_met(test) {
            return None;
        }
        let distance = self.distance(test);
        is_between(&distance, ray, test, self).then_some(distance)
    }

    #[inline(always)]
    fn is_crossed_within(&self, ray: &Ray, test: &RayTest) -> bool {
        self.is_crossed(test) && is_between(&self.distance(test), ray, test, self)
    }

    #[inline(always)]
    fn compare(&self, distance: &Distance, other: &Self, others: &Distance, test: &RayTest) -> Ordering {
        distance.compare(self, others, other, test)
    }

    fn hit(&self, row: u32, _: &Distance, test: &RayTest) -> Hit {
        let [t, u, v] = self.numbers(test);
        Hit { t, triangle: row, u, v }
    }
}
