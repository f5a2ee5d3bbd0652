//! Rays that are known up to a little.

use crate::geometry::{Ray, Vector};

/// A ray that leads to what another one hits: where that one meets something at t, this one is at t no further from it
/// than `spread` along each axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim {
    pub ray: Ray,
    pub spread: Vector,
}

impl Aim {
    /// Just this ray.
    #[inline(always)]
    pub fn exact(ray: &Ray) -> Self {
        Self { ray: *ray, spread: [0.0; 3] }
    }

    /// All of space: nothing is left out.
    pub fn anywhere(ray: &Ray) -> Self {
        Self { ray: *ray, spread: [f64::INFINITY; 3] }
    }

    /// The least and the greatest coordinate of the origin.
    #[inline(always)]
    pub fn origins(&self, axis: usize) -> [f64; 2] {
        [self.ray.origin[axis] - self.spread[axis], self.ray.origin[axis] + self.spread[axis]]
    }
}
