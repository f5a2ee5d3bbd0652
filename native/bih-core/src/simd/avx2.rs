//! Eight lanes in one register of AVX2.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::{Lanes, Mask, SET_BITS};
use super::register_256::{lane_numbers, numbers_in_256_bits, run_with};

/// Lanes of AVX2. They come into being only inside `run`, into which the methods are inlined.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(__m256);

/// All bits of a lane set, or none.
#[derive(Debug, Clone, Copy)]
pub struct Avx2Mask(__m256);

run_with!(Avx2: "avx2", "fma", "bmi1", "bmi2", "lzcnt", "popcnt");

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

impl Lanes for Avx2 {
    type Mask = Avx2Mask;
    numbers_in_256_bits!();
    #[inline(always)]
    fn at_most(self, other: Self) -> Avx2Mask {
        // SAFETY: a value of this type exists, so this runs inside `run`, whose caller vouches for AVX2.
        Avx2Mask(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn below(self, other: Self) -> Avx2Mask {
        // SAFETY: as in `at_most`.
        Avx2Mask(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(self, mask: Avx2Mask, other: Self) -> Self {
        // SAFETY: as in `at_most`.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> usize {
        // SAFETY: as in `at_most`; the references are to the eight words that are read and written.
        unsafe {
            let order = lane_numbers!(order);
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
