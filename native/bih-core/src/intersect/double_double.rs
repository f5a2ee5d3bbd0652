//! Sums of two doubles, by additions and products whose rounding errors are numbers too: Dekker 1971, "A Floating-Point
//! Technique for Extending the Available Precision"; Ogita, Rump and Oishi 2005, "Accurate Sum and Dot Product".
//!
//! Nothing is exact here but `difference` and what stands in `two_sum`, `two_product`, `settled` and `normalised`; docs/accuracy.md,
//! section 6, counts the rest. No branch, so that a loop over rays becomes vectors.

use crate::geometry::Vector;

/// head + tail
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub head: f64,
    pub tail: f64,
}

pub(super) type PairVector = [Pair; 3];

/// a + b and what rounding took from it (Knuth 1969).
#[inline(always)]
pub(super) fn two_sum(a: f64, b: f64) -> Pair {
    let head = a + b;
    let of_b = head - a;
    Pair { head, tail: (a - (head - of_b)) + (b - of_b) }
}

/// a · b and what rounding took from it, where neither overflows nor underflows.
#[inline(always)]
pub(super) fn two_product(a: f64, b: f64) -> Pair {
    let head = a * b;
    Pair { head, tail: a.mul_add(b, -head) }
}

/// a − b
#[inline(always)]
pub(super) fn difference(a: f64, b: f64) -> Pair {
    two_sum(a, -b)
}

impl Pair {
    /// A double.
    #[inline(always)]
    pub fn of(head: f64) -> Self {
        Self { head, tail: 0.0 }
    }

    /// −self
    #[inline(always)]
    pub fn negative(self) -> Self {
        Self { head: -self.head, tail: -self.tail }
    }

    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        let Self { head, tail } = two_product(self.head, other.head);
        Self { head, tail: self.head.mul_add(other.tail, self.tail.mul_add(other.head, tail)) }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        let Self { head, tail } = two_sum(self.head, other.head);
        Self { head, tail: (self.tail + other.tail) + tail }
    }

    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        let Self { head, tail } = two_sum(self.head, -other.head);
        Self { head, tail: (self.tail - other.tail) + tail }
    }

    /// The same with the nearest double as its head.
    #[inline(always)]
    pub fn settled(self) -> Self {
        two_sum(self.head, self.tail)
    }

    /// The same in half the operations, if the tail is not larger than the head.
    #[inline(always)]
    pub fn normalised(self) -> Self {
        let head = self.head + self.tail;
        Self { head, tail: self.tail - (head - self.head) }
    }
}

/// a − b
#[inline(always)]
pub(super) fn differences(a: &Vector, b: &Vector) -> PairVector {
    [difference(a[0], b[0]), difference(a[1], b[1]), difference(a[2], b[2])]
}

/// The largest component, rounded to a double.
#[inline(always)]
pub(super) fn largest(a: &PairVector) -> f64 {
    // Not `max`, which would look for NaN.
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    larger(larger(a[0].head.abs(), a[1].head.abs()), a[2].head.abs())
}

/// a × b
#[inline(always)]
pub(super) fn cross(a: &PairVector, b: &PairVector) -> PairVector {
    [
        a[1].times(b[2]).minus(a[2].times(b[1])),
        a[2].times(b[0]).minus(a[0].times(b[2])),
        a[0].times(b[1]).minus(a[1].times(b[0])),
    ]
}

/// a · b
#[inline(always)]
pub(super) fn dot(a: &PairVector, b: &PairVector) -> Pair {
    a[0].times(b[0]).plus(a[1].times(b[1])).plus(a[2].times(b[2]))
}

/// a / b of normalised numbers, given the double 1 / b.head.
#[inline(always)]
pub(super) fn quotient(a: Pair, b: Pair, inverse: f64) -> f64 {
    let first = a.head * inverse;
    let rest = (-first).mul_add(b.tail, (-first).mul_add(b.head, a.head) + a.tail);
    rest.mul_add(inverse, first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounding_takes_is_kept() {
        let Pair { head, tail } = two_sum(1.0, 1e-30);
        assert_eq!((head, tail), (1.0, 1e-30));
        let x = 1.0 + f64::EPSILON;
        let Pair { head, tail } = two_product(x, x);
        assert_eq!((head, tail), (1.0 + 2.0 * f64::EPSILON, f64::EPSILON * f64::EPSILON));
        let Pair { head, tail } = difference(1e16, 0.3);
        assert_eq!((head, tail), (1e16, -0.3));
    }

    #[test]
    fn a_third_is_the_nearest_double() {
        let (one, three) = (Pair::of(1.0), Pair::of(3.0));
        assert_eq!(quotient(one, three, 1.0 / 3.0), 1.0 / 3.0);
        let more = Pair { head: 1.0, tail: 3.0 * 2f64.powi(-55) };
        assert_eq!(quotient(more, three, 1.0 / 3.0), (1.0f64 / 3.0).next_up());
    }
}
