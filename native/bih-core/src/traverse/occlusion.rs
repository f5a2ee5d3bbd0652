//! Whether anything is hit.

use super::fast::FastOccluded;
use super::scene::Scene;
use super::watertight::WatertightOccluded;
use super::{Counter, Stack, node_search, single, wide};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::Tree;

/// Whether any triangle lies between the ends of a valid ray; ends at the first that does. Through the records of a scene,
/// if there are any, else through the nodes of the tree.
#[inline(always)]
pub(super) fn occluded<L: Lanes, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    scene: Option<&Scene>,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    let Some(scene) = scene else { return in_nodes(tree, triangles, ray, stack, counter) };
    let stack = &mut stack.wide;
    match tree.precision {
        Precision::Fast => wide::search::<L, FastOccluded, C>(scene, ray, stack, counter),
        Precision::Watertight | Precision::Exact => {
            wide::search::<L, WatertightOccluded, C>(scene, ray, stack, counter)
        }
    }
}

/// The same over binary nodes.
#[inline(always)]
pub(super) fn in_nodes<C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> bool {
    match tree.precision {
        Precision::Fast => node_search::search::<single::Any, C>(tree, triangles, ray, stack, counter),
        Precision::Watertight | Precision::Exact => {
            node_search::search::<node_search::Any, C>(tree, triangles, ray, stack, counter)
        }
    }
}

/// The same for many rays, 2 × 2 together.
#[inline(always)]
pub(super) fn two_by_two(tree: &Tree, triangles: &Triangles, rays: &[Ray], stack: &mut Stack, hidden: &mut [bool]) {
    match tree.precision {
        Precision::Fast => node_search::search_packets::<single::Any>(tree, triangles, rays, stack, hidden),
        Precision::Watertight | Precision::Exact => {
            node_search::search_packets::<node_search::Any>(tree, triangles, rays, stack, hidden)
        }
    }
}
