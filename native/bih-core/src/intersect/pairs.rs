//! What one double leaves over, decided by pairs of doubles: docs/accuracy.md, section 2.

use std::cmp::Ordering;

use super::EPSILON;
use super::double_double::{Pair, PairVector, cross, differences, dot, largest};
use super::side::order;
use super::watertight::UNDERFLOW;
use crate::geometry::{Corners, Vector};
use crate::simd::{Kernel, Lanes, dispatch};

/// Of a triple product of differences, relatively to the product of their largest components: 320 · 2^-106 and the
/// roundings made in using it.
const ERROR: f64 = 321.0 * EPSILON * EPSILON;
/// Lengths and directions are below this, so that products of two triple products do not overflow.
const LARGEST: f64 = 1e45;
/// More than triple products of such numbers lose to underflow.
const LOST: f64 = 1e-270;

/// A triple product and a bound on its error.
#[derive(Clone, Copy)]
struct Product {
    value: Pair,
    error: f64,
}

impl Product {
    /// a · b of some largest components, where b is a cross product of vectors with others.
    #[inline(always)]
    fn of(a: &PairVector, b: &PairVector, largest: f64) -> Self {
        Self { value: dot(a, b).settled(), error: ERROR * largest + LOST }
    }

    /// None where it is too near to zero.
    #[inline(always)]
    fn sign(&self) -> Option<Ordering> {
        (self.value.head.abs() > self.error).then(|| order(self.value.head, 0.0))
    }
}

/// The signs of the edge values d · (b × c), d · (c × a) and d · (a × b) that pairs tell.
pub(super) fn edge_signs(corners: &Corners, origin: &Vector, direction: &Vector) -> [Option<Ordering>; 3] {
    dispatch(EdgeSigns { corners, origin, direction })
}

/// The order of the distances of two triangles that the ray is not parallel to.
pub(super) fn compare_distances(
    first: &Corners,
    second: &Corners,
    origin: &Vector,
    direction: &Vector,
) -> Option<Ordering> {
    dispatch(Compared { triangles: [first, second], origin, direction })
}

struct EdgeSigns<'a> {
    corners: &'a Corners,
    origin: &'a Vector,
    direction: &'a Vector,
}

impl Kernel for EdgeSigns<'_> {
    type Output = [Option<Ordering>; 3];
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { corners: [a, b, c], origin, direction } = self;
        let (a, b, c) = (differences(a, origin), differences(b, origin), differences(c, origin));
        let d = exactly(direction);
        let [reach_a, reach_b, reach_c, length] = [largest(&a), largest(&b), largest(&c), largest(&d)];
        if !((reach_a < LARGEST) & (reach_b < LARGEST) & (reach_c < LARGEST) & (length < LARGEST)) {
            return [None; 3];
        }
        [
            Product::of(&d, &cross(&b, &c), length * reach_b * reach_c).sign(),
            Product::of(&d, &cross(&c, &a), length * reach_c * reach_a).sign(),
            Product::of(&d, &cross(&a, &b), length * reach_a * reach_b).sign(),
        ]
    }
}

struct Compared<'a> {
    triangles: [&'a Corners; 2],
    origin: &'a Vector,
    direction: &'a Vector,
}

impl Kernel for Compared<'_> {
    type Output = Option<Ordering>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Ordering> {
        let Self { triangles: [first, second], origin, direction } = self;
        let [above, below] = fraction(first, origin, direction)?;
        let [other_above, other_below] = fraction(second, origin, direction)?;
        let is_turned = below.sign()? != other_below.sign()?;
        let (left, right) = (above.value.times(other_below.value), other_above.value.times(below.value));
        let value = left.minus(right);
        // Of each product that of its factors, and of both products and their difference 14 · 2^-106.
        let of_factors = propagated(&above, &other_below) + propagated(&other_above, &below);
        let error = 16.0 * EPSILON * EPSILON * (left.head.abs() + right.head.abs()) + 1.001 * of_factors + UNDERFLOW;
        let value = value.head + value.tail;
        let sign = (value.abs() > error).then(|| order(value, 0.0))?;
        Some(if is_turned { sign.reverse() } else { sign })
    }
}

/// t is the first over the second. None where a number is too large.
#[inline(always)]
fn fraction([a, b, c]: &Corners, origin: &Vector, direction: &Vector) -> Option<[Product; 2]> {
    let (to_corner, e1, e2) = (differences(a, origin), differences(b, a), differences(c, a));
    let d = exactly(direction);
    let [reach, side1, side2, length] = [largest(&to_corner), largest(&e1), largest(&e2), largest(&d)];
    let in_range = (reach < LARGEST) & (side1 < LARGEST) & (side2 < LARGEST) & (length < LARGEST);
    let normal = cross(&e1, &e2);
    in_range.then_some([
        Product::of(&to_corner, &normal, reach * side1 * side2),
        Product::of(&d, &normal, length * side1 * side2),
    ])
}

/// What the errors of two factors do to their product.
#[inline(always)]
fn propagated(a: &Product, b: &Product) -> f64 {
    a.value.head.abs() * b.error + b.value.head.abs() * a.error + a.error * b.error
}

#[inline(always)]
fn exactly(v: &Vector) -> PairVector {
    [Pair::of(v[0]), Pair::of(v[1]), Pair::of(v[2])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact;

    /// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Rays that pass a vertex or an edge of a triangle as nearly as doubles allow, and another triangle at that vertex.
    /// Some meet it: of these no pair tells.
    #[test]
    fn what_pairs_tell_is_true_and_nearly_all() {
        let mut state = 1;
        let (mut signs, mut told, mut orders, mut ordered) = (0, 0, 0, 0);
        for round in 0..3_000 {
            // At 1 differences are exact, and so the ray at the vertex meets it.
            let scale = [1.1, 1e-9, 1e12, 1e40, 1.0][round % 5];
            let mut point = || -> Vector { std::array::from_fn(|_| scale * random(&mut state)) };
            let first: Corners = std::array::from_fn(|_| point());
            let second = [first[1], point(), point()];
            let origin = point();
            let target: Vector = match round % 3 {
                0 => first[1],
                1 => std::array::from_fn(|i| 0.5 * (first[0][i] + first[1][i])),
                _ => std::array::from_fn(|i| first[0][i] + 0.3 * (first[1][i] - first[0][i])),
            };
            let direction: Vector = std::array::from_fn(|i| (target[i] - origin[i]) / scale);
            let truth = exact::edges(&first, &origin, &direction).map(|edge| edge.sign());
            for (said, truth) in edge_signs(&first, &origin, &direction).into_iter().zip(truth) {
                signs += 1;
                if let Some(said) = said {
                    told += 1;
                    assert_eq!(said, truth, "{first:?} {origin:?} {direction:?}");
                }
            }
            let said = compare_distances(&first, &second, &origin, &direction);
            orders += 1;
            if let Some(said) = said {
                ordered += 1;
                let truth = exact::compare_distances(&first, &second, &origin, &direction).0;
                assert_eq!(said, truth, "{first:?} {second:?} {origin:?} {direction:?}");
            }
        }
        assert!(
            20 * told > 18 * signs && 20 * ordered > 18 * orders && told < signs,
            "{told} of {signs}, {ordered} of {orders}"
        );
    }

    /// Beyond the range and at true zeros they say nothing.
    #[test]
    fn what_pairs_cannot_know() {
        let triangle: Corners = [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [-1.0, -1.0, 1.0]];
        let through_a_vertex = edge_signs(&triangle, &[0.5, 0.0, 0.0], &[0.5, 0.0, 1.0]);
        assert_eq!(through_a_vertex, [Some(Ordering::Greater), None, None]);
        let turned = [triangle[1], triangle[2], triangle[0]];
        assert_eq!(compare_distances(&triangle, &turned, &[0.0; 3], &[0.0, 0.0, 1.0]), None);
        let far = triangle.map(|corner| corner.map(|x| 1e60 * x));
        assert_eq!(edge_signs(&far, &[0.0; 3], &[0.0, 0.0, 1.0]), [None; 3]);
        assert_eq!(compare_distances(&far, &triangle, &[0.0; 3], &[0.0, 0.0, 1.0]), None);
    }
}
