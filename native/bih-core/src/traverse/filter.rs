//! What leaves out the triangles of a leaf that a ray cannot hit: docs/accuracy.md, section 4.

use super::fast::splat;
use super::scene::{Leaf, Scene};
use crate::geometry::{Bounds, Ray, round_up};
use crate::intersect::Meeting;
use crate::simd::{Lanes, Mask};

/// Half a unit in the last place of 1 in single precision.
const U: f64 = f32::EPSILON as f64 / 2.0;
/// Coordinates below this, and directions within `DIRECTIONS`, neither overflow nor underflow unseen.
const RANGE: f64 = 1e18;
const DIRECTIONS: std::ops::Range<f64> = 1e-6..1e6;

/// A ray rounded to single precision, and what that and all that follows can amount to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filter {
    origin: [f32; 3],
    direction: [f32; 3],
    /// Factors of the largest edge component and of its square in the error bounds.
    edge_error: f32,
    square_error: f32,
    above_error: f32,
    below_error: f32,
    least_above: f32,
}

const LEAST_ERROR: f32 = 1e-36;
const MORE: f32 = 1.0 + 8.0 * f32::EPSILON;

impl Filter {
    /// None where the bounds do not hold.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, bounds: &Bounds) -> Option<Self> {
        // The distance that a coordinate can have from the origin, and what rounding the origin adds.
        let mut reach = [0.0; 3];
        for (axis, reach) in reach.iter_mut().enumerate() {
            let origin = ray.origin[axis];
            let [lower, upper] = [f64::from(bounds.lower[axis]) - origin, f64::from(bounds.upper[axis]) - origin];
            *reach = lower.abs().max(upper.abs()) + origin.abs();
        }
        let [x, y, z] = reach;
        let [dx, dy, dz] = ray.direction.map(f64::abs);
        let sum = dx + dy + dz;
        if !(ray.t_min >= 0.0 && x + y + z < RANGE && DIRECTIONS.contains(&dx.max(dy).max(dz))) {
            return None;
        }
        let moment = x * (dy + dz) + y * (dx + dz) + z * (dx + dy);
        Some(Self {
            origin: ray.origin.map(|x| x as f32),
            direction: ray.direction.map(|x| x as f32),
            edge_error: round_up(22.0 * U * moment + 1e-36),
            square_error: round_up(38.0 * U * sum),
            above_error: round_up(19.0 * U * (x + y + z)),
            below_error: round_up(19.0 * U * sum),
            least_above: round_up(1e-36 + 1e-42 * (x + y + z)),
        })
    }

    /// The triangles of a leaf that may be hit before `limit`.
    #[inline(always)]
    pub(super) fn candidates<L: Lanes>(&self, scene: &Scene, leaf: Leaf, limit: f32) -> u8 {
        let vertices = scene.vertices(leaf);
        let Meeting { e1, e2, size, u, v, t: above } =
            Meeting::<L>::new(&splat(&self.origin), &splat(&self.direction), &vertices);
        let longest = largest(&e1).maximum(largest(&e2));
        let square = longest.times(longest);
        let least = L::splat(LEAST_ERROR);
        let error =
            longest.times(L::splat(self.edge_error)).plus(square.times(L::splat(self.square_error))).plus(least);
        let zero = L::splat(0.0);
        let outside = u.plus(error).below(zero).or(v.plus(error).below(zero)).or(size.plus(error).below(u.plus(v)));
        // Beyond the limit: above / size, each at its nearest, still exceeds it.
        let nearest = above.minus(square.times(L::splat(self.above_error))).minus(L::splat(self.least_above));
        let size = size.plus(square.times(L::splat(self.below_error))).plus(least).times(L::splat(MORE));
        let beyond = size.times(L::splat(limit)).below(nearest);
        !outside.or(beyond).bits() & leaf.lanes()
    }
}

#[inline(always)]
fn largest<L: Lanes>(a: &[L; 3]) -> L {
    a[0].magnitude().maximum(a[1].magnitude()).maximum(a[2].magnitude())
}
