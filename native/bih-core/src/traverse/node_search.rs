//! Searches over binary nodes, one ray alone or 2 × 2 rays together: the same answers.

use std::array::from_fn;
use std::ops::ControlFlow;

use super::aim::Aim;
use super::closest::{Nearest, distance_within, walk};
use super::{Counter, Hit, Stack, Uncounted};
use crate::geometry::{Ray, Triangles};
use crate::intersect::RayTest;
use crate::kd_tree::{self, LANES, Packet, walk_packet};
use crate::tree::{BinaryTree, Tree};

/// What a query keeps of one ray on its way through binary nodes.
pub(super) trait NodeSearch: Sized {
    /// What is found.
    type Answer;

    /// Before the first leaf.
    fn new(ray: &Ray, tree: &Tree) -> Self;

    /// The ray that is walked.
    fn ray(&self) -> Ray;

    /// Test the triangles of a leaf.
    fn test(&mut self, rows: &[u32], triangles: &Triangles);

    /// How far the ray still matters; negative infinity where the answer is known.
    fn limit(&self) -> f64;

    /// What was found.
    fn answer(&self) -> Self::Answer;
}

impl NodeSearch for Nearest {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn new(ray: &Ray, tree: &Tree) -> Self {
        Self::new(ray, tree)
    }

    fn ray(&self) -> Ray {
        *self.ray()
    }

    #[inline(always)]
    fn test(&mut self, rows: &[u32], triangles: &Triangles) {
        for &row in rows {
            self.offer(row, triangles.corners(row), |row| row);
        }
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.limit()
    }

    fn answer(&self) -> Option<Hit> {
        self.hit()
    }
}

/// Whether anything is hit, decided exactly.
pub(super) struct Any {
    ray: Ray,
    test: RayTest,
    found: bool,
}

impl NodeSearch for Any {
    type Answer = bool;

    #[inline(always)]
    fn new(ray: &Ray, tree: &Tree) -> Self {
        Self { ray: *ray, test: RayTest::new(ray, tree.bounds()), found: false }
    }

    fn ray(&self) -> Ray {
        self.ray
    }

    #[inline(always)]
    fn test(&mut self, rows: &[u32], triangles: &Triangles) {
        self.found |= rows.iter().any(|&row| distance_within(&self.ray, &self.test, &triangles.corners(row)).is_some());
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        if self.found { f64::NEG_INFINITY } else { self.ray.t_max }
    }

    fn answer(&self) -> bool {
        self.found
    }
}

/// The answer for one valid ray.
#[inline(always)]
pub(super) fn search<S: NodeSearch, C: Counter>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Stack,
    counter: &mut C,
) -> S::Answer {
    let mut search = S::new(ray, tree);
    walk(tree, triangles, &Aim::exact(&search.ray()), stack, counter, |rows| {
        search.test(rows, triangles);
        let limit = search.limit();
        if limit == f64::NEG_INFINITY { ControlFlow::Break(()) } else { ControlFlow::Continue(limit) }
    });
    search.answer()
}

/// The answers for all valid rays, those beside each other together where their directions have the same signs.
#[inline(always)]
pub(super) fn search_packets<S: NodeSearch>(
    tree: &Tree,
    triangles: &Triangles,
    rays: &[Ray],
    stack: &mut Stack,
    answers: &mut [S::Answer],
) {
    for (rays, answers) in rays.chunks(LANES).zip(answers.chunks_mut(LANES)) {
        let active: [bool; LANES] = from_fn(|lane| rays.get(lane).is_some_and(Ray::is_valid));
        let Some(first) = active.iter().position(|&active| active) else { continue };
        // The others are never asked.
        let mut searches: [S; LANES] = from_fn(|lane| S::new(&rays[if active[lane] { lane } else { first }], tree));
        let walked = searches.each_ref().map(NodeSearch::ray);
        // Where nodes are built on demand, rays go alone.
        match Packet::new(&walked, active).filter(|_| tree.on_demand.is_none()) {
            Some(packet) => match &tree.kd_tree {
                Some(kd_tree) => together(kd_tree, triangles, &packet, &mut stack.two_by_two, &mut searches),
                None => together(tree, triangles, &packet, &mut stack.two_by_two, &mut searches),
            },
            None => {
                for (lane, ray) in rays.iter().enumerate().filter(|&(lane, _)| active[lane]) {
                    answers[lane] = search::<S, _>(tree, triangles, ray, stack, &mut Uncounted);
                }
                continue;
            }
        }
        for (lane, answer) in answers.iter_mut().enumerate().filter(|&(lane, _)| active[lane]) {
            *answer = searches[lane].answer();
        }
    }
}

#[inline(always)]
fn together<T: BinaryTree, S: NodeSearch>(
    nodes: &T,
    triangles: &Triangles,
    packet: &Packet,
    stack: &mut kd_tree::Stack<LANES>,
    searches: &mut [S; LANES],
) {
    walk_packet(nodes, packet, stack, &mut Uncounted, |rows, active| {
        for (search, _) in searches.iter_mut().zip(active).filter(|(_, active)| *active) {
            search.test(rows, triangles);
        }
        searches.each_ref().map(NodeSearch::limit)
    });
}
