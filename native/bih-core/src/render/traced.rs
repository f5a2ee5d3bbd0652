//! What a picture is traced in: a tree, or instances of trees.

use crate::build::Precision;
use crate::geometry::{Corners, Ray, Vector};
use crate::traverse::{Counts, Hit, Lists, Stack, Tracer, Way};

/// A hit, and the instance that is hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Where.
    pub hit: Hit,
    /// Row of the instance; 0 for a tree.
    pub instance: u32,
}

/// Answers the rays of a picture, at most a packet of neighbours at once.
pub trait Traced: Sync {
    /// What a thread needs for its rays.
    type Stack: Default + Send;

    /// How its hits are decided.
    fn precision(&self) -> Precision;

    /// The nearest hit of each ray.
    fn closest(&self, rays: &[Ray], stack: &mut Self::Stack, seen: &mut [Option<Seen>]);

    /// Whether each ray hits anything.
    fn occluded(&self, rays: &[Ray], stack: &mut Self::Stack, hidden: &mut [bool]);

    /// All hits of one ray, nearest first, appended.
    fn all(&self, ray: &Ray, stack: &mut Self::Stack, seen: &mut Vec<Seen>);

    /// What the nearest hit of each ray costs alone.
    fn cost(&self, rays: &[Ray], stack: &mut Self::Stack, counts: &mut [Counts]);

    /// Tell the processor that `prefetch_corners` comes next.
    fn prefetch_row(&self, seen: &Seen);

    /// Tell the processor that `corners` comes soon.
    fn prefetch_corners(&self, seen: &Seen);

    /// The corners of what is hit, in the world.
    fn corners(&self, seen: &Seen) -> Corners;

    /// Row of the tree that an instance shows.
    fn tree_of(&self, instance: u32) -> usize;

    /// What pieces that its rays build may hold at once.
    fn piece_bytes(&self) -> usize;

    /// A normal of an instance's own space as one in the world, of any length.
    fn normal_in_world(&self, instance: u32, normal: &Vector) -> Vector;
}

impl Traced for Tracer<'_> {
    type Stack = Stack;

    fn precision(&self) -> Precision {
        self.tree.precision()
    }

    fn closest(&self, rays: &[Ray], stack: &mut Stack, seen: &mut [Option<Seen>]) {
        const MOST: usize = crate::traverse::PACKET;
        let mut hits = [None; MOST];
        Tracer::closest(self, rays, Way::Packets, stack, &mut hits[..rays.len()]);
        for (seen, hit) in seen.iter_mut().zip(hits) {
            *seen = hit.map(|hit| Seen { hit, instance: 0 });
        }
    }

    fn occluded(&self, rays: &[Ray], stack: &mut Stack, hidden: &mut [bool]) {
        Tracer::occluded(self, rays, Way::suited(self.tree, rays), stack, hidden);
    }

    fn all(&self, ray: &Ray, stack: &mut Stack, seen: &mut Vec<Seen>) {
        let mut lists = Lists::default();
        // A panic comes to Python as one; it ends no process.
        Tracer::all(self, &[*ray], usize::MAX, stack, &mut lists).expect("memory for the hits of one ray");
        seen.extend(lists.hits.into_iter().map(|hit| Seen { hit, instance: 0 }));
    }

    fn cost(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [Counts]) {
        Tracer::cost(self, rays, stack, counts);
    }

    fn prefetch_row(&self, seen: &Seen) {
        self.triangles.prefetch_row(seen.hit.triangle);
    }

    fn prefetch_corners(&self, seen: &Seen) {
        self.triangles.prefetch_corners(seen.hit.triangle);
    }

    fn corners(&self, seen: &Seen) -> Corners {
        self.triangles.corners(seen.hit.triangle)
    }

    fn tree_of(&self, _: u32) -> usize {
        0
    }

    fn piece_bytes(&self) -> usize {
        self.tree.piece_bytes()
    }

    fn normal_in_world(&self, _: u32, normal: &Vector) -> Vector {
        *normal
    }
}
