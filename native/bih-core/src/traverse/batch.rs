//! Many rays at once, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::{Counts, Hit, Stack, Uncounted, closest, occluded};
use crate::control::{Cancelled, Control};
use crate::geometry::{Ray, Triangles, Vector};
use crate::simd::FloatEnvironment;
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
        self.answer(control, |ray, stack| closest(tree, triangles, ray, stack, &mut Uncounted))
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<bool>, Cancelled> {
        self.answer(control, |ray, stack| occluded(tree, triangles, ray, stack, &mut Uncounted))
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray.
    pub fn cost(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<Counts>, Cancelled> {
        self.answer(control, |ray, stack| {
            let mut counts = Counts::default();
            closest(tree, triangles, ray, stack, &mut counts);
            counts
        })
    }

    fn answer<T: Clone + Default + Send>(
        &self,
        control: &Control,
        query: impl Fn(&Ray, &mut Stack) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        let mut answers = vec![T::default(); self.origins.len()];
        control.start(answers.len());
        answers.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, answers)| {
            let _standard = FloatEnvironment::standard();
            let mut stack = Stack::default();
            control.advance(answers.len())?;
            for (row, answer) in answers.iter_mut().enumerate() {
                let ray = self.ray(chunk * CHUNK + row);
                if ray.is_valid() {
                    *answer = query(&ray, &mut stack);
                }
            }
            Ok(())
        })?;
        Ok(answers)
    }
}
