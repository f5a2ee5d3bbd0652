//! Many rays in flight: while one waits for memory, others are worked on.

use super::fast::{FastClosest, FastOccluded};
use super::scene::Scene;
use super::search::Search;
use super::slab::Slab;
use super::stack::{Postponed, WideStack, room};
use super::watertight::{WatertightClosest, WatertightOccluded};
use super::wide::walk_slowly;
use super::{Hit, Stack, Uncounted, closest, occlusion};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::{Child, Tree};

/// Rays that one thread has in flight: docs/decisions/rays-in-flight.md.
const RAYS: usize = 32;

/// Rays to trace, and what becomes of their answers.
pub trait Rays<A> {
    /// The next valid ray and its number.
    fn next(&mut self) -> Option<(usize, Ray)>;

    /// The answer for the ray of this number.
    fn answer(&mut self, number: usize, answer: A);
}

/// A ray on its way.
#[derive(Clone, Copy)]
struct Flying<S> {
    slab: Slab,
    search: S,
    number: usize,
    /// What it tests next.
    word: u32,
    postponed: u32,
}

/// Numbers of rays that wait for the same kind of work.
struct Queue {
    rays: [u8; RAYS],
    len: usize,
}

impl Queue {
    const EMPTY: Self = Self { rays: [0; RAYS], len: 0 };

    #[inline(always)]
    fn get(&self, place: usize) -> usize {
        usize::from(self.rays[place % RAYS]) % RAYS
    }

    /// Add a ray if `is_wanted`, without a branch.
    #[inline(always)]
    fn add_if(&mut self, is_wanted: bool, ray: usize) {
        self.rays[self.len % RAYS] = ray as u8;
        self.len += usize::from(is_wanted);
    }
}

/// The nearest hit of each ray, the same as `closest` gives; answered in no particular order.
#[inline(always)]
pub fn closest_in_flight<L: Lanes, R: Rays<Option<Hit>>>(tree: &Tree, triangles: &Triangles, rays: &mut R) {
    if let Some(wide) = &tree.wide {
        let scene = Scene::new(wide, tree, triangles);
        return match tree.precision {
            Precision::Fast => fly::<L, FastClosest, R>(&scene, rays),
            Precision::Watertight => fly::<L, WatertightClosest, R>(&scene, rays),
        };
    }
    let mut stack = Stack::default();
    while let Some((number, ray)) = rays.next() {
        rays.answer(number, closest::in_nodes(tree, triangles, &ray, &mut stack, &mut Uncounted));
    }
}

/// Whether each ray hits anything, the same as `occluded` gives; answered in no particular order.
#[inline(always)]
pub fn occluded_in_flight<L: Lanes, R: Rays<bool>>(tree: &Tree, triangles: &Triangles, rays: &mut R) {
    if let Some(wide) = &tree.wide {
        let scene = Scene::new(wide, tree, triangles);
        return match tree.precision {
            Precision::Fast => fly::<L, FastOccluded, R>(&scene, rays),
            Precision::Watertight => fly::<L, WatertightOccluded, R>(&scene, rays),
        };
    }
    let mut stack = Stack::default();
    while let Some((number, ray)) = rays.next() {
        rays.answer(number, occlusion::in_nodes(tree, triangles, &ray, &mut stack, &mut Uncounted));
    }
}

#[inline(always)]
fn fly<L: Lanes, S: Search, R: Rays<S::Answer>>(scene: &Scene, rays: &mut R) {
    if scene.wide.records.is_empty() {
        while let Some((number, ray)) = rays.next() {
            rays.answer(number, S::new(&ray, scene).answer(scene));
        }
        return;
    }
    let Some(first) = start::<S, R>(scene, rays) else { return };
    let mut flying = [first; RAYS];
    let (mut records, mut leaves) = (Queue::EMPTY, Queue::EMPTY);
    records.add_if(true, 0);
    while records.len < RAYS {
        let Some(ray) = start::<S, R>(scene, rays) else { break };
        flying[records.len % RAYS] = ray;
        records.add_if(true, records.len);
    }
    let stride = room(scene.wide.depth).next_multiple_of(16);
    let mut nears = vec![0.0; RAYS * stride];
    let mut words = vec![0; RAYS * stride];
    while records.len + leaves.len > 0 {
        let mut next_records = Queue::EMPTY;
        for place in 0..records.len {
            let number = records.get(place);
            let ray = &mut flying[number];
            let range = number * stride..(number + 1) * stride;
            let mut stack = Postponed::resumed(&mut nears[range.clone()], &mut words[range], ray.postponed as usize);
            let record = scene.record(ray.word);
            let limit = ray.search.limit();
            let (near, far) = ray.slab.clip::<L>(record, limit);
            let (nears, words) = stack.room();
            let count = near.push(far, record.words(), record.order(ray.slab.octant()), nears, words);
            stack.grow(count);
            match stack.pop(limit) {
                Some(word) => {
                    ray.word = word;
                    ray.postponed = stack.len() as u32;
                    scene.prefetch(word);
                    next_records.add_if(!Child::is_leaf(word), number);
                    leaves.add_if(Child::is_leaf(word), number);
                }
                None => land::<S, R>(scene, rays, ray, &mut next_records, number),
            }
        }
        let mut next_leaves = Queue::EMPTY;
        for place in 0..leaves.len {
            let number = leaves.get(place);
            let ray = &mut flying[number];
            let range = number * stride..(number + 1) * stride;
            let mut stack = Postponed::resumed(&mut nears[range.clone()], &mut words[range], ray.postponed as usize);
            let is_known = ray.search.test::<L>(scene, Scene::leaf(ray.word));
            let next = if is_known { None } else { stack.pop(ray.search.limit()) };
            match next {
                Some(word) => {
                    ray.word = word;
                    ray.postponed = stack.len() as u32;
                    scene.prefetch(word);
                    next_records.add_if(!Child::is_leaf(word), number);
                    next_leaves.add_if(Child::is_leaf(word), number);
                }
                None => land::<S, R>(scene, rays, ray, &mut next_records, number),
            }
        }
        (records, leaves) = (next_records, next_leaves);
    }
}

/// Give the answer of a ray, and let the next one take its place.
#[inline(always)]
fn land<S: Search, R: Rays<S::Answer>>(
    scene: &Scene,
    rays: &mut R,
    ray: &mut Flying<S>,
    records: &mut Queue,
    number: usize,
) {
    rays.answer(ray.number, ray.search.answer(scene));
    if let Some(next) = start::<S, R>(scene, rays) {
        *ray = next;
        records.add_if(true, number);
    }
}

/// The next ray that single precision has room for; others are traced at once.
#[inline(always)]
fn start<S: Search, R: Rays<S::Answer>>(scene: &Scene, rays: &mut R) -> Option<Flying<S>> {
    loop {
        let (number, ray) = rays.next()?;
        let mut search = S::new(&ray, scene);
        if let Some(slab) = search.slab(&ray, scene) {
            return Some(Flying { slab, search, number, word: 0, postponed: 0 });
        }
        walk_slowly::<S, Uncounted>(scene, &mut search, &mut WideStack::default(), &mut Uncounted);
        rays.answer(number, search.answer(scene));
    }
}
