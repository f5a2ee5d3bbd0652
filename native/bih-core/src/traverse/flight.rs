//! Many rays in flight: while one waits for memory, others are worked on.

use std::hint::select_unpredictable;

use super::fast::{FastClosest, FastOccluded};
use super::postponed::{DONE, Postponed};
use super::scene::{Leaf, Scene};
use super::search::Search;
use super::slab::Slab;
use super::watertight::{WatertightClosest, WatertightOccluded};
use super::wide::{sort, walk_slowly};
use super::{Hit, Stack, Uncounted, closest, occlusion};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::{Child, Record, Tree};

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
    /// The end of its stack.
    end: u32,
}

/// Which rays wait for the same kind of work.
struct Queue {
    /// As many as a `u8` can count: no place needs a check.
    rays: [u8; 256],
    len: u8,
}

impl Queue {
    fn new() -> Self {
        Self { rays: [0; 256], len: 0 }
    }

    #[inline(always)]
    fn get(&self, place: u8) -> usize {
        usize::from(self.rays[usize::from(place)])
    }

    /// Add a ray if `is_wanted`, without a branch.
    #[inline(always)]
    fn add_if(&mut self, is_wanted: bool, ray: usize) {
        self.rays[usize::from(self.len)] = ray as u8;
        self.len = self.len.wrapping_add(u8::from(is_wanted));
    }
}

/// Rays by what they wait for.
struct Queues {
    records: Queue,
    leaves: Queue,
    /// Those that are done, and those that come to a piece.
    special: Queue,
}

impl Queues {
    /// Which of them is not predictable: no branch.
    #[inline(always)]
    fn add(&mut self, ray: usize, word: u32) {
        let (is_leaf, is_special) = (Child::is_leaf(word), Child::is_special(word));
        self.records.add_if(!is_leaf && !is_special, ray);
        self.leaves.add_if(is_leaf, ray);
        self.special.add_if(is_special, ray);
    }
}

/// The nearest hit of each ray, the same as `closest` gives; answered in no particular order.
#[inline(always)]
pub fn closest_in_flight<L: Lanes, R: Rays<Option<Hit>>>(tree: &Tree, triangles: &Triangles, rays: &mut R) {
    if let Some(wide) = &tree.wide {
        return in_records::<L, FastClosest, WatertightClosest, R>(&Scene::new(wide, tree, triangles), rays);
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
        return in_records::<L, FastOccluded, WatertightOccluded, R>(&Scene::new(wide, tree, triangles), rays);
    }
    let mut stack = Stack::default();
    while let Some((number, ray)) = rays.next() {
        rays.answer(number, occlusion::in_nodes(tree, triangles, &ray, &mut stack, &mut Uncounted));
    }
}

/// By the search of the tree's precision.
#[inline(always)]
fn in_records<L: Lanes, F: Search, W: Search<Answer = F::Answer>, R: Rays<F::Answer>>(scene: &Scene, rays: &mut R) {
    match scene.tree.precision {
        Precision::Fast => fly::<L, F, R>(scene, rays),
        Precision::Watertight | Precision::Exact => fly::<L, W, R>(scene, rays),
    }
}

/// Trace all rays.
#[inline(always)]
fn fly<L: Lanes, S: Search, R: Rays<S::Answer>>(scene: &Scene, rays: &mut R) {
    if scene.wide.records.is_empty() {
        while let Some((number, ray)) = rays.next() {
            rays.answer(number, S::new(&ray, scene).answer(scene));
        }
        return;
    }
    let mut space = Record::EMPTY;
    let mut stacks = Postponed::new(RAYS, scene.depth());
    let mut queues = Queues { records: Queue::new(), leaves: Queue::new(), special: Queue::new() };
    // No ray is on its way yet.
    let nowhere = Ray::new([0.0; 3], [1.0; 3]);
    let slab = Slab::nowhere();
    let mut flying = [Flying { slab, search: S::new(&nowhere, scene), number: 0, word: DONE, end: 0 }; RAYS];
    for (place, slot) in flying.iter_mut().enumerate() {
        if !start::<S, R>(scene, rays, slot, stacks.start(place)) {
            break;
        }
        queues.records.add_if(true, place);
    }
    while queues.records.len | queues.leaves.len | queues.special.len > 0 {
        let mut entries = stacks.entries();
        // A queue is filled again from its start while it is read: no more is added than was read.
        for place in 0..std::mem::take(&mut queues.records.len) {
            let number = queues.records.get(place);
            let ray = &mut flying[number % RAYS];
            let record = scene.record::<L>(ray.word, &mut space);
            let limit = ray.search.limit();
            // First of all whether there is room: a check in between splits loads from their use.
            let (nears, words) = entries.room(ray.end);
            let (near, far) = ray.slab.clip::<L>(record, limit);
            let order = record.order(ray.slab.octant());
            let places = near.push(far, record.words(), order, nears, words);
            (ray.word, ray.end) = if scene.is_ordered {
                entries.next(ray.end, places, record.last(order, places), limit)
            } else {
                sort(nears, words, places);
                entries.pop(ray.end + places.count_ones(), limit)
            };
            scene.prefetch(ray.word);
            queues.add(number, ray.word);
        }
        if scene.wide.copies.is_some() {
            for place in 0..queues.leaves.len {
                scene.prefetch_copy(flying[queues.leaves.get(place) % RAYS].word);
            }
        }
        if scene.is_gathered {
            // What one of these finds is where the next one looks.
            for place in 0..queues.leaves.len {
                scene.prefetch_rows(Leaf::new(flying[queues.leaves.get(place) % RAYS].word));
            }
            for place in 0..queues.leaves.len {
                scene.prefetch_corners(Leaf::new(flying[queues.leaves.get(place) % RAYS].word));
            }
        }
        for place in 0..std::mem::take(&mut queues.leaves.len) {
            let number = queues.leaves.get(place);
            let ray = &mut flying[number % RAYS];
            let is_known = ray.search.test::<L>(scene, Leaf::new(ray.word), entries.near(ray.end));
            let end = select_unpredictable(is_known, entries.start(number), ray.end);
            (ray.word, ray.end) = entries.pop(end, ray.search.limit());
            scene.prefetch(ray.word);
            queues.add(number, ray.word);
        }
        let (mut has_entered, mut waiting) = (false, 0);
        for place in 0..std::mem::take(&mut queues.special.len) {
            let number = queues.special.get(place);
            let ray = &mut flying[number % RAYS];
            if ray.word != DONE {
                match scene.enter(ray.word) {
                    Some(root) => {
                        has_entered = true;
                        ray.word = root;
                        scene.prefetch(root);
                    }
                    None => waiting += 1,
                }
                queues.add(number, ray.word);
                continue;
            }
            rays.answer(ray.number, ray.search.answer(scene));
            let is_next = start::<S, R>(scene, rays, ray, entries.start(number));
            queues.records.add_if(is_next, number);
        }
        if has_entered && scene.depth() > stacks.depth() {
            deepen(scene, &mut stacks, &mut flying);
        }
        if waiting > 0 && queues.records.len | queues.leaves.len == 0 {
            // All rays wait for pieces that other threads build.
            std::thread::yield_now();
        }
    }
}

/// A deeper piece has been built: more room for each ray.
#[cold]
#[inline(never)]
fn deepen<S>(scene: &Scene, stacks: &mut Postponed, flying: &mut [Flying<S>; RAYS]) {
    if let Some(further) = stacks.deepen(scene.depth()) {
        for (place, ray) in flying.iter_mut().enumerate() {
            ray.end += further * place as u32;
        }
    }
}

/// Put the next ray that single precision has room for into a slot; others are traced at once. Whether there is one.
#[inline(always)]
fn start<S: Search, R: Rays<S::Answer>>(scene: &Scene, rays: &mut R, slot: &mut Flying<S>, end: u32) -> bool {
    while let Some((number, ray)) = rays.next() {
        let mut search = S::new(&ray, scene);
        if let Some(slab) = search.slab(&ray, scene) {
            *slot = Flying { slab, search, number, word: 0, end };
            return true;
        }
        walk_slowly::<S, Uncounted>(scene, &mut search, &mut Postponed::default(), &mut Uncounted);
        rays.answer(number, search.answer(scene));
    }
    false
}
