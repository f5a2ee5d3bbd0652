//! Every triangle, one after another: what every faster way is tested against.

use super::closest::{Hit, Nearest, distance_within};
use super::rounding::round_hits;
use super::single;
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::intersect::RayTest;
use crate::simd::InstructionSet;
use crate::tree::Tree;

/// The nearest hit of a valid ray among all triangles that were not rejected.
pub fn naive_closest(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    if tree.precision == Precision::Fast {
        return single::naive_closest(tree, triangles, ray);
    }
    let mut nearest = Nearest::new(ray, tree);
    for row in tree.references() {
        nearest.offer(row, triangles.corners(row));
    }
    let mut hit = [nearest.hit()];
    if tree.precision == Precision::Exact {
        round_hits(InstructionSet::Scalar, triangles, &[*ray], &mut hit);
    }
    hit[0]
}

/// Whether any triangle lies between the ends of a valid ray.
pub fn naive_occluded(tree: &Tree, triangles: &Triangles, ray: &Ray) -> bool {
    if tree.precision == Precision::Fast {
        return single::naive_occluded(tree, triangles, ray);
    }
    let test = RayTest::new(ray, tree.bounds());
    tree.references().into_iter().any(|row| distance_within(ray, &test, &triangles.corners(row)).is_some())
}
