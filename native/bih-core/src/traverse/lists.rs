//! All hits and the number of crossings of many rays, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::Hit;
use super::all::Lists;
use super::batch::{Float, RayBatch, Worker};
use super::trace::Tracer;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::Triangles;
use crate::memory::{self, Headroom};
use crate::tree::Tree;

/// The hits of many rays, one ray after another.
#[derive(Debug, Clone, PartialEq)]
pub struct HitLists<F> {
    /// Where those of each ray start, and where the last ones end.
    pub offsets: Vec<i64>,
    /// Distances.
    pub t: Vec<F>,
    /// Rows of the triangles.
    pub triangle: Vec<i32>,
    /// Weights of their second vertices.
    pub u: Vec<F>,
    /// Weights of their third vertices.
    pub v: Vec<F>,
}

/// Rays or points that a thread takes at a time.
pub(super) const TOGETHER: usize = 64;

/// Fewer of them where each may meet every triangle of a large mesh: who asks to stop is heard before the next ones.
pub(super) fn few(tree: &Tree) -> usize {
    const TESTS: usize = 1 << 22;
    (TESTS / tree.stats.triangles.max(1)).clamp(1, TOGETHER)
}

impl<F: Float> HitLists<F> {
    pub(crate) fn with_room(rays: usize, hits: usize) -> Self {
        let mut offsets = Vec::with_capacity(rays + 1);
        offsets.push(0);
        let numbers = || Vec::with_capacity(hits);
        Self { offsets, t: numbers(), triangle: Vec::with_capacity(hits), u: numbers(), v: numbers() }
    }

    pub(crate) fn bytes(rays: usize, hits: usize) -> usize {
        (rays + 1) * size_of::<i64>() + hits * (3 * size_of::<F>() + size_of::<i32>())
    }

    /// Of hits that `hit` is a part of.
    pub(crate) fn new<H>(
        Lists { hits, ends, allowance }: &mut Lists<H>,
        hit: impl Fn(&H) -> &Hit,
    ) -> Result<Self, Error> {
        allowance.take(Self::bytes(ends.len(), hits.len()))?;
        let mut lists = Self::with_room(ends.len(), hits.len());
        lists.offsets.extend(ends.iter().map(|&end| end as i64));
        for hit in hits.iter().map(hit) {
            lists.t.push(F::narrowed(hit.t));
            lists.triangle.push(hit.triangle as i32);
            lists.u.push(F::narrowed(hit.u));
            lists.v.push(F::narrowed(hit.v));
        }
        Ok(lists)
    }

    pub(crate) fn append(&mut self, other: Self) {
        let start = self.t.len() as i64;
        self.offsets.extend(other.offsets[1..].iter().map(|end| start + end));
        self.t.extend(other.t);
        self.triangle.extend(other.triangle);
        self.u.extend(other.u);
        self.v.extend(other.v);
    }
}

impl RayBatch<'_> {
    /// All hits of each ray, nearest first and of equal distances the lower row first, of each the nearest `most`, one at
    /// least; none for an invalid ray.
    pub fn all<F: Float>(
        &self,
        tree: &Tree,
        triangles: &Triangles,
        most: usize,
        control: &Control,
    ) -> Result<HitLists<F>, Error> {
        const WHAT: &str = "the hits";
        let count = self.len();
        // Twice the lists of the parts while they are put in a row.
        tree.room(WHAT, 2 * size_of::<HitLists<F>>() * count.div_ceil(TOGETHER))?;
        let headroom = Headroom::new(WHAT);
        control.start(count);
        let tracer = Tracer::new(tree, triangles);
        let parts: Vec<HitLists<F>> = (0..count.div_ceil(TOGETHER))
            .into_par_iter()
            .map_init(Worker::default, |worker, chunk| {
                worker.take(self, chunk * TOGETHER..count.min((chunk + 1) * TOGETHER));
                let mut lists = Lists::of(&headroom);
                for rays in worker.rays.chunks(few(tree)) {
                    control.advance(rays.len())?;
                    tracer.all(rays, most.max(1), &mut worker.stack, &mut lists)?;
                }
                HitLists::new(&mut lists, |hit| hit)
            })
            .collect::<Result<_, Error>>()?;
        let hits = parts.iter().map(|part| part.t.len()).sum();
        memory::room(WHAT, HitLists::<F>::bytes(count, hits))?;
        let mut lists = HitLists::with_room(count, hits);
        parts.into_iter().for_each(|part| lists.append(part));
        Ok(lists)
    }

    /// How many triangles each ray crosses between its ends; none for an invalid ray.
    pub fn count(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<i32>, Error> {
        self.each(tree, few(tree), control, |worker, counts| {
            Tracer::new(tree, triangles).count(&worker.rays, &mut worker.stack, counts);
        })
    }
}
