//! Boxes against rays, lane by lane: one ray and eight boxes, or eight rays and one box.

use crate::simd::Lanes;
use crate::tree::{Record, WIDTH};

/// Added where a product may have lost all bits to underflow.
const TINY: f32 = f32::MIN_POSITIVE;

/// Where rays enter and leave boxes, rounded outward: docs/accuracy.md, section 4.
///
/// All operations are monotone in the numbers of the ray, so one ray whose numbers are the extremes of many enters no
/// later than any of them and leaves no earlier.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slabs<L> {
    pub near_origin: [L; 3],
    pub near_reciprocal: [L; 3],
    pub far_origin: [L; 3],
    pub far_reciprocal: [L; 3],
    pub t_min: L,
}

/// The planes through which rays of one octant enter boxes, and those through which they leave.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides<L> {
    enter: [L; 3],
    leave: [L; 3],
}

/// Rays run towards smaller coordinates along the axes whose bits are set.
#[inline(always)]
pub(super) fn is_negative(octant: usize, axis: usize) -> bool {
    octant >> axis & 1 != 0
}

/// The rows of the planes through which rays of an octant enter the boxes of a record, and those through which they
/// leave.
#[inline(always)]
fn rows(record: &Record, octant: usize, axis: usize) -> [&[f32; WIDTH]; 2] {
    if is_negative(octant, axis) {
        [&record.upper[axis], &record.lower[axis]]
    } else {
        [&record.lower[axis], &record.upper[axis]]
    }
}

impl<L: Lanes> Sides<L> {
    /// Of all boxes of a record.
    #[inline(always)]
    pub fn all(record: &Record, octant: usize) -> Self {
        let [x, y, z] = [rows(record, octant, 0), rows(record, octant, 1), rows(record, octant, 2)];
        Self {
            enter: [L::load(x[0]), L::load(y[0]), L::load(z[0])],
            leave: [L::load(x[1]), L::load(y[1]), L::load(z[1])],
        }
    }

    /// Of one box, in every lane.
    #[inline(always)]
    pub fn one(record: &Record, octant: usize, lane: usize) -> Self {
        let [x, y, z] = [rows(record, octant, 0), rows(record, octant, 1), rows(record, octant, 2)];
        Self {
            enter: [L::splat(x[0][lane]), L::splat(y[0][lane]), L::splat(z[0][lane])],
            leave: [L::splat(x[1][lane]), L::splat(y[1][lane]), L::splat(z[1][lane])],
        }
    }
}

impl<L: Lanes> Slabs<L> {
    /// A ray meets a box before `limit` if it enters no later than it leaves.
    #[inline(always)]
    pub fn clip(&self, sides: &Sides<L>, limit: L) -> (L, L) {
        let mut near = self.t_min;
        let mut far = limit;
        for axis in 0..3 {
            // A ray in the plane of a side gives NaN, which the operand order passes over.
            let enters = sides.enter[axis].minus(self.near_origin[axis]);
            near = enters.times(self.near_reciprocal[axis]).maximum(near);
            let leaves = sides.leave[axis].minus(self.far_origin[axis]);
            far = leaves.fused(self.far_reciprocal[axis], L::splat(TINY)).minimum(far);
        }
        (near, far)
    }
}
