//! Hit or miss, without a gap between triangles that share an edge or a vertex, and without a false hit.
//!
//! The test is on the signs of the three edge values d · (b × c), d · (c × a), d · (a × b) of the corners a, b, c taken
//! relative to the origin of the ray. They are computed in double precision; where rounding could have changed a sign
//! that matters, whole numbers decide. docs/accuracy.md derives the bounds.

use std::array::from_fn;
use std::cmp::Ordering;

use super::distance::{Approximation, triple_product};
use super::double_double::{Pair, difference, two_product};
use super::side::{Place, SMALLEST, side};
use super::{EPSILON, Means, exact, pairs};
use crate::geometry::{Bounds, Corners, Ray, Vector, cross, dot, subtract};

/// Products of three numbers of at most twice this size do not overflow.
pub(super) const LARGEST: f64 = 1e90;
/// More than the roundings of subnormal products can add up to while every factor is below `LARGEST`.
pub(super) const UNDERFLOW: f64 = 1e-200;

/// A ray, prepared for tests against the triangles within some bounds.
#[derive(Debug, Clone, Copy)]
pub struct RayTest {
    pub(super) origin: Vector,
    pub(super) direction: Vector,
    /// No edge value of a triangle within the bounds is further than this from its true value.
    edge_error: f64,
}

impl RayTest {
    /// `bounds` must hold every triangle that will be tested.
    pub fn new(ray: &Ray, bounds: &Bounds) -> Self {
        let reach: Vector = std::array::from_fn(|axis| {
            let to = |x: f32| (f64::from(x) - ray.origin[axis]).abs();
            to(bounds.lower[axis]).max(to(bounds.upper[axis]))
        });
        let [x, y, z] = reach;
        let [dx, dy, dz] = ray.direction.map(f64::abs);
        // Seven roundings reach an edge value, on at most twice this sum; the rest covers those made here.
        let error = 18.0 * EPSILON * (dx * y * z + dy * x * z + dz * x * y) + UNDERFLOW;
        let in_range = [x, y, z, dx, dy, dz].iter().all(|&value| value < LARGEST);
        let edge_error = if in_range { error } else { f64::INFINITY };
        Self { origin: ray.origin, direction: ray.direction, edge_error }
    }

    /// The same for triangles that were rounded: no coordinate is off by more than `off` along its axis.
    pub(super) fn of_rounded(ray: &Ray, bounds: &Bounds, off: &Vector) -> Self {
        let exact = Self::new(ray, bounds);
        let reach = |axis: usize| {
            let to = |x: f32| (f64::from(x) - ray.origin[axis]).abs();
            to(bounds.lower[axis]).max(to(bounds.upper[axis])) + off[axis]
        };
        // Two products of each component, both factors of which are off.
        let moved: f64 = (0..3)
            .map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                2.0 * ray.direction[i].abs() * (off[j] * reach(k) + off[k] * reach(j) + off[j] * off[k])
            })
            .sum();
        Self { edge_error: exact.edge_error + (1.0 + 16.0 * EPSILON) * moved, ..exact }
    }

    /// Whether double precision holds all products of this ray and the triangles within the bounds.
    pub(super) fn is_in_range(&self) -> bool {
        self.edge_error < f64::INFINITY
    }

    /// The edge values, each within `edge_error` of the truth. Their sum is the denominator of `t`.
    #[inline(always)]
    fn edges(&self, corners: &Corners) -> [f64; 3] {
        let a = subtract(&corners[0], &self.origin);
        let b = subtract(&corners[1], &self.origin);
        let c = subtract(&corners[2], &self.origin);
        let d = &self.direction;
        [dot(d, &cross(&b, &c)), dot(d, &cross(&c, &a)), dot(d, &cross(&a, &b))]
    }

    /// Whether the line of the ray meets the triangle, where the edge values are far enough from zero to tell.
    #[inline(always)]
    pub(super) fn is_clearly_inside(&self, corners: &Corners) -> Option<bool> {
        let edges = self.edges(corners);
        let error = self.edge_error;
        let least = edges[0].min(edges[1]).min(edges[2]);
        let most = edges[0].max(edges[1]).max(edges[2]);
        if least < -error && most > error {
            return Some(false);
        }
        let is_one_side = edges.iter().all(|&edge| edge > error) || edges.iter().all(|&edge| edge < -error);
        is_one_side.then_some(true)
    }

    /// Whether the line of the ray meets the closed triangle; exact.
    #[inline(always)]
    pub fn is_inside(&self, corners: &Corners) -> bool {
        self.inside(corners).0
    }

    /// The same, and what it takes to tell.
    #[inline(always)]
    pub fn inside(&self, corners: &Corners) -> (bool, Means) {
        match self.is_clearly_inside(corners) {
            Some(is_inside) => (is_inside, Means::Double),
            None => self.is_inside_exactly(corners),
        }
    }

    /// By one means after another.
    #[cold]
    #[inline(never)]
    fn is_inside_exactly(&self, corners: &Corners) -> (bool, Means) {
        if !corners.as_flattened().iter().all(|x| x.is_finite()) {
            return (false, Means::Double);
        }
        if let Some(axis) = self.axis() {
            let sides = self.sides(corners, axis);
            let means = sides.iter().map(|side| side.1).max().unwrap_or(Means::Double);
            return (are_on_one_side(&sides.map(|side| Some(side.0))), means);
        }
        let mut known = [None; 3];
        if self.is_in_range() {
            let is_zero = self.zero_edges(corners);
            known = self.signs(corners);
            known = from_fn(|edge| if is_zero[edge] { Some(Ordering::Equal) } else { known[edge] });
            if is_settled(&known) {
                return (are_on_one_side(&known), Means::Double);
            }
            let by_pairs = pairs::edge_signs(corners, &self.origin, &self.direction);
            known = from_fn(|edge| known[edge].or(by_pairs[edge]));
            if is_settled(&known) {
                return (are_on_one_side(&known), Means::Pairs);
            }
        }
        exact::is_inside(corners, &self.origin, &self.direction, known)
    }

    /// The signs of the edge values that error bounds of the triangle's own distances tell, which are smaller than the
    /// scene's.
    fn signs(&self, corners: &Corners) -> [Option<Ordering>; 3] {
        let [a, b, c] = corners.map(|corner| subtract(&corner, &self.origin));
        let d = &self.direction;
        let edges = [triple_product(d, &b, &c), triple_product(d, &c, &a), triple_product(d, &a, &b)];
        edges.map(|Approximation { value, error }| if value.abs() > error { value.partial_cmp(&0.0) } else { None })
    }

    /// The axis that the ray runs along, if there is one.
    pub(super) fn axis(&self) -> Option<usize> {
        match self.direction.map(|x| x == 0.0) {
            [false, true, true] => Some(0),
            [true, false, true] => Some(1),
            [true, true, false] => Some(2),
            _ => None,
        }
    }

    /// Whether the weights of the second and third vertex are known to be zero, of a triangle that the line meets.
    pub(super) fn zero_weights(&self, corners: &Corners) -> [bool; 2] {
        let [_, second, third] = match self.axis() {
            Some(axis) => self.sides(corners, axis).map(|side| side.0 == Ordering::Equal),
            None => self.zero_edges(corners),
        };
        [second, third]
    }

    /// Which edge values are zero because the line goes through an end of the edge, or lies with it in a plane across an
    /// axis. Others may be zero too.
    fn zero_edges(&self, corners: &Corners) -> [bool; 3] {
        let is_met = corners.map(|corner| self.meets(&corner));
        from_fn(|edge| {
            let (start, end) = ((edge + 1) % 3, (edge + 2) % 3);
            is_met[start] || is_met[end] || self.is_level_with(&corners[start], &corners[end])
        })
    }

    /// Whether the line goes through a point, where products of two doubles tell: the point's distances from the origin
    /// are to each other as the components of the direction.
    pub(super) fn meets(&self, point: &Vector) -> bool {
        let to_point: [Pair; 3] = from_fn(|axis| difference(point[axis], self.origin[axis]));
        let in_range = |x: f64| x == 0.0 || (SMALLEST..1.0 / SMALLEST).contains(&x.abs());
        (0..3).all(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (p, q) = (to_point[j].head * self.direction[k], to_point[k].head * self.direction[j]);
            p == q
                && two_product(to_point[j].head, self.direction[k]).tail
                    == two_product(to_point[k].head, self.direction[j]).tail
        }) && to_point.iter().all(|x| x.tail == 0.0 && in_range(x.head))
            && self.direction.iter().all(|&x| in_range(x))
    }

    /// Whether the line and both points lie in one plane across an axis.
    pub(super) fn is_level_with(&self, a: &Vector, b: &Vector) -> bool {
        (0..3).any(|i| self.direction[i] == 0.0 && a[i] == self.origin[i] && b[i] == self.origin[i])
    }

    /// What is left of the edge values' signs for a ray along an axis: which way round they are is not told. What it
    /// takes to tell, too.
    fn sides(&self, corners: &Corners, axis: usize) -> [(Ordering, Means); 3] {
        let [a, b, c] = corners.map(|corner| seen_along(axis, &corner));
        let origin = seen_along(axis, &self.origin);
        [side(&b, &c, &origin), side(&c, &a, &origin), side(&a, &b, &origin)]
    }
}

/// A point in the plane across an axis.
pub(super) fn seen_along(axis: usize, point: &Vector) -> Place {
    [point[(axis + 1) % 3], point[(axis + 2) % 3]]
}

/// Whether signs of edge values, as far as they are known, tell whether the line meets the triangle.
fn is_settled(known: &[Option<Ordering>; 3]) -> bool {
    !known.contains(&None) || [Ordering::Less, Ordering::Greater].iter().all(|&sign| known.contains(&Some(sign)))
}

/// Whether the line meets the triangle: no two signs are opposite, and not all are zero.
fn are_on_one_side(signs: &[Option<Ordering>; 3]) -> bool {
    signs.contains(&Some(Ordering::Less)) != signs.contains(&Some(Ordering::Greater))
}

/// Whether the corners, all finite, lie on a line: nothing can hit such a triangle.
pub fn has_no_area(corners: &Corners) -> bool {
    let a = subtract(&corners[1], &corners[0]);
    let b = subtract(&corners[2], &corners[0]);
    let in_range = a.iter().chain(&b).all(|x| x.abs() < LARGEST);
    let has_area = (0..3).any(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = (a[j] * b[k], a[k] * b[j]);
        // Two roundings of the differences, one of each product, one of their difference.
        (p - q).abs() > 5.0 * EPSILON * (p.abs() + q.abs()) + UNDERFLOW
    });
    !(in_range && has_area) && exact::is_degenerate(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAR: Bounds = Bounds { lower: [-10.0; 3], upper: [10.0; 3] };
    const TRIANGLE: Corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];

    fn hits(origin: Vector, direction: Vector) -> bool {
        RayTest::new(&Ray::new(origin, direction), &FAR).is_inside(&TRIANGLE)
    }

    #[test]
    fn the_boundary_is_hit_and_what_is_a_bit_outside_is_not() {
        let up = [0.0, 0.0, 1.0];
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.25, 0.25)] {
            assert!(hits([x, y, 0.0], up), "({x}, {y})");
        }
        let tiny = f64::MIN_POSITIVE / 1024.0;
        for (x, y) in [(-tiny, 0.0), (0.0, -1e-300), (1.0, tiny), (0.5f64.next_up(), 0.5), (-1.0, 0.5)] {
            assert!(!hits([x, y, 0.0], up), "({x}, {y})");
        }
    }

    #[test]
    fn a_ray_in_the_plane_misses() {
        assert!(!hits([-1.0, 0.25, 1.0], [1.0, 0.0, 0.0]));
    }

    #[test]
    fn flat_triangles_have_no_area_and_slivers_have() {
        assert!(has_no_area(&[[0.1, 0.2, 0.3]; 3]));
        assert!(has_no_area(&[[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0]]));
        assert!(has_no_area(&[[1e300; 3], [-1e300; 3], [0.0; 3]]));
        assert!(!has_no_area(&[[0.0; 3], [1.0, 2.0, 3.0], [2.0, 4.0, 6.0f64.next_up()]]));
        assert!(!has_no_area(&[[0.0; 3], [1e-300, 0.0, 0.0], [0.0, 1e-300, 0.0]]));
    }

    /// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Rays that show that half of the bound is too little are not known (docs/accuracy.md), so it is held against what
    /// was derived: seven roundings, of twice the sum of the products.
    #[test]
    fn the_bound_is_not_less_than_what_was_derived() {
        let state = &mut 3;
        for _ in 0..1_000 {
            let mut point = || -> Vector { std::array::from_fn(|_| 20.0 * random(state)) };
            let ray = Ray::new(point(), point());
            let reach: Vector = std::array::from_fn(|axis| 10.0 + ray.origin[axis].abs());
            let [dx, dy, dz] = ray.direction.map(f64::abs);
            let sum = dx * reach[1] * reach[2] + dy * reach[0] * reach[2] + dz * reach[0] * reach[1];
            let derived = 7.1 * EPSILON * 2.0 * sum;
            let used = RayTest::new(&ray, &FAR).edge_error;
            // Not twice as large either: more rays than need be would be decided in whole numbers.
            assert!(derived < used && used < 1.4 * derived, "{ray:?}");
        }
    }

    #[test]
    fn what_the_filter_decides_is_true() {
        let state = &mut 1;
        let mut inside = 0;
        for _ in 0..20_000 {
            let mut point = || -> Vector { std::array::from_fn(|_| random(state)) };
            let corners = [point(), point(), point()];
            let origin = point().map(|x| 3.0 * x);
            // At a point of an edge, as near as doubles come.
            let weight = random(state);
            let target: Vector = std::array::from_fn(|i| corners[0][i] + weight * (corners[1][i] - corners[0][i]));
            let ray = Ray::new(origin, subtract(&target, &origin));
            let (truth, _) = exact::is_inside(&corners, &ray.origin, &ray.direction, [None; 3]);
            assert_eq!(RayTest::new(&ray, &FAR).is_inside(&corners), truth, "{corners:?} {ray:?}");
            inside += usize::from(truth);
        }
        // Half of the weights lie on the edge, and half of those fall inside.
        assert!((4_000..6_000).contains(&inside), "{inside}");
    }

    /// Rays through vertices, which multiples of a direction lead to, and rays in planes across an axis that hold an edge.
    #[test]
    fn zeros_that_need_no_arithmetic_are_zeros() {
        let state = &mut 7;
        let (mut known, mut all) = (0, 0);
        for round in 0..6_000 {
            let mut number = || (256.0 * random(state)).round() / 64.0;
            let mut corners: Corners = from_fn(|_| from_fn(|_| number()));
            let direction: Vector = from_fn(|axis| if axis == round % 4 { 0.0 } else { number() });
            let steps = [1.0, 0.5, 3.0][round % 3];
            let nudge = if round % 5 == 0 { f64::EPSILON } else { 0.0 };
            let mut origin: Vector = from_fn(|i| corners[round % 2][i] - steps * direction[i] + nudge);
            if round % 3 == 0 && round % 4 < 3 {
                corners[2][round % 4] = corners[round % 2][round % 4];
                origin = from_fn(|i| if i == round % 4 { corners[2][i] } else { number() });
            }
            let test = RayTest::new(&Ray::new(origin, direction), &FAR);
            let truth = exact::edges(&corners, &origin, &direction).map(|edge| edge.sign() == Ordering::Equal);
            for (is_known, is_true) in test.zero_edges(&corners).into_iter().zip(truth) {
                assert!(is_true || !is_known, "{corners:?} {origin:?} {direction:?}");
                (known, all) = (known + usize::from(is_known), all + usize::from(is_true));
            }
            assert_eq!(test.is_inside(&corners), exact::is_inside(&corners, &origin, &direction, [None; 3]).0);
        }
        assert!(known > 5_000 && 100 * known > 95 * all, "{known} of {all}");
    }

    /// Rays along an axis through vertices, through points of edges and in planes that hold an edge, of either precision.
    #[test]
    fn along_an_axis_sides_tell() {
        let state = &mut 5;
        let (mut inside, mut zero) = (0, 0);
        for round in 0..6_000 {
            let mut point = || -> Vector {
                let p: Vector = std::array::from_fn(|_| random(state));
                if round % 2 == 0 { p.map(|x| f64::from(x as f32)) } else { p }
            };
            let mut corners = [point(), point(), point()];
            let axis = round % 3;
            if round % 7 == 0 {
                corners[1][axis] = corners[0][axis];
            }
            let mut origin: Vector = match round % 5 {
                0 => std::array::from_fn(|i| 0.5 * (corners[0][i] + corners[1][i])),
                1 => corners[2],
                2 => [corners[0][0], corners[1][1], corners[0][2]],
                _ => corners[1],
            };
            origin[axis] = -4.0;
            let mut direction = [0.0; 3];
            direction[axis] = if round % 11 == 0 { -0.3 } else { 0.7 };
            let test = RayTest::new(&Ray::new(origin, direction), &FAR);
            let (truth, _) = exact::is_inside(&corners, &origin, &direction, [None; 3]);
            assert_eq!(test.is_inside(&corners), truth, "{corners:?} {origin:?} {direction:?}");
            inside += usize::from(truth);
            if truth {
                let weights = exact::weights(&corners, &origin, &direction);
                for (is_zero, weight) in test.zero_weights(&corners).into_iter().zip(weights) {
                    assert_eq!(is_zero, weight == 0.0, "{corners:?} {origin:?} {direction:?}");
                    zero += usize::from(is_zero);
                }
            }
        }
        assert!(inside > 3_000 && zero > 2_000, "{inside} {zero}");
    }
}
