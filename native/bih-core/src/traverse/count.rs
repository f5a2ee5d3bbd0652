//! How often a ray crosses the surface: decided exactly, whatever the precision of the tree.

use super::Stack;
use super::closest::is_between;
use super::every::{Visitor, every};
use super::trace::Tracer;
use crate::geometry::{Corners, Ray, Triangles};
use crate::intersect::{Distance, RayTest};
use crate::simd::{Kernel, Lanes, dispatch_common_to};
use crate::tree::Tree;

impl Tracer<'_> {
    /// How many triangles each ray crosses between its ends, once it is moved by less than any number; none for an
    /// invalid ray.
    pub fn count(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [i32]) {
        assert_eq!(rays.len(), counts.len());
        dispatch_common_to(self.set, Count { tracer: self, rays, stack, counts });
    }
}

struct Count<'a> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    stack: &'a mut Stack,
    counts: &'a mut [i32],
}

impl Kernel for Count<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer: Tracer { tree, triangles, .. }, rays, stack, counts } = self;
        for (ray, count) in rays.iter().zip(counts) {
            *count = if ray.is_valid() { crossings::<L>(tree, triangles, ray, stack) as i32 } else { 0 };
        }
    }
}

/// Triangles that were counted: their number, or where the same may come again their rows.
pub(super) struct Tally {
    number: usize,
    rows: Option<Vec<u32>>,
}

impl Tally {
    pub(super) fn new(tree: &Tree) -> Self {
        Self { number: 0, rows: tree.kd_tree.is_some().then(Vec::new) }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, row: u32) {
        match &mut self.rows {
            Some(rows) => rows.push(row),
            None => self.number += 1,
        }
    }

    pub(super) fn total(self) -> usize {
        let Some(mut rows) = self.rows else { return self.number };
        rows.sort_unstable();
        rows.dedup();
        rows.len()
    }
}

struct Crossings<'a> {
    ray: &'a Ray,
    test: RayTest,
    tally: Tally,
}

impl Visitor for Crossings<'_> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        if crosses(self.ray, &self.test, corners) {
            self.tally.add(row);
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ray.t_max
    }
}

/// Whether the moved ray crosses a triangle, and meets it between the ends where it is.
#[inline(always)]
pub(super) fn crosses(ray: &Ray, test: &RayTest, corners: &Corners) -> bool {
    test.crosses(corners) && is_between(&Distance::new(test, corners), ray, test, corners)
}

#[inline(always)]
fn crossings<L: Lanes>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> usize {
    let mut crossings = Crossings { ray, test: RayTest::new(ray, tree.bounds()), tally: Tally::new(tree) };
    every::<L, _>(tree, triangles, ray, stack, &mut crossings);
    crossings.tally.total()
}
