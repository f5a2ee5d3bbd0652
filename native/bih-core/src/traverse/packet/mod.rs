//! Coherent rays together: 64 of them in eight groups of eight lanes go down the wide records as one.
//!
//! A record's children are tested once against the interval that holds all rays, then against the intervals of the
//! groups, and a leaf against the rays of the groups that are left (docs/decisions/packets.md). What is left out is what
//! no ray meets, so the answers are those of single rays.

mod bundle;
mod extremes;
mod fast;
mod fast_closest;
mod rays;
mod shaft;
mod slabs;
mod triangles;
mod walk;
mod watertight;

use bundle::Bundle;
use fast_closest::FastClosest;
use rays::{Group, Rows, filled, groups, octants, rows};
pub(super) use walk::Entry;
use walk::{Query, walk};

use super::{Hit, Stack, Uncounted};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::simd::Lanes;
use crate::tree::{Tree, WIDTH, Wide};

/// Rays of a packet at most.
pub const PACKET: usize = GROUPS * WIDTH;

const GROUPS: usize = 8;

/// How far apart the origins of coherent rays may lie, as a part of the scene's longest side, and how far their
/// directions, as a part of the component along which they go farthest.
const ORIGINS: f64 = 0.25;
const DIRECTIONS: f64 = 0.5;

/// The nearest hits of up to `PACKET` rays, those of `traverse::closest`; none for invalid rays. `answer` is told each
/// ray's once, in any order.
#[inline(always)]
pub fn closest<L: Lanes>(
    tree: &Tree,
    triangles: &Triangles,
    rays: &[Ray],
    stack: &mut Stack,
    mut answer: impl FnMut(usize, Option<Hit>),
) {
    assert!(rays.len() <= PACKET, "{} rays", rays.len());
    let rows = rows::<L>(rays);
    let groups = groups::<L>(&rows);
    let active = active(tree, &groups);
    for i in alone(rays, active) {
        let is_valid = rays[i].is_valid();
        let hit =
            if is_valid { super::closest::<L, _>(tree, triangles, &rays[i], stack, &mut Uncounted) } else { None };
        answer(i, hit);
    }
    let Some(wide) = tree.wide.as_ref().filter(|_| active != 0) else { return };
    match tree.precision {
        Precision::Fast => {
            let mut query = FastClosest::new(&rows, &groups, &tree.order);
            trace(tree, wide, &rows, &groups, active, stack, &mut query);
            query.collect(active, answer);
        }
        Precision::Watertight => {
            let mut query = watertight::Closest::new(rays, &groups, tree);
            trace(tree, wide, &rows, &groups, active, stack, &mut query);
            query.collect(active, answer);
        }
    }
}

/// Which of up to `PACKET` rays hit anything, one bit a ray, the first the lowest: the answers of `traverse::occluded`;
/// an invalid ray does not.
#[inline(always)]
pub fn occluded<L: Lanes>(tree: &Tree, triangles: &Triangles, rays: &[Ray], stack: &mut Stack) -> u64 {
    assert!(rays.len() <= PACKET, "{} rays", rays.len());
    let rows = rows::<L>(rays);
    let groups = groups::<L>(&rows);
    let active = active(tree, &groups);
    let mut hidden = 0;
    for i in alone(rays, active) {
        let is_hidden = rays[i].is_valid() && super::occluded::<L, _>(tree, triangles, &rays[i], stack, &mut Uncounted);
        hidden |= u64::from(is_hidden) << i;
    }
    let Some(wide) = tree.wide.as_ref().filter(|_| active != 0) else { return hidden };
    match tree.precision {
        Precision::Fast => {
            let mut query = fast::Occluded::new(&rows, &groups);
            trace(tree, wide, &rows, &groups, active, stack, &mut query);
            hidden | query.hidden
        }
        Precision::Watertight => {
            let mut query = watertight::Occluded::new(rays, &groups, tree);
            trace(tree, wide, &rows, &groups, active, stack, &mut query);
            hidden | query.hidden
        }
    }
}

/// Ask about the active rays, one octant after another.
#[inline(always)]
fn trace<L: Lanes, Q: Query<L>>(
    tree: &Tree,
    wide: &Wide,
    rows: &Rows,
    groups: &[Group<L>; GROUPS],
    active: u64,
    stack: &mut Stack,
    query: &mut Q,
) {
    for (octant, active) in octants(groups, active) {
        let others;
        let groups = if active == u64::MAX {
            groups
        } else {
            others = rays::groups(&filled(rows, active));
            &others
        };
        if let Some(mut bundle) = Bundle::new::<Q>(groups, active, octant, tree, &wide.records[0]) {
            walk(wide, &mut bundle, &mut stack.packet, query);
            query.end(&bundle, active);
        }
    }
}

/// Whether rays are so alike that a packet of them is worth its while: most of what one of them meets, the others do.
pub fn is_coherent(tree: &Tree, rays: &[Ray]) -> bool {
    let Some(first) = rays.first() else { return false };
    let bounds = tree.bounds();
    let size = (0..3).map(|axis| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis])).fold(0.0, f64::max);
    let along = (0..3).max_by(|&a, &b| first.direction[a].abs().total_cmp(&first.direction[b].abs())).unwrap_or(0);
    let mut least = [[f64::INFINITY; 3]; 2];
    let mut most = [[f64::NEG_INFINITY; 3]; 2];
    for ray in rays {
        for axis in 0..3 {
            for (kind, x) in [ray.origin[axis], ray.direction[axis] / ray.direction[along]].into_iter().enumerate() {
                least[kind][axis] = least[kind][axis].min(x);
                most[kind][axis] = most[kind][axis].max(x);
            }
        }
    }
    (0..3).all(|axis| most[0][axis] - least[0][axis] <= ORIGINS * size && most[1][axis] - least[1][axis] <= DIRECTIONS)
}

/// The rays that a packet can answer, one bit a ray.
#[inline(always)]
fn active<L: Lanes>(tree: &Tree, groups: &[Group<L>; GROUPS]) -> u64 {
    let has_rows = tree.wide.as_ref().is_some_and(|wide: &Wide| !wide.rows.is_empty() && !wide.records.is_empty());
    let mut active = 0;
    for (group, rays) in groups.iter().enumerate().filter(|_| has_rows) {
        active |= u64::from(rays.in_range(tree.bounds())) << (WIDTH * group);
    }
    active
}

/// The other rays.
#[inline(always)]
fn alone(rays: &[Ray], active: u64) -> impl Iterator<Item = usize> {
    bits(!active & u64::MAX.checked_shr((PACKET - rays.len()) as u32).unwrap_or(0))
}

/// The places of the bits that are set.
#[inline(always)]
fn bits(mask: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut mask = mask.into();
    std::iter::from_fn(move || {
        let place = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (place < 64).then_some(place)
    })
}
