//! Where a ray crosses axis-parallel planes, rounded so that nothing within them is ever lost.

use super::aim::Aim;
use crate::geometry::Bounds;

/// Relative width that covers the four roundings of (plane − origin) · reciprocal: 8 · 2^-53.
const PAD: f64 = 4.0 * f64::EPSILON;

/// Bounds on the t at which a ray meets planes.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// The origin as near to what is ahead, and as far from it, as it may be.
    nearest: [f64; 3],
    farthest: [f64; 3],
    /// 1/d rounded towards zero and away from it, both with the sign of d.
    least: [f64; 3],
    most: [f64; 3],
    negative: [bool; 3],
}

impl Crossing {
    pub fn new(aim: &Aim) -> Self {
        let origin = aim.ray.origin;
        let mut crossing =
            Self { nearest: origin, farthest: origin, least: [0.0; 3], most: [0.0; 3], negative: [false; 3] };
        for axis in 0..3 {
            let direction = aim.ray.direction[axis];
            let [lower, upper] = aim.origins(axis);
            (crossing.nearest[axis], crossing.farthest[axis]) =
                if direction.is_sign_negative() { (lower, upper) } else { (upper, lower) };
            let reciprocal = 1.0 / direction;
            let (least, most) = if direction == 0.0 {
                (f64::INFINITY, f64::INFINITY)
            } else if reciprocal.is_infinite() {
                (f64::MAX, f64::INFINITY)
            } else if reciprocal.is_subnormal() {
                (0.0, f64::MIN_POSITIVE)
            } else {
                (reciprocal.abs() * (1.0 - PAD), reciprocal.abs() * (1.0 + PAD))
            };
            crossing.least[axis] = least.copysign(direction);
            crossing.most[axis] = most.copysign(direction);
            crossing.negative[axis] = direction.is_sign_negative();
        }
        crossing
    }

    /// Whether the ray runs towards smaller coordinates.
    #[inline(always)]
    pub fn is_negative(&self, axis: usize) -> bool {
        self.negative[axis]
    }

    /// Bit 0 is set where the ray runs towards smaller x, bit 1 for y, bit 2 for z.
    pub fn octant(&self) -> usize {
        (0..3).map(|axis| usize::from(self.negative[axis]) << axis).sum()
    }

    /// At most the t at which the plane is met; NaN where the ray lies in the plane: it says nothing.
    #[inline(always)]
    pub fn earliest(&self, axis: usize, plane: f32) -> f64 {
        let offset = f64::from(plane) - self.nearest[axis];
        let is_ahead = (offset < 0.0) == self.negative[axis];
        let reciprocal = if is_ahead { self.least[axis] } else { self.most[axis] };
        offset * reciprocal - f64::MIN_POSITIVE
    }

    /// At least the t at which the plane is met; NaN where the ray lies in the plane: it says nothing.
    #[inline(always)]
    pub fn latest(&self, axis: usize, plane: f32) -> f64 {
        let offset = f64::from(plane) - self.farthest[axis];
        let is_ahead = (offset < 0.0) == self.negative[axis];
        let reciprocal = if is_ahead { self.most[axis] } else { self.least[axis] };
        offset * reciprocal + f64::MIN_POSITIVE
    }

    /// The part of [near, far] in which the ray may be within the bounds; empty where the first exceeds the second.
    pub fn clip(&self, bounds: &Bounds, mut near: f64, mut far: f64) -> (f64, f64) {
        for axis in 0..3 {
            let [mut entry, mut exit] = [bounds.lower[axis], bounds.upper[axis]];
            if self.negative[axis] {
                std::mem::swap(&mut entry, &mut exit);
            }
            // `max` and `min` pass over NaN.
            near = near.max(self.earliest(axis, entry));
            far = far.min(self.latest(axis, exit));
        }
        (near, far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Ray, Vector};

    fn along(origin: Vector, direction: Vector) -> Crossing {
        Crossing::new(&Aim::exact(&Ray::new(origin, direction)))
    }

    fn crossing(origin: f64, direction: f64) -> Crossing {
        along([origin, 0.0, 0.0], [direction, 1.0, 0.0])
    }

    #[test]
    fn the_true_crossing_lies_between() {
        for direction in [1.0, -1.0, 3.0, -0.1, 1e-300, -1e-300, 1e300, 5e-324, -f64::MAX] {
            for plane in [-3.0f32, -1e-38, 0.0, 1e-44, 2.5] {
                let t = crossing(0.0, direction);
                // The quotient, one rounding away from the truth; infinite quotients stand for all beyond.
                let truth = f64::from(plane) / direction;
                let (earliest, latest) = (t.earliest(0, plane), t.latest(0, plane));
                assert!(
                    earliest.is_nan() || earliest <= truth.next_down() || truth.is_infinite(),
                    "{direction} {plane}"
                );
                assert!(latest.is_nan() || latest >= truth.next_up() || truth.is_infinite(), "{direction} {plane}");
                assert!(earliest.is_nan() || latest.is_nan() || earliest <= latest, "{direction} {plane}");
            }
        }
    }

    #[test]
    fn a_ray_in_a_side_of_the_bounds_is_within_them() {
        let bounds = Bounds { lower: [0.0; 3], upper: [1.0; 3] };
        for direction in [[0.0, 0.0, 1.0], [-0.0, -0.0, 1.0]] {
            let (near, far) = along([0.0, 1.0, -1.0], direction).clip(&bounds, 0.0, f64::INFINITY);
            assert!(near <= 1.0 && (2.0..2.1).contains(&far));
            let (near, far) = along([-1e-9, 1.0, -1.0], direction).clip(&bounds, 0.0, f64::INFINITY);
            assert!(near > far);
        }
    }

    #[test]
    fn what_a_ray_is_near_to_is_within_its_spread() {
        let bounds = Bounds { lower: [0.0; 3], upper: [1.0; 3] };
        for direction in [[0.0, 0.0, 1.0], [-0.0, 1e-9, 1.0]] {
            let ray = Ray::new([-0.25, 0.5, -1.0], direction);
            let clip = |spread: f64| Crossing::new(&Aim { ray, spread: [spread; 3] }).clip(&bounds, 0.0, f64::INFINITY);
            let (near, far) = clip(0.25);
            assert!(near <= 0.75 && far >= 2.25, "{near} {far}");
            let (near, far) = clip(0.125);
            assert!(near > far);
            let (near, far) = clip(f64::INFINITY);
            assert_eq!([near, far], [0.0, f64::INFINITY]);
        }
    }
}
