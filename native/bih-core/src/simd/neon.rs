//! Eight lanes in two registers of NEON, which every 64-bit ARM processor has.

#![expect(unsafe_code, reason = "for the compiler intrinsics are unsafe; loads and stores go by pointers")]

use std::arch::aarch64::*;

use super::lanes::{Lanes, Mask, SET_BITS};

/// Lanes 0 to 3 and 4 to 7.
#[derive(Debug, Clone, Copy)]
pub struct Neon(float32x4_t, float32x4_t);

/// All bits of a lane set, or none.
#[derive(Debug, Clone, Copy)]
pub struct NeonMask(uint32x4_t, uint32x4_t);

/// Methods that are one intrinsic for each half.
macro_rules! for_both {
    ($($name:ident($($operand:ident),*) -> $output:ident: $intrinsic:ident)*) => {$(
        #[inline(always)]
        fn $name(self $(, $operand: Self)*) -> $output {
            // SAFETY: every 64-bit ARM processor has NEON.
            unsafe { $output($intrinsic(self.0 $(, $operand.0)*), $intrinsic(self.1 $(, $operand.1)*)) }
        }
    )*};
}

impl Mask for NeonMask {
    for_both! {
        and(other) -> Self: vandq_u32
        or(other) -> Self: vorrq_u32
        and_not(other) -> Self: vbicq_u32
    }
    #[inline(always)]
    fn bits(self) -> u8 {
        // SAFETY: every 64-bit ARM processor has NEON.
        unsafe { bits_of_bytes(bytes_of_mask(self)) }
    }
}

impl Lanes for Neon {
    type Mask = NeonMask;
    for_both! {
        plus(other) -> Self: vaddq_f32
        minus(other) -> Self: vsubq_f32
        times(other) -> Self: vmulq_f32
        over(other) -> Self: vdivq_f32
        magnitude() -> Self: vabsq_f32
        turned_by(other) -> Self: turned_by
        minimum(other) -> Self: smaller
        maximum(other) -> Self: larger
        fused(factor, term) -> Self: fused
        at_most(other) -> NeonMask: vcleq_f32
        below(other) -> NeonMask: vcltq_f32
    }
    #[inline(always)]
    fn mask(bits: u8) -> NeonMask {
        let lanes: [u32; 8] = [1, 2, 4, 8, 16, 32, 64, 128];
        // SAFETY: as in `splat`; four of the eight numbers stand at each pointer.
        unsafe {
            let set = vdupq_n_u32(u32::from(bits));
            NeonMask(vtstq_u32(set, vld1q_u32(lanes.as_ptr())), vtstq_u32(set, vld1q_u32(lanes[4..].as_ptr())))
        }
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: every 64-bit ARM processor has NEON.
        unsafe { Self(vdupq_n_f32(x), vdupq_n_f32(x)) }
    }
    #[inline(always)]
    fn load(values: &[f32; 8]) -> Self {
        let (low, high) = (values.as_ptr(), values[4..].as_ptr());
        // SAFETY: as in `splat`; four of the eight numbers stand at each pointer; any alignment is right.
        unsafe { Self(vld1q_f32(low), vld1q_f32(high)) }
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut values = [0.0; 8];
        // SAFETY: as in `splat`.
        unsafe { write(&mut values, self) };
        values
    }
    #[inline(always)]
    fn select(self, mask: NeonMask, other: Self) -> Self {
        // SAFETY: as in `splat`.
        unsafe { Self(vbslq_f32(mask.0, self.0, other.0), vbslq_f32(mask.1, self.1, other.1)) }
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        // SAFETY: as in `splat`.
        unsafe {
            let four = smaller(self.0, self.1);
            let two = smaller(four, vextq_f32::<2>(four, four));
            vgetq_lane_f32::<0>(smaller(two, vextq_f32::<1>(two, two)))
        }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: as in `splat`.
        unsafe {
            let four = larger(self.0, self.1);
            let two = larger(four, vextq_f32::<2>(four, four));
            vgetq_lane_f32::<0>(larger(two, vextq_f32::<1>(two, two)))
        }
    }
    #[inline(always)]
    fn push(self, far: Self, words: &[u32; 8], order: u32, nears: &mut [f32; 8], pushed: &mut [u32; 8]) -> u8 {
        // SAFETY: as in `splat`.
        unsafe {
            let order = lane_numbers(order);
            let hits = bits_of_bytes(vtbl1_u8(bytes_of_mask(self.at_most(far)), order));
            let lanes = vtbl1_u8(order, vcreate_u8(SET_BITS[usize::from(hits)]));
            write(nears, permuted(self, lanes));
            write(bytemuck::cast_mut(pushed), permuted(Self::load(bytemuck::cast_ref(words)), lanes));
            hits
        }
    }
}

// What follows has the feature of its own, as the intrinsics have: inside, they are safe.

#[inline]
#[target_feature(enable = "neon")]
fn write(values: &mut [f32; 8], lanes: Neon) {
    let (low, high) = values.split_at_mut(4);
    // SAFETY: each half has room for the four numbers that are written; any alignment is right.
    unsafe {
        vst1q_f32(low.as_mut_ptr(), lanes.0);
        vst1q_f32(high.as_mut_ptr(), lanes.1);
    }
}

#[inline]
#[target_feature(enable = "neon")]
fn turned_by(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    let sign = vandq_u32(vreinterpretq_u32_f32(b), vdupq_n_u32(1 << 31));
    vreinterpretq_f32_u32(veorq_u32(vreinterpretq_u32_f32(a), sign))
}

/// Not FMIN, which would give NaN where either is, and order the zeros.
#[inline]
#[target_feature(enable = "neon")]
fn smaller(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    vbslq_f32(vcltq_f32(a, b), a, b)
}

#[inline]
#[target_feature(enable = "neon")]
fn larger(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    vbslq_f32(vcgtq_f32(a, b), a, b)
}

#[inline]
#[target_feature(enable = "neon")]
fn fused(a: float32x4_t, factor: float32x4_t, term: float32x4_t) -> float32x4_t {
    vfmaq_f32(term, a, factor)
}

/// A byte a lane, all its bits set or none.
#[inline]
#[target_feature(enable = "neon")]
fn bytes_of_mask(mask: NeonMask) -> uint8x8_t {
    vmovn_u16(vcombine_u16(vmovn_u32(mask.0), vmovn_u32(mask.1)))
}

/// One bit of each byte.
#[inline]
#[target_feature(enable = "neon")]
fn bits_of_bytes(bytes: uint8x8_t) -> u8 {
    vaddv_u8(vand_u8(bytes, vcreate_u8(0x8040_2010_0804_0201)))
}

/// The eight numbers of four bits of an order, one a byte; only the lowest three bits are a lane's number.
#[inline]
#[target_feature(enable = "neon")]
fn lane_numbers(order: u32) -> uint8x8_t {
    let nibbles = vcreate_u8(u64::from(order));
    vand_u8(vzip1_u8(nibbles, vshr_n_u8::<4>(nibbles)), vdup_n_u8(7))
}

#[inline]
#[target_feature(enable = "neon")]
fn permuted(values: Neon, lanes: uint8x8_t) -> Neon {
    let lanes = vmovl_u8(lanes);
    let bytes = uint8x16x2_t(vreinterpretq_u8_f32(values.0), vreinterpretq_u8_f32(values.1));
    let low = vqtbl2q_u8(bytes, bytes_of_lanes(vget_low_u16(lanes)));
    let high = vqtbl2q_u8(bytes, bytes_of_lanes(vget_high_u16(lanes)));
    Neon(vreinterpretq_f32_u8(low), vreinterpretq_f32_u8(high))
}

/// Where the four bytes of each of these lanes stand among the thirty-two of all.
#[inline]
#[target_feature(enable = "neon")]
fn bytes_of_lanes(four: uint16x4_t) -> uint8x16_t {
    let first = vmulq_n_u32(vmovl_u16(four), 0x0404_0404);
    vreinterpretq_u8_u32(vaddq_u32(first, vdupq_n_u32(0x0302_0100)))
}
