//! What takes a mesh to its place.

use std::array::from_fn;

use crate::geometry::{Bounds, Corners, Vector, add_scaled, cross, dot};
use crate::intersect::{EPSILON, Image, rounded_sum};

/// Products between this and its inverse, of numbers that are not zero, have a rounding error that is a double.
const LEAST: f64 = 1e-270;
const IDENTITY: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// x ↦ L x + T
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    pub(super) linear: [Vector; 3],
    pub(super) shift: Vector,
}

impl Affine {
    /// The upper three rows of a matrix from object to world.
    pub fn new(matrix: &[[f64; 4]; 4]) -> Self {
        Self { linear: from_fn(|i| from_fn(|j| matrix[i][j])), shift: from_fn(|i| matrix[i][3]) }
    }

    /// Where a finite point is taken, each coordinate rounded once, so that triangles that share a vertex share its image;
    /// infinite beyond the largest double.
    #[inline(always)]
    pub fn image(&self, point: &Vector) -> Vector {
        // Written out: compiled for vectors, without a closure.
        [self.coordinate(0, point), self.coordinate(1, point), self.coordinate(2, point)]
    }

    /// The images of three corners.
    #[inline(always)]
    pub fn corners(&self, corners: &Corners) -> Corners {
        if self.linear == IDENTITY {
            // One sum is rounded once.
            return corners.map(|corner| add_scaled(&corner, 1.0, &self.shift));
        }
        [self.image(&corners[0]), self.image(&corners[1]), self.image(&corners[2])]
    }

    #[inline(always)]
    fn coordinate(&self, axis: usize, point: &Vector) -> f64 {
        let (row, shift) = (&self.linear[axis], self.shift[axis]);
        let [(p, p_lost), (q, q_lost), (r, r_lost)] =
            [product(row[0], point[0]), product(row[1], point[1]), product(row[2], point[2])];
        let (sum, first) = sum(p, q);
        let (sum, second) = self::sum(sum, r);
        let (sum, third) = self::sum(sum, shift);
        let lost = (first + second + third) + (p_lost + q_lost + r_lost);
        let size = (first.abs() + second.abs() + third.abs()) + (p_lost.abs() + q_lost.abs() + r_lost.abs());
        // Five roundings of what was lost, one here, and those of the bound.
        let error = 8.0 * EPSILON * size;
        let (least, most) = (sum + (lost - error), sum + (lost + error));
        let is_small = |p: f64, a: f64, b: f64| p.abs() < LEAST && a != 0.0 && b != 0.0;
        let is_lost = is_small(p, row[0], point[0]) || is_small(q, row[1], point[1]) || is_small(r, row[2], point[2]);
        // Rounding is monotone: where both ends of what it can be round to one number, so does the truth.
        if least == most && !is_lost { least } else { rounded_sum(row, point, shift) }
    }

    /// Whether the image of a triangle, all finite and not rounded, lies on a line.
    pub(super) fn has_no_area(&self, corners: &Corners) -> bool {
        self.real(corners).has_no_area()
    }

    /// The image of a triangle, not rounded.
    #[inline(always)]
    pub(super) fn real(&self, corners: &Corners) -> Image {
        Image { linear: self.linear, shift: self.shift, corners: *corners, rounded: self.corners(corners) }
    }

    /// A normal of the mesh as one of its image, of any length: what is perpendicular to two edges is so to their images.
    pub(super) fn normal(&self, normal: &Vector) -> Vector {
        let largest = self.linear.as_flattened().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        let [a, b, c] = self.linear.map(|row| row.map(|x| x / largest));
        [dot(&cross(&b, &c), normal), dot(&cross(&c, &a), normal), dot(&cross(&a, &b), normal)]
    }

    /// A box that holds the images of all points of a finite box, however they are rounded.
    pub(super) fn bounds(&self, bounds: &Bounds) -> [Vector; 2] {
        let ends: [[f64; 2]; 3] = from_fn(|axis| {
            let (mut lower, mut upper, mut size) = (self.shift[axis], self.shift[axis], self.shift[axis].abs());
            for (factor, (&low, &high)) in self.linear[axis].iter().zip(bounds.lower.iter().zip(&bounds.upper)) {
                let ends = [factor * f64::from(low), factor * f64::from(high)];
                lower += ends[0].min(ends[1]);
                upper += ends[0].max(ends[1]);
                size += ends[0].abs().max(ends[1].abs());
            }
            // Four roundings of each term, one of the image, and those of the bound.
            let error = 8.0 * EPSILON * size + f64::MIN_POSITIVE;
            [lower - error, upper + error]
        });
        [ends.map(|[lower, _]| lower), ends.map(|[_, upper]| upper)]
    }
}

/// a · b, and what rounding took from it.
#[inline(always)]
fn product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

/// a + b, and what rounding took from it (Knuth 1969).
#[inline(always)]
fn sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of both signs, most of them small, some of many sizes.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 1u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let mantissa = (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
            match state & 15 {
                0 => 0.0,
                1..4 => (8.0 * mantissa).round(),
                4 => mantissa * 1e-200,
                5 => mantissa * 1e200,
                6..9 => f64::from(mantissa as f32),
                _ => mantissa,
            }
        }
    }

    #[test]
    fn images_are_rounded_once() {
        let mut number = numbers();
        for _ in 0..20_000 {
            let matrix: [[f64; 4]; 4] = from_fn(|_| from_fn(|_| number()));
            let place = Affine::new(&matrix);
            let point: Vector = from_fn(|_| number());
            let truth: Vector = from_fn(|i| rounded_sum(&place.linear[i], &point, place.shift[i]));
            assert_eq!(place.image(&point), truth, "{place:?} {point:?}");
        }
    }

    #[test]
    fn what_is_only_shifted_is_rounded_once_too() {
        let mut number = numbers();
        for _ in 0..5_000 {
            let place = Affine { linear: IDENTITY, shift: from_fn(|_| number()) };
            let corners: Corners = from_fn(|_| from_fn(|_| number()));
            assert_eq!(place.corners(&corners), corners.map(|corner| place.image(&corner)), "{place:?} {corners:?}");
        }
    }

    #[test]
    fn boxes_hold_the_images_of_their_corners() {
        let mut number = numbers();
        for _ in 0..5_000 {
            let place = Affine::new(&from_fn(|_| from_fn(|_| number())));
            let ends: [[f32; 3]; 2] = from_fn(|_| from_fn(|_| number() as f32));
            if ends.as_flattened().iter().any(|x| x.is_infinite()) {
                continue;
            }
            let bounds = Bounds {
                lower: from_fn(|i| ends[0][i].min(ends[1][i])),
                upper: from_fn(|i| ends[0][i].max(ends[1][i])),
            };
            let [lower, upper] = place.bounds(&bounds);
            for corner in 0..8 {
                let point =
                    from_fn(|i| f64::from(if corner >> i & 1 == 0 { bounds.lower[i] } else { bounds.upper[i] }));
                let image = place.image(&point);
                assert!((0..3).all(|i| lower[i] <= image[i] && image[i] <= upper[i]), "{place:?} {bounds:?}");
            }
        }
    }
}
