//! Eight lanes in one register of AVX2.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::{Lanes, SET_BITS};
use super::register_256::{Mask256, four_transposed, lane_numbers, numbers_in_256_bits, run_with};

/// Lanes of AVX2. They come into being only inside `run`, into which the methods are inlined.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(__m256);

run_with!(Avx2: "avx2", "fma", "bmi1", "bmi2", "lzcnt", "popcnt");

impl Lanes for Avx2 {
    numbers_in_256_bits!();
    #[inline(always)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> u8 {
        // SAFETY: a value of this type exists, so this runs inside `run`, whose caller vouches for AVX2; the
        // references are to the eight words that are read and written.
        unsafe {
            let order = lane_numbers!(order);
            let hits = _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, far.0);
            let hits = _mm256_movemask_ps(_mm256_permutevar8x32_ps(hits, order)) as usize;
            let set = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(SET_BITS[hits].cast_signed()));
            let lanes = _mm256_permutevar8x32_epi32(order, set);
            let words = _mm256_loadu_si256(words.as_ptr().cast());
            _mm256_storeu_si256(pushed.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(words, lanes));
            _mm256_storeu_ps(nears.as_mut_ptr(), _mm256_permutevar8x32_ps(self.0, lanes));
            hits as u8
        }
    }
}
