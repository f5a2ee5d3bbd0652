//! The way of a ray into the space of a mesh: not exact, but how far it may be off is known.

use std::array::from_fn;

use super::affine::Affine;
use crate::geometry::{Bounds, Ray, Vector, cross, dot, subtract};
use crate::intersect::EPSILON;
use crate::traverse::Aim;

/// The product of the inverse and the matrix may differ by so much from the identity, in the sum of a row: an object's
/// boxes grow by that part of its size, and the bounds of docs/accuracy.md hold.
const LARGEST_RESIDUAL: f64 = 1.0 / (1u32 << 12) as f64;
/// Factors are zero or of a size within this and its inverse, and components of directions are above it: neither do
/// products overflow, nor does underflow count.
const LEAST: f64 = 1e-130;

/// From world to object, nearly.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inverse {
    linear: [Vector; 3],
    /// How far a point that is hit may be off, but for what depends on the ray.
    spread: Vector,
}

impl Inverse {
    /// None where the matrix has no inverse, or none that double precision could lead by. `object` holds the mesh, `world`
    /// its image.
    pub fn new(place: &Affine, object: &Bounds, world: &[Vector; 2]) -> Option<Self> {
        let linear = inverse(&place.linear)?;
        let is_in_range = |x: &f64| *x == 0.0 || (LEAST..1.0 / LEAST).contains(&x.abs());
        if !linear.as_flattened().iter().all(is_in_range) {
            return None;
        }
        // |I - N L|: the sums of products carry three roundings, the difference one.
        let residual: [Vector; 3] = from_fn(|i| {
            from_fn(|j| {
                let column: Vector = from_fn(|k| place.linear[k][j]);
                let (size, unit) = (magnitude(&linear[i], &column), if i == j { 1.0 } else { 0.0 });
                (unit - dot(&linear[i], &column)).abs() + 5.0 * EPSILON * (size + unit)
            })
        });
        if !residual.iter().all(|row| row.iter().sum::<f64>() <= LARGEST_RESIDUAL) {
            return None;
        }
        let farthest = |lower: f64, upper: f64| lower.abs().max(upper.abs());
        // Half a unit in the last place of what an image can be, twice that.
        let rounding: Vector = from_fn(|i| 2.0 * EPSILON * farthest(world[0][i], world[1][i]) + f64::MIN_POSITIVE);
        let moved: Vector = from_fn(|i| magnitude(&linear[i], &rounding));
        let most = 2.0 * moved.iter().fold(0.0, |most: f64, &x| most.max(x));
        let size: Vector = from_fn(|i| farthest(f64::from(object.lower[i]), f64::from(object.upper[i])) + most);
        let reach: Vector = from_fn(|i| farthest(world[0][i] - place.shift[i], world[1][i] - place.shift[i]));
        let spread: Vector = from_fn(|i| {
            let turned = magnitude(&residual[i], &size) + moved[i] + magnitude(&residual[i], &[most; 3]);
            1.001 * (turned + 4.0 * EPSILON * magnitude(&linear[i], &reach))
        });
        spread.iter().all(|x| x.is_finite()).then_some(Self { linear, spread })
    }

    /// The ray that leads to what this one hits in the mesh.
    #[inline(always)]
    pub fn aim(&self, place: &Affine, ray: &Ray) -> Aim {
        let from = subtract(&ray.origin, &place.shift);
        let [x, y, z] = &self.linear;
        let origin = [dot(x, &from), dot(y, &from), dot(z, &from)];
        let direction = [dot(x, &ray.direction), dot(y, &ray.direction), dot(z, &ray.direction)];
        // Seven roundings of the origin and of the direction as far as it matters, and two more where it is used.
        let off = |axis: usize, row: &Vector| self.spread[axis] + 10.0 * EPSILON * magnitude(row, &from);
        let spread = [off(0, x), off(1, y), off(2, z)];
        let is_sound = |d: &f64| *d == 0.0 || d.abs() > LEAST;
        let is_finite = spread.iter().chain(&direction).all(|x| x.is_finite());
        if !(is_finite && ray.direction.iter().all(is_sound)) {
            return Aim::anywhere(ray);
        }
        Aim { ray: Ray { origin, direction, ..*ray }, spread }
    }
}

/// Σ |aᵢ bᵢ|
#[inline(always)]
fn magnitude(a: &Vector, b: &Vector) -> f64 {
    (a[0] * b[0]).abs() + (a[1] * b[1]).abs() + (a[2] * b[2]).abs()
}

/// Nearly the inverse of a matrix; none where that is not finite.
fn inverse(matrix: &[Vector; 3]) -> Option<[Vector; 3]> {
    let largest = matrix.as_flattened().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    if !(LEAST..1.0 / LEAST).contains(&largest) {
        return None;
    }
    let [a, b, c] = matrix.map(|row| row.map(|x| x / largest));
    let cofactors = [cross(&b, &c), cross(&c, &a), cross(&a, &b)];
    let determinant = dot(&a, &cofactors[0]);
    let inverse: [Vector; 3] = from_fn(|i| from_fn(|j| cofactors[j][i] / determinant / largest));
    inverse.as_flattened().iter().all(|x| x.is_finite()).then_some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::add_scaled;

    /// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    #[test]
    fn what_is_hit_is_within_the_spread() {
        let (mut state, mut led) = (1, 0);
        let object = Bounds { lower: [-1.0, -0.5, 0.25], upper: [1.0, 2.0, 3.0] };
        for turn in 0..20_000 {
            let (scale, flat) = ([1.0, 1e30, 1e-30, 1e3][turn % 4], [1.0, 1e-3, 1e-6, 1e-9][turn / 4 % 4]);
            let away = [0.0, 1.0, 1e6][turn / 16 % 3] * scale;
            let row = |state: &mut u64| -> Vector { from_fn(|_| random(state)) };
            let (mut x, mut y) = (row(&mut state), row(&mut state));
            let z = add_scaled(&add_scaled(&row(&mut state).map(|a| flat * a), 0.5, &x), 0.25, &y);
            (x, y) = (x.map(|a| scale * a), y.map(|a| scale * a));
            let place = Affine { linear: [x, y, z.map(|a| scale * a)], shift: row(&mut state).map(|a| away * a) };
            let Some(inverse) = Inverse::new(&place, &object, &place.bounds(&object)) else { continue };
            led += 1;
            let point = from_fn(|i| {
                let (low, high) = (f64::from(object.lower[i]), f64::from(object.upper[i]));
                low + (0.5 * random(&mut state) + 0.5) * (high - low)
            });
            let target = place.image(&point);
            let origin = row(&mut state).map(|a| (10.0 * scale + away) * a);
            // t is a power of two, so that this direction leads to the image but for its own rounding.
            let ray = Ray::new(origin, subtract(&target, &origin));
            let aim = inverse.aim(&place, &ray);
            let met = add_scaled(&aim.ray.origin, 1.0, &aim.ray.direction);
            for axis in 0..3 {
                // The direction's rounding moves the target by so much.
                let own: Vector = from_fn(|i| EPSILON * (ray.direction[i].abs() + met[i].abs()));
                let slack = 2.0 * magnitude(&inverse.linear[axis], &own) + 4.0 * EPSILON * aim.ray.origin[axis].abs();
                let off = (met[axis] - point[axis]).abs();
                assert!(off <= aim.spread[axis] + slack, "{off} {aim:?} {place:?}");
                // No more than need be.
                let is_near = flat == 1.0 && away <= scale;
                assert!(!is_near || aim.spread[axis] < 1e-2, "{aim:?} {place:?}");
            }
        }
        assert!(led > 15_000, "{led}");
    }

    #[test]
    fn what_double_precision_cannot_turn_back_has_no_inverse() {
        let object = Bounds { lower: [-1.0; 3], upper: [1.0; 3] };
        let of = |linear: [Vector; 3]| {
            let place = Affine { linear, shift: [0.0; 3] };
            Inverse::new(&place, &object, &place.bounds(&object))
        };
        assert!(of([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 1e-9]]).is_some());
        assert!(of([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]).is_none());
        assert!(of([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]).is_none());
        assert!(of([[1e200, 0.0, 0.0], [0.0, 1e200, 0.0], [0.0, 0.0, 1e200]]).is_none());
        assert!(of([[0.0; 3]; 3]).is_none());
    }

    #[test]
    fn a_ray_that_says_nothing_leads_anywhere() {
        let object = Bounds { lower: [-1.0; 3], upper: [1.0; 3] };
        let place = Affine { linear: [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]], shift: [0.0; 3] };
        let inverse = Inverse::new(&place, &object, &place.bounds(&object)).unwrap();
        for ray in [Ray::new([0.0; 3], [1e-200, 0.0, 0.0]), Ray::new([1e308; 3], [0.0, 0.0, 1e308])] {
            let aim = inverse.aim(&place, &ray);
            assert!(aim.spread.iter().all(|x| *x == f64::INFINITY) || ray.origin[0] > 0.0, "{aim:?}");
        }
    }
}
