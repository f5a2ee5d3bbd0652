//! The nearest hit, and the walk down the tree that every query shares.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use super::aim::Aim;
use super::fast::FastClosest;
use super::interval::Crossing;
use super::scene::Scene;
use super::stack::{Entry, Stack};
use super::watertight::WatertightClosest;
use super::{Counter, node_search, single, wide};
use crate::build::Precision;
use crate::geometry::{Corners, Ray, Triangles};
use crate::intersect::{Distance, Means, RayTest, Real, SingleHit, weights};
use crate::kd_tree;
use crate::simd::Lanes;
use crate::tree::{Kind, Tree};

/// A hit: the lowest row among the nearest triangles. Numbers of precision `exact` are off by less than one unit in the
/// last place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in units of the direction's length; watertight within 2^-40 of the true value, relatively.
    pub t: f64,
    /// Row of the triangle.
    pub triangle: u32,
    /// Weight of its second vertex; watertight within 2^-32.
    pub u: f64,
    /// Weight of its third vertex; watertight within 2^-32.
    pub v: f64,
}

impl Hit {
    /// A hit in single precision.
    #[inline(always)]
    pub(super) fn single(hit: SingleHit, triangle: u32) -> Self {
        Self { t: f64::from(hit.t), triangle, u: f64::from(hit.u), v: f64::from(hit.v) }
    }
}

/// The nearest triangle so far.
#[derive(Debug, Clone, Copy)]
struct Best {
    reference: u32,
    corners: Corners,
    distance: Distance,
}

/// Finds the nearest of the triangles it is offered: by their rows, or by references that rows are looked up by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    ray: Ray,
    test: RayTest,
    best: Option<Best>,
    /// Whether t and the weights are left to `Tracer::closest`, which rounds those of many rays together.
    is_rounded_later: bool,
}

impl Nearest {
    pub(super) fn new(ray: &Ray, tree: &Tree) -> Self {
        let is_rounded_later = tree.precision == Precision::Exact;
        Self { ray: *ray, test: RayTest::new(ray, tree.bounds()), best: None, is_rounded_later }
    }

    /// Goes on from a nearest triangle so far that the ray hits between its ends.
    #[inline(always)]
    pub(super) fn resumed(ray: &Ray, tree: &Tree, best: Option<(u32, Corners)>) -> Self {
        let nearest = Self::new(ray, tree);
        let best = best.map(|(reference, corners)| Best {
            reference,
            corners,
            distance: Distance::new(&nearest.test, &corners),
        });
        Self { best, ..nearest }
    }

    pub(super) fn ray(&self) -> &Ray {
        &self.ray
    }

    /// Past this nothing can be nearer.
    #[inline(always)]
    pub(super) fn limit(&self) -> f64 {
        self.best.as_ref().map_or(self.ray.t_max, |best| best.distance.upper())
    }

    /// The true t of the nearest triangle so far lies between these; t_max before there is one.
    pub(super) fn interval(&self) -> [f64; 2] {
        self.best.as_ref().map_or([self.ray.t_max; 2], |Best { distance, .. }| [distance.lower(), distance.upper()])
    }

    /// What it takes to decide whether a triangle is the nearest so far.
    pub(super) fn means(&self, corners: &Corners) -> Means {
        let Self { ray, test, best, .. } = self;
        let (is_inside, means) = test.inside(corners);
        if !is_inside {
            return means;
        }
        let distance = Distance::new(test, corners);
        let of_ends = [ray.t_min, ray.t_max].map(|end| distance.compared_with(end, test, corners).1);
        let of_best =
            best.map_or(Means::Double, |best| distance.compared(corners, &best.distance, &best.corners, test).1);
        means.max(of_ends[0]).max(of_ends[1]).max(of_best)
    }

    /// Whether the triangle is the nearest so far. Its row is asked for only where another one is as near: looking it up
    /// may mean waiting for memory.
    #[inline(always)]
    pub(super) fn offer(&mut self, reference: u32, corners: Corners, row: impl Fn(u32) -> u32) -> bool {
        if let Some(distance) = distance_within(&self.ray, &self.test, &corners) {
            let order = match &self.best {
                Some(best) => distance
                    .compare(&corners, &best.distance, &best.corners, &self.test)
                    .then_with(|| row(reference).cmp(&row(best.reference))),
                None => Ordering::Less,
            };
            if order == Ordering::Less {
                self.best = Some(Best { reference, corners, distance });
                return true;
            }
        }
        false
    }

    /// Where rows were offered.
    pub(super) fn hit(&self) -> Option<Hit> {
        let Best { reference: row, corners, distance } = self.best.as_ref()?;
        Some(if self.is_rounded_later {
            Hit { t: distance.t, triangle: *row, u: 0.0, v: 0.0 }
        } else {
            hit_at(&self.test, *row, corners, distance)
        })
    }
}

/// The hit of a triangle that the ray meets at this distance, as precision `watertight` has it.
pub(crate) fn hit_at(test: &RayTest, row: u32, corners: &Corners, distance: &Distance) -> Hit {
    let [u, v] = weights(test, corners);
    Hit { t: distance.refined(test, corners).t, triangle: row, u, v }
}

/// The distance of a triangle if the ray meets it between its ends.
#[inline(always)]
pub(crate) fn distance_within(ray: &Ray, test: &RayTest, corners: &Corners) -> Option<Distance> {
    if !test.is_inside(corners) {
        return None;
    }
    let distance = Distance::new(test, corners);
    is_between(&distance, ray, test, corners).then_some(distance)
}

/// Whether the distance of a triangle lies between the ends of the ray.
#[inline(always)]
pub(crate) fn is_between<T: Real>(distance: &Distance, ray: &Ray, test: &RayTest, corners: &T) -> bool {
    distance.compare_with(ray.t_min, test, corners) != Ordering::Less
        && distance.compare_with(ray.t_max, test, corners) != Ordering::Greater
}

/// The nearest hit of a valid ray; of equal distances, watertight compared exactly, the lower row. Through the records of a
/// scene, if there are any, else through the nodes of the tree.
#[inline(always)]
pub(super) fn closest<L: Lanes, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    scene: Option<&Scene>,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> Option<Hit> {
    let Some(scene) = scene else { return in_nodes(tree, triangles, ray, stack, counter) };
    let stack = &mut stack.wide;
    match tree.precision {
        Precision::Fast => wide::search::<L, FastClosest, C>(scene, ray, stack, counter),
        Precision::Watertight | Precision::Exact => wide::search::<L, WatertightClosest, C>(scene, ray, stack, counter),
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
) -> Option<Hit> {
    match tree.precision {
        Precision::Fast => node_search::search::<single::Nearest, C>(tree, triangles, ray, stack, counter),
        Precision::Watertight | Precision::Exact => {
            node_search::search::<Nearest, C>(tree, triangles, ray, stack, counter)
        }
    }
}

/// The same for many rays, 2 × 2 together.
#[inline(always)]
pub(super) fn two_by_two(
    tree: &Tree,
    triangles: &Triangles,
    rays: &[Ray],
    stack: &mut Stack,
    hits: &mut [Option<Hit>],
) {
    match tree.precision {
        Precision::Fast => node_search::search_packets::<single::Nearest>(tree, triangles, rays, stack, hits),
        Precision::Watertight | Precision::Exact => {
            node_search::search_packets::<Nearest>(tree, triangles, rays, stack, hits)
        }
    }
}

/// Visit the leaves that the ray crosses, front to back by the sign of its direction (Wächter and Keller 2006, section
/// 3.3). `leaf` answers how far the ray still matters, or that it is done.
///
/// Both ends of the ray's part in a node are carried down: the near one is cut by the right child's plane, the far one
/// by the left child's, or the other way round for a ray that runs backwards.
#[inline(always)]
pub(super) fn walk<C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    aim: &Aim,
    stack: &mut Stack,
    counter: &mut C,
    mut leaf: impl FnMut(&[u32]) -> ControlFlow<(), f64>,
) {
    if let Some(kd_tree) = &tree.kd_tree {
        return kd_tree::walk_around(kd_tree, aim, &mut stack.alone, counter, leaf);
    }
    if tree.nodes.is_empty() {
        return;
    }
    let (crossing, ray) = (Crossing::new(aim), &aim.ray);
    let (near, far) = crossing.clip(&tree.bounds, ray.t_min, ray.t_max);
    let mut limit = ray.t_max;
    stack.clear();
    let mut entry = Entry { node: 0, near, far };
    loop {
        if entry.near <= entry.far && entry.near <= limit {
            let mut node = tree.nodes.get(entry.node);
            if let Some(piece) = node.piece_number() {
                let Some(root) = tree.enter(piece, triangles) else {
                    // Another thread builds it. Single precision wants the nodes in their order, so the ray stays here.
                    std::thread::yield_now();
                    continue;
                };
                node = tree.nodes.get(root as usize);
            }
            counter.visit_node();
            match node.kind() {
                Kind::Inner { axis, left, clip } => {
                    let backwards = usize::from(crossing.is_negative(axis));
                    let first_ends = crossing.latest(axis, clip[backwards]);
                    let second_starts = crossing.earliest(axis, clip[1 - backwards]);
                    // `min` and `max` pass over NaN.
                    let first = Entry { node: left + backwards, near: entry.near, far: entry.far.min(first_ends) };
                    let second =
                        Entry { node: left + 1 - backwards, near: entry.near.max(second_starts), far: entry.far };
                    if second.near <= second.far {
                        if first.near <= first.far {
                            stack.push(second);
                            entry = first;
                        } else {
                            entry = second;
                        }
                        continue;
                    }
                    entry = first;
                    continue;
                }
                Kind::Leaf { first, count } => {
                    counter.test_triangles(count);
                    match leaf(tree.order.slice(first..first + count)) {
                        ControlFlow::Continue(t) => limit = t,
                        ControlFlow::Break(()) => return,
                    }
                }
            }
        }
        match stack.pop() {
            Some(next) => entry = next,
            None => return,
        }
    }
}
