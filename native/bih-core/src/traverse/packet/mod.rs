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

use super::scene::Scene;
use super::{Hit, Stack};
use crate::build::Precision;
use crate::geometry::Ray;
use crate::simd::Lanes;
use crate::tree::{Record, Tree, WIDTH};

/// Rays of a packet at most.
pub const PACKET: usize = GROUPS * WIDTH;

const GROUPS: usize = 8;

/// One number of each ray, group by group.
type Column = [[f32; WIDTH]; GROUPS];

/// How far apart the origins of coherent rays may lie, as a part of the scene's longest side, and how far their
/// directions, as a part of the component along which they go farthest.
const ORIGINS: f64 = 0.0625;
const DIRECTIONS: f64 = 0.5;

/// The nearest hits of up to `PACKET` rays, the same as for single rays. Answers for which rays, one bit each, the first
/// the lowest: single precision has no room for others.
#[inline(always)]
pub(super) fn closest<L: Lanes>(scene: &Scene, rays: &[Ray], stack: &mut Stack, hits: &mut [Option<Hit>]) -> u64 {
    assert!(rays.len() <= PACKET, "{} rays", rays.len());
    let tree = scene.tree;
    let rows = rows::<L>(rays);
    let groups = groups::<L>(&rows);
    let active = active(scene, &groups);
    match tree.precision {
        _ if active == 0 => {}
        Precision::Fast => {
            let mut query = FastClosest::new(&rows, &groups, &tree.order);
            trace(scene, &rows, &groups, active, stack, &mut query);
            query.collect(active, |ray, hit| hits[ray] = hit);
        }
        Precision::Watertight | Precision::Exact => {
            let mut query = watertight::Closest::new(rays, &rows, &groups, scene);
            trace(scene, &rows, &groups, active, stack, &mut query);
            query.collect(active, |ray, hit| hits[ray] = hit);
        }
    }
    active
}

/// Whether up to `PACKET` rays hit anything, the same as for single rays. Answers for which rays.
#[inline(always)]
pub(super) fn occluded<L: Lanes>(scene: &Scene, rays: &[Ray], stack: &mut Stack, hidden: &mut [bool]) -> u64 {
    assert!(rays.len() <= PACKET, "{} rays", rays.len());
    let rows = rows::<L>(rays);
    let groups = groups::<L>(&rows);
    let active = active(scene, &groups);
    let found = match scene.tree.precision {
        _ if active == 0 => 0,
        Precision::Fast => {
            let mut query = fast::Occluded::new(&rows, &groups);
            trace(scene, &rows, &groups, active, stack, &mut query);
            query.hidden
        }
        Precision::Watertight | Precision::Exact => {
            let mut query = watertight::Occluded::new(rays, &rows, &groups, scene);
            trace(scene, &rows, &groups, active, stack, &mut query);
            query.hidden
        }
    };
    for ray in bits(found) {
        hidden[ray] = true;
    }
    active
}

/// Ask about the active rays, one octant after another.
#[inline(always)]
fn trace<L: Lanes, Q: Query<L>>(
    scene: &Scene,
    rows: &Rows,
    groups: &[Group<L>; GROUPS],
    active: u64,
    stack: &mut Stack,
    query: &mut Q,
) {
    let mut space = Record::EMPTY;
    let root = scene.record::<L>(0, &mut space);
    for (octant, active) in octants(groups, active) {
        let others;
        let groups = if active == u64::MAX {
            groups
        } else {
            others = rays::groups(&filled(rows, active));
            &others
        };
        if let Some(mut bundle) = Bundle::new::<Q>(groups, active, octant, scene.tree, root) {
            walk(scene, &mut bundle, &mut stack.packet, query);
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
fn active<L: Lanes>(scene: &Scene, groups: &[Group<L>; GROUPS]) -> u64 {
    // Where double precision decides, the filter has no room for its vertices.
    let is_double = scene.triangles.is_double() && scene.tree.precision != Precision::Fast;
    let mut active = 0;
    for (group, rays) in groups.iter().enumerate().filter(|_| !is_double && !scene.wide.records.is_empty()) {
        active |= u64::from(rays.in_range(scene.tree.bounds())) << (WIDTH * group);
    }
    active
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
