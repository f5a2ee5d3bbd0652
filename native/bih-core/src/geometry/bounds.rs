//! Axis-aligned bounds in single precision, rounded outward.

use std::array::from_fn;

use super::Corners;

/// Lower and upper corner of a box; empty where a lower component exceeds its upper one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The smallest coordinates.
    pub lower: [f32; 3],
    /// The largest coordinates.
    pub upper: [f32; 3],
}

impl Bounds {
    /// The bounds of nothing.
    pub const EMPTY: Self = Self { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// The bounds of one triangle, rounded outward where a coordinate is not a float32.
    pub fn of_triangle(corners: &Corners) -> Self {
        // Adding +0 makes -0 a +0: which of the two a minimum gives is left open, and the bits of a tree are not.
        let [a, b, c] = corners;
        Self {
            lower: from_fn(|axis| round_down(a[axis].min(b[axis]).min(c[axis])) + 0.0),
            upper: from_fn(|axis| round_up(a[axis].max(b[axis]).max(c[axis])) + 0.0),
        }
    }

    /// What lies in both.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            lower: std::array::from_fn(|axis| self.lower[axis].max(other.lower[axis])),
            upper: std::array::from_fn(|axis| self.upper[axis].min(other.upper[axis])),
        }
    }

    /// The smallest bounds that hold both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        let mut bounds = *self;
        for axis in 0..3 {
            bounds.lower[axis] = bounds.lower[axis].min(other.lower[axis]);
            bounds.upper[axis] = bounds.upper[axis].max(other.upper[axis]);
        }
        bounds
    }

    /// Whether `other` lies inside or on these bounds.
    pub fn contains(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.lower[axis] <= other.lower[axis] && other.upper[axis] <= self.upper[axis])
    }
}

/// The largest float32 that is not above `x`.
#[inline(always)]
pub fn round_down(x: f64) -> f32 {
    let rounded = x as f32;
    stepped(rounded, -i32::from(f64::from(rounded) > x))
}

/// The smallest float32 that is not below `x`.
#[inline(always)]
pub fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    stepped(rounded, i32::from(f64::from(rounded) < x))
}

/// The float32 so many steps above `x`; without a branch, because which way a number is rounded cannot be predicted.
///
/// Their bits count upwards from zero, those of negative numbers turned over; −0 comes just before +0, and what is rounded
/// to one of both has its sign.
#[inline(always)]
fn stepped(x: f32, steps: i32) -> f32 {
    let turned = |bits: i32| bits ^ (bits >> 31).cast_unsigned().wrapping_shr(1).cast_signed();
    f32::from_bits(turned(turned(x.to_bits().cast_signed()) + steps).cast_unsigned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_outward_and_exact_on_float32() {
        for x in [0.0, -0.0, 1.0, -1.5, f64::from(f32::MIN_POSITIVE) / 8.0, f64::from(f32::MAX)] {
            assert_eq!(f64::from(round_down(x)), x);
            assert_eq!(f64::from(round_up(x)), x);
        }
        for x in [0.1, -0.1, 1.0 + 1e-12, -1e-300, 1e-300, 3.5e38, -3.5e38, 1e300] {
            assert!(f64::from(round_down(x)) < x && x < f64::from(round_up(x)), "{x}");
            assert_eq!(round_down(x).next_up(), round_up(x));
        }
        assert_eq!([round_down(1e300), round_up(1e300)], [f32::MAX, f32::INFINITY]);
        assert_eq!([round_down(-1e300), round_up(-1e300)], [f32::NEG_INFINITY, f32::MIN]);
        for x in [f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!([round_down(x), round_up(x)], [x as f32; 2]);
        }
        assert!(round_down(f64::NAN).is_nan() && round_up(f64::NAN).is_nan());
    }
}
