//! Whole numbers of a fixed length, two's complement, the lowest 64 bits first.

use std::cmp::Ordering;

use super::double_double::{Pair, quotient};

/// A whole number of 64 `N` bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Int<const N: usize>([u64; N]);

impl<const N: usize> Int<N> {
    /// x / 2^exponent, which must be a whole number that has room.
    #[inline(always)]
    pub fn scaled(x: f64, exponent: i32) -> Self {
        let (mantissa, own) = parts(x);
        let number = if own < exponent {
            Self::of(mantissa.checked_shr(own.abs_diff(exponent)).unwrap_or(0))
        } else {
            Self::of(mantissa).shifted(own.abs_diff(exponent))
        };
        if x < 0.0 { number.negative() } else { number }
    }

    /// a · b / 2^exponent, which must be a whole number that has room.
    pub fn product(a: f64, b: f64, exponent: i32) -> Self {
        let [(first, up), (second, further)] = [a, b].map(|x| {
            let (mantissa, exponent) = parts(x);
            // Without the zeros at the end what is left need be shifted one way only.
            let zeros = mantissa.trailing_zeros() % 64;
            (u128::from(mantissa >> zeros), exponent + zeros as i32)
        });
        let product = first * second;
        if product == 0 {
            return Self::of(0);
        }
        let mut digits = [0; N];
        for (digit, part) in digits.iter_mut().zip([product as u64, (product >> 64) as u64]) {
            *digit = part;
        }
        let number = Self(digits).shifted((up + further).abs_diff(exponent));
        if a.is_sign_negative() == b.is_sign_negative() { number } else { number.negative() }
    }

    /// A number without a sign.
    #[inline(always)]
    pub fn of(x: u64) -> Self {
        let mut digits = [0; N];
        digits[0] = x;
        Self(digits)
    }

    #[inline(always)]
    fn is_negative(&self) -> bool {
        self.0[N - 1] >> 63 != 0
    }

    #[inline(always)]
    pub fn sign(&self) -> Ordering {
        if self.is_negative() {
            Ordering::Less
        } else if self.0 == [0; N] {
            Ordering::Equal
        } else {
            Ordering::Greater
        }
    }

    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        self.added(other, 0, false)
    }

    #[inline(always)]
    pub fn minus(&self, other: &Self) -> Self {
        self.added(other, u64::MAX, true)
    }

    /// self + (other with all bits turned that are set in `turned`) + carry
    #[inline(always)]
    fn added(&self, other: &Self, turned: u64, mut carry: bool) -> Self {
        let mut digits = [0; N];
        for (digit, (&a, &b)) in digits.iter_mut().zip(self.0.iter().zip(&other.0)) {
            let (sum, first) = a.overflowing_add(b ^ turned);
            let (sum, second) = sum.overflowing_add(u64::from(carry));
            (*digit, carry) = (sum, first | second);
        }
        Self(digits)
    }

    #[inline(always)]
    pub fn negative(&self) -> Self {
        Self([0; N]).minus(self)
    }

    #[inline(always)]
    fn magnitude(&self) -> Self {
        if self.is_negative() { self.negative() } else { *self }
    }

    /// The product, which must have room in `O` digits.
    #[inline(always)]
    pub fn times<const M: usize, const O: usize>(&self, other: &Int<M>) -> Int<O> {
        let (a, b) = (self.magnitude(), other.magnitude());
        let mut digits = [0u64; O];
        for (i, &a) in a.0.iter().enumerate() {
            let mut carry = 0;
            for (j, &b) in b.0.iter().enumerate() {
                if let Some(digit) = digits.get_mut(i + j) {
                    let sum = u128::from(a) * u128::from(b) + u128::from(*digit) + carry;
                    *digit = sum as u64;
                    carry = sum >> 64;
                }
            }
            if let Some(digit) = digits.get_mut(i + M) {
                *digit = carry as u64;
            }
        }
        let product = Int(digits);
        if self.is_negative() == other.is_negative() { product } else { product.negative() }
    }

    /// self · 2^count, which must have room.
    #[inline(always)]
    pub fn shifted(&self, count: u32) -> Self {
        let (whole, rest) = (count as usize / 64, count % 64);
        Self(std::array::from_fn(|i| {
            let digit = |back: usize| i.checked_sub(whole + back).map_or(0, |place| self.0[place]);
            // In two steps: a shift by 64 is none.
            digit(0) << rest | digit(1) >> 1 >> (63 - rest)
        }))
    }

    /// The same number in more digits.
    #[inline(always)]
    pub fn widened<const O: usize>(&self) -> Int<O> {
        let fill = if self.is_negative() { u64::MAX } else { 0 };
        Int(std::array::from_fn(|i| self.0.get(i).copied().unwrap_or(fill)))
    }

    fn bits(&self) -> i32 {
        let above = self.0.iter().rev().take_while(|&&digit| digit == 0).count();
        let top = self.0.iter().rev().find(|&&digit| digit != 0).map_or(0, |digit| digit.leading_zeros());
        64 * (N - above) as i32 - top as i32
    }

    /// The 53 bits from `place` upwards; below the first there are zeros.
    fn window(&self, place: i32) -> f64 {
        let bit =
            |i: i32| usize::try_from(i.div_euclid(64)).ok().and_then(|digit| self.0.get(digit)).copied().unwrap_or(0);
        let rest = place.rem_euclid(64) as u32;
        let bits = bit(place) >> rest | bit(place + 64) << 1 << (63 - rest);
        (bits & ((1 << 53) - 1)) as f64
    }

    /// A pair and a power of two whose product is this positive number, but for 2^-105 of it; the head is below 2^53 + 1 and
    /// not below 2^52.
    fn pair(&self) -> (Pair, i32) {
        let place = self.bits() - 53;
        let tail = self.window(place - 53) / (1u64 << 53) as f64;
        (Pair { head: self.window(place), tail }.normalised(), place)
    }

    /// self / other · 2^exponent, rounded from what is off by less than 2^-98 of it, with the largest finite double for all
    /// beyond it. `other` is not zero.
    pub fn over(&self, other: &Self, exponent: i32) -> f64 {
        if self.sign() == Ordering::Equal {
            return 0.0;
        }
        let ((above, up), (below, down)) = (self.magnitude().pair(), other.magnitude().pair());
        let value = quotient(above, below, 1.0 / below.head);
        let value = scale(value, i64::from(exponent + up - down)).min(f64::MAX);
        if self.is_negative() == other.is_negative() { value } else { -value }
    }
}

/// The mantissa of a finite |x| and the power of two that it is multiplied by.
#[inline(always)]
pub(super) fn parts(x: f64) -> (u64, i32) {
    let biased = (x.to_bits() >> 52 & 0x7ff) as i32;
    let fraction = x.to_bits() & ((1 << 52) - 1);
    // Subnormals have no hidden bit and the exponent of the smallest normals.
    if biased == 0 { (fraction, -1074) } else { (fraction | 1 << 52, biased - 1075) }
}

/// x · 2^exponent in steps that stay in range.
pub(super) fn scale(mut x: f64, mut exponent: i64) -> f64 {
    while exponent != 0 && x != 0.0 && x.is_finite() {
        let step = exponent.clamp(-1000, 1000);
        x *= 2f64.powi(step as i32);
        exponent -= step;
    }
    x
}

#[cfg(test)]
mod tests {
    use num_bigint::BigInt;

    use super::*;

    fn big<const N: usize>(x: &Int<N>) -> BigInt {
        let bytes: Vec<u8> = x.0.iter().flat_map(|digit| digit.to_le_bytes()).collect();
        BigInt::from_signed_bytes_le(&bytes)
    }

    /// Digits that are all ones or nothing now and then, so that carries go far.
    fn digits(state: &mut u64) -> u64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        match *state >> 62 {
            0 => 0,
            1 => u64::MAX,
            _ => *state ^ *state >> 29,
        }
    }

    #[test]
    fn sums_and_products_are_those_of_big_integers() {
        let mut state = 1;
        for _ in 0..3000 {
            let mut number =
                || Int::<2>([digits(&mut state), digits(&mut state).cast_signed().wrapping_shr(3).cast_unsigned()]);
            let (a, b) = (number(), number());
            assert_eq!(big(&a.plus(&b)), big(&a) + big(&b));
            assert_eq!(big(&a.minus(&b)), big(&a) - big(&b));
            assert_eq!(big(&a.negative()), -big(&a));
            let product: Int<4> = a.times(&b);
            assert_eq!(big(&product), big(&a) * big(&b));
            assert_eq!(big(&product.widened::<7>()), big(&product));
            for count in [0, 1, 63, 64, 65, 127, 128] {
                assert_eq!(big(&product.widened::<7>().shifted(count)), big(&product) << count);
            }
            assert_eq!(product.sign(), big(&product).cmp(&BigInt::ZERO));
        }
    }

    #[test]
    fn doubles_are_whole_once_they_are_scaled() {
        for (x, exponent) in
            [(0.0, 0), (-0.0, 3), (1.0, -70), (-1.5, -1), (0.1, -56), (5e-324, -1074), (-1e-310, -1074)]
        {
            let number = Int::<2>::scaled(x, exponent);
            assert_eq!(number.over(&Int::of(1), exponent), x, "{x}");
        }
    }

    #[test]
    fn products_are_whole_once_they_are_scaled() {
        for (a, b, exponent) in
            [(0.0, 3.0, 0), (-1.5, 0.75, -3), (0.1, -0.1, -112), (5e-324, 5e-324, -2148), (3.0, 4.0, 2)]
        {
            let [scaled, other] = [a, b].map(|x| Int::<2>::scaled(x, -1074));
            let expected: Int<4> = scaled.times(&other);
            let shift = u32::try_from(exponent + 2148).unwrap();
            if shift < 64 {
                assert_eq!(Int::<4>::product(a, b, exponent).shifted(shift), expected, "{a} {b}");
            }
        }
        assert_eq!(Int::<1>::product(-1.5, 0.75, -3), Int::of(9).negative());
        assert_eq!(Int::<1>::product(3.0, 4.0, 2), Int::of(3));
        assert_eq!(Int::<1>::product(0.0, -3.0, -5), Int::of(0));
        let third: Int<2> = Int::<1>::scaled(0.1, -56).times(&Int::<1>::scaled(0.3, -56));
        assert_eq!(Int::<2>::product(0.1, 0.3, -112), third);
    }

    #[test]
    fn quotients_are_the_nearest_doubles() {
        for (a, b) in [(1.0, 3.0), (-2.0, 7.0), (1e5, 3e-5), (0.1, 0.3), (5.0, -1e-5), (123_456_789.0, 0.1)] {
            let [above, below] = [a, b].map(|x| Int::<3>::scaled(x, -75));
            assert_eq!(above.over(&below, 0), a / b, "{a} / {b}");
            assert_eq!(above.over(&below, 2000), f64::MAX.copysign(a / b));
            assert_eq!(above.over(&below, -2000).abs(), 0.0);
        }
    }
}
