//! Every triangle, one after another: what every faster way is tested against.

use super::closest::{Hit, Nearest, distance_within, hit_at};
use super::count::crosses;
use super::rounding::{round_all, round_hits};
use super::{Tracer, single};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles, Vector};
use crate::intersect::{PointTest, RayTest, Sight};
use crate::simd::InstructionSet;
use crate::tree::Tree;

/// The nearest hit of a valid ray among all triangles that were not rejected.
pub fn naive_closest(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    if tree.precision == Precision::Fast {
        return single::naive_closest(tree, triangles, ray);
    }
    let mut nearest = Nearest::new(ray, tree);
    for row in tree.references() {
        nearest.offer(row, triangles.corners(row), |row| row);
    }
    let mut hit = [nearest.hit()];
    if tree.precision == Precision::Exact {
        round_hits(&Tracer { tree, triangles, set: InstructionSet::Scalar }, &[*ray], &mut hit);
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

/// All hits of a valid ray, decided exactly, nearest first and of equal distances the lower row first.
pub fn naive_all(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Vec<Hit> {
    let test = RayTest::new(ray, tree.bounds());
    let mut met: Vec<_> = rows(tree)
        .into_iter()
        .filter_map(|row| {
            let corners = triangles.corners(row);
            Some((row, corners, distance_within(ray, &test, &corners)?))
        })
        .collect();
    met.sort_by(|(row, corners, distance), (other, others, another)| {
        distance.compare(corners, another, others, &test).then(row.cmp(other))
    });
    let mut hits: Vec<_> = met.iter().map(|(row, corners, distance)| hit_at(&test, *row, corners, distance)).collect();
    if tree.precision == Precision::Exact {
        round_all(&Tracer { tree, triangles, set: InstructionSet::Scalar }, ray, &mut hits);
    }
    hits
}

/// How many triangles a valid ray crosses between its ends.
pub fn naive_count(tree: &Tree, triangles: &Triangles, ray: &Ray) -> usize {
    let test = RayTest::new(ray, tree.bounds());
    rows(tree).into_iter().filter(|&row| crosses(ray, &test, &triangles.corners(row))).count()
}

/// Whether a finite point is inside the surface or on it.
pub fn naive_contains(tree: &Tree, triangles: &Triangles, point: &Vector) -> bool {
    let test = PointTest::new(point, tree.bounds());
    let sights: Vec<_> = rows(tree).into_iter().map(|row| test.sight(&triangles.corners(row))).collect();
    let above = sights.iter().filter(|&&sight| sight == Sight::Above).count();
    sights.contains(&Sight::Touched) || above % 2 == 1
}

/// Each row that is not rejected, once.
fn rows(tree: &Tree) -> Vec<u32> {
    let mut rows = tree.references();
    rows.sort_unstable();
    rows.dedup();
    rows
}
