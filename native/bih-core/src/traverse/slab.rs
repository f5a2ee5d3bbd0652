//! Eight boxes at a time, in single precision, rounded outward: docs/accuracy.md, section 4.

use super::scene::Scene;
use crate::geometry::{Bounds, Ray, round_down, round_up};
use crate::intersect::SingleRay;
use crate::simd::Lanes;
use crate::tree::Record;

/// Half a unit in the last place of 1 in single precision.
const U: f64 = f32::EPSILON as f64 / 2.0;
/// Added where a product may have lost all bits to underflow.
pub(super) const TINY: f32 = f32::MIN_POSITIVE;
/// Coordinates below this do not overflow.
const RANGE: f32 = f32::MAX / 4.0;
/// Reciprocals within these are neither subnormal nor infinite after padding.
const RECIPROCALS: std::ops::Range<f32> = 2.0 * f32::MIN_POSITIVE..f32::MAX / 2.0;

/// A ray as the boxes see it: scalars, which are spread over the lanes where they are used.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slab {
    near_origin: [f32; 3],
    near_reciprocal: [f32; 3],
    far_origin: [f32; 3],
    far_reciprocal: [f32; 3],
    t_min: f32,
    /// Bit 0 is set where the ray runs towards smaller x, bit 1 for y, bit 2 for z.
    octant: u32,
}

impl Slab {
    /// None where single precision might lose a hit: t may be negative, or coordinates overflow.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, scene: &Scene) -> Option<Self> {
        let is_near = ray.origin.iter().all(|x| x.abs() < f64::from(RANGE));
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        let mut slab = Self::EMPTY;
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            let [lower, upper] = [round_down(origin), round_up(origin)];
            let is_negative = direction.is_sign_negative();
            [slab.near_origin[axis], slab.far_origin[axis]] = if is_negative { [lower, upper] } else { [upper, lower] };
            slab.set_reciprocals(axis, direction);
        }
        slab.t_min = round_down(ray.t_min);
        Some(slab)
    }

    /// The same for a ray that is all of single precision.
    #[inline(always)]
    pub(super) fn single(ray: &SingleRay, scene: &Scene) -> Option<Self> {
        let is_near = ray.origin.iter().all(|x| x.abs() < RANGE);
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        let mut slab = Self::EMPTY;
        slab.near_origin = ray.origin;
        slab.far_origin = ray.origin;
        slab.t_min = ray.t_min;
        for axis in 0..3 {
            let direction = ray.direction[axis];
            let reciprocal = 1.0 / direction;
            if RECIPROCALS.contains(&reciprocal.abs()) {
                slab.near_reciprocal[axis] = reciprocal * (1.0 - 2.0 * f32::EPSILON);
                slab.far_reciprocal[axis] = reciprocal * (1.0 + 3.0 * f32::EPSILON);
                slab.octant |= u32::from(direction.is_sign_negative()) << axis;
            } else {
                slab.set_reciprocals(axis, f64::from(direction));
            }
        }
        Some(slab)
    }

    const EMPTY: Self = Self {
        near_origin: [0.0; 3],
        near_reciprocal: [0.0; 3],
        far_origin: [0.0; 3],
        far_reciprocal: [0.0; 3],
        t_min: 0.0,
        octant: 0,
    };

    #[inline(always)]
    fn set_reciprocals(&mut self, axis: usize, direction: f64) {
        let magnitude = (1.0 / direction).abs();
        let [near, far] = if direction == 0.0 {
            [f32::INFINITY; 2]
        } else {
            // Rounded down an overflow is the largest number; only that of a true zero is infinite.
            [round_down(magnitude * (1.0 - 4.0 * U)).min(f32::MAX), round_up(magnitude * (1.0 + 4.0 * U))]
        };
        let sign = if direction.is_sign_negative() { -1.0 } else { 1.0 };
        self.near_reciprocal[axis] = near.copysign(sign);
        self.far_reciprocal[axis] = far.copysign(sign);
        self.octant |= u32::from(direction.is_sign_negative()) << axis;
    }

    /// Where the ray runs.
    #[inline(always)]
    pub(super) fn octant(&self) -> usize {
        self.octant as usize
    }

    /// Where the ray enters the boxes of a record and where it leaves them; the boxes it may meet before `limit` are
    /// those that it leaves no earlier than it enters.
    #[inline(always)]
    pub(super) fn clip<L: Lanes>(&self, record: &Record, limit: f32) -> (L, L) {
        let planes = record.planes();
        let mut near = L::splat(self.t_min);
        let mut far = L::splat(limit);
        for axis in 0..3 {
            let upper = 3 * (self.octant as usize >> axis & 1);
            // A ray in the plane of a side gives NaN, which the operand order passes over.
            let enters = L::load(&planes[axis + upper]).minus(L::splat(self.near_origin[axis]));
            near = enters.times(L::splat(self.near_reciprocal[axis])).maximum(near);
            let leaves = L::load(&planes[axis + 3 - upper]).minus(L::splat(self.far_origin[axis]));
            far = leaves.fused(L::splat(self.far_reciprocal[axis]), L::splat(TINY)).minimum(far);
        }
        (near, far)
    }
}

/// Whether no coordinate can overflow.
pub(super) fn is_small(bounds: &Bounds) -> bool {
    bounds.lower.iter().chain(&bounds.upper).all(|x| x.abs() < RANGE)
}
