//! Precision `fast` without lanes: over the paper's nodes, and over all triangles.

use super::Hit;
use super::node_search::NodeSearch;
use crate::geometry::{Ray, Triangles};
use crate::intersect::{SingleHit, SingleRay};
use crate::tree::Tree;

/// The nearest of the triangles it is offered; of equal distances the lower row.
pub(super) struct Nearest {
    ray: SingleRay,
    best: Option<(SingleHit, u32)>,
}

impl Nearest {
    fn offer(&mut self, row: u32, triangles: &Triangles) {
        if let Some(hit) = meet(&self.ray, row, triangles) {
            let precedes = |(best, other): (SingleHit, u32)| hit.t < best.t || hit.t == best.t && row < other;
            if self.best.is_none_or(precedes) {
                self.best = Some((hit, row));
            }
        }
    }
}

pub(super) fn meet(ray: &SingleRay, row: u32, triangles: &Triangles) -> Option<SingleHit> {
    ray.meet(&triangles.corners(row).map(|corner| corner.map(|x| x as f32)))
}

impl NodeSearch for Nearest {
    type Answer = Option<Hit>;

    fn new(ray: &Ray, _: &Tree) -> Self {
        Self { ray: SingleRay::new(ray), best: None }
    }

    fn ray(&self) -> Ray {
        self.ray.widened()
    }

    #[inline(always)]
    fn test(&mut self, rows: &[u32], triangles: &Triangles) {
        for &row in rows {
            self.offer(row, triangles);
        }
    }

    fn limit(&self) -> f64 {
        f64::from(self.best.map_or(self.ray.t_max, |(hit, _)| hit.t))
    }

    fn answer(&self) -> Option<Hit> {
        self.best.map(|(hit, row)| Hit::single(hit, row))
    }
}

/// Whether anything is hit.
pub(super) struct Any {
    ray: SingleRay,
    found: bool,
}

impl NodeSearch for Any {
    type Answer = bool;

    fn new(ray: &Ray, _: &Tree) -> Self {
        Self { ray: SingleRay::new(ray), found: false }
    }

    fn ray(&self) -> Ray {
        self.ray.widened()
    }

    #[inline(always)]
    fn test(&mut self, rows: &[u32], triangles: &Triangles) {
        self.found |= rows.iter().any(|&row| meet(&self.ray, row, triangles).is_some());
    }

    fn limit(&self) -> f64 {
        if self.found { f64::NEG_INFINITY } else { f64::from(self.ray.t_max) }
    }

    fn answer(&self) -> bool {
        self.found
    }
}

pub(super) fn naive_closest(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    let mut nearest = Nearest::new(ray, tree);
    nearest.test(&tree.references(), triangles);
    nearest.answer()
}

pub(super) fn naive_occluded(tree: &Tree, triangles: &Triangles, ray: &Ray) -> bool {
    let mut any = Any::new(ray, tree);
    any.test(&tree.references(), triangles);
    any.answer()
}
