//! The bounds of what lies of a triangle in a cell, never too small: "perfect splits" (Wald and Havran 2006;
//! Havran and Bittner 2002, "On Improving KD-Trees for Ray Shooting").
//!
//! The triangle is clipped by the six planes in turn (Sutherland and Hodgman 1974), in double precision. Let u = 2^-53
//! and M the largest coordinate of a corner. A new vertex a + t (b − a), t = (c − a)/(b − a), carries three roundings in
//! t, two in the product of at most 2 M, one in the sum: it is within 11 u M, say ε = 12 u M, of the true point on its
//! edge; on the clipping axis it is exact. So that no rounding drops what lies inside, each plane is moved outward by δ.
//!
//! Why that suffices: let m be the axis on which the normal is longest, and see the polygon along m. The triangle's
//! plane is a function g there with slopes of at most 1. After k planes each vertex lies within 3 k ε of g: interpolation
//! keeps the distance, the roundings add ε on each axis. Claim: every point of triangle and cell is enclosed by the
//! polygon, or within k ε of it. A plane across another axis than m cuts the polygon as drawn: a point inside it stays
//! enclosed, or within k ε of a part that is kept as δ > k ε, and the new vertices add ε. A plane across m removes parts
//! whose every point has g > c + δ − 3 k ε − ε, and a point of the cell is nearer than that: it has g <= c, and at k ε
//! from the polygon g changes by 2 k ε at most. So δ > (2 k + 3 k + 1) ε is enough, 31 ε = 372 u M after all six, and
//! on m the bounds of the vertices, 3 k ε + 2 k ε too narrow at most, are made wider by as much. δ = 512 u M.

use std::array::from_fn;

use crate::geometry::{Bounds, Corners, Vector, round_down, round_up};

/// δ / M
const MARGIN: f64 = 256.0 * f64::EPSILON;

/// A plane adds one vertex to a convex polygon; with rounding it may be a little less than convex.
const VERTICES: usize = 16;

/// Corners of a polygon, in order.
struct Polygon {
    vertices: [Vector; VERTICES],
    len: usize,
}

impl Polygon {
    /// None where there is no room left.
    fn push(&mut self, vertex: Vector) -> Option<()> {
        *self.vertices.get_mut(self.len)? = vertex;
        self.len += 1;
        Some(())
    }

    fn vertices(&self) -> &[Vector] {
        &self.vertices[..self.len]
    }

    /// What lies on the side of `plane` where `sign` times the coordinate is not larger.
    fn clipped(&self, axis: usize, sign: f64, plane: f64) -> Option<Self> {
        let beyond = |vertex: &Vector| sign * (vertex[axis] - plane) > 0.0;
        let mut kept = Self { vertices: [[0.0; 3]; VERTICES], len: 0 };
        let mut previous = self.vertices().last()?;
        for vertex in self.vertices() {
            if beyond(vertex) != beyond(previous) {
                let (inside, outside) = if beyond(vertex) { (previous, vertex) } else { (vertex, previous) };
                kept.push(crossing(inside, outside, axis, plane))?;
            }
            if !beyond(vertex) {
                kept.push(*vertex)?;
            }
            previous = vertex;
        }
        Some(kept)
    }
}

/// Where the edge from a to b crosses the plane.
fn crossing(a: &Vector, b: &Vector, axis: usize, plane: f64) -> Vector {
    let t = (plane - a[axis]) / (b[axis] - a[axis]);
    from_fn(|i| if i == axis { plane } else { a[i] + t * (b[i] - a[i]) })
}

/// Bounds of triangle and cell, within both `bounds`, which hold the triangle or the part of it that matters, and the
/// cell; none only where nothing of the triangle lies in them.
pub fn clip(corners: &Corners, bounds: &Bounds, cell: &Bounds) -> Option<Bounds> {
    let coarse = intersection(bounds, cell)?;
    let largest = corners.iter().flatten().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if largest > f64::from(f32::MAX) {
        return Some(coarse);
    }
    let margin = MARGIN * largest + f64::MIN_POSITIVE;
    let mut polygon = Polygon { vertices: [[0.0; 3]; VERTICES], len: 3 };
    polygon.vertices[..3].copy_from_slice(corners);
    for axis in 0..3 {
        for (sign, plane) in [(-1.0, f64::from(coarse.lower[axis])), (1.0, f64::from(coarse.upper[axis]))] {
            let plane = plane + sign * margin;
            if polygon.vertices().iter().any(|vertex| sign * (vertex[axis] - plane) > 0.0) {
                match polygon.clipped(axis, sign, plane) {
                    Some(clipped) => polygon = clipped,
                    None => return Some(coarse),
                }
            }
            if polygon.len == 0 {
                return None;
            }
        }
    }
    let of_polygon = Bounds {
        // Adding +0 makes -0 a +0, as in every other bounds.
        lower: from_fn(|axis| round_down(extreme(&polygon, axis, f64::min) - margin) + 0.0),
        upper: from_fn(|axis| round_up(extreme(&polygon, axis, f64::max) + margin) + 0.0),
    };
    intersection(&of_polygon, &coarse)
}

fn extreme(polygon: &Polygon, axis: usize, choose: fn(f64, f64) -> f64) -> f64 {
    let first = polygon.vertices[0][axis];
    polygon.vertices().iter().fold(first, |x, vertex| choose(x, vertex[axis]))
}

/// What both hold.
fn intersection(a: &Bounds, b: &Bounds) -> Option<Bounds> {
    let both = Bounds {
        lower: from_fn(|axis| a.lower[axis].max(b.lower[axis])),
        upper: from_fn(|axis| a.upper[axis].min(b.upper[axis])),
    };
    (0..3).all(|axis| both.lower[axis] <= both.upper[axis]).then_some(both)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn inside(point: &Vector, bounds: &Bounds) -> bool {
        (0..3).all(|i| f64::from(bounds.lower[i]) <= point[i] && point[i] <= f64::from(bounds.upper[i]))
    }

    #[test]
    fn a_corner_is_cut_to_its_cell() {
        let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 4.0]];
        let bounds = Bounds::of_triangle(&corners);
        let cell = Bounds { lower: [1.0, 0.0, 0.0], upper: [4.0; 3] };
        let clipped = clip(&corners, &bounds, &cell).unwrap();
        assert_eq!((clipped.lower, clipped.upper[0]), ([1.0, 0.0, 0.0], 4.0));
        for axis in 1..3 {
            assert!((3.0..3.0f32.next_up().next_up()).contains(&clipped.upper[axis]), "{clipped:?}");
        }
        let beside = Bounds { lower: [3.0, 3.0, 0.0], upper: [4.0; 3] };
        assert_eq!(clip(&corners, &bounds, &beside), None);
    }

    /// Sixteenths, so that sums of them times sixteenths are exact.
    fn coordinate() -> impl Strategy<Value = f64> {
        prop_oneof![(-8i32..=8).prop_map(f64::from), (-128i32..=128).prop_map(|x| f64::from(x) / 16.0)]
    }

    fn point() -> impl Strategy<Value = Vector> {
        proptest::collection::vec(coordinate(), 3).prop_map(|v| [v[0], v[1], v[2]])
    }

    proptest! {
        /// Points of the triangle whose coordinates are exact: those in the cell must be in the bounds.
        #[test]
        fn no_point_is_lost(corners in proptest::collection::vec(point(), 3), a in point(), b in point(), scale in -40i32..40) {
            let scale = 2f64.powi(scale);
            let corners: Corners = from_fn(|i| corners[i].map(|x| x * scale));
            let cell = Bounds {
                lower: from_fn(|i| (a[i].min(b[i]) * scale) as f32),
                upper: from_fn(|i| (a[i].max(b[i]) * scale) as f32),
            };
            let clipped = clip(&corners, &Bounds::of_triangle(&corners), &cell);
            if let Some(clipped) = clipped {
                prop_assert!(cell.contains(&clipped) && Bounds::of_triangle(&corners).contains(&clipped));
            }
            for u in 0..=16 {
                for v in 0..=16 - u {
                    let [u, v] = [f64::from(u) / 16.0, f64::from(v) / 16.0];
                    let p: Vector = from_fn(|i| corners[0][i] * (1.0 - u - v) + corners[1][i] * u + corners[2][i] * v);
                    if inside(&p, &cell) {
                        prop_assert!(clipped.is_some_and(|clipped| inside(&p, &clipped)), "{p:?} {clipped:?}");
                    }
                }
            }
        }
    }
}
