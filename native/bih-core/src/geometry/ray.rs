//! Rays.

use bytemuck::{Pod, Zeroable};

use super::Vector;

/// A ray and the interval of it that counts: a hit has `t_min <= t <= t_max`. One cache line.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vector,
    /// Where it goes; need not be of unit length, `t` is in units of its length.
    pub direction: Vector,
    /// The first `t` that counts; may be negative infinity.
    pub t_min: f64,
    /// The last `t` that counts; may be infinity.
    pub t_max: f64,
}

impl Ray {
    /// The whole half-line from `origin` along `direction`.
    pub fn new(origin: Vector, direction: Vector) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
    }

    /// Whether an answer can be given: no NaN, a finite origin, a finite direction that is not zero, and an interval
    /// that holds at least one finite end.
    #[inline]
    pub fn is_valid(&self) -> bool {
        let Self { origin, direction, t_min, t_max } = self;
        // All at once: nearly every ray passes them all.
        let finite = |v: &Vector| v[0].is_finite() & v[1].is_finite() & v[2].is_finite();
        let is_anywhere = (direction[0] != 0.0) | (direction[1] != 0.0) | (direction[2] != 0.0);
        finite(origin) & finite(direction) & is_anywhere & (*t_min < f64::INFINITY) & (*t_max > f64::NEG_INFINITY)
    }
}
