//! Some rays through a tree, in one of several ways that give the same answers.
//!
//! This is where kernels begin, but for those of `all`, `count` and `contains`: everything below is compiled once for each
//! instruction set.

use super::decisions::decisions;
use super::flight::{Rays, closest_in_flight, occluded_in_flight};
use super::packet::{self, PACKET};
use super::rounding::round_hits;
use super::scene::Scene;
use super::{Counts, Decisions, Hit, Stack, Uncounted, closest, occlusion};
use crate::geometry::{Ray, Triangles};
use crate::simd::{InstructionSet, Kernel, Lanes, dispatch_common_to, dispatch_to, instruction_sets};
use crate::tree::Tree;

/// How rays go through a tree. Through the paper's nodes they go alone, unless 2 × 2 are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// One after another: for a few rays.
    Alone,
    /// Many at once, each on its own way: while one waits for memory, others are worked on.
    InFlight,
    /// As packets of neighbours; through a kd-tree 2 × 2.
    Packets,
    /// 2 × 2 of them through binary nodes, those of the paper too; alone through records.
    TwoByTwo,
}

impl Way {
    /// The best one for some rays: packets if most groups of neighbours are coherent, which four of each tell.
    pub fn suited(tree: &Tree, rays: &[Ray]) -> Self {
        /// Rays for which the other ways are worth their preparations.
        const FEW: usize = 8;
        if rays.len() < FEW {
            return Self::Alone;
        }
        let some = |group: &[Ray]| [0, 1, 2, 3].map(|i| group[i * (group.len() - 1) / 3]);
        let coherent = rays.chunks(PACKET).filter(|group| packet::is_coherent(tree, &some(group))).count();
        if 2 * coherent >= rays.len().div_ceil(PACKET) { Self::Packets } else { Self::InFlight }
    }
}

/// A tree, the triangles it was built over, and in what it is traced.
#[derive(Debug, Clone, Copy)]
pub struct Tracer<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// Those it was built over.
    pub triangles: &'a Triangles<'a>,
    /// One of `instruction_sets`.
    pub set: InstructionSet,
}

impl<'a> Tracer<'a> {
    /// In the best instruction set.
    pub fn new(tree: &'a Tree, triangles: &'a Triangles<'a>) -> Self {
        Self { tree, triangles, set: instruction_sets()[0] }
    }

    /// The nearest hit of each ray; none for a miss and for an invalid ray.
    pub fn closest(&self, rays: &[Ray], way: Way, stack: &mut Stack, hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len());
        hits.fill(None);
        dispatch_to(self.set, Closest { tracer: self, rays, way, stack, hits: &mut *hits });
        round_hits(self, rays, hits);
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, rays: &[Ray], way: Way, stack: &mut Stack, hidden: &mut [bool]) {
        assert_eq!(rays.len(), hidden.len());
        hidden.fill(false);
        dispatch_to(self.set, Occluded { tracer: self, rays, way, stack, hidden });
    }

    /// What the nearest hit of each ray costs alone; nothing for an invalid ray.
    pub fn cost(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [Counts]) {
        assert_eq!(rays.len(), counts.len());
        counts.fill(Counts::default());
        dispatch_common_to(self.set, Cost { tracer: self, rays, stack, counts });
    }

    /// How many tests of each ray the filters of exact decisions leave over; none for an invalid ray.
    pub fn decisions(&self, rays: &[Ray], stack: &mut Stack, answers: &mut [Decisions]) {
        assert_eq!(rays.len(), answers.len());
        for (ray, answer) in rays.iter().zip(answers) {
            let is_valid = ray.is_valid();
            *answer = if is_valid { decisions(self.tree, self.triangles, ray, stack) } else { Decisions::default() };
        }
    }
}

/// The records of a tree, made ready once for many rays.
fn scene<'a>(tree: &'a Tree, triangles: &'a Triangles<'a>) -> Option<Scene<'a>> {
    tree.wide.as_ref().map(|wide| Scene::new(wide, tree, triangles))
}

/// Whether the rays go as 2 × 2 packets.
fn are_two_by_two(tree: &Tree, way: Way) -> bool {
    match way {
        Way::Alone | Way::InFlight => false,
        Way::Packets => tree.kd_tree.is_some(),
        Way::TwoByTwo => tree.wide.is_none(),
    }
}

struct Closest<'a> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    way: Way,
    stack: &'a mut Stack,
    hits: &'a mut [Option<Hit>],
}

impl Kernel for Closest<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer: Tracer { tree, triangles, .. }, rays, way, stack, hits } = self;
        if way == Way::InFlight {
            return closest_in_flight::<L, _>(tree, triangles, &mut Slices { rays, next: 0, answers: hits });
        }
        if are_two_by_two(tree, way) {
            return closest::two_by_two(tree, triangles, rays, stack, hits);
        }
        let scene = scene(tree, triangles);
        for (rays, hits) in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            // A packet leaves some rays.
            let answered = match &scene {
                Some(scene) if way == Way::Packets => packet::closest::<L>(scene, rays, stack, hits),
                _ => 0,
            };
            for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                if answered >> i & 1 == 0 && ray.is_valid() {
                    *hit = closest::closest::<L, _>(tree, triangles, scene.as_ref(), ray, stack, &mut Uncounted);
                }
            }
        }
    }
}

struct Occluded<'a> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    way: Way,
    stack: &'a mut Stack,
    hidden: &'a mut [bool],
}

impl Kernel for Occluded<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer: Tracer { tree, triangles, .. }, rays, way, stack, hidden } = self;
        if way == Way::InFlight {
            return occluded_in_flight::<L, _>(tree, triangles, &mut Slices { rays, next: 0, answers: hidden });
        }
        if are_two_by_two(tree, way) {
            return occlusion::two_by_two(tree, triangles, rays, stack, hidden);
        }
        let scene = scene(tree, triangles);
        for (rays, hidden) in rays.chunks(PACKET).zip(hidden.chunks_mut(PACKET)) {
            let answered = match &scene {
                Some(scene) if way == Way::Packets => packet::occluded::<L>(scene, rays, stack, hidden),
                _ => 0,
            };
            for (i, (ray, is_hidden)) in rays.iter().zip(hidden).enumerate() {
                if answered >> i & 1 == 0 && ray.is_valid() {
                    *is_hidden =
                        occlusion::occluded::<L, _>(tree, triangles, scene.as_ref(), ray, stack, &mut Uncounted);
                }
            }
        }
    }
}

struct Cost<'a> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    stack: &'a mut Stack,
    counts: &'a mut [Counts],
}

impl Kernel for Cost<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer: Tracer { tree, triangles, .. }, rays, stack, counts } = self;
        let scene = scene(tree, triangles);
        for (ray, counts) in rays.iter().zip(counts) {
            if ray.is_valid() {
                closest::closest::<L, _>(tree, triangles, scene.as_ref(), ray, stack, counts);
            }
        }
    }
}

/// Rays in an array, and where their answers go.
struct Slices<'a, A> {
    rays: &'a [Ray],
    next: usize,
    answers: &'a mut [A],
}

impl<A> Rays<A> for Slices<'_, A> {
    #[inline(always)]
    fn next(&mut self) -> Option<(usize, Ray)> {
        while let Some(ray) = self.rays.get(self.next) {
            self.next += 1;
            if ray.is_valid() {
                return Some((self.next - 1, *ray));
            }
        }
        None
    }

    #[inline(always)]
    fn answer(&mut self, number: usize, answer: A) {
        self.answers[number] = answer;
    }
}
