//! Many rays at once, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::{Counts, Hit, Stack, Uncounted, closest, occluded};
use crate::control::{Cancelled, Control};
use crate::geometry::{Ray, Triangles, Vector};
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch};
use crate::tree::Tree;

/// Rays that a thread takes at a time: enough to forget what taking them costs, few enough to cancel promptly.
const CHUNK: usize = 256;

/// One end of each ray.
#[derive(Debug, Clone, Copy)]
pub enum Limits<'a> {
    /// The same for all.
    All(f64),
    /// One for each.
    Each(&'a [f64]),
}

impl Limits<'_> {
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
    pub origins: &'a [Vector],
    /// Where they go.
    pub directions: &'a [Vector],
    /// The first t that counts.
    pub t_min: Limits<'a>,
    /// The last t that counts.
    pub t_max: Limits<'a>,
}

impl RayBatch<'_> {
    fn ray(&self, row: usize) -> Ray {
        Ray {
            origin: self.origins[row],
            direction: self.directions[row],
            t_min: self.t_min.get(row),
            t_max: self.t_max.get(row),
        }
    }

    /// How many rays no answer can be given for.
    pub fn invalid(&self) -> usize {
        (0..self.origins.len()).into_par_iter().filter(|&row| !self.ray(row).is_valid()).count()
    }

    /// The nearest hit of each ray; none for a miss and for an invalid ray.
    pub fn closest(
        &self,
        tree: &Tree,
        triangles: &Triangles,
        control: &Control,
    ) -> Result<Vec<Option<Hit>>, Cancelled> {
        self.answer::<Closest>(tree, triangles, control)
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<bool>, Cancelled> {
        self.answer::<Occluded>(tree, triangles, control)
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray.
    pub fn cost(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Counts>, Cancelled> {
        self.answer::<Cost>(tree, triangles, control)
    }

    fn answer<Q: Query>(
        &self,
        tree: &Tree,
        triangles: &Triangles,
        control: &Control,
    ) -> Result<Vec<Q::Answer>, Cancelled> {
        let mut answers = vec![Q::Answer::default(); self.origins.len()];
        control.start(answers.len());
        answers.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, answers)| {
            let _standard = FloatEnvironment::standard();
            control.advance(answers.len())?;
            dispatch(Chunk::<Q> { tree, triangles, rays: self, first: chunk * CHUNK, answers });
            Ok(())
        })?;
        Ok(answers)
    }
}

/// What is asked of each ray.
trait Query {
    type Answer: Clone + Default + Send;
    fn answer<L: Lanes>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> Self::Answer;
}

struct Closest;

impl Query for Closest {
    type Answer = Option<Hit>;
    #[inline(always)]
    fn answer<L: Lanes>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> Option<Hit> {
        closest::<L, _>(tree, triangles, ray, stack, &mut Uncounted)
    }
}

struct Occluded;

impl Query for Occluded {
    type Answer = bool;
    #[inline(always)]
    fn answer<L: Lanes>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> bool {
        occluded::<L, _>(tree, triangles, ray, stack, &mut Uncounted)
    }
}

struct Cost;

impl Query for Cost {
    type Answer = Counts;
    #[inline(always)]
    fn answer<L: Lanes>(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> Counts {
        let mut counts = Counts::default();
        closest::<L, _>(tree, triangles, ray, stack, &mut counts);
        counts
    }
}

/// The rays that one thread takes at a time.
struct Chunk<'a, Q: Query> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    rays: &'a RayBatch<'a>,
    first: usize,
    answers: &'a mut [Q::Answer],
}

impl<Q: Query> Kernel for Chunk<'_, Q> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut stack = Stack::default();
        for (row, answer) in self.answers.iter_mut().enumerate() {
            let ray = self.rays.ray(self.first + row);
            if ray.is_valid() {
                *answer = Q::answer::<L>(self.tree, self.triangles, &ray, &mut stack);
            }
        }
    }
}
