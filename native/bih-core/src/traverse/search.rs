//! What a query keeps of one ray on its way through wide records.

use super::aim::Aim;
use super::scene::{Leaf, Scene};
use super::slab::Slab;
use crate::geometry::Ray;
use crate::simd::Lanes;

/// The state of one ray, which the walks over records carry from leaf to leaf.
pub(super) trait Walker {
    /// The ray as the boxes see it; none where it must be walked in double precision.
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab>;

    /// The ray that is walked in double precision.
    fn ray(&self) -> Ray;

    /// The same with what it may be off by.
    fn aim(&self) -> Aim {
        Aim::exact(&self.ray())
    }

    /// Past this nothing matters.
    fn limit(&self) -> f32;

    /// Test the triangles of a leaf, whose box the ray enters at `near`. Whether the answer is known now.
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, near: f32) -> bool;
}

/// A walker that finds one answer for a ray.
pub(super) trait Search: Walker + Copy {
    /// What is found.
    type Answer;

    /// Before the first leaf.
    fn new(ray: &Ray, scene: &Scene) -> Self;

    /// What was found.
    fn answer(&self, scene: &Scene) -> Self::Answer;
}
