//! Where along the ray a triangle is met, which of two is nearer, and where in the triangle it is.

use std::array::from_fn;
use std::cmp::Ordering;

use super::exact;
use super::real::Real;
use super::watertight::UNDERFLOW;
use super::{EPSILON, RayTest};
use crate::geometry::{Corners, Vector, subtract};

/// `t` of a triangle that the ray's line meets: the true value lies within `error` of `t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// The computed value.
    pub t: f64,
    /// Infinite where double precision says nothing.
    pub error: f64,
}

/// A sum of products and a bound on its error.
#[derive(Clone, Copy)]
pub(super) struct Approximation {
    pub value: f64,
    pub error: f64,
}

/// a · (b × c), where each component of the three may carry the error of one subtraction.
#[inline(always)]
pub(super) fn triple_product(a: &Vector, b: &Vector, c: &Vector) -> Approximation {
    let terms: [(f64, f64); 3] = from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = (b[j] * c[k], b[k] * c[j]);
        (a[i] * (p - q), a[i].abs() * (p.abs() + q.abs()))
    });
    let [x, y, z] = terms;
    let (value, uncancelled) = (x.0 + y.0 + z.0, x.1 + y.1 + z.1);
    // Three subtractions, three products and differences, two sums: eight roundings of what does not cancel; two more
    // cover those made in adding that up.
    Approximation { value, error: 10.0 * EPSILON * uncancelled + UNDERFLOW }
}

/// A quotient of two approximations; the error is infinite where the denominator could be zero.
#[inline(always)]
pub(super) fn quotient(above: Approximation, below: Approximation) -> Approximation {
    let value = above.value / below.value;
    let margin = below.value.abs() - below.error;
    if !(margin > below.error && value.is_finite()) {
        return Approximation { value: 0.0, error: f64::INFINITY };
    }
    let error = (above.error + value.abs() * below.error) / margin;
    // The division's own rounding, and those made in bounding it.
    let error = error * (1.0 + 16.0 * EPSILON) + 2.0 * EPSILON * value.abs() + f64::MIN_POSITIVE;
    Approximation { value, error }
}

/// The corner a relative to the origin, and the edges b − a and c − a.
#[inline(always)]
pub(super) fn relative(test: &RayTest, corners: &Corners) -> [Vector; 3] {
    let [a, b, c] = corners;
    [subtract(a, &test.origin), subtract(b, a), subtract(c, a)]
}

impl Distance {
    /// `t` = (a − o) · n / d · n for the corner a and the normal n = (b − a) × (c − a).
    #[inline]
    pub fn new(test: &RayTest, corners: &Corners) -> Self {
        let [to_corner, e1, e2] = relative(test, corners);
        let above = triple_product(&to_corner, &e1, &e2);
        let below = triple_product(&test.direction, &e1, &e2);
        let Approximation { value, error } = quotient(above, below);
        if !test.is_in_range() || error == f64::INFINITY {
            return Self::exact(test, corners);
        }
        Self { t: value, error }
    }

    #[cold]
    fn exact(test: &RayTest, corners: &Corners) -> Self {
        let t = exact::distance(corners, &test.origin, &test.direction);
        Self { t, error: 2.0 * EPSILON * t.abs() + f64::MIN_POSITIVE }
    }

    /// No true value of `self` lies above this.
    #[inline(always)]
    pub fn upper(&self) -> f64 {
        (self.t + self.error).next_up()
    }

    /// No true value of `self` lies below this.
    #[inline(always)]
    pub fn lower(&self) -> f64 {
        (self.t - self.error).next_down()
    }

    /// The order of the true value and `x`; exact.
    #[inline]
    pub fn compare_with<T: Real>(&self, x: f64, test: &RayTest, corners: &T) -> Ordering {
        if self.upper() < x {
            Ordering::Less
        } else if self.lower() > x {
            Ordering::Greater
        } else {
            exact::compare_distance_with(corners, &test.origin, &test.direction, x)
        }
    }

    /// The order of two true values; exact.
    #[inline]
    pub fn compare<T: Real + PartialEq>(&self, corners: &T, other: &Self, others: &T, test: &RayTest) -> Ordering {
        if self.upper() < other.lower() {
            Ordering::Less
        } else if self.lower() > other.upper() {
            Ordering::Greater
        } else if corners == others {
            // Meshes do hold the same triangle many times.
            Ordering::Equal
        } else {
            exact::compare_distances(corners, others, &test.origin, &test.direction)
        }
    }

    /// The same value with an error of at most 2^-40 of it.
    pub fn refined(self, test: &RayTest, corners: &Corners) -> Self {
        const LIMIT: f64 = 1.0 / (1u64 << 40) as f64;
        if self.error <= LIMIT * self.t.abs() { self } else { Self::exact(test, corners) }
    }
}

/// Barycentric weights of the second and third vertex of a triangle that the ray's line meets, each within 2^-32.
pub fn weights(test: &RayTest, corners: &Corners) -> [f64; 2] {
    const LIMIT: f64 = 1.0 / (1u64 << 32) as f64;
    // From a − o + u e1 + v e2 = t d by products with e2 × d and e1 × d.
    let [to_corner, e1, e2] = relative(test, corners);
    let below = triple_product(&test.direction, &e1, &e2);
    let u = quotient(triple_product(&test.direction, &e2, &to_corner), below);
    let v = quotient(triple_product(&test.direction, &to_corner, &e1), below);
    let [u, v] = if test.is_in_range() && u.error < LIMIT && v.error < LIMIT {
        [u.value, v.value]
    } else {
        exact::weights(corners, &test.origin, &test.direction)
    };
    let u = u.clamp(0.0, 1.0);
    [u, v.clamp(0.0, 1.0 - u)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Bounds, Ray};

    const BOX: Bounds = Bounds { lower: [-10.0; 3], upper: [10.0; 3] };
    const TRIANGLE: Corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

    #[test]
    fn weights_and_distance_are_those_of_the_point() {
        let test = RayTest::new(&Ray::new([0.25, 0.5, 0.0], [0.0, 0.0, 0.5]), &BOX);
        assert_eq!(weights(&test, &TRIANGLE), [0.25, 0.5]);
        let distance = Distance::new(&test, &TRIANGLE);
        assert_eq!(distance.t, 2.0);
        assert_eq!(distance.compare_with(2.0, &test, &TRIANGLE), Ordering::Equal);
        assert_eq!(distance.compare_with(2f64.next_up(), &test, &TRIANGLE), Ordering::Less);
        assert_eq!(distance.compare_with(f64::INFINITY, &test, &TRIANGLE), Ordering::Less);
        assert_eq!(distance.compare_with(f64::NEG_INFINITY, &test, &TRIANGLE), Ordering::Greater);
    }

    #[test]
    fn planes_apart_by_less_than_a_double_are_ordered() {
        // Both t round to the same double; the second plane is tilted and nearer by 2^-60.
        let tilt = 1.0 / (1u64 << 60) as f64;
        let tilted: Corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0 - f64::EPSILON], [0.0, 1.0, 1.0]];
        let test = RayTest::new(&Ray::new([tilt / f64::EPSILON, 0.25, 0.0], [0.0, 0.0, 1.0]), &BOX);
        let [flat, near] = [&TRIANGLE, &tilted].map(|corners| Distance::new(&test, corners));
        assert_eq!(flat.compare(&TRIANGLE, &near, &tilted, &test), Ordering::Greater);
        assert_eq!(near.compare(&tilted, &flat, &TRIANGLE, &test), Ordering::Less);
        assert_eq!(flat.compare(&TRIANGLE, &flat, &TRIANGLE, &test), Ordering::Equal);
    }

    #[test]
    fn an_origin_in_the_plane_is_at_zero() {
        let corners: Corners = [[0.1, 0.2, 0.3], [1.3, 0.1, 0.7], [0.2, 1.7, 0.9]];
        let test = RayTest::new(&Ray::new(corners[0], [0.3, -0.2, 0.9]), &BOX);
        let distance = Distance::new(&test, &corners).refined(&test, &corners);
        assert_eq!(distance.t, 0.0);
        assert_eq!(distance.compare_with(0.0, &test, &corners), Ordering::Equal);
    }
}
