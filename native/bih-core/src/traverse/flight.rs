//! Many rays in flight: while one waits for memory, others are worked on.

use super::fast::{FastClosest, FastOccluded};
use super::scene::{Leaf, Scene};
use super::search::Search;
use super::slab::Slab;
use super::stack::{WideStack, room};
use super::watertight::{WatertightClosest, WatertightOccluded};
use super::wide::{sort, walk_slowly};
use super::{Hit, Stack, Uncounted, closest, occlusion};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::{Child, Packed, Record, Tree, WIDTH};

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
    top: u32,
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
    done: Queue,
}

impl Queues {
    /// Which of them is not predictable: no branch.
    #[inline(always)]
    fn add(&mut self, ray: usize, word: u32) {
        let (is_leaf, is_done) = (Child::is_leaf(word), word == DONE);
        self.records.add_if(!is_leaf && !is_done, ray);
        self.leaves.add_if(is_leaf, ray);
        self.done.add_if(is_done, ray);
    }
}

/// Stands at the bottom of each stack, before any limit: a word that is no child.
const DONE: u32 = Child::NONE;

/// The stacks of all rays in flight, one behind another.
struct Stacks {
    nears: Vec<f32>,
    words: Vec<u32>,
    stride: usize,
}

impl Stacks {
    fn new(depth: usize) -> Self {
        let stride = room(depth) + 1;
        let mut stacks = Self { nears: vec![0.0; RAYS * stride], words: vec![0; RAYS * stride], stride };
        for ray in 0..RAYS {
            stacks.nears[ray * stride] = f32::NEG_INFINITY;
            stacks.words[ray * stride] = DONE;
        }
        stacks
    }

    /// Where the stack of a ray starts to grow.
    #[inline(always)]
    fn start(&self, ray: usize) -> u32 {
        (ray * self.stride) as u32 + 1
    }

    /// Where the children of a record go.
    #[inline(always)]
    fn room(&mut self, top: u32) -> (&mut [f32; WIDTH], &mut [u32; WIDTH]) {
        let range = top as usize..top as usize + WIDTH;
        let nears = self.nears.get_mut(range.clone()).and_then(<[f32]>::first_chunk_mut);
        let words = self.words.get_mut(range).and_then(<[u32]>::first_chunk_mut);
        nears.zip(words).expect("a stack has room for a step at any depth of its tree")
    }

    /// The last one that begins before the limit, and the end of what is left; those behind it are dropped.
    #[inline(always)]
    fn pop(&self, mut top: u32, limit: f32) -> (u32, u32) {
        loop {
            top -= 1;
            // The lowest entry is before any limit.
            if self.nears[top as usize] <= limit {
                return (self.words[top as usize], top);
            }
        }
    }
}

/// The nearest hit of each ray, the same as `closest` gives; answered in no particular order.
#[inline(always)]
pub fn closest_in_flight<L: Lanes, R: Rays<Option<Hit>>>(tree: &Tree, triangles: &Triangles, rays: &mut R) {
    if let Some(wide) = &tree.wide {
        return in_records::<L, FastClosest, WatertightClosest, _, R>(&Scene::new(wide, tree, triangles), rays);
    }
    if let Some(compact) = &tree.compact {
        return in_records::<L, FastClosest, WatertightClosest, _, R>(&Scene::new(compact, tree, triangles), rays);
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
        return in_records::<L, FastOccluded, WatertightOccluded, _, R>(&Scene::new(wide, tree, triangles), rays);
    }
    if let Some(compact) = &tree.compact {
        return in_records::<L, FastOccluded, WatertightOccluded, _, R>(&Scene::new(compact, tree, triangles), rays);
    }
    let mut stack = Stack::default();
    while let Some((number, ray)) = rays.next() {
        rays.answer(number, occlusion::in_nodes(tree, triangles, &ray, &mut stack, &mut Uncounted));
    }
}

/// By the search of the tree's precision.
#[inline(always)]
fn in_records<L: Lanes, F: Search, W: Search<Answer = F::Answer>, B: Packed, R: Rays<F::Answer>>(
    scene: &Scene<B>,
    rays: &mut R,
) {
    match scene.tree.precision {
        Precision::Fast => fly::<L, F, B, R>(scene, rays),
        Precision::Watertight => fly::<L, W, B, R>(scene, rays),
    }
}

/// Trace all rays.
#[inline(always)]
fn fly<L: Lanes, S: Search, B: Packed, R: Rays<S::Answer>>(scene: &Scene<B>, rays: &mut R) {
    if scene.wide.records.is_empty() {
        while let Some((number, ray)) = rays.next() {
            rays.answer(number, S::new(&ray, scene).answer(scene));
        }
        return;
    }
    let Some(first) = start::<S, B, R>(scene, rays) else { return };
    let mut flying = [first; RAYS];
    let mut space = Record::EMPTY;
    let mut stacks = Stacks::new(scene.wide.depth);
    let mut queues = Queues { records: Queue::new(), leaves: Queue::new(), done: Queue::new() };
    flying[0].top = stacks.start(0);
    queues.records.add_if(true, 0);
    for (place, slot) in flying.iter_mut().enumerate().skip(1) {
        let Some(ray) = start::<S, B, R>(scene, rays) else { break };
        *slot = Flying { top: stacks.start(place), ..ray };
        queues.records.add_if(true, place);
    }
    while queues.records.len | queues.leaves.len > 0 {
        // A queue is filled again from its start while it is read: no more is added than was read.
        for place in 0..std::mem::take(&mut queues.records.len) {
            let number = queues.records.get(place);
            let ray = &mut flying[number % RAYS];
            let record = scene.record::<L>(ray.word, &mut space);
            let limit = ray.search.limit();
            // First of all whether there is room: a check in between splits loads from their use.
            let (nears, words) = stacks.room(ray.top);
            let (near, far) = ray.slab.clip::<L>(record, limit);
            let count = near.push(far, record.words(), record.order(ray.slab.octant()), nears, words);
            if !B::IS_ORDERED {
                sort(nears, words, count);
            }
            let top = ray.top + count as u32;
            (ray.word, ray.top) = stacks.pop(top, limit);
            scene.prefetch(ray.word);
            queues.add(number, ray.word);
        }
        for place in 0..std::mem::take(&mut queues.leaves.len) {
            let number = queues.leaves.get(place);
            let ray = &mut flying[number % RAYS];
            let is_known = ray.search.test::<L, B>(scene, Leaf::new(ray.word));
            let top = if is_known { stacks.start(number) } else { ray.top };
            (ray.word, ray.top) = stacks.pop(top, ray.search.limit());
            scene.prefetch(ray.word);
            queues.add(number, ray.word);
        }
        for place in 0..std::mem::take(&mut queues.done.len) {
            let number = queues.done.get(place);
            let ray = &mut flying[number % RAYS];
            rays.answer(ray.number, ray.search.answer(scene));
            if let Some(next) = start::<S, B, R>(scene, rays) {
                *ray = Flying { top: stacks.start(number), ..next };
                queues.records.add_if(true, number);
            }
        }
    }
}

/// The next ray that single precision has room for; others are traced at once.
#[inline(always)]
fn start<S: Search, B: Packed, R: Rays<S::Answer>>(scene: &Scene<B>, rays: &mut R) -> Option<Flying<S>> {
    loop {
        let (number, ray) = rays.next()?;
        let mut search = S::new(&ray, scene);
        if let Some(slab) = search.slab(&ray, scene) {
            return Some(Flying { slab, search, number, word: 0, top: 0 });
        }
        walk_slowly::<S, Uncounted, B>(scene, &mut search, &mut WideStack::default(), &mut Uncounted);
        rays.answer(number, search.answer(scene));
    }
}
