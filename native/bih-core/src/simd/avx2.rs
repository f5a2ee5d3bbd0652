//! Eight lanes in one register of AVX2.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::{Lanes, Mask};

/// Lanes of AVX2. They come into being only inside `run`, into which the methods are inlined.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(__m256);

/// All bits of a lane set, or none.
#[derive(Debug, Clone, Copy)]
pub struct Avx2Mask(__m256);

impl Mask for Avx2Mask {
    #[inline(always)]
    fn bits(self) -> u8 {
        // SAFETY: a value of this type exists, so this runs inside `run`, whose caller vouches for AVX2.
        unsafe { _mm256_movemask_ps(self.0) as u8 }
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: as in `bits`.
        Self(unsafe { _mm256_and_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        // SAFETY: as in `bits`.
        Self(unsafe { _mm256_or_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        // SAFETY: as in `bits`.
        Self(unsafe { _mm256_andnot_ps(other.0, self.0) })
    }
}

/// The lanes whose bits are set, first to last, as bytes.
static SET_BITS: [u64; 256] = {
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

/// Columns of four rows: the first four, and beside them the last four.
///
/// # Safety
/// The processor must have AVX.
#[inline(always)]
unsafe fn four_transposed(a: __m256, b: __m256, c: __m256, d: __m256) -> [__m256; 4] {
    // SAFETY: the caller vouches for AVX.
    unsafe {
        let (ab, cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0x44>(ab, cd),
            _mm256_shuffle_ps::<0xee>(ab, cd),
            _mm256_shuffle_ps::<0x44>(ab_high, cd_high),
            _mm256_shuffle_ps::<0xee>(ab_high, cd_high),
        ]
    }
}

/// Run the kernel in lanes of AVX2.
///
/// # Safety
/// The processor must have these instruction sets.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}

/// Methods whose body is one intrinsic.
macro_rules! intrinsic {
    ($($name:ident($($operand:ident),*) -> $output:ty { $value:expr })*) => {$(
        #[inline(always)]
        fn $name(self $(, $operand: Self)*) -> $output {
            // SAFETY: a value of this type exists, so this runs inside `run`, whose caller vouches for AVX2.
            unsafe { ($value)(self.0 $(, $operand.0)*) }
        }
    )*};
}

impl Lanes for Avx2 {
    type Mask = Avx2Mask;
    #[inline(always)]
    fn mask(bits: u8) -> Avx2Mask {
        // SAFETY: as in `splat`.
        unsafe {
            let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), lanes);
            Avx2Mask(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lanes)))
        }
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: lanes are made only inside `run`, whose caller vouches for AVX2.
        Self(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        // SAFETY: as in `splat`; the reference is to the eight numbers that are read, of any alignment.
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: as in `splat`; the array has room for the eight numbers that are written, at any alignment.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    intrinsic! {
        plus(other) -> Self { |a, b| Self(_mm256_add_ps(a, b)) }
        minus(other) -> Self { |a, b| Self(_mm256_sub_ps(a, b)) }
        times(other) -> Self { |a, b| Self(_mm256_mul_ps(a, b)) }
        over(other) -> Self { |a, b| Self(_mm256_div_ps(a, b)) }
        magnitude() -> Self { |a| Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a)) }
        turned_by(other) -> Self { |a, b| Self(_mm256_xor_ps(a, _mm256_and_ps(_mm256_set1_ps(-0.0), b))) }
        minimum(other) -> Self { |a, b| Self(_mm256_min_ps(a, b)) }
        maximum(other) -> Self { |a, b| Self(_mm256_max_ps(a, b)) }
        fused(factor, term) -> Self { |a, b, c| Self(_mm256_fmadd_ps(a, b, c)) }
        at_most(other) -> Avx2Mask { |a, b| Avx2Mask(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) }
        below(other) -> Avx2Mask { |a, b| Avx2Mask(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) }
    }
    #[inline(always)]
    fn select(self, mask: Avx2Mask, other: Self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        // SAFETY: as in `splat`.
        unsafe {
            let half = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let pair = _mm_min_ps(half, _mm_movehl_ps(half, half));
            _mm_cvtss_f32(_mm_min_ss(pair, _mm_movehdup_ps(pair)))
        }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: as in `splat`.
        unsafe {
            let half = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let pair = _mm_max_ps(half, _mm_movehl_ps(half, half));
            _mm_cvtss_f32(_mm_max_ss(pair, _mm_movehdup_ps(pair)))
        }
    }
    #[inline(always)]
    fn transposed(rows: [Self; 8]) -> [Self; 8] {
        // SAFETY: as in `splat`.
        unsafe {
            let [Self(a), Self(b), Self(c), Self(d), Self(e), Self(f), Self(g), Self(h)] = rows;
            let [a, b, c, d] = four_transposed(a, b, c, d);
            let [e, f, g, h] = four_transposed(e, f, g, h);
            [
                Self(_mm256_permute2f128_ps::<0x20>(a, e)),
                Self(_mm256_permute2f128_ps::<0x20>(b, f)),
                Self(_mm256_permute2f128_ps::<0x20>(c, g)),
                Self(_mm256_permute2f128_ps::<0x20>(d, h)),
                Self(_mm256_permute2f128_ps::<0x31>(a, e)),
                Self(_mm256_permute2f128_ps::<0x31>(b, f)),
                Self(_mm256_permute2f128_ps::<0x31>(c, g)),
                Self(_mm256_permute2f128_ps::<0x31>(d, h)),
            ]
        }
    }
    #[inline(always)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> usize {
        // SAFETY: as in `splat`; the references are to the eight words that are read and written.
        unsafe {
            let places = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
            // Only the lowest three bits of a lane's number count.
            let order = _mm256_srlv_epi32(_mm256_set1_epi32(order.cast_signed()), places);
            let hits = _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, far.0);
            let hits = _mm256_movemask_ps(_mm256_permutevar8x32_ps(hits, order)) as usize;
            let set = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(SET_BITS[hits].cast_signed()));
            let lanes = _mm256_permutevar8x32_epi32(order, set);
            let words = _mm256_loadu_si256(words.as_ptr().cast());
            _mm256_storeu_si256(pushed.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(words, lanes));
            _mm256_storeu_ps(nears.as_mut_ptr(), _mm256_permutevar8x32_ps(self.0, lanes));
            hits.count_ones() as usize
        }
    }
}
