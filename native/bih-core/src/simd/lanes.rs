//! Eight lanes of single precision: what a kernel is written in.

/// Which lanes something holds for.
pub trait Mask: Copy {
    /// One bit a lane, the first lane the lowest.
    fn bits(self) -> u8;
    /// Both.
    fn and(self, other: Self) -> Self;
    /// Either.
    fn or(self, other: Self) -> Self;
    /// self without other
    fn and_not(self, other: Self) -> Self;
}

/// Eight float32 numbers. A comparison with NaN is false. `minimum` and `maximum` give `other` where either is NaN.
pub trait Lanes: Copy {
    /// Which lanes.
    type Mask: Mask;
    /// The lanes whose bits are set.
    fn mask(bits: u8) -> Self::Mask;
    /// The same number in each lane.
    fn splat(x: f32) -> Self;
    /// From memory of any alignment.
    fn load(values: &[f32; 8]) -> Self;
    /// Whole numbers from 0 to 255.
    fn from_bytes(bytes: &[u8; 8]) -> Self;
    /// Each rounded to nearest.
    #[inline(always)]
    fn rounded(values: &[f64; 8]) -> Self {
        Self::load(&values.map(|x| x as f32))
    }
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
    /// self · factor + term, rounded once.
    fn fused(self, factor: Self, term: Self) -> Self;
    /// self <= other
    fn at_most(self, other: Self) -> Self::Mask;
    /// self < other
    fn below(self, other: Self) -> Self::Mask;
    /// `self` where the mask holds, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// The smallest of the eight; none is NaN. Lane i with i + 4, then with i + 2, then with i + 1, by `minimum`: so
    /// which of two zeros it is is the same everywhere.
    fn smallest(self) -> f32;
    /// The largest of the eight; none is NaN. As `smallest`, by `maximum`.
    fn largest(self) -> f32;
    /// Rows become columns: lane j of row i comes to lane i of row j.
    #[inline(always)]
    fn transposed(rows: [Self; 8]) -> [Self; 8] {
        let mut columns = [[0.0; 8]; 8];
        for (i, row) in rows.into_iter().enumerate() {
            for (column, x) in columns.iter_mut().zip(row.store()) {
                column[i] = x;
            }
        }
        let [a, b, c, d, e, f, g, h] = columns;
        [
            Self::load(&a),
            Self::load(&b),
            Self::load(&c),
            Self::load(&d),
            Self::load(&e),
            Self::load(&f),
            Self::load(&g),
            Self::load(&h),
        ]
    }
    /// What a stack is given: of the lanes in `order` (eight numbers of four bits, the first in the lowest) those with
    /// `self <= far`, their `self` and their word. The arrays behind the last one hold anything. Answers which of the places
    /// in the order those are, one bit each, the first the lowest.
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> u8;
}

/// The lanes whose bits are set, first to last, as bytes: for instruction sets that cannot compress.
#[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), expect(dead_code, reason = "no vector lanes"))]
pub(super) static SET_BITS: [u64; 256] = {
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 != 0 {
                table[mask] |= (lane as u64) << (8 * count);
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

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

    #[inline(always)]
    fn halved(self, combine: impl Fn(f32, f32) -> f32) -> f32 {
        let four: [f32; 4] = std::array::from_fn(|i| combine(self.0[i], self.0[i + 4]));
        combine(combine(four[0], four[2]), combine(four[1], four[3]))
    }
}

impl Mask for u8 {
    #[inline(always)]
    fn bits(self) -> u8 {
        self
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }
}

// Calls, except for what only moves: inlined, this one instruction set takes longer to compile than all others, and
// becomes 7 % faster by it.
impl Lanes for Scalar {
    type Mask = u8;
    #[inline(always)]
    fn mask(bits: u8) -> u8 {
        bits
    }
    #[inline(never)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        Self(*values)
    }
    #[inline(never)]
    fn from_bytes(bytes: &[u8; 8]) -> Self {
        Self(bytes.map(f32::from))
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(never)]
    fn plus(self, other: Self) -> Self {
        self.each(other, |a, b| a + b)
    }
    #[inline(never)]
    fn minus(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }
    #[inline(never)]
    fn times(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }
    #[inline(never)]
    fn over(self, other: Self) -> Self {
        self.each(other, |a, b| a / b)
    }
    #[inline(never)]
    fn magnitude(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(never)]
    fn turned_by(self, other: Self) -> Self {
        self.each(other, |a, b| f32::from_bits(a.to_bits() ^ b.to_bits() & 1 << 31))
    }
    #[inline(never)]
    fn minimum(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }
    #[inline(never)]
    fn maximum(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }
    #[inline(never)]
    fn at_most(self, other: Self) -> u8 {
        self.mask(other, f32::le)
    }
    #[inline(never)]
    fn below(self, other: Self) -> u8 {
        self.mask(other, f32::lt)
    }
    #[inline(never)]
    fn fused(self, factor: Self, term: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(factor.0[i], term.0[i])))
    }
    #[inline(never)]
    fn select(self, mask: u8, other: Self) -> Self {
        Self(std::array::from_fn(|i| if mask >> i & 1 != 0 { self.0[i] } else { other.0[i] }))
    }
    #[inline(never)]
    fn smallest(self) -> f32 {
        self.halved(|a, b| if a < b { a } else { b })
    }
    #[inline(never)]
    fn largest(self) -> f32 {
        self.halved(|a, b| if a > b { a } else { b })
    }
    #[inline(never)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> u8 {
        let (mut count, mut places) = (0, 0);
        for place in 0..8 {
            let lane = (order >> (4 * place) & 7) as usize;
            if self.0[lane] <= far.0[lane] {
                nears[count] = self.0[lane];
                pushed[count] = words[lane];
                count += 1;
                places |= 1 << place;
            }
        }
        places
    }
}
