//! Where a line crosses a surface: each crossing counts once, also where it is at an edge or a vertex.
//!
//! The origin is moved by (ε, ε², ε³) for an ε that is smaller than any number: then the line meets no edge, and lies in
//! no triangle (Edelsbrunner and Mücke 1990, "Simulation of Simplicity"). docs/accuracy.md derives the signs.

use super::{RayTest, exact};
use crate::geometry::Corners;

impl RayTest {
    /// Whether the line of the ray, moved by less than any number, crosses the triangle; exact. Then it meets the closed
    /// triangle where it is, too.
    #[inline(always)]
    pub fn crosses(&self, corners: &Corners) -> bool {
        self.is_clearly_inside(corners).unwrap_or_else(|| self.crosses_exactly(corners))
    }

    #[cold]
    fn crosses_exactly(&self, corners: &Corners) -> bool {
        corners.iter().flatten().all(|x| x.is_finite()) && exact::is_crossed(corners, &self.origin, &self.direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Bounds, Ray, Vector};

    const BOX: Bounds = Bounds { lower: [-10.0; 3], upper: [10.0; 3] };

    /// The triangles around the origin that a closed disc of the plane z = height is cut into.
    fn disc(height: f64) -> Vec<Corners> {
        let rim =
            [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]];
        let at = |i: usize| [rim[i % 8][0], rim[i % 8][1], height];
        (0..8).map(|i| [[0.0, 0.0, height], at(i), at(i + 1)]).collect()
    }

    fn crossings(triangles: &[Corners], origin: Vector, direction: Vector) -> usize {
        let test = RayTest::new(&Ray::new(origin, direction), &BOX);
        triangles.iter().filter(|corners| test.crosses(corners)).count()
    }

    #[test]
    fn a_surface_is_crossed_once_at_every_vertex_and_edge() {
        let disc = disc(2.0);
        for (x, y) in [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, -0.25), (0.25, 0.125), (-0.5, 0.5)] {
            for direction in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [-0.0, -0.0, 0.5], [1.0, 0.0, 4.0], [0.25, -0.5, 1.0]]
            {
                let t = 2.0 / direction[2];
                let origin = [x - t * direction[0], y - t * direction[1], 0.0];
                assert_eq!(crossings(&disc, origin, direction), 1, "({x}, {y}) {direction:?}");
            }
        }
    }

    #[test]
    fn the_rim_is_crossed_on_the_side_that_the_origin_is_moved_to() {
        // Moved by (ε, ε²): into the disc at its lower x, out of it at its upper x; where x does not matter, y does.
        let disc = disc(2.0);
        let up = [0.0, 0.0, 1.0];
        for (x, y, expected) in [(-1.0, 0.5, 1), (1.0, 0.5, 0), (0.5, -1.0, 1), (0.5, 1.0, 0), (1.0, 1.0, 0)] {
            assert_eq!(crossings(&disc, [x, y, 0.0], up), expected, "({x}, {y})");
        }
    }

    #[test]
    fn a_line_in_the_plane_crosses_nothing() {
        let disc = disc(2.0);
        for direction in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 0.5, 0.0]] {
            assert_eq!(crossings(&disc, [0.0, 0.0, 2.0], direction), 0);
        }
        assert_eq!(crossings(&[[[0.0; 3], [1.0; 3], [3.0; 3]], [[1.0; 3]; 3]], [0.0; 3], [1.0, 1.0, 1.0]), 0);
    }
}
