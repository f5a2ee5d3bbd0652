//! Distance and weights of a hit with an error below one unit in the last place: what precision `exact` answers.

use super::double_double::{Pair, cross, differences, dot, largest, quotient};
use super::{RayTest, exact};
use crate::geometry::{Bounds, Corners, Ray, Vector};

/// Where lengths and directions are below this, and products above `SMALLEST`, nothing overflows, and what underflows is
/// far below the error bound.
const LARGEST: f64 = 1e90;
const SMALLEST: f64 = 1e-180;
/// Quotients between this and its inverse are rounded as normal numbers.
const SMALLEST_QUOTIENT: f64 = 1e-280;
/// The part of what does not cancel that a product must exceed, for its error of 320 · 2^-106 of that to be below 2^-58 of
/// it: 2^-39.
const LEAST: f64 = 1.0 / (1u64 << 39) as f64;

/// t, u and v where a ray meets a triangle, each rounded from a value that is off by less than 2^-57 of it; NaN where
/// that cannot be said. Without a branch.
#[inline(always)]
pub fn rounded_quickly(origin: &Vector, direction: &Vector, [a, b, c]: &Corners) -> [f64; 3] {
    let to_corner = differences(a, origin);
    let (e1, e2) = (differences(b, a), differences(c, a));
    let direction = [Pair::of(direction[0]), Pair::of(direction[1]), Pair::of(direction[2])];
    let normal = cross(&e1, &e2);
    let moment = cross(&to_corner, &direction);
    let [reach, side1, side2, length] = [largest(&to_corner), largest(&e1), largest(&e2), largest(&direction)];
    let is_in_range = (reach < LARGEST) & (side1 < LARGEST) & (side2 < LARGEST) & (length < LARGEST);
    let below = dot(&direction, &normal);
    let is_sound = is_in_range & is_large(below, length, side1, side2);
    let below = below.normalised();
    let inverse = 1.0 / below.head;
    let divided = |above: Pair, p: f64, q: f64, r: f64| {
        let value = quotient(above.normalised(), below, inverse);
        let is_normal = (value.abs() > SMALLEST_QUOTIENT) & (value.abs() < 1.0 / SMALLEST_QUOTIENT);
        if is_sound & is_normal & is_large(above, p, q, r) { value } else { f64::NAN }
    };
    // From a − o + u e1 + v e2 = t d by products with n, with e2 × d and with e1 × d.
    [
        divided(dot(&to_corner, &normal), reach, side1, side2),
        divided(dot(&e2, &moment), reach, length, side2),
        divided(dot(&e1, &moment).negative(), reach, length, side1),
    ]
}

/// t, u and v where a ray meets a triangle, each off by less than one unit in the last place: those of `rounded_quickly`,
/// and in whole numbers what these leave open. None where no answer can be given: the mesh has been changed since.
#[inline(always)]
pub fn rounded(
    quickly: [f64; 3],
    origin: &Vector,
    direction: &Vector,
    corners: impl FnOnce() -> Corners,
) -> Option<[f64; 3]> {
    if quickly.iter().any(|value| value.is_nan()) {
        return completed(quickly, origin, direction, &corners());
    }
    Some(quickly)
}

#[cold]
#[inline(never)]
fn completed([t, u, v]: [f64; 3], origin: &Vector, direction: &Vector, corners: &Corners) -> Option<[f64; 3]> {
    let test = RayTest::new(&Ray::new(*origin, *direction), &Bounds::of_triangle(corners));
    let are_finite = corners.as_flattened().iter().all(|x| x.is_finite());
    if !(are_finite && test.is_inside(corners)) {
        return None;
    }
    let t = if t.is_nan() { exact::distance(corners, origin, direction) } else { t };
    let [is_u_zero, is_v_zero] = test.zero_weights(corners);
    let (u, v) = (if is_u_zero { 0.0 } else { u }, if is_v_zero { 0.0 } else { v });
    if !(u.is_nan() || v.is_nan()) {
        return Some([t, u, v]);
    }
    let [u, v] = exact::weights(corners, origin, direction);
    Some([t, u, v])
}

/// Whether a triple product of vectors with these largest components is far above its error.
#[inline(always)]
fn is_large(product: Pair, p: f64, q: f64, r: f64) -> bool {
    product.head.abs() > LEAST * (p * q * r) + SMALLEST
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{add_scaled, subtract};
    use crate::intersect::exact::{Fraction, is_inside};

    /// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Rays at points of triangles of many shapes, sizes and offsets, in single and double precision.
    fn cases() -> impl Iterator<Item = (Vector, Vector, Corners)> {
        let mut state = 1;
        (0..6_000u32).map(move |case| {
            let mut point = |scale: f64| -> Vector { std::array::from_fn(|_| scale * random(&mut state)) };
            let far = [0.0, 1.0, 1e3, 1e9][case as usize % 4];
            let thin = [1.0, 1e-3, 1e-9][case as usize / 4 % 3];
            let a = add_scaled(&point(1.0), far, &[1.0, -0.5, 0.25]);
            let b = add_scaled(&a, 1.0, &point(1.0));
            let c = add_scaled(&add_scaled(&a, 0.5, &subtract(&b, &a)), thin, &point(1.0));
            let away = [0.3, 3.0, 1e5, 1e-7][case as usize / 12 % 4];
            let origin = add_scaled(&a, away, &point(1.0));
            let weights = point(0.25).map(|x| x + 0.25);
            let target = add_scaled(&add_scaled(&a, weights[0], &subtract(&b, &a)), weights[1], &subtract(&c, &a));
            let direction = subtract(&target, &origin);
            let narrow = |v: Vector| if case % 2 == 0 { v.map(|x| f64::from(x as f32)) } else { v };
            (narrow(origin), narrow(direction), [narrow(a), narrow(b), narrow(c)])
        })
    }

    #[test]
    fn what_is_quickly_said_is_within_an_ulp_and_most_is() {
        let (mut said, mut all) = (0, 0);
        for (origin, direction, corners) in cases() {
            if !is_inside(&corners, &origin, &direction, [None; 3]).0 {
                continue;
            }
            let t = Fraction::distance(&corners, &origin, &direction);
            let [u, v] = Fraction::weights(&corners, &origin, &direction);
            let quickly = rounded_quickly(&origin, &direction, &corners);
            let complete = rounded(quickly, &origin, &direction, || corners).expect("it is inside");
            for (truth, (quickly, value)) in [t, u, v].into_iter().zip(quickly.into_iter().zip(complete)) {
                (all, said) = (all + 1, said + usize::from(!quickly.is_nan()));
                // Rounded from what is off by 2^-57 of it, or less.
                let error = truth.error(value);
                assert!(error <= 0.57, "{error} ulp: {value}, ray {origin:?} {direction:?}, {corners:?}");
            }
        }
        assert!(all > 10_000 && 100 * said > 80 * all, "{said} of {all}");
    }
}
