//! A point and a triangle, seen from below: is the point on it, or does the way up from the point cross it?
//!
//! The way up is the z axis, so the sides of edges are those in the plane of x and y, and ties are comparisons.

use std::cmp::Ordering::{self, Equal, Greater, Less};

use super::side::{order, side};
use super::{Distance, RayTest};
use crate::geometry::{Bounds, Corners, Ray, Vector};

/// What a triangle is to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// The way up does not cross it, and the point is not on it.
    Apart,
    /// The way up crosses it.
    Above,
    /// The point is on it, its boundary included.
    Touched,
}

/// A point, prepared for tests against the triangles within some bounds.
#[derive(Debug, Clone, Copy)]
pub struct PointTest {
    point: Vector,
    up: RayTest,
}

impl PointTest {
    /// `bounds` must hold every triangle that will be tested.
    pub fn new(point: &Vector, bounds: &Bounds) -> Self {
        Self { point: *point, up: RayTest::new(&Self::way(point), bounds) }
    }

    /// The ray whose crossings tell inside from outside.
    pub fn way(point: &Vector) -> Ray {
        Ray::new(*point, [0.0, 0.0, 1.0])
    }

    /// What a triangle with area is to the point; exact.
    #[inline]
    pub fn sight(&self, corners: &Corners) -> Sight {
        let sides = self.sides(corners, 0, 1);
        if are_opposite(&sides) {
            return Sight::Apart;
        }
        if sides == [Equal; 3] {
            return self.in_its_plane(corners);
        }
        match Distance::new(&self.up, corners).compare_with(0.0, &self.up, corners) {
            Less => Sight::Apart,
            Equal => Sight::Touched,
            Greater => {
                let [a, b, c] = corners;
                let moved = [moved(sides[0], b, c), moved(sides[1], c, a), moved(sides[2], a, b)];
                if are_opposite(&moved) { Sight::Apart } else { Sight::Above }
            }
        }
    }

    /// The triangle stands upright and its plane holds the point.
    #[cold]
    fn in_its_plane(&self, corners: &Corners) -> Sight {
        // It is no line, so it has an area along x or along y, and the point is on it where it is so in that view.
        let views = [self.sides(corners, 1, 2), self.sides(corners, 2, 0)];
        let is_within = |sides: &[Ordering; 3]| *sides != [Equal; 3] && !are_opposite(sides);
        if views.iter().any(is_within) { Sight::Touched } else { Sight::Apart }
    }

    /// On which side of its three edges the point is, seen along the axis that is not `x` and not `y`.
    #[inline(always)]
    fn sides(&self, corners: &Corners, x: usize, y: usize) -> [Ordering; 3] {
        let point = [self.point[x], self.point[y]];
        let [a, b, c] = corners.map(|corner| [corner[x], corner[y]]);
        [side(&b, &c, &point).0, side(&c, &a, &point).0, side(&a, &b, &point).0]
    }
}

#[inline(always)]
fn are_opposite(sides: &[Ordering; 3]) -> bool {
    sides.contains(&Less) && sides.contains(&Greater)
}

/// The side once the point is moved by (ε, ε²): it is on neither only where a and b are one point.
#[inline(always)]
fn moved(side: Ordering, a: &Vector, b: &Vector) -> Ordering {
    side.then(order(a[1], b[1])).then(order(b[0], a[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { lower: [-10.0; 3], upper: [10.0; 3] };
    const FLAT: Corners = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]];

    fn sight(point: Vector, corners: &Corners) -> Sight {
        PointTest::new(&point, &BOX).sight(corners)
    }

    #[test]
    fn points_below_above_on_and_beside() {
        assert_eq!(sight([1.0, 1.0, 0.0], &FLAT), Sight::Above);
        assert_eq!(sight([1.0, 1.0, 2.0], &FLAT), Sight::Apart);
        assert_eq!(sight([1.0, 1.0, 1.0], &FLAT), Sight::Touched);
        assert_eq!(sight([1.0, 1.0, 1f64.next_down()], &FLAT), Sight::Above);
        for (x, y) in [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (2.0, 2.0), (0.0, 1.0)] {
            assert_eq!(sight([x, y, 1.0], &FLAT), Sight::Touched, "({x}, {y})");
        }
        for (x, y) in [(-1e-300, 0.0), (2f64.next_up(), 2.0), (1.0, -5e-324), (5.0, 0.0)] {
            assert_eq!(sight([x, y, 1.0], &FLAT), Sight::Apart, "({x}, {y})");
            assert_eq!(sight([x, y, 0.0], &FLAT), Sight::Apart, "({x}, {y})");
        }
    }

    #[test]
    fn points_on_upright_triangles() {
        for axis in 0..3 {
            let turned = |p: Vector| -> Vector { std::array::from_fn(|i| p[(i + axis) % 3]) };
            let corners = FLAT.map(turned);
            for (x, y, expected) in [
                (1.0, 1.0, Sight::Touched),
                (0.0, 0.0, Sight::Touched),
                (2.0, 2.0, Sight::Touched),
                (0.0, 4.0, Sight::Touched),
                (2.0, 2f64.next_up(), Sight::Apart),
                (-1.0, 1.0, Sight::Apart),
            ] {
                assert_eq!(sight(turned([x, y, 1.0]), &corners), expected, "axis {axis}: ({x}, {y})");
            }
        }
    }

    #[test]
    fn a_shared_edge_is_crossed_once() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, y]| [x, y, 3.0]);
        let [a, b, c, d] = corners;
        for halves in [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]], [[c, b, a], [a, c, d]]] {
            let mut seen = 0;
            for (x, y) in (-1..=5).flat_map(|x| (-1..=5).map(move |y| (f64::from(x), f64::from(y)))) {
                let above = halves.iter().filter(|half| sight([x, y, 0.0], half) == Sight::Above).count();
                // Moved by (ε, ε²): the lower sides belong to the square, the upper ones do not.
                assert_eq!(above, usize::from((0.0..4.0).contains(&x) && (0.0..4.0).contains(&y)), "({x}, {y})");
                seen += above;
            }
            assert_eq!(seen, 16);
        }
    }
}
