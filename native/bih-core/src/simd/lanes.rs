//! Eight lanes of single precision: what a kernel is written in.

/// Eight float32 numbers. Comparisons give a bit a lane; one with NaN is false. `minimum` and `maximum` give `other`
/// where either is NaN.
pub trait Lanes: Copy {
    /// The same number in each lane.
    fn splat(x: f32) -> Self;
    /// From memory of any alignment.
    fn load(values: &[f32; 8]) -> Self;
    /// To memory.
    fn store(self) -> [f32; 8];
    /// self + other
    fn plus(self, other: Self) -> Self;
    /// self − other
    fn minus(self, other: Self) -> Self;
    /// self · other
    fn times(self, other: Self) -> Self;
    /// self / other
    fn over(self, other: Self) -> Self;
    /// |self|
    fn magnitude(self) -> Self;
    /// self with its sign turned where `other` is negative, −0 included.
    fn turned_by(self, other: Self) -> Self;
    /// The smaller one.
    fn minimum(self, other: Self) -> Self;
    /// The larger one.
    fn maximum(self, other: Self) -> Self;
    /// self <= other
    fn at_most(self, other: Self) -> u8;
    /// self < other
    fn below(self, other: Self) -> u8;
}

/// Without any vector instruction: kept for ever, as what the others are tested against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scalar([f32; 8]);

impl Scalar {
    #[inline(always)]
    fn each(self, other: Self, combine: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| combine(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn mask(self, other: Self, compare: impl Fn(&f32, &f32) -> bool) -> u8 {
        (0..8).fold(0, |mask, i| mask | u8::from(compare(&self.0[i], &other.0[i])) << i)
    }
}

impl Lanes for Scalar {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
    #[inline(always)]
    fn over(self, other: Self) -> Self {
        self.each(other, |a, b| a / b)
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn turned_by(self, other: Self) -> Self {
        self.each(other, |a, b| f32::from_bits(a.to_bits() ^ b.to_bits() & 1 << 31))
    }
    #[inline(always)]
    fn minimum(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn maximum(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u8 {
        self.mask(other, f32::le)
    }
    #[inline(always)]
    fn below(self, other: Self) -> u8 {
        self.mask(other, f32::lt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Kernel, dispatch_to, instruction_sets};

    const ODD: [f32; 8] = [0.0, -0.0, 1.5, -2.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 1e-45];

    struct Everything;

    impl Kernel for Everything {
        type Output = Vec<u32>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<u32> {
            let mut bits = Vec::new();
            for shift in 0..8 {
                let mut turned = ODD;
                turned.rotate_left(shift);
                let (a, b) = (L::load(&ODD), L::load(&turned));
                let values = [
                    a.plus(b),
                    a.minus(b),
                    a.times(b),
                    a.over(b),
                    a.magnitude(),
                    a.turned_by(b),
                    a.minimum(b),
                    a.maximum(b),
                    L::splat(turned[0]),
                ];
                // Which NaN comes out is not promised.
                let canonical = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
                bits.extend(values.iter().flat_map(|value| value.store().map(canonical)));
                bits.extend([u32::from(a.at_most(b)), u32::from(a.below(b))]);
            }
            bits
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let expected = Everything.run::<Scalar>();
        for set in instruction_sets() {
            assert_eq!(dispatch_to(*set, Everything), expected, "{set:?}");
        }
    }
}
