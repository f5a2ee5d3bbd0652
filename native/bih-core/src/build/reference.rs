//! What the construction sorts: the bounds of one triangle and its row.

use crate::geometry::{Bounds, Triangles};
use crate::intersect::has_no_area;

/// Bounds and row of a triangle; sorted in place, 28 bytes each.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    pub bounds: Bounds,
    pub row: u32,
}

impl Reference {
    /// Twice the centre of the bounds, without a rounding that the split rule would notice.
    #[inline(always)]
    pub fn doubled_centre(&self, axis: usize) -> f64 {
        f64::from(self.bounds.lower[axis]) + f64::from(self.bounds.upper[axis])
    }
}

/// References of the triangles that a ray can hit, and the rows of those that none can: a coordinate that is not
/// finite, or no area.
pub fn collect(triangles: &Triangles) -> (Vec<Reference>, Vec<u32>) {
    let mut references = Vec::with_capacity(triangles.len());
    let mut rejected = Vec::new();
    for row in 0..triangles.len() as u32 {
        let corners = triangles.corners(row);
        if corners.iter().flatten().all(|x| x.is_finite()) && !has_no_area(&corners) {
            references.push(Reference { bounds: Bounds::of_triangle(&corners), row });
        } else {
            rejected.push(row);
        }
    }
    (references, rejected)
}
