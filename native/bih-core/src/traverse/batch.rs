//! Many rays at once, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::flight::{Rays, closest_in_flight, occluded_in_flight};
use super::{Counts, Hit, Stack, closest};
use crate::control::{Cancelled, Control};
use crate::geometry::{Ray, Triangles};
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch};
use crate::tree::Tree;

/// Rays that a thread takes at a time: enough to forget what taking them costs, few enough to cancel promptly.
const CHUNK: usize = 1024;

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
    fn get(&self, row: usize) -> [f64; 3] {
        match self {
            Self::F32(vectors) => vectors[row].map(f64::from),
            Self::F64(vectors) => vectors[row],
        }
    }

    fn len(&self) -> usize {
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
    #[inline(always)]
    fn ray(&self, row: usize) -> Ray {
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
    pub fn closest<F: Float>(
        &self,
        tree: &Tree,
        triangles: &Triangles,
        control: &Control,
    ) -> Result<Hits<F>, Cancelled> {
        let count = self.len();
        control.start(count);
        let (mut t, mut triangle) = (vec![F::ZERO; count], vec![0; count]);
        let (mut u, mut v) = (vec![F::ZERO; count], vec![F::ZERO; count]);
        let arrays = (t.par_chunks_mut(CHUNK), triangle.par_chunks_mut(CHUNK));
        let arrays = (arrays.0, arrays.1, u.par_chunks_mut(CHUNK), v.par_chunks_mut(CHUNK));
        let invalid = arrays
            .into_par_iter()
            .enumerate()
            .map(|(chunk, (t, triangle, u, v))| {
                let _standard = FloatEnvironment::standard();
                control.advance(t.len())?;
                t.fill(F::INFINITY);
                triangle.fill(-1);
                let rays = Chunk::new(self, chunk, HitsMut { t, triangle, u, v });
                Ok(dispatch(Closest { tree, triangles, rays }))
            })
            .try_reduce(|| 0, |a, b| Ok(a + b))?;
        Ok(Hits { t, triangle, u, v, invalid })
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<bool>, Cancelled> {
        self.each(control, |rays| dispatch(Occluded { tree, triangles, rays }))
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray.
    pub fn cost(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Counts>, Cancelled> {
        self.each(control, |rays| dispatch(Cost { tree, triangles, rays }))
    }

    fn each<A: Clone + Default + Send>(
        &self,
        control: &Control,
        work: impl Fn(Chunk<&mut [A]>) + Sync,
    ) -> Result<Vec<A>, Cancelled> {
        let mut answers = vec![A::default(); self.len()];
        control.start(answers.len());
        answers.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, answers)| {
            let _standard = FloatEnvironment::standard();
            control.advance(answers.len())?;
            work(Chunk::new(self, chunk, answers));
            Ok(())
        })?;
        Ok(answers)
    }
}

/// Where the answers of a thread's rays go.
trait Answers<A> {
    fn len(&self) -> usize;
    fn put(&mut self, place: usize, answer: A);
}

impl<A> Answers<A> for &mut [A] {
    fn len(&self) -> usize {
        <[A]>::len(self)
    }
    #[inline(always)]
    fn put(&mut self, place: usize, answer: A) {
        self[place] = answer;
    }
}

/// A part of `Hits`, filled with misses.
struct HitsMut<'a, F> {
    t: &'a mut [F],
    triangle: &'a mut [i32],
    u: &'a mut [F],
    v: &'a mut [F],
}

impl<F: Float> Answers<Option<Hit>> for HitsMut<'_, F> {
    fn len(&self) -> usize {
        self.t.len()
    }
    #[inline(always)]
    fn put(&mut self, place: usize, answer: Option<Hit>) {
        if let Some(hit) = answer {
            self.t[place] = F::narrowed(hit.t);
            self.triangle[place] = hit.triangle as i32;
            self.u[place] = F::narrowed(hit.u);
            self.v[place] = F::narrowed(hit.v);
        }
    }
}

/// The rays that one thread takes at a time, and where their answers go.
struct Chunk<'a, O> {
    batch: &'a RayBatch<'a>,
    first: usize,
    /// Of the next ray.
    place: usize,
    answers: O,
    invalid: usize,
}

impl<'a, O> Chunk<'a, O> {
    fn new(batch: &'a RayBatch<'a>, chunk: usize, answers: O) -> Self {
        Self { batch, first: chunk * CHUNK, place: 0, answers, invalid: 0 }
    }
}

impl<A, O: Answers<A>> Rays<A> for Chunk<'_, O> {
    #[inline(always)]
    fn next(&mut self) -> Option<(usize, Ray)> {
        while self.place < self.answers.len() {
            let place = self.place;
            self.place += 1;
            let ray = self.batch.ray(self.first + place);
            if ray.is_valid() {
                return Some((place, ray));
            }
            self.invalid += 1;
        }
        None
    }

    #[inline(always)]
    fn answer(&mut self, number: usize, answer: A) {
        self.answers.put(number, answer);
    }
}

struct Closest<'a, F> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    rays: Chunk<'a, HitsMut<'a, F>>,
}

impl<F: Float> Kernel for Closest<'_, F> {
    /// How many rays were invalid.
    type Output = usize;
    #[inline(always)]
    fn run<L: Lanes>(mut self) -> usize {
        closest_in_flight::<L, _>(self.tree, self.triangles, &mut self.rays);
        self.rays.invalid
    }
}

struct Occluded<'a> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    rays: Chunk<'a, &'a mut [bool]>,
}

impl Kernel for Occluded<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        occluded_in_flight::<L, _>(self.tree, self.triangles, &mut self.rays);
    }
}

struct Cost<'a> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    rays: Chunk<'a, &'a mut [Counts]>,
}

impl Kernel for Cost<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(mut self) {
        let mut stack = Stack::default();
        while let Some((place, ray)) = self.rays.next() {
            let mut counts = Counts::default();
            closest::<L, _>(self.tree, self.triangles, &ray, &mut stack, &mut counts);
            self.rays.answer(place, counts);
        }
    }
}
