//! Searches in single precision.

use super::Hit;
use super::scene::{Leaf, Scene, bits};
use super::search::{Search, Walker};
use super::slab::Slab;
use crate::geometry::{Ray, round_down, round_up};
use crate::intersect::{Meeting, SingleHit, SingleRay};
use crate::simd::{Lanes, Mask};

impl SingleRay {
    /// The nearest ray of single precision, and those t of single precision that count.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.map(|x| x as f32),
            direction: ray.direction.map(|x| x as f32),
            t_min: exactly(ray.t_min).unwrap_or_else(|| round_up(ray.t_min)).max(f32::MIN),
            t_max: exactly(ray.t_max).unwrap_or_else(|| round_down(ray.t_max)).min(f32::MAX),
        }
    }

    /// The same in double precision.
    pub(super) fn widened(&self) -> Ray {
        Ray {
            origin: self.origin.map(f64::from),
            direction: self.direction.map(f64::from),
            t_min: f64::from(self.t_min),
            t_max: f64::from(self.t_max),
        }
    }

    /// Eight triangles of a box that is entered at `near`: which of them are met between the ends, at which t, and the
    /// rest.
    ///
    /// A ray meets no triangle before it enters the box, so what rounding put before is moved there: a box beyond the
    /// nearest hit then holds no nearer one, and the answer does not depend on the order of boxes.
    #[inline(always)]
    pub(super) fn meet_eight<L: Lanes>(&self, scene: &Scene, leaf: Leaf, near: f32) -> (u8, L, Meeting<L>) {
        let vertices = scene.vertices(leaf);
        let meeting = Meeting::<L>::new(&splat(&self.origin), &splat(&self.direction), &vertices);
        // Dividing all costs less than a branch on whether any is inside.
        let met = meeting.t.over(meeting.size);
        let t = met.maximum(L::splat(near));
        let is_within = L::splat(self.t_min).at_most(met).and(t.at_most(L::splat(self.t_max)));
        (is_within.and(meeting.is_inside()).bits() & leaf.lanes(), t, meeting)
    }
}

/// A number of single precision, as the ends of most rays are.
#[inline(always)]
fn exactly(x: f64) -> Option<f32> {
    let rounded = x as f32;
    (f64::from(rounded) == x).then_some(rounded)
}

#[inline(always)]
pub(super) fn splat<L: Lanes>(values: &[f32; 3]) -> [L; 3] {
    [L::splat(values[0]), L::splat(values[1]), L::splat(values[2])]
}

/// The nearest hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct FastClosest {
    /// Ends at the nearest hit so far.
    ray: SingleRay,
    /// That hit's reference; none yet where it is `NONE`.
    best: usize,
    /// Its weights, and what divides them.
    weights: [f32; 3],
}

const NONE: usize = usize::MAX;

impl FastClosest {
    /// Whether a hit at `t` comes before the nearest so far.
    #[inline(always)]
    fn precedes(&self, t: f32, reference: usize, scene: &Scene) -> bool {
        t < self.ray.t_max || self.best == NONE || scene.row(reference) < scene.row(self.best)
    }
}

impl Walker for FastClosest {
    #[inline(always)]
    fn slab(&self, _: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::single(&self.ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray.widened()
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, near: f32) -> bool {
        let (within, t, meeting) = self.ray.meet_eight::<L>(scene, leaf, near);
        if within == 0 {
            return false;
        }
        let (t, u, v, size) = (t.store(), meeting.u.store(), meeting.v.store(), meeting.size.store());
        for lane in bits(within) {
            if t[lane] <= self.ray.t_max && self.precedes(t[lane], leaf.first + lane, scene) {
                self.ray.t_max = t[lane];
                self.best = leaf.first + lane;
                scene.prefetch_row(self.best);
                self.weights = [u[lane], v[lane], size[lane]];
            }
        }
        false
    }
}

impl Search for FastClosest {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn new(ray: &Ray, _: &Scene) -> Self {
        Self { ray: SingleRay::new(ray), best: NONE, weights: [0.0; 3] }
    }

    #[inline(always)]
    fn answer(&self, scene: &Scene) -> Option<Hit> {
        if self.best == NONE {
            return None;
        }
        let [u, v, size] = self.weights;
        let hit = SingleHit { t: self.ray.t_max, u: u / size, v: v / size };
        Some(Hit::single(hit, scene.row(self.best)))
    }
}

/// Whether anything is hit.
#[derive(Debug, Clone, Copy)]
pub(super) struct FastOccluded {
    ray: SingleRay,
    found: bool,
}

impl Walker for FastOccluded {
    #[inline(always)]
    fn slab(&self, _: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::single(&self.ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray.widened()
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, near: f32) -> bool {
        self.found = self.ray.meet_eight::<L>(scene, leaf, near).0 != 0;
        self.found
    }
}

impl Search for FastOccluded {
    type Answer = bool;

    #[inline(always)]
    fn new(ray: &Ray, _: &Scene) -> Self {
        Self { ray: SingleRay::new(ray), found: false }
    }

    #[inline(always)]
    fn answer(&self, _: &Scene) -> bool {
        self.found
    }
}
