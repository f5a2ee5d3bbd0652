//! The walk of a packet down the wide records.

use super::bundle::Bundle;
use super::rays::Group;
use super::slabs::{Sides, Slabs};
use super::triangles::{LeafTriangles, Stored};
use super::{GROUPS, bits};
use crate::simd::{Lanes, Mask};
use crate::traverse::scene::{self, ROWS, Scene};
use crate::tree::{Child, MAX_DEPTH, Record, Target, WIDTH};

/// Children of a record that survive the whole packet's test are tested against its groups if there are as many.
const CONFIRM: usize = 2;

/// A child to visit later.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::traverse) struct Entry {
    /// No ray of the packet meets it before.
    near: f32,
    /// The record that it is a child of, times `WIDTH`, and its lane.
    place: u32,
    /// The groups that may meet it.
    groups: u8,
}

/// Room for what a record puts off on each level.
pub(in crate::traverse) const STACK_SIZE: usize = WIDTH * (MAX_DEPTH as usize + 2);

/// A leaf, and its triangles in the rows of the tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaf<'a> {
    /// Nine rows of `count` numbers, and more.
    pub rows: &'a [f32],
    /// First reference.
    pub first: usize,
    pub count: usize,
}

/// Those triangles of a leaf that a ray of the packet may meet.
pub(super) struct Triangles<'a> {
    pub leaf: Leaf<'a>,
    /// One bit each.
    pub lanes: u8,
    pub stored: Stored,
}

impl Triangles<'_> {
    /// Where a triangle stands in the order, as the bits of a number.
    #[inline(always)]
    pub fn place(&self, lane: usize) -> f32 {
        f32::from_bits((self.leaf.first + lane) as u32)
    }
}

/// What is asked of the rays of a packet at leaves.
pub(super) trait Query<L: Lanes> {
    /// Rays as boxes see them; monotone in each of their numbers.
    fn slabs(rays: &Group<L>) -> Slabs<L>;

    /// How far rays matter.
    fn limits(rays: &Group<L>) -> L;

    /// Test some rays of a group, which enter the leaf's box at `near`, against some triangles. Answers whether any of
    /// the rays matters less far.
    fn test(&mut self, bundle: &mut Bundle<L>, triangles: &Triangles, group: usize, rays: u8, near: L) -> bool;

    /// All that the active rays of a bundle may meet has been shown.
    #[inline(always)]
    fn end(&mut self, _: &Bundle<L>, _active: u64) {}
}

const LANES: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Show the query all leaves that its rays may meet, front to back by their octant.
#[inline(always)]
pub(super) fn walk<L: Lanes, Q: Query<L>>(
    scene: &Scene,
    bundle: &mut Bundle<L>,
    stack: &mut Vec<Entry>,
    query: &mut Q,
) {
    stack.resize(STACK_SIZE, Entry::default());
    let (mut parents, mut space) = (Record::EMPTY, Record::EMPTY);
    let mut gathered: [f32; ROWS];
    let mut top = 0;
    let mut index = 0;
    let mut live = u8::MAX;
    loop {
        top = descend(scene, bundle, index, &mut space, live, stack, top);
        // The next record that is not beyond all rays; the leaves before it.
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let entry = stack[top];
            if entry.near > bundle.limit {
                continue;
            }
            let (parent, lane) = (entry.place as usize / WIDTH, entry.place as usize % WIDTH);
            let parent = scene.record::<L>(parent as u32, &mut parents);
            let target = match parent.child(lane).target() {
                // The packet's limit is that of its farthest ray: build nothing that none of the rays comes to.
                Target::Piece(number)
                    if scene.is_unbuilt(number)
                        && bundle.confirmed(&Sides::one(parent, bundle.octant, lane), entry.groups) == 0 =>
                {
                    continue;
                }
                Target::Piece(number) => match scene.enter(number as u32) {
                    Some(root) => Child::from_word(root).target(),
                    None => {
                        put_off(&mut stack[..=top]);
                        top += 1;
                        continue;
                    }
                },
                target => target,
            };
            match target {
                Target::Piece(_) => unreachable!("a piece has none for its root"),
                Target::Record(child) => {
                    index = child;
                    live = entry.groups;
                    break;
                }
                Target::Leaf { first, count } => {
                    let leaf = scene::Leaf { first, count };
                    let sides = Sides::one(parent, bundle.octant, lane);
                    let rows = match scene.rows(leaf) {
                        Some(rows) => rows.all(),
                        None if bundle.confirmed(&sides, entry.groups) == 0 => continue,
                        None => {
                            gathered = scene.gathered(leaf);
                            &gathered
                        }
                    };
                    let leaf = Leaf { rows, first, count };
                    visit(bundle, &leaf, &sides, entry.groups, query);
                }
            }
        }
    }
}

/// The last entry waits for another thread: put it behind the next one, if there is one.
#[cold]
#[inline(never)]
fn put_off(stack: &mut [Entry]) {
    std::thread::yield_now();
    if let [.., next, last] = stack {
        std::mem::swap(next, last);
    }
}

/// Put off the children of a record that the packet may meet, the nearest last. Answers the new top of the stack.
#[inline(always)]
fn descend<L: Lanes>(
    scene: &Scene,
    bundle: &Bundle<L>,
    index: usize,
    space: &mut Record,
    live: u8,
    stack: &mut [Entry],
    mut top: usize,
) -> usize {
    let record = scene.record::<L>(index as u32, space);
    let (near, far) = bundle.whole.clip(&Sides::all(record, bundle.octant), L::splat(bundle.limit));
    let (mut nears, mut lanes) = ([0.0; WIDTH], [0; WIDTH]);
    let places = near.push(far, &LANES, record.order(bundle.octant), &mut nears, &mut lanes);
    let count = places.count_ones() as usize;
    for (&near, &lane) in nears.iter().zip(&lanes).take(count) {
        let groups = if count < CONFIRM {
            live
        } else {
            let sides = Sides::one(record, bundle.octant, lane as usize & 7);
            let (near, far) = bundle.groups.clip(&sides, L::load(&bundle.group_limits));
            let groups = near.at_most(far).bits() & live;
            if record.words()[lane as usize & 7] >> 31 != 0 { groups } else { bundle.confirmed(&sides, groups) }
        };
        stack[top] = Entry { near, place: (index * WIDTH) as u32 | lane, groups };
        top += usize::from(groups != 0);
        scene.prefetch(record.words()[lane as usize & 7]);
    }
    top
}

/// Show the query a leaf, and those rays of some groups that meet its box.
#[inline(always)]
fn visit<L: Lanes, Q: Query<L>>(bundle: &mut Bundle<L>, leaf: &Leaf, sides: &Sides<L>, live: u8, query: &mut Q) {
    let mut nears = [bundle.groups.t_min; GROUPS];
    let mut rays = [0; GROUPS];
    let mut any = 0;
    for group in bits(live) {
        let (near, far) = bundle.rays[group].clip(sides, L::load(&bundle.limits[group]));
        nears[group] = near;
        rays[group] = near.at_most(far).bits();
        any |= rays[group];
    }
    if any == 0 {
        return;
    }
    let triangles = LeafTriangles::<L>::new(leaf);
    let lanes = bundle.shaft.meets(&triangles) & ((1u16 << leaf.count) - 1) as u8;
    if lanes == 0 {
        return;
    }
    let triangles = Triangles { leaf: *leaf, lanes, stored: triangles.stored() };
    let mut is_shorter = false;
    for group in bits(live) {
        if rays[group] != 0 {
            is_shorter |= query.test(bundle, &triangles, group, rays[group], nears[group]);
        }
    }
    if is_shorter {
        bundle.limit = L::load(&bundle.group_limits).largest();
    }
}
