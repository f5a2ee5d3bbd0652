//! Every triangle that a ray may hit, through any tree.

use std::ops::ControlFlow;

use super::aim::Aim;
use super::closest::walk;
use super::filter::Filter;
use super::scene::{Leaf, Scene, bits};
use super::search::Walker;
use super::slab::Slab;
use super::watertight::{candidates, filter, single};
use super::{Counter, Stack, Uncounted, wide};
use crate::geometry::{Corners, Ray, Triangles, Vertices};
use crate::simd::Lanes;
use crate::tree::Tree;

/// What is done with the triangles that a ray may hit.
pub(crate) trait Visitor {
    /// One of them; a kd-tree may offer it several times. Whether the answer is known now.
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool;

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
    let filter = tree.wide.as_ref().and_then(|wide| filter(ray, &Scene::new(wide, tree, triangles)));
    along::<L, V, _>(tree, triangles, &Aim::exact(ray), filter, stack, visitor, &mut Uncounted);
}

/// The same for images of the triangles that the ray meets which this one leads to. Whether the visitor has its answer.
#[inline(always)]
pub(crate) fn every_near<L: Lanes, V: Visitor, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    aim: &Aim,
    stack: &mut Stack,
    visitor: &mut V,
    counter: &mut C,
) -> bool {
    let filter = tree.wide.as_ref().and_then(|_| Filter::around(aim, &tree.bounds, triangles.is_double()));
    along::<L, V, C>(tree, triangles, aim, filter, stack, visitor, counter)
}

/// The same where the tree is over boxes of the images, and the triangles themselves are elsewhere: all whose boxes the ray
/// comes near to.
#[inline(always)]
pub(crate) fn every_in_boxes<L: Lanes, V: Visitor, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    aim: &Aim,
    stack: &mut Stack,
    visitor: &mut V,
    counter: &mut C,
) -> bool {
    along::<L, V, C>(tree, triangles, aim, None, stack, visitor, counter)
}

/// The same through a tree of records over boxes: triangles that nobody has, whose rows are those of the boxes.
#[inline(always)]
pub(crate) fn every_box<L: Lanes, V: Visitor, C: Counter>(
    tree: &Tree,
    ray: &Ray,
    stack: &mut Stack,
    visitor: &mut V,
    counter: &mut C,
) {
    // Where the boxes are is known to the tree.
    let boxes = Triangles::unchecked(Vertices::F32(&[]), None);
    if let Some(wide) = &tree.wide {
        in_records::<L, V, C>(&Scene::new(wide, tree, &boxes), &Aim::exact(ray), None, stack, visitor, counter);
    }
}

#[inline(always)]
fn along<L: Lanes, V: Visitor, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    aim: &Aim,
    filter: Option<Filter>,
    stack: &mut Stack,
    visitor: &mut V,
    counter: &mut C,
) -> bool {
    if let Some(wide) = &tree.wide {
        let scene = Scene::new(wide, tree, triangles);
        return in_records::<L, V, C>(&scene, aim, filter, stack, visitor, counter);
    }
    let mut is_known = false;
    walk(tree, triangles, aim, stack, counter, |rows| {
        is_known = rows.iter().any(|&row| visitor.visit::<L>(row, &triangles.corners(row)));
        if is_known { ControlFlow::Break(()) } else { ControlFlow::Continue(visitor.limit()) }
    });
    is_known
}

#[inline(always)]
fn in_records<L: Lanes, V: Visitor, C: Counter>(
    scene: &Scene,
    aim: &Aim,
    filter: Option<Filter>,
    stack: &mut Stack,
    visitor: &mut V,
    counter: &mut C,
) -> bool {
    let limit = single(visitor.limit());
    let mut guide = Guide { aim: *aim, filter, limit, is_known: false, visitor };
    wide::visit::<L, _, _>(scene, &aim.ray, &mut guide, &mut stack.wide, counter);
    guide.is_known
}

/// Leads a visitor from leaf to leaf.
struct Guide<'a, V> {
    aim: Aim,
    filter: Option<Filter>,
    limit: f32,
    is_known: bool,
    visitor: &'a mut V,
}

impl<V: Visitor> Walker for Guide<'_, V> {
    #[inline(always)]
    fn slab(&self, _: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::around(&self.aim, scene)
    }

    fn ray(&self) -> Ray {
        self.aim.ray
    }

    fn aim(&self) -> Aim {
        self.aim
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        for lane in bits(candidates::<L>(&self.filter, scene, &self.aim.ray, leaf, self.limit)) {
            let row = scene.row(leaf.first + lane);
            // For precision `fast` the tree holds corners in single precision, whatever the mesh's.
            let is_single = !scene.triangles.is_double();
            let corners = if is_single { scene.corners(leaf, lane) } else { scene.triangles.corners(row) };
            if self.visitor.visit::<L>(row, &corners) {
                self.is_known = true;
                return true;
            }
        }
        self.limit = single(self.visitor.limit());
        false
    }
}
