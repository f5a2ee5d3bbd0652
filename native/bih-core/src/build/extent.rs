//! The first pass over a mesh: the bounds of what can be hit, and the rows of what cannot.

use std::ops::Range;

use rayon::prelude::*;

use super::accepted::CHUNK;
use super::source::{Coordinate, Reading, Source, box_of, least, most, read};
use crate::control::{Cancelled, Control};
use crate::geometry::{Bounds, Triangles, round_down, round_up};
use crate::intersect::has_no_area;
use crate::simd::FloatEnvironment;

/// The bounds of all triangles that a ray can hit, in the mesh's own precision, and the rows of the others, ascending.
#[derive(Debug)]
pub struct Extent {
    pub lower: [f64; 3],
    pub upper: [f64; 3],
    pub rejected: Vec<u32>,
}

impl Extent {
    pub fn of(triangles: &Triangles, control: &Control) -> Result<Self, Cancelled> {
        let parts: Vec<_> = (0..triangles.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let _standard = FloatEnvironment::standard();
                control.check()?;
                let rows = chunk * CHUNK..triangles.len().min((chunk + 1) * CHUNK);
                Ok(read(triangles, Part { rows }))
            })
            .collect::<Result<_, Cancelled>>()?;
        let mut all = Self { lower: [f64::INFINITY; 3], upper: [f64::NEG_INFINITY; 3], rejected: Vec::new() };
        for part in parts {
            for axis in 0..3 {
                all.lower[axis] = least(part.lower[axis], all.lower[axis]);
                all.upper[axis] = most(part.upper[axis], all.upper[axis]);
            }
            all.rejected.extend(part.rejected);
        }
        Ok(all)
    }

    /// In single precision, rounded outward.
    pub fn bounds(&self) -> Bounds {
        // Adding +0 makes -0 a +0.
        Bounds { lower: self.lower.map(|x| round_down(x) + 0.0), upper: self.upper.map(|x| round_up(x) + 0.0) }
    }
}

struct Part {
    rows: Range<usize>,
}

impl Reading for Part {
    type Output = Extent;

    #[inline(always)]
    fn run<S: Source>(self, source: S) -> Extent {
        let mut lower = [S::Scalar::INFINITY; 3];
        let mut upper = [S::Scalar::NEG_INFINITY; 3];
        let mut rejected = Vec::new();
        for row in self.rows {
            let corners = source.corners(row);
            if !surely_has_area(&corners) && cannot_be_hit(&corners) {
                rejected.push(row as u32);
                continue;
            }
            let [low, high] = box_of(&corners);
            for axis in 0..3 {
                lower[axis] = least(low[axis], lower[axis]);
                upper[axis] = most(high[axis], upper[axis]);
            }
        }
        Extent { lower: lower.map(Into::into), upper: upper.map(Into::into), rejected }
    }
}

/// The test of `has_no_area` in the single precision that nearly all triangles are sure in. False for a coordinate that
/// is not finite, because its differences are not.
#[inline(always)]
fn surely_has_area<T: Coordinate>(corners: &[[T; 3]; 3]) -> bool {
    const LARGEST: f32 = 1e18;
    const UNIT: f32 = f32::EPSILON / 2.0;
    let a: [f32; 3] = std::array::from_fn(|axis| corners[1][axis].above_by(corners[0][axis]));
    let b: [f32; 3] = std::array::from_fn(|axis| corners[2][axis].above_by(corners[0][axis]));
    // Without branches.
    let in_range = (0..3).fold(true, |all, axis| all & (a[axis].abs() < LARGEST) & (b[axis].abs() < LARGEST));
    let has_area = (0..3).any(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = (a[j] * b[k], a[k] * b[j]);
        // Two roundings of each difference at most, one of each product, one of their difference; underflow.
        (p - q).abs() > 7.0 * UNIT * (p.abs() + q.abs()) + f32::MIN_POSITIVE
    });
    in_range && has_area
}

#[cold]
#[inline(never)]
fn cannot_be_hit<T: Coordinate>(corners: &[[T; 3]; 3]) -> bool {
    let corners = corners.map(|corner| corner.map(Into::<f64>::into));
    !corners.as_flattened().iter().all(|x| x.is_finite()) || has_no_area(&corners)
}
