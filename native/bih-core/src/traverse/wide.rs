//! One ray at a time through wide records.

use super::Counter;
use super::interval::Crossing;
use super::postponed::{DONE, Postponed};
use super::scene::{Leaf, Scene};
use super::search::{Search, Walker};
use super::slab::Slab;
use crate::geometry::{Ray, round_down};
use crate::simd::{Lanes, Mask, Scalar};
use crate::tree::{Child, Record, WIDTH};

/// The answer for one valid ray.
#[inline(always)]
pub(super) fn search<L: Lanes, S: Search, C: Counter>(
    scene: &Scene,
    ray: &Ray,
    stack: &mut Postponed,
    counter: &mut C,
) -> S::Answer {
    let mut search = S::new(ray, scene);
    visit::<L, S, C>(scene, ray, &mut search, stack, counter);
    search.answer(scene)
}

/// Lead a walker along a valid ray.
#[inline(always)]
pub(super) fn visit<L: Lanes, W: Walker, C: Counter>(
    scene: &Scene,
    ray: &Ray,
    walker: &mut W,
    stack: &mut Postponed,
    counter: &mut C,
) {
    if !scene.wide.records.is_empty() {
        match walker.slab(ray, scene) {
            Some(slab) => walk::<L, W, C>(scene, &slab, walker, stack, counter),
            None => walk_slowly::<W, C>(scene, walker, stack, counter),
        }
    }
}

#[inline(always)]
fn walk<L: Lanes, W: Walker, C: Counter>(
    scene: &Scene,
    slab: &Slab,
    walker: &mut W,
    stack: &mut Postponed,
    counter: &mut C,
) {
    stack.reserve(scene.depth());
    let mut space = Record::EMPTY;
    let mut limit = walker.limit();
    let (mut word, mut end) = (0, stack.start(0));
    let mut entries = stack.entries();
    loop {
        if Child::is_leaf(word) {
            counter.visit_node();
            let leaf = Leaf::new(word);
            counter.test_triangles(leaf.count);
            if walker.test::<L>(scene, leaf, entries.near(end)) {
                return;
            }
            limit = walker.limit();
            (word, end) = entries.pop(end, limit);
        } else if Child::is_special(word) {
            if word == DONE {
                return;
            }
            (word, end) = enter::<C>(scene, stack, word, end, limit);
            entries = stack.entries();
        } else {
            counter.visit_node();
            let record = scene.record::<L>(word, &mut space);
            let (near, far) = slab.clip::<L>(record, limit);
            let met = near.at_most(far).bits();
            if met & met.wrapping_sub(1) == 0 {
                // One child or none: a branch, so that the processor goes on before it knows which.
                if met == 0 {
                    (word, end) = entries.pop(end, limit);
                } else {
                    let lane = met.trailing_zeros() as usize % WIDTH;
                    word = record.words()[lane];
                    entries.put_near(end, near.store()[lane]);
                }
                continue;
            }
            let order = record.order(slab.octant());
            let (nears, words) = entries.room(end);
            let places = near.push(far, record.words(), order, nears, words);
            if scene.is_ordered {
                word = record.last(order, places);
                // Memory is asked for the second while the nearest is walked.
                scene.prefetch(record.last(order, places & !(1 << (places | 1).ilog2())));
                end += places.count_ones() - 1;
            } else {
                sort(nears, words, places);
                (word, end) = entries.pop(end + places.count_ones(), limit);
            }
        }
    }
}

/// The same with boxes in double precision, one child after another, for rays that single precision has no room for. A
/// function of its own, so it uses the lanes of no instruction set.
#[cold]
#[inline(never)]
pub(super) fn walk_slowly<W: Walker, C: Counter>(
    scene: &Scene,
    walker: &mut W,
    stack: &mut Postponed,
    counter: &mut C,
) {
    let aim = walker.aim();
    let (crossing, ray) = (Crossing::new(&aim), aim.ray);
    stack.reserve(scene.depth());
    let mut space = Record::EMPTY;
    let (mut word, mut end) = (0, stack.start(0));
    while word != DONE {
        if Child::is_special(word) {
            (word, end) = enter::<C>(scene, stack, word, end, walker.limit());
            continue;
        }
        counter.visit_node();
        if Child::is_leaf(word) {
            let leaf = Leaf::new(word);
            counter.test_triangles(leaf.count);
            if walker.test::<Scalar>(scene, leaf, stack.entries().near(end)) {
                return;
            }
        } else {
            let record = scene.record::<Scalar>(word, &mut space);
            let mut entries = stack.entries();
            let (nears, words) = entries.room(end);
            end += push_slowly(&crossing, &ray, walker.limit(), record, nears, words);
        }
        (word, end) = stack.entries().pop(end, walker.limit());
    }
}

/// The root of a piece instead of it. While another thread builds it, the ray goes on with the next entry; where steps are
/// counted it waits, so that their order is always the same.
#[inline(always)]
fn enter<C: Counter>(scene: &Scene, stack: &mut Postponed, word: u32, end: u32, limit: f32) -> (u32, u32) {
    match scene.enter(word) {
        Some(root) => {
            if scene.depth() > stack.depth() {
                stack.deepen(scene.depth());
            }
            (root, end)
        }
        None => {
            std::thread::yield_now();
            if C::COUNTS {
                return (word, end);
            }
            let end = stack.put_off(word, end);
            stack.entries().pop(end, limit)
        }
    }
}

/// Put what was pushed in the order of where it is entered, the nearest last.
#[inline(always)]
pub(super) fn sort(nears: &mut [f32; WIDTH], words: &mut [u32; WIDTH], places: u8) {
    for end in 1..places.count_ones() as usize {
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
) -> u32 {
    let order = record.order(crossing.octant());
    let mut count = 0usize;
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
    count as u32
}
