//! Many rays at once, on all threads of the pool that the caller runs in.

use std::ops::Range;

use rayon::prelude::*;

use super::trace::{Tracer, Way};
use super::{Counts, Decisions, Hit, Stack};
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::{Ray, Triangles};
use crate::simd::FloatEnvironment;
use crate::tree::Tree;

/// Rays that a thread takes at a time: enough to forget what taking them costs, few enough to cancel promptly.
pub(super) const CHUNK: usize = 1024;

/// Points or directions in the precision they came in.
#[derive(Debug, Clone, Copy)]
pub enum Vectors<'a> {
    /// Single precision.
    F32(&'a [[f32; 3]]),
    /// Double precision.
    F64(&'a [[f64; 3]]),
}

impl Vectors<'_> {
    #[inline(always)]
    pub(super) fn get(&self, row: usize) -> [f64; 3] {
        match self {
            Self::F32(vectors) => vectors[row].map(f64::from),
            Self::F64(vectors) => vectors[row],
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::F32(vectors) => vectors.len(),
            Self::F64(vectors) => vectors.len(),
        }
    }
}

/// One end of each ray.
#[derive(Debug, Clone, Copy)]
pub enum Limits<'a> {
    /// The same for all.
    All(f64),
    /// One for each.
    Each(&'a [f64]),
}

impl Limits<'_> {
    #[inline(always)]
    fn get(&self, row: usize) -> f64 {
        match self {
            Self::All(limit) => *limit,
            Self::Each(limits) => limits[row],
        }
    }
}

/// Borrowed rays, in as many rows as `origins` has.
#[derive(Debug, Clone, Copy)]
pub struct RayBatch<'a> {
    /// Where they start.
    pub origins: Vectors<'a>,
    /// Where they go.
    pub directions: Vectors<'a>,
    /// The first t that counts.
    pub t_min: Limits<'a>,
    /// The last t that counts.
    pub t_max: Limits<'a>,
}

/// A number that answers are given in.
pub trait Float: Copy + Send + 'static {
    /// The distance of a miss.
    const INFINITY: Self;
    /// The weights of a miss.
    const ZERO: Self;
    /// The nearest one; a finite number stays finite: infinity means a miss.
    fn narrowed(x: f64) -> Self;
}

impl Float for f32 {
    const INFINITY: Self = f32::INFINITY;
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn narrowed(x: f64) -> Self {
        if x.is_finite() { (x as f32).clamp(f32::MIN, f32::MAX) } else { x as f32 }
    }
}

impl Float for f64 {
    const INFINITY: Self = f64::INFINITY;
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn narrowed(x: f64) -> Self {
        x
    }
}

/// The nearest hits of many rays.
#[derive(Debug, Clone, PartialEq)]
pub struct Hits<F> {
    /// Distances; infinite for a miss.
    pub t: Vec<F>,
    /// Rows of the triangles; -1 for a miss.
    pub triangle: Vec<i32>,
    /// Weights of their second vertices.
    pub u: Vec<F>,
    /// Weights of their third vertices.
    pub v: Vec<F>,
    /// How many rays no answer can be given for.
    pub invalid: usize,
}

impl RayBatch<'_> {
    /// One of them.
    #[inline(always)]
    pub fn ray(&self, row: usize) -> Ray {
        Ray {
            origin: self.origins.get(row),
            direction: self.directions.get(row),
            t_min: self.t_min.get(row),
            t_max: self.t_max.get(row),
        }
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.origins.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The nearest hit of each ray; a miss where there is none and for an invalid ray.
    pub fn closest<F: Float>(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Hits<F>, Error> {
        let count = self.len();
        tree.room("the hits", count * (3 * size_of::<F>() + 2 * size_of::<i32>()))?;
        control.start(count);
        // Memory of zeros is not touched before the threads write to it.
        let (mut t, mut triangle) = (vec![F::ZERO; count], vec![0; count]);
        let (mut u, mut v) = (vec![F::ZERO; count], vec![F::ZERO; count]);
        let arrays = (t.par_chunks_mut(CHUNK), triangle.par_chunks_mut(CHUNK));
        let arrays = (arrays.0, arrays.1, u.par_chunks_mut(CHUNK), v.par_chunks_mut(CHUNK));
        let invalid = arrays
            .into_par_iter()
            .enumerate()
            .map_init(Worker::default, |worker, (chunk, (t, triangle, u, v))| {
                control.advance(t.len())?;
                let invalid = worker.take(self, chunk * CHUNK..chunk * CHUNK + t.len());
                for (place, hit) in worker.closest(tree, triangles).iter().enumerate() {
                    (t[place], triangle[place]) = (F::INFINITY, -1);
                    if let Some(hit) = hit {
                        t[place] = F::narrowed(hit.t);
                        triangle[place] = hit.triangle as i32;
                        u[place] = F::narrowed(hit.u);
                        v[place] = F::narrowed(hit.v);
                    }
                }
                Ok::<_, Cancelled>(invalid)
            })
            .try_reduce(|| 0, |a, b| Ok(a + b))?;
        Ok(Hits { t, triangle, u, v, invalid })
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<bool>, Error> {
        self.each(tree, CHUNK, control, |worker, hidden| {
            let way = Way::suited(tree, &worker.rays);
            Tracer::new(tree, triangles).occluded(&worker.rays, way, &mut worker.stack, hidden);
        })
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray.
    pub fn cost(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Counts>, Error> {
        self.each(tree, CHUNK, control, |worker, counts| {
            Tracer::new(tree, triangles).cost(&worker.rays, &mut worker.stack, counts);
        })
    }

    /// How many tests of each ray the filters of exact decisions leave over.
    pub fn decisions(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Decisions>, Error> {
        self.each(tree, CHUNK, control, |worker, decisions| {
            Tracer::new(tree, triangles).decisions(&worker.rays, &mut worker.stack, decisions);
        })
    }

    /// Answers for all rays, of which a thread takes so many at a time.
    pub(super) fn each<A: Clone + Default + Send>(
        &self,
        tree: &Tree,
        size: usize,
        control: &Control,
        work: impl Fn(&mut Worker, &mut [A]) + Sync,
    ) -> Result<Vec<A>, Error> {
        tree.room("the answers", 2 * self.len() * size_of::<A>())?;
        let mut answers = vec![A::default(); self.len()];
        control.start(answers.len());
        answers.par_chunks_mut(size).enumerate().try_for_each_init(Worker::default, |worker, (chunk, answers)| {
            control.advance(answers.len())?;
            worker.take(self, chunk * size..chunk * size + answers.len());
            work(worker, answers);
            Ok::<_, Cancelled>(())
        })?;
        Ok(answers)
    }
}

/// What a thread keeps from one chunk of rays to the next.
pub(super) struct Worker {
    _standard: FloatEnvironment,
    pub(super) rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    pub(super) stack: Stack,
}

impl Default for Worker {
    fn default() -> Self {
        Self {
            _standard: FloatEnvironment::standard(),
            rays: Vec::with_capacity(CHUNK),
            hits: Vec::with_capacity(CHUNK),
            stack: Stack::default(),
        }
    }
}

impl Worker {
    /// Take the rays of some rows. Answers how many of them no answer can be given for.
    pub(super) fn take(&mut self, batch: &RayBatch, rows: Range<usize>) -> usize {
        self.rays.clear();
        self.rays.extend(rows.map(|row| batch.ray(row)));
        self.rays.iter().filter(|ray| !ray.is_valid()).count()
    }

    fn closest(&mut self, tree: &Tree, triangles: &Triangles) -> &[Option<Hit>] {
        self.hits.resize(self.rays.len(), None);
        let way = Way::suited(tree, &self.rays);
        Tracer::new(tree, triangles).closest(&self.rays, way, &mut self.stack, &mut self.hits);
        &self.hits
    }
}
