//! Where along the ray a triangle is met, which of two is nearer, and where in the triangle it is.

use std::array::from_fn;
use std::cmp::Ordering;

use super::real::Real;
use super::side::{order, side};
use super::watertight::{UNDERFLOW, seen_along};
use super::{EPSILON, Means, RayTest, exact, pairs};
use crate::geometry::{Corners, Vector, subtract};

/// What precision `watertight` promises: of t relatively, of the weights absolutely.
const DISTANCE_LIMIT: f64 = 1.0 / (1u64 << 40) as f64;
const WEIGHT_LIMIT: f64 = 1.0 / (1u64 << 32) as f64;

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
    let error = (above.error + value.abs() * below.error) / margin;
    // The division's own rounding, and those made in bounding it.
    let error = error * (1.0 + 16.0 * EPSILON) + 2.0 * EPSILON * value.abs() + f64::MIN_POSITIVE;
    // No branch, so that a loop over hits becomes vectors.
    let is_known = (margin > below.error) & (value.abs() < f64::INFINITY);
    Approximation { value: if is_known { value } else { 0.0 }, error: if is_known { error } else { f64::INFINITY } }
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
        self.compared_with(x, test, corners).0
    }

    /// The same, and what it takes to tell.
    #[inline]
    pub fn compared_with<T: Real>(&self, x: f64, test: &RayTest, corners: &T) -> (Ordering, Means) {
        if self.upper() < x {
            (Ordering::Less, Means::Double)
        } else if self.lower() > x {
            (Ordering::Greater, Means::Double)
        } else {
            exact::compare_distance_with(corners, &test.origin, &test.direction, x)
        }
    }

    /// The order of two true values; exact.
    #[inline]
    pub fn compare<T: Real + PartialEq>(&self, corners: &T, other: &Self, others: &T, test: &RayTest) -> Ordering {
        self.compared(corners, other, others, test).0
    }

    /// The same, and what it takes to tell.
    #[inline]
    pub fn compared<T: Real + PartialEq>(
        &self,
        corners: &T,
        other: &Self,
        others: &T,
        test: &RayTest,
    ) -> (Ordering, Means) {
        if self.upper() < other.lower() {
            (Ordering::Less, Means::Double)
        } else if self.lower() > other.upper() {
            (Ordering::Greater, Means::Double)
        } else if corners == others {
            // Meshes do hold the same triangle many times.
            (Ordering::Equal, Means::Double)
        } else {
            compare_exactly(corners, others, test)
        }
    }

    /// The same value with an error of at most 2^-40 of it.
    pub fn refined(self, test: &RayTest, corners: &Corners) -> Self {
        if self.error <= DISTANCE_LIMIT * self.t.abs() { self } else { Self::exact(test, corners) }
    }
}

/// The order of the distances of two triangles that the line meets and is not parallel to, by one means after another.
#[cold]
#[inline(never)]
fn compare_exactly<T: Real>(first: &T, second: &T, test: &RayTest) -> (Ordering, Means) {
    if let (Some(one), Some(other)) = (first.doubles(), second.doubles()) {
        let order = test.axis().and_then(|axis| compare_along(axis, one, other, test));
        let order = order.or_else(|| are_met_together(one, other, test).then_some(Ordering::Equal));
        if let Some(order) = order.or_else(|| pairs::compare_distances(one, other, &test.origin, &test.direction)) {
            return (order, Means::Pairs);
        }
    }
    exact::compare_distances(first, second, &test.origin, &test.direction)
}

/// Whether the line is known to meet both triangles, neither of which it is parallel to, at a corner or an edge that they
/// share.
fn are_met_together(first: &Corners, second: &Corners, test: &RayTest) -> bool {
    let mut shared = first.iter().filter(|corner| second.contains(corner));
    shared.clone().any(|corner| test.meets(corner))
        || shared.next().zip(shared.next()).is_some_and(|(a, b)| test.is_level_with(a, b))
}

/// The same where a ray along an axis meets a corner of each, or an edge that both share.
fn compare_along(axis: usize, first: &Corners, second: &Corners, test: &RayTest) -> Option<Ordering> {
    let origin = seen_along(axis, &test.origin);
    let met = |corners: &Corners| corners.iter().find(|corner| seen_along(axis, corner) == origin).map(|p| p[axis]);
    if let (Some(one), Some(other)) = (met(first), met(second)) {
        let order = order(one, other);
        return Some(if test.direction[axis] < 0.0 { order.reverse() } else { order });
    }
    let mut shared = first.iter().filter(|corner| second.contains(corner)).map(|corner| seen_along(axis, corner));
    let (a, b) = (shared.next()?, shared.next()?);
    (side(&a, &b, &origin).0 == Ordering::Equal).then_some(Ordering::Equal)
}

/// t and the weights, not yet clamped, of a hit whose numbers in double precision are narrow enough: those of
/// `Distance::refined` and `weights`, to the bit, where the bounds of all triangles are finite. Else t is NaN. Without a
/// branch.
#[inline(always)]
pub fn located_quickly(origin: &Vector, direction: &Vector, [a, b, c]: &Corners) -> [f64; 3] {
    /// Far below what `RayTest::is_in_range` asks.
    const LARGEST: f64 = 1e60;
    let (to_corner, e1, e2) = (subtract(a, origin), subtract(b, a), subtract(c, a));
    let below = triple_product(direction, &e1, &e2);
    let t = quotient(triple_product(&to_corner, &e1, &e2), below);
    let u = quotient(triple_product(direction, &e2, &to_corner), below);
    let v = quotient(triple_product(direction, &to_corner, &e1), below);
    let is_small = |v: &Vector| (v[0].abs() < LARGEST) & (v[1].abs() < LARGEST) & (v[2].abs() < LARGEST);
    let is_narrow = (t.error <= DISTANCE_LIMIT * t.value.abs()) & (u.error < WEIGHT_LIMIT) & (v.error < WEIGHT_LIMIT);
    let is_known = is_narrow & (t.error < f64::INFINITY) & is_small(origin) & is_small(direction);
    [if is_known { t.value } else { f64::NAN }, u.value, v.value]
}

/// Weights between 0 and 1, their sum too.
#[inline(always)]
pub fn clamped([u, v]: [f64; 2]) -> [f64; 2] {
    let u = u.clamp(0.0, 1.0);
    [u, v.clamp(0.0, 1.0 - u)]
}

/// Barycentric weights of the second and third vertex of a triangle that the ray's line meets, each within 2^-32.
pub fn weights(test: &RayTest, corners: &Corners) -> [f64; 2] {
    // From a − o + u e1 + v e2 = t d by products with e2 × d and e1 × d.
    let [to_corner, e1, e2] = relative(test, corners);
    let below = triple_product(&test.direction, &e1, &e2);
    let u = quotient(triple_product(&test.direction, &e2, &to_corner), below);
    let v = quotient(triple_product(&test.direction, &to_corner, &e1), below);
    clamped(if test.is_in_range() && u.error < WEIGHT_LIMIT && v.error < WEIGHT_LIMIT {
        [u.value, v.value]
    } else {
        exact::weights(corners, &test.origin, &test.direction)
    })
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
    fn along_an_axis_corners_and_shared_edges_are_ordered_as_whole_numbers_have_it() {
        let [a, b, c, d] = [[0.125, 0.25, 0.3], [0.75, -0.5, 0.9], [-0.3, 0.8, 0.4], [0.6, 0.9, -0.2]];
        let higher = [0.125, 0.25, 0.3f64.next_up()];
        let middle = [0.4375, -0.125];
        for direction in [[0.0, 0.0, 1.0], [0.0, 0.0, -0.7]] {
            for [x, y] in [[0.125, 0.25], middle] {
                let test = RayTest::new(&Ray::new([x, y, -2.0], direction), &BOX);
                let triangles: [Corners; 5] = [[a, b, c], [b, a, d], [d, a, b], [higher, b, d], [c, higher, b]];
                for (one, other) in triangles.iter().flat_map(|one| triangles.iter().map(move |other| (one, other))) {
                    let (truth, _) = exact::compare_distances(one, other, &test.origin, &test.direction);
                    let [near, far] = [one, other].map(|corners| Distance::new(&test, corners));
                    assert_eq!(near.compare(one, &far, other, &test), truth, "{one:?} {other:?} {direction:?}");
                    if let Some(order) = compare_along(2, one, other, &test) {
                        assert_eq!(order, truth, "{one:?} {other:?} {direction:?}");
                    }
                }
                assert_eq!(compare_along(2, &triangles[0], &triangles[1], &test), Some(Ordering::Equal));
            }
        }
    }

    /// Two triangles that share a corner that the ray meets, or an edge that it crosses in a plane across an axis.
    #[test]
    fn triangles_that_are_met_together_are_as_far() {
        let [a, b, c, d] = [[0.125, 0.25, 0.5], [0.75, 0.25, 0.875], [-0.25, 0.75, 0.375], [0.5, -0.875, -0.25]];
        let triangles: [Corners; 3] = [[a, b, c], [b, a, d], [d, c, a]];
        // All meet the corner a; two hold the edge from a to b.
        for (target, direction, expected) in [(a, [0.5, 0.25, 2.0], 9), ([0.25; 3], [0.25, 0.0, 2.0], 4)] {
            let origin: Vector = from_fn(|i| target[i] - 2.0 * direction[i]);
            let test = RayTest::new(&Ray::new(origin, direction), &BOX);
            let mut together = 0;
            for (one, other) in triangles.iter().flat_map(|one| triangles.iter().map(move |other| (one, other))) {
                if are_met_together(one, other, &test) {
                    together += 1;
                    let (truth, _) = exact::compare_distances(one, other, &origin, &direction);
                    assert_eq!(truth, Ordering::Equal, "{one:?} {other:?} {direction:?}");
                }
            }
            assert_eq!(together, expected);
        }
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
