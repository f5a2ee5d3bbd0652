//! Rays of one octant on their way together.

use super::GROUPS;
use super::extremes::Extremes;
use super::rays::Group;
use super::shaft::Shaft;
use super::slabs::{Sides, Slabs};
use super::walk::Query;
use crate::simd::{Lanes, Mask};
use crate::tree::{Record, Tree, WIDTH};

/// The rays of a packet that go towards one octant, and what encloses each group of them and all of them.
pub(super) struct Bundle<L> {
    pub octant: usize,
    pub rays: [Slabs<L>; GROUPS],
    /// How far each ray still matters; others than those of the bundle nowhere.
    pub limits: [[f32; WIDTH]; GROUPS],
    /// A lane is a group.
    pub groups: Slabs<L>,
    pub group_limits: [f32; GROUPS],
    /// All lanes are the same.
    pub whole: Slabs<L>,
    pub limit: f32,
    pub shaft: Shaft<L>,
}

impl<L: Lanes> Bundle<L> {
    /// The rays of the groups are all of the octant; only the active ones matter. None if they all miss a record.
    #[inline(always)]
    pub fn new<Q: Query<L>>(
        groups: &[Group<L>; GROUPS],
        active: u64,
        octant: usize,
        tree: &Tree,
        record: &Record,
    ) -> Option<Self> {
        let nowhere = L::splat(f32::NEG_INFINITY);
        let mut limits = [nowhere; GROUPS];
        let mut longest = nowhere;
        for (i, group) in groups.iter().enumerate() {
            limits[i] = Q::limits(group).select(L::mask((active >> (WIDTH * i)) as u8), nowhere);
            longest = longest.maximum(limits[i]);
        }
        let limit = longest.largest();
        let extremes = Extremes::of_all(groups);
        let whole = enclosed::<L, Q>(&extremes, octant);
        let (near, far) = whole.clip(&Sides::all(record, octant), L::splat(limit));
        if near.at_most(far).bits() == 0 {
            return None;
        }
        let mut rays = [whole; GROUPS];
        let mut stored = [[0.0; WIDTH]; GROUPS];
        for (i, group) in groups.iter().enumerate() {
            rays[i] = Q::slabs(group);
            stored[i] = limits[i].store();
        }
        Some(Self {
            octant,
            rays,
            limits: stored,
            groups: enclosed::<L, Q>(&Extremes::of_each(groups), octant),
            group_limits: largest_each(limits).store(),
            whole,
            limit,
            shaft: Shaft::new(&extremes, tree.bounds()),
        })
    }

    /// Of the groups, the first of which a ray meets the box, and all behind it.
    #[inline(always)]
    pub fn confirmed(&self, sides: &Sides<L>, mut groups: u8) -> u8 {
        while groups != 0 {
            let group = groups.trailing_zeros() as usize;
            let (near, far) = self.rays[group].clip(sides, L::load(&self.limits[group]));
            if near.at_most(far).bits() != 0 {
                break;
            }
            groups &= groups - 1;
        }
        groups
    }

    /// The rays of a group matter less far.
    #[inline(always)]
    pub fn shorten(&mut self, group: usize, limits: L) {
        self.limits[group] = limits.store();
        self.group_limits[group] = limits.largest();
    }
}

/// One ray a lane that meets each box that one of the rays meets: what makes slabs of rays is monotone in every number.
#[inline(always)]
fn enclosed<L: Lanes, Q: Query<L>>(extremes: &Extremes<L>, octant: usize) -> Slabs<L> {
    let [first, last] = extremes.first_and_last(octant);
    let (near, far) = (Q::slabs(&first), Q::slabs(&last));
    Slabs { far_origin: far.far_origin, far_reciprocal: far.far_reciprocal, ..near }
}

/// The largest of each.
#[inline(always)]
fn largest_each<L: Lanes>(rows: [L; WIDTH]) -> L {
    let [a, b, c, d, e, f, g, h] = L::transposed(rows);
    a.maximum(b).maximum(c.maximum(d)).maximum(e.maximum(f).maximum(g.maximum(h)))
}
