//! Ray against triangle: in single precision, or decided in double precision where a proven bound allows, in whole
//! numbers where not.

mod containment;
mod distance;
mod double_double;
mod exact;
mod fixed;
mod image;
mod moller_trumbore;
mod pairs;
mod parity;
mod real;
mod rounding;
mod side;
mod watertight;
mod whole;

pub use containment::{PointTest, Sight};
pub use distance::{Distance, clamped, located_quickly, weights};
#[cfg(test)]
pub(crate) use exact::{Fraction, is_inside as is_inside_exactly};
pub use image::rounded_sum;
pub use moller_trumbore::{Meeting, SingleHit, SingleRay};
pub use real::{Image, Real};
pub use rounding::{rounded, rounded_quickly};
pub use watertight::{RayTest, has_no_area};

/// Half a unit in the last place of 1: the largest relative error of one rounding in double precision.
pub(crate) const EPSILON: f64 = f64::EPSILON / 2.0;

/// What it takes to decide something; each leaves something over to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Means {
    /// One double.
    Double,
    /// Sums of two doubles.
    Pairs,
    /// Whole numbers of a fixed length.
    Whole,
    /// Big integers.
    Big,
}
