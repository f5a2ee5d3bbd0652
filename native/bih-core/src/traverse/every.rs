//! Every triangle that a ray may hit, through any tree.

use std::ops::ControlFlow;

use super::closest::walk;
use super::filter::Filter;
use super::scene::{Leaf, Scene, bits};
use super::search::Walker;
use super::slab::Slab;
use super::watertight::{candidates, filter, single};
use super::{Stack, Uncounted, wide};
use crate::geometry::{Corners, Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::Tree;

/// What is done with the triangles that a ray may hit.
pub(super) trait Visitor {
    /// One of them; a kd-tree may offer it several times. Whether the answer is known now.
    fn visit(&mut self, row: u32, corners: &Corners) -> bool;

    /// Past this nothing matters.
    fn limit(&self) -> f64;
}

/// Show a visitor every triangle that a valid ray meets exactly before the visitor's limit, and some others.
#[inline(always)]
pub(super) fn every<L: Lanes, V: Visitor>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    visitor: &mut V,
) {
    let Some(wide) = &tree.wide else {
        return walk(tree, triangles, ray, stack, &mut Uncounted, |rows| {
            match rows.iter().any(|&row| visitor.visit(row, &triangles.corners(row))) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(visitor.limit()),
            }
        });
    };
    let scene = Scene::new(wide, tree, triangles);
    let limit = single(visitor.limit());
    let mut guide = Guide { ray: *ray, filter: filter(ray, &scene), limit, visitor };
    wide::visit::<L, _, _>(&scene, ray, &mut guide, &mut stack.wide, &mut Uncounted);
}

/// Leads a visitor from leaf to leaf.
struct Guide<'a, V> {
    ray: Ray,
    filter: Option<Filter>,
    limit: f32,
    visitor: &'a mut V,
}

impl<V: Visitor> Walker for Guide<'_, V> {
    #[inline(always)]
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::new(ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        for lane in bits(candidates::<L>(&self.filter, scene, leaf, self.limit)) {
            let row = scene.row(leaf.first + lane);
            // For precision `fast` the tree holds corners in single precision, whatever the mesh's.
            let is_single = !scene.triangles.is_double();
            let corners = if is_single { scene.corners(leaf, lane) } else { scene.triangles.corners(row) };
            if self.visitor.visit(row, &corners) {
                return true;
            }
        }
        self.limit = single(self.visitor.limit());
        false
    }
}
