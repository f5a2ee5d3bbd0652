//! Eight lanes in one register of 256 bits, with the compression of AVX-512.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::is_x86_feature_detected;
use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::Lanes;
use super::register_256::{Mask256, four_transposed, lane_numbers, numbers_in_256_bits, run_with};

/// Lanes of AVX-512. They come into being only inside `run`, into which the methods are inlined.
#[derive(Debug, Clone, Copy)]
pub struct Avx512(__m256);

run_with!(
    Avx512: "avx512f", "avx512vl", "avx512dq", "avx512bw", "avx2", "fma", "bmi1", "bmi2", "lzcnt", "popcnt"
);

impl Lanes for Avx512 {
    numbers_in_256_bits!();
    #[inline(always)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> u8 {
        // SAFETY: a value of this type exists, so this runs inside `run`, whose caller vouches for AVX-512; the
        // references are to the eight words that are read and written.
        unsafe {
            let order = lane_numbers!(order);
            let near = _mm256_permutexvar_ps(order, self.0);
            let hits = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, _mm256_permutexvar_ps(order, far.0));
            let words = _mm256_permutexvar_epi32(order, _mm256_loadu_si256(words.as_ptr().cast()));
            // Compressed in registers: Zen 4 takes more than a hundred cycles for a compression to memory.
            _mm256_storeu_si256(pushed.as_mut_ptr().cast(), _mm256_maskz_compress_epi32(hits, words));
            _mm256_storeu_ps(nears.as_mut_ptr(), _mm256_maskz_compress_ps(hits, near));
            hits
        }
    }
}
