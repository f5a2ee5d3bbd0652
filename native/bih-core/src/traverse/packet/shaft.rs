//! Eight triangles against all rays of a packet: which of them none of the rays can meet.

use super::extremes::Extremes;
use super::triangles::{LeafTriangles, cross, dot, minus};
use crate::geometry::Bounds;
use crate::simd::{Lanes, Mask};

/// More than all roundings of an edge value, in units of the longest edge times the moment: docs/accuracy.md, section 4.
const ERROR: f32 = 1.0 / (1 << 15) as f32;
/// Added where products may have lost all bits to underflow.
const LEAST: f32 = 1e-36;

/// What holds all rays of a packet (Haines and Wallace, "Shaft Culling for Efficient Ray-Traced Radiosity", 1994): each
/// origin is the middle one and no more than a spread away from it along each axis, and so is each direction.
///
/// All lanes are the same.
pub(super) struct Shaft<L> {
    origin: [L; 3],
    direction: [L; 3],
    direction_spread: [L; 3],
    /// The components of (o − middle) × d are no larger.
    moment_spread: [L; 3],
    /// Of an edge value, in units of the longest edge.
    error: L,
}

impl<L: Lanes> Shaft<L> {
    #[inline(always)]
    pub fn new(rays: &Extremes<L>, bounds: &Bounds) -> Self {
        let (half, zero) = (L::splat(0.5), L::splat(0.0));
        let [mut origin, mut spread, mut direction, mut direction_spread, mut longest, mut reach] = [[zero; 3]; 6];
        for axis in 0..3 {
            let [a, b] = [rays.least_origin[axis], rays.most_origin[axis]];
            origin[axis] = a.plus(b).times(half);
            spread[axis] = b.minus(a).times(half);
            let [a, b] = [rays.least_direction[axis], rays.most_direction[axis]];
            direction[axis] = a.plus(b).times(half);
            direction_spread[axis] = b.minus(a).times(half);
            longest[axis] = direction[axis].magnitude().plus(direction_spread[axis]);
            let to_lower = origin[axis].minus(L::splat(bounds.lower[axis])).magnitude();
            let to_upper = origin[axis].minus(L::splat(bounds.upper[axis])).magnitude();
            reach[axis] = to_lower.maximum(to_upper).plus(spread[axis]).plus(origin[axis].magnitude());
        }
        let [x, y, z] = spread;
        let [dx, dy, dz] = longest;
        let moment_spread =
            [y.times(dz).plus(z.times(dy)), z.times(dx).plus(x.times(dz)), x.times(dy).plus(y.times(dx))];
        let [x, y, z] = reach;
        let moment = x.times(dy.plus(dz)).plus(y.times(dx.plus(dz))).plus(z.times(dx.plus(dy)));
        let error = moment.times(L::splat(ERROR)).plus(L::splat(LEAST));
        Self { origin, direction, direction_spread, moment_spread, error }
    }

    /// The triangles that a ray may meet.
    ///
    /// The edge value d · (e × c) of a line whose direction is within a spread η of the middle one, and whose origin within δ,
    /// is within η·|e × c| + |e|·|δ × d| of the middle line's. A line meets a triangle if its edge values have one sign.
    #[inline(always)]
    pub fn meets(&self, triangles: &LeafTriangles<L>) -> u8 {
        let LeafTriangles { v0, e1, e2, normal, longest } = triangles;
        let to_vertex = minus(v0, &self.origin);
        let u = cross(e2, &to_vertex);
        let v = cross(e1, &to_vertex);
        let w = minus(&minus(normal, &u), &v);
        let edges = [
            e1[0].magnitude().plus(e2[0].magnitude()),
            e1[1].magnitude().plus(e2[1].magnitude()),
            e1[2].magnitude().plus(e2[2].magnitude()),
        ];
        let margin = dot(&edges, &self.moment_spread).plus(longest.fused(self.error, L::splat(LEAST)));
        let ([u, u_spread], [v, v_spread], [w, w_spread]) = (self.value(&u), self.value(&v), self.value(&w));
        let (u_spread, v_spread, w_spread) = (u_spread.plus(margin), v_spread.plus(margin), w_spread.plus(margin));
        let zero = L::splat(0.0);
        // A comparison with NaN leaves nothing out.
        let below = u.plus(u_spread).below(zero).or(v.plus(v_spread).below(zero)).or(w.plus(w_spread).below(zero));
        let above = u_spread.below(u).or(v_spread.below(v)).or(w_spread.below(w));
        !below.and(above).bits()
    }

    /// The edge value of the middle line, and how far others' may be from it for their directions.
    #[inline(always)]
    fn value(&self, normal: &[L; 3]) -> [L; 2] {
        let size = [normal[0].magnitude(), normal[1].magnitude(), normal[2].magnitude()];
        [dot(normal, &self.direction), dot(&size, &self.direction_spread)]
    }
}
