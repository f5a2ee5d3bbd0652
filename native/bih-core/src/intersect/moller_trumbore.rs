//! Ray against triangle in single precision, without a division: the whole of precision `fast`, and what the
//! watertight test is filtered by.
//!
//! Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997, with the products in the order of
//! Shevtsov, Soupikov and Kapustin 2007: the normal is common to t and to the denominator. Every product and sum stands
//! where it stands: the answers are the same bits wherever they are computed.

use crate::simd::{Lanes, Mask};

/// A triangle, or eight of them, as a ray's line sees them.
///
/// With c = v₀ − o, e₁ = v₀ − v₁, e₂ = v₂ − v₀ and n = e₂ × e₁ the line meets the plane at t = n·c / n·d, where the
/// weights of the second and third vertex are (c × d)·e₂ / n·d and (c × d)·e₁ / n·d.
#[derive(Debug, Clone, Copy)]
pub struct Meeting<L> {
    /// v₀ − v₁
    pub e1: [L; 3],
    /// v₂ − v₀
    pub e2: [L; 3],
    /// |n·d|
    pub size: L,
    /// Weight of the second vertex, times `size`.
    pub u: L,
    /// Weight of the third vertex, times `size`.
    pub v: L,
    /// t, times `size`.
    pub t: L,
}

impl<L: Lanes> Meeting<L> {
    /// One ray and eight triangles, or eight rays and one.
    #[inline(always)]
    pub fn new(origin: &[L; 3], direction: &[L; 3], corners: &[[L; 3]; 3]) -> Self {
        let [v0, v1, v2] = corners;
        Self::of(&minus(v0, origin), minus(v0, v1), minus(v2, v0), direction)
    }

    /// The same of c, e₁ and e₂.
    #[inline(always)]
    pub fn of(to_vertex: &[L; 3], e1: [L; 3], e2: [L; 3], direction: &[L; 3]) -> Self {
        let normal = cross(&e2, &e1);
        let moment = cross(to_vertex, direction);
        let below = dot(&normal, direction);
        Self {
            size: below.magnitude(),
            u: dot(&moment, &e2).turned_by(below),
            v: dot(&moment, &e1).turned_by(below),
            t: dot(&normal, to_vertex).turned_by(below),
            e1,
            e2,
        }
    }

    /// Where the line meets the triangle, its boundary included, and is not parallel to it. False where anything is NaN,
    /// or where `size` has overflowed.
    #[inline(always)]
    pub fn is_inside(&self) -> L::Mask {
        let zero = L::splat(0.0);
        let weights = zero.at_most(self.u).and(zero.at_most(self.v)).and(self.u.plus(self.v).at_most(self.size));
        weights.and(zero.below(self.size)).and(self.size.at_most(L::splat(f32::MAX)))
    }
}

#[inline(always)]
fn minus<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0].minus(b[0]), a[1].minus(b[1]), a[2].minus(b[2])]
}

#[inline(always)]
fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [component(a[1], b[2], a[2], b[1]), component(a[2], b[0], a[0], b[2]), component(a[0], b[1], a[1], b[0])]
}

/// a · b − c · d; −0 less a number is its negative, whatever it is.
#[inline(always)]
fn component<L: Lanes>(a: L, b: L, c: L, d: L) -> L {
    a.fused(b, L::splat(-0.0).minus(c.times(d)))
}

#[inline(always)]
fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].fused(b[0], a[1].fused(b[1], a[2].times(b[2])))
}

/// A ray of single precision and the interval of it that counts.
#[derive(Debug, Clone, Copy)]
pub struct SingleRay {
    /// Where it starts.
    pub origin: [f32; 3],
    /// Where it goes.
    pub direction: [f32; 3],
    /// The first t that counts.
    pub t_min: f32,
    /// The last one: a finite number.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleHit {
    /// Distance.
    pub t: f32,
    /// Weight of the second vertex.
    pub u: f32,
    /// Weight of the third vertex.
    pub v: f32,
}

impl SingleRay {
    /// The same for one triangle, without lanes: what the eight are tested against.
    #[inline(always)]
    pub fn meet(&self, corners: &[[f32; 3]; 3]) -> Option<SingleHit> {
        let [v0, v1, v2] = corners;
        let minus = |a: &[f32; 3], b: &[f32; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let cross = |a: &[f32; 3], b: &[f32; 3]| {
            let component = |i: usize, j: usize| a[i].mul_add(b[j], -(a[j] * b[i]));
            [component(1, 2), component(2, 0), component(0, 1)]
        };
        let dot = |a: &[f32; 3], b: &[f32; 3]| a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]));
        let to_vertex = minus(v0, &self.origin);
        let (e1, e2) = (minus(v0, v1), minus(v2, v0));
        let normal = cross(&e2, &e1);
        let moment = cross(&to_vertex, &self.direction);
        let below = dot(&normal, &self.direction);
        let turned = |x: f32| if below.is_sign_negative() { -x } else { x };
        let (u, v) = (turned(dot(&moment, &e2)), turned(dot(&moment, &e1)));
        let size = below.abs();
        if !(u >= 0.0 && v >= 0.0 && u + v <= size && 0.0 < size && size <= f32::MAX) {
            return None;
        }
        let t = turned(dot(&normal, &to_vertex)) / size;
        (self.t_min <= t && t <= self.t_max).then_some(SingleHit { t, u: u / size, v: v / size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Kernel, Mask, dispatch_to, instruction_sets};

    struct EightAtOnce<'a> {
        ray: &'a SingleRay,
        triangles: &'a [[[f32; 3]; 3]; 8],
    }

    impl Kernel for EightAtOnce<'_> {
        type Output = [Option<SingleHit>; 8];

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let mut corners = [[L::splat(0.0); 3]; 3];
            for (corner, rows) in corners.iter_mut().enumerate() {
                for (axis, row) in rows.iter_mut().enumerate() {
                    let mut values = [0.0; 8];
                    for (value, triangle) in values.iter_mut().zip(self.triangles) {
                        *value = triangle[corner][axis];
                    }
                    *row = L::load(&values);
                }
            }
            let [x, y, z] = self.ray.origin;
            let [dx, dy, dz] = self.ray.direction;
            let origin = [L::splat(x), L::splat(y), L::splat(z)];
            let direction = [L::splat(dx), L::splat(dy), L::splat(dz)];
            let meeting = Meeting::new(&origin, &direction, &corners);
            let t = meeting.t.over(meeting.size);
            let is_within = L::splat(self.ray.t_min).at_most(t).and(t.at_most(L::splat(self.ray.t_max)));
            let is_hit = meeting.is_inside().and(is_within).bits();
            let (t, u) = (t.store(), meeting.u.over(meeting.size).store());
            let v = meeting.v.over(meeting.size).store();
            let mut hits = [None; 8];
            for (lane, hit) in hits.iter_mut().enumerate().filter(|(lane, _)| is_hit >> lane & 1 != 0) {
                *hit = Some(SingleHit { t: t[lane], u: u[lane], v: v[lane] });
            }
            hits
        }
    }

    #[test]
    fn eight_at_once_are_the_same_as_one_by_one() {
        let mut state = 1u64;
        // Small whole numbers meet edges; now and then one of any size.
        let mut number = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let small = ((state >> 33) % 7) as f32 - 3.0;
            match state >> 60 {
                0 => small * 1e30,
                1 => small * 1e-40,
                2..8 => small + (state >> 40 & 0xffff) as f32 * 1e-5,
                _ => small,
            }
        };
        let mut hits = 0;
        for _ in 0..20_000 {
            let triangles = std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| number())));
            let [origin, direction] = std::array::from_fn(|_| std::array::from_fn(|_| number()));
            let ray = SingleRay { origin, direction, t_min: -1.0, t_max: f32::MAX };
            let expected = triangles.map(|corners| ray.meet(&corners));
            for set in instruction_sets() {
                assert_eq!(dispatch_to(*set, EightAtOnce { ray: &ray, triangles: &triangles }), expected, "{ray:?}");
            }
            hits += expected.iter().flatten().count();
        }
        assert!(hits > 1000, "{hits}");
    }
}
