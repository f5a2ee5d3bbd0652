//! One ray at a time through wide records.

use super::Counter;
use super::interval::Crossing;
use super::scene::{Leaf, Scene};
use super::search::Search;
use super::slab::Slab;
use super::stack::WideStack;
use crate::geometry::{Ray, round_down};
use crate::simd::{Lanes, Scalar};
use crate::tree::{Child, Packed, Record, WIDTH};

/// The answer for one valid ray.
#[inline(always)]
pub(super) fn search<L: Lanes, S: Search, C: Counter, R: Packed>(
    scene: &Scene<R>,
    ray: &Ray,
    stack: &mut WideStack,
    counter: &mut C,
) -> S::Answer {
    let mut search = S::new(ray, scene);
    if !scene.wide.records.is_empty() {
        match search.slab(ray, scene) {
            Some(slab) => walk::<L, S, C, R>(scene, &slab, &mut search, stack, counter),
            None => walk_slowly::<S, C, R>(scene, &mut search, stack, counter),
        }
    }
    search.answer(scene)
}

#[inline(always)]
fn walk<L: Lanes, S: Search, C: Counter, R: Packed>(
    scene: &Scene<R>,
    slab: &Slab,
    search: &mut S,
    stack: &mut WideStack,
    counter: &mut C,
) {
    let mut stack = stack.emptied(scene.wide.depth);
    let mut space = Record::EMPTY;
    let mut limit = search.limit();
    let mut word = 0;
    loop {
        counter.visit_node();
        if Child::is_leaf(word) {
            let leaf = Leaf::new(word);
            counter.test_triangles(leaf.count);
            if search.test::<L, R>(scene, leaf) {
                return;
            }
            limit = search.limit();
        } else {
            let record = scene.record::<L>(word, &mut space);
            let (near, far) = slab.clip::<L>(record, limit);
            let (nears, words) = stack.room();
            let count = near.push(far, record.words(), record.order(slab.octant()), nears, words);
            if !R::IS_ORDERED {
                sort(nears, words, count);
            }
            stack.grow(count);
        }
        match stack.pop(limit) {
            Some(next) => word = next,
            None => return,
        }
    }
}

/// The same with boxes in double precision, one child after another, for rays that single precision has no room for. A
/// function of its own, so it uses the lanes of no instruction set.
#[cold]
#[inline(never)]
pub(super) fn walk_slowly<S: Search, C: Counter, R: Packed>(
    scene: &Scene<R>,
    search: &mut S,
    stack: &mut WideStack,
    counter: &mut C,
) {
    let ray = search.ray();
    let crossing = Crossing::new(&ray);
    let mut stack = stack.emptied(scene.wide.depth);
    let mut space = Record::EMPTY;
    let mut word = 0;
    loop {
        counter.visit_node();
        if Child::is_leaf(word) {
            let leaf = Leaf::new(word);
            counter.test_triangles(leaf.count);
            if search.test::<Scalar, R>(scene, leaf) {
                return;
            }
        } else {
            let record = scene.record::<Scalar>(word, &mut space);
            let (nears, words) = stack.room();
            let count = push_slowly(&crossing, &ray, search.limit(), record, nears, words);
            stack.grow(count);
        }
        match stack.pop(search.limit()) {
            Some(next) => word = next,
            None => return,
        }
    }
}

/// Put what was pushed in the order of where it is entered, the nearest last.
#[inline(always)]
pub(super) fn sort(nears: &mut [f32; WIDTH], words: &mut [u32; WIDTH], count: usize) {
    for end in 1..count.min(WIDTH) {
        let mut place = end;
        while place > 0 && nears[place - 1] < nears[place] {
            nears.swap(place - 1, place);
            words.swap(place - 1, place);
            place -= 1;
        }
    }
}

fn push_slowly(
    crossing: &Crossing,
    ray: &Ray,
    limit: f32,
    record: &Record,
    nears: &mut [f32; WIDTH],
    words: &mut [u32; WIDTH],
) -> usize {
    let order = record.order(crossing.octant());
    let mut count = 0;
    for place in 0..WIDTH {
        let lane = (order >> (4 * place) & 7) as usize;
        let bounds = record.bounds(lane);
        let (enters, leaves) = crossing.clip(&bounds, ray.t_min, f64::from(limit).min(ray.t_max));
        if enters <= leaves && bounds.lower[0] <= bounds.upper[0] {
            nears[count] = round_down(enters);
            words[count] = record.words()[lane];
            count += 1;
        }
    }
    count
}
