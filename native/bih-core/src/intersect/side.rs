//! On which side of a line a point is, in a plane; exact. Points and rays along an axis need no more than this.

use std::cmp::Ordering;

use super::double_double::{Pair, difference, two_product, two_sum};
use super::watertight::UNDERFLOW;
use super::{EPSILON, Means, exact};

/// Products of two numbers between this and its inverse have a rounding error that is a number too.
pub(super) const SMALLEST: f64 = 1e-140;

/// A point of the plane.
pub(super) type Place = [f64; 2];

/// The sign of (a − p) × (b − p), and what it takes to tell.
#[inline(always)]
pub(super) fn side(a: &Place, b: &Place, p: &Place) -> (Ordering, Means) {
    let [ax, ay] = [a[0] - p[0], a[1] - p[1]];
    let [bx, by] = [b[0] - p[0], b[1] - p[1]];
    let (left, right) = (ax * by, ay * bx);
    let value = left - right;
    // A product has three roundings, the difference one. Where anything is infinite or NaN this is false.
    if value.abs() > 5.0 * EPSILON * (left.abs() + right.abs()) + UNDERFLOW {
        return (order(value, 0.0), Means::Double);
    }
    // A rounded difference has the sign of the true one, and two products of different signs are in the order of these.
    let sign = |x: f64| order(x, 0.0) as i8;
    let (left, right) = (sign(ax) * sign(by), sign(ay) * sign(bx));
    if left != right || left == 0 {
        return (left.cmp(&right), Means::Double);
    }
    match by_pairs(a, b, p) {
        Some(side) => (side, Means::Pairs),
        None => (exact::side(a, b, p), Means::Big),
    }
}

/// Neither product is zero.
#[cold]
#[inline(never)]
fn by_pairs(a: &Place, b: &Place, p: &Place) -> Option<Ordering> {
    let differences =
        [[difference(a[0], p[0]), difference(a[1], p[1])], [difference(b[0], p[0]), difference(b[1], p[1])]];
    let [[ax, ay], [bx, by]] = differences;
    let in_range = |x: &Pair| (SMALLEST..1.0 / SMALLEST).contains(&x.head.abs());
    if !differences.as_flattened().iter().all(in_range) {
        return None;
    }
    let (left, right) = (two_product(ax.head, by.head), two_product(ay.head, bx.head));
    if differences.as_flattened().iter().all(|x| x.tail == 0.0) {
        // Both are exact, and rounding keeps the order.
        return Some(order(left.head, right.head).then(order(left.tail, right.tail)));
    }
    let Pair { head, tail } = two_sum(left.head, -right.head);
    let rest = |x: Pair, y: Pair| x.head * y.tail + x.tail * y.head;
    let value = head + (tail + ((left.tail - right.tail) + (rest(ax, by) - rest(ay, bx))));
    let error = 20.0 * EPSILON * EPSILON * (left.head.abs() + right.head.abs());
    (value.abs() > error).then(|| order(value, 0.0))
}

/// The order of two numbers; Equal where either is NaN.
#[inline(always)]
pub(super) fn order(a: f64, b: f64) -> Ordering {
    if a < b {
        Ordering::Less
    } else if a > b {
        Ordering::Greater
    } else {
        Ordering::Equal
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(mut state: u64, number: fn(u64) -> f64) -> impl FnMut() -> f64 {
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            number(state)
        }
    }

    #[test]
    fn sides_are_those_of_whole_numbers() {
        let mut number = numbers(1, |state| {
            let whole = ((state >> 33) % 9) as f64 - 4.0;
            match state >> 61 {
                0 => whole * 1e-300,
                1 => whole + 1e-16,
                2 => whole * 1e300,
                3 => whole / 3.0,
                _ => whole,
            }
        });
        for _ in 0..20_000 {
            let [a, b, p] = std::array::from_fn(|_| [number(), number()]);
            assert_eq!(side(&a, &b, &p).0, exact::side(&a, &b, &p), "{a:?} {b:?} {p:?}");
        }
    }

    /// And pairs tell nearly all of them, those on the line too where the differences are exact.
    #[test]
    fn points_next_to_a_line() {
        let mut number = numbers(2, |state| (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0);
        let (mut asked, mut told) = (0, 0);
        for round in 0..20_000 {
            let single = |p: Place| if round % 2 == 0 { p.map(|x| f64::from(x as f32)) } else { p };
            let [a, b] = std::array::from_fn(|_| single([number(), number()]));
            let weight = if round % 3 == 0 { 0.5 } else { number() };
            let mut p: Place = std::array::from_fn(|i| a[i] + weight * (b[i] - a[i]));
            if round % 5 == 0 {
                p[0] = p[0].next_up();
            }
            let truth = exact::side(&a, &b, &p);
            assert_eq!(side(&a, &b, &p).0, truth, "{a:?} {b:?} {p:?}");
            if let Some(side) = by_pairs(&a, &b, &p) {
                assert_eq!(side, truth, "{a:?} {b:?} {p:?}");
                told += 1;
            }
            asked += 1;
        }
        assert!(100 * told > 95 * asked, "{told} of {asked}");
    }
}
