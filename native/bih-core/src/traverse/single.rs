//! Precision `fast` without lanes: over the paper's nodes, and over all triangles.

use std::ops::ControlFlow;

use super::closest::walk;
use super::{Counter, Hit, Stack};
use crate::geometry::{Ray, Triangles};
use crate::intersect::{SingleHit, SingleRay};
use crate::tree::Tree;

/// The nearest of the triangles it is offered; of equal distances the lower row.
struct Nearest {
    ray: SingleRay,
    best: Option<(SingleHit, u32)>,
}

impl Nearest {
    fn new(ray: &Ray) -> Self {
        Self { ray: SingleRay::new(ray), best: None }
    }

    fn limit(&self) -> f64 {
        f64::from(self.best.map_or(self.ray.t_max, |(hit, _)| hit.t))
    }

    fn offer(&mut self, row: u32, triangles: &Triangles) {
        if let Some(hit) = meet(&self.ray, row, triangles) {
            let precedes = |(best, other): (SingleHit, u32)| hit.t < best.t || hit.t == best.t && row < other;
            if self.best.is_none_or(precedes) {
                self.best = Some((hit, row));
            }
        }
    }

    fn hit(&self) -> Option<Hit> {
        self.best.map(|(hit, row)| Hit::single(hit, row))
    }
}

fn meet(ray: &SingleRay, row: u32, triangles: &Triangles) -> Option<SingleHit> {
    ray.meet(&triangles.corners(row).map(|corner| corner.map(|x| x as f32)))
}

pub(super) fn closest<C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> Option<Hit> {
    let mut nearest = Nearest::new(ray);
    let ray = nearest.ray.widened();
    walk(tree, triangles, &ray, stack, counter, |rows| {
        for &row in rows {
            nearest.offer(row, triangles);
        }
        ControlFlow::Continue(nearest.limit())
    });
    nearest.hit()
}

pub(super) fn occluded<C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    let single = SingleRay::new(ray);
    let mut found = false;
    walk(tree, triangles, &single.widened(), stack, counter, |rows| {
        found = rows.iter().any(|&row| meet(&single, row, triangles).is_some());
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(f64::from(single.t_max)) }
    });
    found
}

pub(super) fn naive_closest(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    let mut nearest = Nearest::new(ray);
    for row in tree.references() {
        nearest.offer(row, triangles);
    }
    nearest.hit()
}

pub(super) fn naive_occluded(tree: &Tree, triangles: &Triangles, ray: &Ray) -> bool {
    let ray = SingleRay::new(ray);
    tree.references().into_iter().any(|row| meet(&ray, row, triangles).is_some())
}
