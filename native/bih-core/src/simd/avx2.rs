//! Eight lanes in one register of AVX2.

#![expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]

use std::arch::x86_64::*;

use super::Kernel;
use super::lanes::Lanes;

/// Lanes of AVX2. They come into being only inside `run`, into which the methods are inlined.
#[derive(Debug, Clone, Copy)]
pub struct Avx2(__m256);

/// Run the kernel in lanes of AVX2.
///
/// # Safety
/// The processor must have these instruction sets.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
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
        at_most(other) -> u8 { |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u8 }
        below(other) -> u8 { |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u8 }
    }
}
