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
    /// Where it enters boxes.
    near: Side,
    /// Where it leaves them.
    far: Side,
    t_min: f32,
    /// Bit 0 is set where the ray runs towards smaller x, bit 1 for y, bit 2 for z.
    octant: u32,
}

/// A number for each axis, and one that nobody reads: the compiler makes one vector of them, where three would go through
/// memory one after another.
type Four = [f32; 4];

/// What subtracts from the planes across each axis, what multiplies the difference, and which planes these are.
#[derive(Debug, Clone, Copy)]
struct Side {
    origins: Four,
    reciprocals: Four,
    planes: [Planes; 3],
}

/// Where a row of `Record::planes` begins; as an enumeration it needs no check whether one does.
#[derive(Debug, Clone, Copy)]
#[repr(u16)]
enum Planes {
    LowerX = 0,
    LowerY = 8,
    LowerZ = 16,
    UpperX = 24,
    UpperY = 32,
    UpperZ = 40,
}

/// For each octant those through which rays enter, then those through which they leave.
static PLANES: [[[Planes; 3]; 2]; 8] = {
    let (lower, upper) =
        ([Planes::LowerX, Planes::LowerY, Planes::LowerZ], [Planes::UpperX, Planes::UpperY, Planes::UpperZ]);
    let mut planes = [[lower, upper]; 8];
    let mut bit = 0;
    while bit < 24 {
        let (octant, axis) = (bit / 3, bit % 3);
        if octant >> axis & 1 != 0 {
            planes[octant][0][axis] = upper[axis];
            planes[octant][1][axis] = lower[axis];
        }
        bit += 1;
    }
    planes
};

impl Planes {
    #[inline(always)]
    fn of<L: Lanes>(self, record: &Record) -> L {
        let start = self as usize;
        L::load(record.planes().as_flattened()[start..].first_chunk().expect("eight rows"))
    }
}

/// Whether a reciprocal has room for `nearer` and `farther`.
#[inline(always)]
fn is_usual(x: f32) -> bool {
    (x.abs() >= RECIPROCALS.start) & (x.abs() < RECIPROCALS.end)
}

#[inline(always)]
fn nearer(x: f32) -> f32 {
    x * (1.0 - 2.0 * f32::EPSILON)
}

#[inline(always)]
fn farther(x: f32) -> f32 {
    x * (1.0 + 3.0 * f32::EPSILON)
}

/// Rounded reciprocals of directions, so much nearer to zero and further from it that it makes up for their rounding and for
/// the three that follow.
#[inline(always)]
fn padded(reciprocals: Four, directions: [f64; 3]) -> [Four; 2] {
    if reciprocals.iter().fold(true, |all, &x| all & is_usual(x)) {
        [reciprocals.map(nearer), reciprocals.map(farther)]
    } else {
        unusual(reciprocals, directions)
    }
}

/// The same where one of them could overflow or underflow.
#[cold]
#[inline(never)]
fn unusual(reciprocals: Four, directions: [f64; 3]) -> [Four; 2] {
    let mut sides = [[1.0; 4]; 2];
    for (axis, (x, direction)) in reciprocals.into_iter().zip(directions).enumerate() {
        [sides[0][axis], sides[1][axis]] = if is_usual(x) { [nearer(x), farther(x)] } else { unusual_one(direction) };
    }
    sides
}

fn unusual_one(direction: f64) -> [f32; 2] {
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
    #[inline(always)]
    fn of(octant: u32, origins: [Four; 2], reciprocals: [Four; 2], t_min: f32) -> Self {
        let [near, far] = PLANES[octant as usize & 7];
        Self {
            near: Side { origins: origins[0], reciprocals: reciprocals[0], planes: near },
            far: Side { origins: origins[1], reciprocals: reciprocals[1], planes: far },
            t_min,
            octant,
        }
    }

    /// Of no ray.
    pub(super) fn nowhere() -> Self {
        Self::of(0, [[0.0; 4]; 2], [[1.0; 4]; 2], 0.0)
    }

    /// A ray of double precision whose origin is somewhere between two corners: the plane where a box is entered must not
    /// seem further away than it is, nor the other one nearer.
    #[inline(always)]
    fn between(least: [f64; 3], greatest: [f64; 3], ray: &Ray) -> Self {
        let is_negative = ray.direction.map(f64::is_sign_negative);
        let mut origins = [[0.0; 4]; 2];
        let mut reciprocals = [1.0; 4];
        for axis in 0..3 {
            let (lower, upper) = (round_down(least[axis]), round_up(greatest[axis]));
            origins[0][axis] = if is_negative[axis] { lower } else { upper };
            origins[1][axis] = if is_negative[axis] { upper } else { lower };
            reciprocals[axis] = (1.0 / ray.direction[axis]) as f32;
        }
        Self::of(octant(is_negative), origins, padded(reciprocals, ray.direction), round_down(ray.t_min))
    }

    /// None where single precision might lose a hit: t may be negative, or coordinates overflow.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, scene: &Scene) -> Option<Self> {
        let is_near = ray.origin.iter().all(|x| x.abs() < f64::from(RANGE));
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        Some(Self::between(ray.origin, ray.origin, ray))
    }

    /// The same where the ray is known up to its spread.
    #[inline(always)]
    pub(super) fn around(aim: &Aim, scene: &Scene) -> Option<Self> {
        let Aim { ray, spread } = aim;
        let is_near = (0..3).all(|axis| ray.origin[axis].abs() + spread[axis] < f64::from(RANGE));
        if !(ray.t_min >= 0.0 && is_near && scene.is_small) {
            return None;
        }
        let [x, y, z] = [0, 1, 2].map(|axis| aim.origins(axis));
        Some(Self::between([x[0], y[0], z[0]], [x[1], y[1], z[1]], ray))
    }

    /// The same for a ray that is all of single precision. An infinite direction says nothing of any box, and so would find
    /// a child in every lane.
    #[inline(always)]
    pub(super) fn single(ray: &SingleRay, scene: &Scene) -> Option<Self> {
        let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin, ray.direction);
        // All at once: nearly every ray passes them all.
        let is_near = (ox.abs() < RANGE) & (oy.abs() < RANGE) & (oz.abs() < RANGE);
        let is_finite = dx.is_finite() & dy.is_finite() & dz.is_finite();
        if !(is_near & is_finite & (ray.t_min >= 0.0) & scene.is_small) {
            return None;
        }
        let reciprocals = [dx, dy, dz, 1.0].map(|x| 1.0 / x);
        let octant = octant(ray.direction.map(f32::is_sign_negative));
        let sides = padded(reciprocals, ray.direction.map(f64::from));
        Some(Self::of(octant, [[ox, oy, oz, 0.0]; 2], sides, ray.t_min))
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
        let mut near = L::splat(self.t_min);
        let mut far = L::splat(limit);
        for axis in 0..3 {
            // A ray in the plane of a side gives NaN, which the operand order passes over.
            let enters = self.near.planes[axis].of::<L>(record).minus(L::splat(self.near.origins[axis]));
            near = enters.times(L::splat(self.near.reciprocals[axis])).maximum(near);
            let leaves = self.far.planes[axis].of::<L>(record).minus(L::splat(self.far.origins[axis]));
            far = leaves.fused(L::splat(self.far.reciprocals[axis]), L::splat(TINY)).minimum(far);
        }
        (near, far)
    }
}

/// Whether no coordinate can overflow.
pub(super) fn is_small(bounds: &Bounds) -> bool {
    bounds.lower.iter().chain(&bounds.upper).all(|x| x.abs() < RANGE)
}
