//! Rays that walk together: where they cross axis-parallel planes, rounded so that nothing within them is ever lost.
//!
//! Written once for one ray and for 2 × 2 packets (Wald, Slusallek, Benthin and Wagner 2001, "Interactive Rendering with
//! Coherent Ray Tracing"). The bounds are those of docs/accuracy.md, section 1.

use crate::geometry::{Bounds, Ray};
use crate::traverse::Aim;

/// Rays of a 2 × 2 packet.
pub const LANES: usize = 4;

/// Relative width that covers the four roundings of (plane − origin) · reciprocal: 8 · 2^-53.
const PAD: f64 = 4.0 * f64::EPSILON;

/// Rays whose directions have the same signs, so that all see the children of a node in the same order.
#[derive(Debug, Clone, Copy)]
pub struct Packet<const N: usize = LANES> {
    /// The origins as near to what is ahead, and as far from it, as they may be.
    nearest: [[f64; N]; 3],
    farthest: [[f64; N]; 3],
    /// 1/d rounded towards zero and away from it, both with the sign of d.
    least: [[f64; N]; 3],
    most: [[f64; N]; 3],
    negative: [bool; 3],
    /// The part of each ray that counts; empty for one that is not active.
    pub(super) near: [f64; N],
    pub(super) far: [f64; N],
}

impl<const N: usize> Packet<N> {
    /// None where the directions of active rays differ in a sign: these are to be traced one by one; or where no ray is
    /// active. Rays that are not active meet no leaf; an invalid ray must not be active.
    #[inline(always)]
    pub fn new(rays: &[Ray; N], active: [bool; N]) -> Option<Self> {
        let example = &rays[active.iter().position(|&active| active)?];
        let mut packet = Self {
            nearest: [[0.0; N]; 3],
            farthest: [[0.0; N]; 3],
            least: [[1.0; N]; 3],
            most: [[1.0; N]; 3],
            negative: example.direction.map(f64::is_sign_negative),
            near: [f64::INFINITY; N],
            far: [f64::NEG_INFINITY; N],
        };
        for lane in (0..N).filter(|&lane| active[lane]) {
            let ray = &rays[lane];
            for axis in 0..3 {
                if ray.direction[axis].is_sign_negative() != packet.negative[axis] {
                    return None;
                }
                packet.nearest[axis][lane] = ray.origin[axis];
                packet.farthest[axis][lane] = ray.origin[axis];
                (packet.least[axis][lane], packet.most[axis][lane]) = reciprocals(ray.direction[axis]);
            }
            packet.near[lane] = ray.t_min;
            packet.far[lane] = ray.t_max;
        }
        Some(packet)
    }

    /// One ray that is known up to its spread.
    #[inline(always)]
    pub(super) fn around(aim: &Aim) -> Option<Packet<1>> {
        let mut packet = Packet::new(&[aim.ray], [true])?;
        for axis in 0..3 {
            let [lower, upper] = aim.origins(axis);
            let [nearest, farthest] = if packet.negative[axis] { [lower, upper] } else { [upper, lower] };
            (packet.nearest[axis], packet.farthest[axis]) = ([nearest], [farthest]);
        }
        Some(packet)
    }

    /// Whether the rays run towards smaller coordinates.
    #[inline(always)]
    pub(super) fn is_negative(&self, axis: usize) -> bool {
        self.negative[axis]
    }

    /// At most and at least the t at which the rays meet a plane; NaN where a ray lies in it: it says nothing.
    #[inline(always)]
    pub(super) fn crossings(&self, axis: usize, plane: f32) -> ([f64; N], [f64; N]) {
        let (mut earliest, mut latest) = ([0.0; N], [0.0; N]);
        let (least, most) = (&self.least[axis], &self.most[axis]);
        let (nearest, farthest) = (&self.nearest[axis], &self.farthest[axis]);
        for lane in 0..N {
            // Ahead of the origin the first is the earlier one, behind it the second.
            let offset = f64::from(plane) - nearest[lane];
            let (a, b) = (offset * least[lane], offset * most[lane]);
            earliest[lane] = if a < b { a } else { b } - f64::MIN_POSITIVE;
            let offset = f64::from(plane) - farthest[lane];
            let (a, b) = (offset * least[lane], offset * most[lane]);
            latest[lane] = if a > b { a } else { b } + f64::MIN_POSITIVE;
        }
        (earliest, latest)
    }

    /// The parts of the rays within the bounds.
    #[inline(always)]
    pub(super) fn clip(&self, bounds: &Bounds) -> ([f64; N], [f64; N]) {
        let (mut near, mut far) = (self.near, self.far);
        for axis in 0..3 {
            let [mut entry, mut exit] = [bounds.lower[axis], bounds.upper[axis]];
            if self.negative[axis] {
                std::mem::swap(&mut entry, &mut exit);
            }
            near = larger(&self.crossings(axis, entry).0, &near);
            far = smaller(&self.crossings(axis, exit).1, &far);
        }
        (near, far)
    }
}

/// 1/d rounded towards zero and away from it, both with the sign of d.
#[inline(always)]
fn reciprocals(direction: f64) -> (f64, f64) {
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
    (least.copysign(direction), most.copysign(direction))
}

/// The smaller of two numbers a lane, the second where the first is NaN.
#[inline(always)]
pub(super) fn smaller<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    let mut least = *b;
    for lane in 0..N {
        least[lane] = if a[lane] < b[lane] { a[lane] } else { b[lane] };
    }
    least
}

/// The larger of two numbers a lane, the second where the first is NaN.
#[inline(always)]
pub(super) fn larger<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    let mut most = *b;
    for lane in 0..N {
        most[lane] = if a[lane] > b[lane] { a[lane] } else { b[lane] };
    }
    most
}

/// The lanes in which `a` does not exceed `b`.
#[inline(always)]
pub(super) fn in_order<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [bool; N] {
    let mut mask = [false; N];
    for lane in 0..N {
        mask[lane] = a[lane] <= b[lane];
    }
    mask
}

/// Whether any lane is set.
#[inline(always)]
pub(super) fn any<const N: usize>(mask: &[bool; N]) -> bool {
    mask.iter().fold(false, |any, &lane| any | lane)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_true_crossing_lies_between() {
        for direction in [1.0, -1.0, 3.0, -0.1, 1e-300, -1e-300, 1e300, 5e-324, -f64::MAX] {
            let origins = [-2.0, 0.0, 2.5, 1e-44];
            let rays = origins.map(|x| Ray::new([x, 0.0, 0.0], [direction, 1.0, 0.0]));
            let packet = Packet::new(&rays, [true; LANES]).unwrap();
            for plane in [-3.0f32, -1e-38, 0.0, 1e-44, 2.5] {
                let (earliest, latest) = packet.crossings(0, plane);
                for lane in 0..LANES {
                    // The quotient of an exact difference, one rounding away from the truth.
                    let offset = f64::from(plane) - origins[lane];
                    let truth = offset / direction;
                    if origins[lane] != 0.0 && offset + origins[lane] != f64::from(plane) {
                        continue;
                    }
                    let (earliest, latest) = (earliest[lane], latest[lane]);
                    assert!(earliest.is_nan() || earliest <= truth.next_down() || truth.is_infinite());
                    assert!(latest.is_nan() || latest >= truth.next_up() || truth.is_infinite());
                    assert!(earliest.is_nan() || latest.is_nan() || earliest <= latest, "{direction} {plane}");
                }
            }
        }
    }

    #[test]
    fn a_ray_in_a_side_of_the_bounds_is_within_them() {
        let bounds = Bounds { lower: [0.0; 3], upper: [1.0; 3] };
        for direction in [[0.0, 0.0, 1.0], [-0.0, -0.0, 1.0]] {
            let rays = [[0.0, 1.0, -1.0], [-1e-9, 1.0, -1.0]].map(|origin| Ray::new(origin, direction));
            let (near, far) = Packet::new(&rays, [true; 2]).unwrap().clip(&bounds);
            assert!(near[0] <= 1.0 && (2.0..2.1).contains(&far[0]));
            assert!(near[1] > far[1]);
        }
    }

    #[test]
    fn rays_of_different_octants_are_no_packet() {
        let mut rays = [Ray::new([0.0; 3], [1.0, 0.0, 0.0]); LANES];
        rays[2].direction[1] = -0.0;
        assert!(Packet::new(&rays, [true; LANES]).is_none());
        assert!(Packet::new(&rays, [true, true, false, true]).is_some());
        assert!(Packet::new(&rays, [false; LANES]).is_none());
    }
}
