//! Whether anything is hit.

use std::ops::ControlFlow;

use super::closest::{distance_within, walk};
use super::{Counter, Stack, wide};
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
    let test = RayTest::new(ray, tree.bounds());
    let mut found = false;
    if let Some(wide) = &tree.wide {
        wide::walk::<L, C>(wide, tree, triangles, ray, &mut stack.wide, counter, |_, corners| {
            found = distance_within(ray, &test, &corners).is_some();
            if found { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
        });
        return found;
    }
    walk(tree, ray, stack, counter, |rows| {
        found = rows.iter().any(|&row| distance_within(ray, &test, &triangles.corners(row)).is_some());
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
    });
    found
}
