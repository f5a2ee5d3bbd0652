//! Whether anything is hit.

use std::ops::ControlFlow;

use super::closest::{distance_within, walk};
use super::fast::FastOccluded;
use super::scene::Scene;
use super::watertight::WatertightOccluded;
use super::{Counter, Stack, single, wide};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::intersect::RayTest;
use crate::simd::Lanes;
use crate::tree::Tree;

/// Whether any triangle lies between the ends of a valid ray; ends at the first that does.
#[inline(always)]
pub fn occluded<L: Lanes, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    if let Some(wide) = &tree.wide {
        return in_records::<L, C>(&Scene::new(wide, tree, triangles), ray, stack, counter);
    }
    in_nodes(tree, triangles, ray, stack, counter)
}

/// The same over records.
#[inline(always)]
fn in_records<L: Lanes, C: Counter>(scene: &Scene, ray: &Ray, stack: &mut Stack, counter: &mut C) -> bool {
    let stack = &mut stack.wide;
    match scene.tree.precision {
        Precision::Fast => wide::search::<L, FastOccluded, C>(scene, ray, stack, counter),
        Precision::Watertight => wide::search::<L, WatertightOccluded, C>(scene, ray, stack, counter),
    }
}

/// The same over the paper's nodes.
#[inline(always)]
pub(super) fn in_nodes<C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    if tree.precision == Precision::Fast {
        return single::occluded(tree, triangles, ray, stack, counter);
    }
    let test = RayTest::new(ray, tree.bounds());
    let mut found = false;
    walk(tree, triangles, ray, stack, counter, |rows| {
        found = rows.iter().any(|&row| distance_within(ray, &test, &triangles.corners(row)).is_some());
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
    });
    found
}
