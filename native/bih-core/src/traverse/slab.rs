//! Eight boxes at a time, in single precision, rounded outward: docs/accuracy.md, section 4.

use super::aim::Aim;
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
    axes: [Axis; 3],
    t_min: f32,
    /// Bit 0 is set where the ray runs towards smaller x, bit 1 for y, bit 2 for z.
    octant: u32,
}

/// A ray along one axis: what subtracts from planes and what multiplies the difference, where the ray enters a box and
/// where it leaves it.
#[derive(Debug, Clone, Copy)]
struct Axis {
    near_origin: f32,
    near_reciprocal: f32,
    far_origin: f32,
    far_reciprocal: f32,
    near_planes: Planes,
    far_planes: Planes,
}

/// A row of `Record::planes`; as an enumeration it needs no check whether it is one.
#[derive(Debug, Clone, Copy)]
#[repr(u16)]
enum Planes {
    LowerX,
    LowerY,
    LowerZ,
    UpperX,
    UpperY,
    UpperZ,
}

const LOWER: [Planes; 3] = [Planes::LowerX, Planes::LowerY, Planes::LowerZ];
const UPPER: [Planes; 3] = [Planes::UpperX, Planes::UpperY, Planes::UpperZ];

impl Axis {
    /// An axis of a ray of double precision: the plane where a box is entered must not seem further away than it is, nor
    /// the other one nearer.
    #[inline(always)]
    fn new(ray: &Ray, axis: usize) -> Self {
        Self::between(axis, [ray.origin[axis]; 2], ray.direction[axis])
    }

    /// The same where the origin is somewhere between two coordinates.
    #[inline(always)]
    fn between(axis: usize, [least, greatest]: [f64; 2], direction: f64) -> Self {
        let [lower, upper] = [round_down(least), round_up(greatest)];
        let is_negative = direction.is_sign_negative();
        let origins = if is_negative { [lower, upper] } else { [upper, lower] };
        Self::of(axis, is_negative, origins, padded((1.0 / direction) as f32, direction))
    }

    /// An axis of a ray of single precision.
    #[inline(always)]
    fn single(ray: &SingleRay, axis: usize) -> Self {
        let direction = ray.direction[axis];
        let reciprocal = 1.0 / direction;
        Self::of(axis, direction.is_sign_negative(), [ray.origin[axis]; 2], padded(reciprocal, f64::from(direction)))
    }

    #[inline(always)]
    fn of(axis: usize, is_negative: bool, origins: [f32; 2], reciprocals: [f32; 2]) -> Self {
        let [near_origin, far_origin] = origins;
        let [near_reciprocal, far_reciprocal] = reciprocals;
        let near_planes = if is_negative { UPPER[axis] } else { LOWER[axis] };
        let far_planes = if is_negative { LOWER[axis] } else { UPPER[axis] };
        Self { near_origin, near_reciprocal, far_origin, far_reciprocal, near_planes, far_planes }
    }
}

/// A rounded reciprocal of a direction, so much nearer to zero and further from it that it makes up for its rounding and
/// for the three that follow.
#[inline(always)]
fn padded(reciprocal: f32, direction: f64) -> [f32; 2] {
    if RECIPROCALS.contains(&reciprocal.abs()) {
        [reciprocal * (1.0 - 2.0 * f32::EPSILON), reciprocal * (1.0 + 3.0 * f32::EPSILON)]
    } else {
        reciprocals(direction)
    }
}

/// The same where that could overflow or underflow.
#[cold]
#[inline(never)]
fn reciprocals(direction: f64) -> [f32; 2] {
    let magnitude = (1.0 / direction).abs();
    let [near, far] = if direction == 0.0 {
        [f32::INFINITY; 2]
    } else {
        // Rounded down an overflow is the largest number; only that of a true zero is infinite.
        [round_down(magnitude * (1.0 - 4.0 * U)).min(f32::MAX), round_up(magnitude * (1.0 + 4.0 * U))]
    };
    let sign = if direction.is_sign_negative() { -1.0 } else { 1.0 };
    [near.copysign(sign), far.copysign(sign)]
}

#[inline(always)]
fn octant(is_negative: [bool; 3]) -> u32 {
    u32::from(is_negative[0]) | u32::from(is_negative[1]) << 1 | u32::from(is_negative[2]) << 2
}

impl Slab {
    /// None where single precision might lose a hit: t may be negative, or coordinates overflow.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, scene: &Scene) -> Option<Self> {
        let is_near = ray.origin.iter().all(|x| x.abs() < f64::from(RANGE));
        // Written out: a loop over the axes would build the slab in memory, and copying what was just stored in pieces
        // stalls.
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        Some(Self {
            axes: [Axis::new(ray, 0), Axis::new(ray, 1), Axis::new(ray, 2)],
            t_min: round_down(ray.t_min),
            octant: octant(ray.direction.map(f64::is_sign_negative)),
        })
    }

    /// The same where the ray is known up to its spread.
    #[inline(always)]
    pub(super) fn around(aim: &Aim, scene: &Scene) -> Option<Self> {
        let Aim { ray, spread } = aim;
        let is_near = (0..3).all(|axis| ray.origin[axis].abs() + spread[axis] < f64::from(RANGE));
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        let [dx, dy, dz] = ray.direction;
        Some(Self {
            axes: [
                Axis::between(0, aim.origins(0), dx),
                Axis::between(1, aim.origins(1), dy),
                Axis::between(2, aim.origins(2), dz),
            ],
            t_min: round_down(ray.t_min),
            octant: octant(ray.direction.map(f64::is_sign_negative)),
        })
    }

    /// The same for a ray that is all of single precision. An infinite direction says nothing of any box, and so would find
    /// a child in every lane.
    #[inline(always)]
    pub(super) fn single(ray: &SingleRay, scene: &Scene) -> Option<Self> {
        let is_near = ray.origin.iter().all(|x| x.abs() < RANGE) && ray.direction.iter().all(|x| x.is_finite());
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        Some(Self {
            axes: [Axis::single(ray, 0), Axis::single(ray, 1), Axis::single(ray, 2)],
            t_min: ray.t_min,
            octant: octant(ray.direction.map(f32::is_sign_negative)),
        })
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
        for axis in &self.axes {
            // A ray in the plane of a side gives NaN, which the operand order passes over.
            let enters = L::load(&planes[axis.near_planes as usize]).minus(L::splat(axis.near_origin));
            near = enters.times(L::splat(axis.near_reciprocal)).maximum(near);
            let leaves = L::load(&planes[axis.far_planes as usize]).minus(L::splat(axis.far_origin));
            far = leaves.fused(L::splat(axis.far_reciprocal), L::splat(TINY)).minimum(far);
        }
        (near, far)
    }
}

/// Whether no coordinate can overflow.
pub(super) fn is_small(bounds: &Bounds) -> bool {
    bounds.lower.iter().chain(&bounds.upper).all(|x| x.abs() < RANGE)
}
