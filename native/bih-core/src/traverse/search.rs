//! What a query keeps of one ray on its way through wide records.

use super::scene::{Leaf, Scene};
use super::slab::Slab;
use crate::geometry::Ray;
use crate::simd::Lanes;
use crate::tree::Packed;

/// The state of one ray, which the walks over records carry from leaf to leaf.
pub(super) trait Search: Copy {
    /// What is found.
    type Answer;

    /// Before the first leaf.
    fn new<R: Packed>(ray: &Ray, scene: &Scene<R>) -> Self;

    /// The ray as the boxes see it; none where it must be walked in double precision.
    fn slab<R: Packed>(&self, ray: &Ray, scene: &Scene<R>) -> Option<Slab>;

    /// The ray that is walked in double precision.
    fn ray(&self) -> Ray;

    /// Past this nothing matters.
    fn limit(&self) -> f32;

    /// Test the triangles of a leaf, whose box the ray enters at `near`. Whether the answer is known now.
    fn test<L: Lanes, R: Packed>(&mut self, scene: &Scene<R>, leaf: Leaf, near: f32) -> bool;

    /// What was found.
    fn answer<R: Packed>(&self, scene: &Scene<R>) -> Self::Answer;
}
