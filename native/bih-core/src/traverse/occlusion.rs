//! Whether anything is hit.

use std::ops::ControlFlow;

use super::closest::{distance_within, walk};
use super::{Counter, Stack};
use crate::geometry::{Ray, Triangles};
use crate::intersect::RayTest;
use crate::tree::Tree;

/// Whether any triangle lies between the ends of a valid ray; ends at the first that does.
pub fn occluded<C: Counter>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack, counter: &mut C) -> bool {
    let test = RayTest::new(ray, tree.bounds());
    let mut found = false;
    walk(tree, ray, stack, counter, |rows| {
        found = rows.iter().any(|&row| distance_within(ray, &test, &triangles.corners(row)).is_some());
        if found { ControlFlow::Break(()) } else { ControlFlow::Continue(ray.t_max) }
    });
    found
}
