//! What AVX2 and AVX-512 share: eight numbers in one register of 256 bits, and how a kernel gets an instruction set.
//!
//! Lanes and their masks come into being only inside the instruction set's `run`, into which the methods are inlined
//! and whose caller vouches for AVX2 and FMA at least: "inside `run`" below.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::x86_64::*;

use super::lanes::Mask;

/// All bits of a lane set, or none.
///
/// For AVX-512 too: one combined from comparisons in its mask registers takes half as long again on Zen 4.
#[derive(Debug, Clone, Copy)]
pub struct Mask256(pub(super) __m256);

impl Mask for Mask256 {
    #[inline(always)]
    fn bits(self) -> u8 {
        // SAFETY: inside `run`.
        unsafe { _mm256_movemask_ps(self.0) as u8 }
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: inside `run`.
        Self(unsafe { _mm256_and_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        // SAFETY: inside `run`.
        Self(unsafe { _mm256_or_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        // SAFETY: inside `run`.
        Self(unsafe { _mm256_andnot_ps(other.0, self.0) })
    }
}

/// All of `Lanes` but `push`, for a type that wraps an `__m256`.
macro_rules! numbers_in_256_bits {
    () => {
        type Mask = Mask256;
        #[inline(always)]
        fn mask(bits: u8) -> Mask256 {
            // SAFETY: inside `run`.
            unsafe {
                let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let set = _mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), lanes);
                Mask256(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lanes)))
            }
        }
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(values: &[f32; 8]) -> Self {
            // SAFETY: inside `run`; the reference is to the eight numbers that are read, of any alignment.
            Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
        }
        #[inline(always)]
        fn from_bytes(bytes: &[u8; 8]) -> Self {
            let bytes = i64::from_le_bytes(*bytes);
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(bytes))) })
        }
        #[inline(always)]
        fn rounded(values: &[f64; 8]) -> Self {
            // SAFETY: inside `run`; the reference is to the eight numbers that are read, of any alignment.
            unsafe {
                let low = _mm256_cvtpd_ps(_mm256_loadu_pd(values.as_ptr()));
                let high = _mm256_cvtpd_ps(_mm256_loadu_pd(values[4..].as_ptr()));
                Self(_mm256_set_m128(high, low))
            }
        }
        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut values = [0.0; 8];
            // SAFETY: inside `run`; the array has room for the eight numbers that are written, at any alignment.
            unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
            values
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn over(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_div_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn magnitude(self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn turned_by(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_xor_ps(self.0, _mm256_and_ps(_mm256_set1_ps(-0.0), other.0)) })
        }
        #[inline(always)]
        fn minimum(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn maximum(self, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn fused(self, factor: Self, term: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
        }
        #[inline(always)]
        fn at_most(self, other: Self) -> Mask256 {
            // SAFETY: inside `run`.
            Mask256(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn below(self, other: Self) -> Mask256 {
            // SAFETY: inside `run`.
            Mask256(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn select(self, mask: Mask256, other: Self) -> Self {
            // SAFETY: inside `run`.
            Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
        }
        #[inline(always)]
        fn smallest(self) -> f32 {
            // SAFETY: inside `run`.
            unsafe {
                let four = _mm_min_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_min_ss(two, _mm_movehdup_ps(two)))
            }
        }
        #[inline(always)]
        fn largest(self) -> f32 {
            // SAFETY: inside `run`.
            unsafe {
                let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
            }
        }
        #[inline(always)]
        fn transposed(rows: [Self; 8]) -> [Self; 8] {
            let [Self(a), Self(b), Self(c), Self(d), Self(e), Self(f), Self(g), Self(h)] = rows;
            // SAFETY: inside `run`.
            unsafe {
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
    };
}

/// Columns of four rows: the first four, and beside them the last four.
///
/// # Safety
/// The processor must have AVX.
#[inline(always)]
pub(super) unsafe fn four_transposed(a: __m256, b: __m256, c: __m256, d: __m256) -> [__m256; 4] {
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

/// From one list of features: whether the processor has them, and a function that runs a kernel with them.
macro_rules! run_with {
    ($lanes:ty: $($feature:tt),+) => {
        /// Whether this processor has all that `run` enables.
        pub fn is_available() -> bool {
            true $(&& is_x86_feature_detected!($feature))+
        }

        /// Run the kernel in these lanes.
        ///
        /// # Safety
        /// `is_available` has answered true.
        #[target_feature($(enable = $feature),+)]
        pub unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<$lanes>()
        }
    };
}

/// The eight numbers of four bits of an order, one a lane; only the lowest three bits of a lane are its number.
macro_rules! lane_numbers {
    ($order:expr) => {
        _mm256_srlv_epi32(_mm256_set1_epi32($order.cast_signed()), _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28))
    };
}

pub(super) use {lane_numbers, numbers_in_256_bits, run_with};
