//! Many rays through a scene, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::queries::{Any, Nearest, SceneHit};
use super::scene::{Model, Scene};
use super::walk::{Stacks, search};
use crate::control::{Cancelled, Control};
use crate::geometry::Ray;
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch};
use crate::traverse::{Counts, Float, Hits, RayBatch, Uncounted};

/// Rays that a thread takes at a time: who asks to stop is heard before the next ones.
const CHUNK: usize = 256;

/// The nearest hits of many rays, and the instances that they are in.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneHits<F> {
    /// Where, and which triangles of the models.
    pub hits: Hits<F>,
    /// Rows of the instances; -1 for a miss.
    pub instance: Vec<i32>,
}

/// A scene and the models that it was made of.
#[derive(Debug, Clone, Copy)]
pub struct SceneTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Those that it was made of.
    pub models: &'a [Model<'a>],
}

impl SceneTracer<'_> {
    /// The nearest hit of each ray; none for a miss and for an invalid ray.
    pub fn closest(&self, rays: &[Ray], stacks: &mut Stacks, hits: &mut [Option<SceneHit>]) {
        assert_eq!(rays.len(), hits.len());
        hits.fill(None);
        dispatch(Closest { tracer: self, rays, stacks, hits });
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, rays: &[Ray], stacks: &mut Stacks, hidden: &mut [bool]) {
        assert_eq!(rays.len(), hidden.len());
        hidden.fill(false);
        dispatch(Occluded { tracer: self, rays, stacks, hidden });
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray. Nodes are those of all trees.
    pub fn cost(&self, rays: &[Ray], stacks: &mut Stacks, counts: &mut [Counts]) {
        assert_eq!(rays.len(), counts.len());
        counts.fill(Counts::default());
        dispatch(Cost { tracer: self, rays, stacks, counts });
    }
}

struct Closest<'a> {
    tracer: &'a SceneTracer<'a>,
    rays: &'a [Ray],
    stacks: &'a mut Stacks,
    hits: &'a mut [Option<SceneHit>],
}

impl Kernel for Closest<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let SceneTracer { scene, models } = self.tracer;
        for (ray, hit) in self.rays.iter().zip(self.hits).filter(|(ray, _)| ray.is_valid()) {
            *hit = search::<L, Nearest, _>(scene, models, ray, self.stacks, &mut [Uncounted; 2]);
        }
    }
}

struct Occluded<'a> {
    tracer: &'a SceneTracer<'a>,
    rays: &'a [Ray],
    stacks: &'a mut Stacks,
    hidden: &'a mut [bool],
}

impl Kernel for Occluded<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let SceneTracer { scene, models } = self.tracer;
        for (ray, is_hidden) in self.rays.iter().zip(self.hidden).filter(|(ray, _)| ray.is_valid()) {
            *is_hidden = search::<L, Any, _>(scene, models, ray, self.stacks, &mut [Uncounted; 2]);
        }
    }
}

struct Cost<'a> {
    tracer: &'a SceneTracer<'a>,
    rays: &'a [Ray],
    stacks: &'a mut Stacks,
    counts: &'a mut [Counts],
}

impl Kernel for Cost<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let SceneTracer { scene, models } = self.tracer;
        for (ray, counts) in self.rays.iter().zip(self.counts).filter(|(ray, _)| ray.is_valid()) {
            let mut both = [Counts::default(); 2];
            search::<L, Nearest, _>(scene, models, ray, self.stacks, &mut both);
            let [upper, lower] = both;
            // The upper tree's leaves hold instances.
            *counts = Counts { nodes: upper.nodes + lower.nodes, triangles: lower.triangles };
        }
    }
}

/// What a thread keeps from one chunk of rays to the next.
struct Worker {
    _standard: FloatEnvironment,
    rays: Vec<Ray>,
    stacks: Stacks,
}

impl Default for Worker {
    fn default() -> Self {
        Self { _standard: FloatEnvironment::standard(), rays: Vec::with_capacity(CHUNK), stacks: Stacks::default() }
    }
}

impl Worker {
    fn take(&mut self, batch: &RayBatch, chunk: usize, count: usize) {
        self.rays.clear();
        self.rays.extend((chunk * CHUNK..chunk * CHUNK + count).map(|row| batch.ray(row)));
    }
}

impl SceneTracer<'_> {
    /// The nearest hit of each ray of a batch; a miss where there is none and for an invalid ray.
    pub fn closest_of<F: Float>(&self, batch: &RayBatch, control: &Control) -> Result<SceneHits<F>, Cancelled> {
        let hits = self.each(batch, control, |worker, hits: &mut [Option<SceneHit>]| {
            self.closest(&worker.rays, &mut worker.stacks, hits);
        })?;
        let of = |value: fn(&SceneHit) -> f64, miss: F| -> Vec<F> {
            hits.iter().map(|hit| hit.as_ref().map_or(miss, |hit| F::narrowed(value(hit)))).collect()
        };
        let invalid = (0..batch.len()).filter(|&row| !batch.ray(row).is_valid()).count();
        Ok(SceneHits {
            hits: Hits {
                t: of(|hit| hit.hit.t, F::INFINITY),
                triangle: hits.iter().map(|hit| hit.map_or(-1, |hit| hit.hit.triangle as i32)).collect(),
                u: of(|hit| hit.hit.u, F::ZERO),
                v: of(|hit| hit.hit.v, F::ZERO),
                invalid,
            },
            instance: hits.iter().map(|hit| hit.map_or(-1, |hit| hit.instance as i32)).collect(),
        })
    }

    /// Whether each ray of a batch hits anything; an invalid ray does not.
    pub fn occluded_of(&self, batch: &RayBatch, control: &Control) -> Result<Vec<bool>, Cancelled> {
        self.each(batch, control, |worker, hidden| self.occluded(&worker.rays, &mut worker.stacks, hidden))
    }

    /// What the nearest hit of each ray of a batch costs; nothing for an invalid ray.
    pub fn cost_of(&self, batch: &RayBatch, control: &Control) -> Result<Vec<Counts>, Cancelled> {
        self.each(batch, control, |worker, counts| self.cost(&worker.rays, &mut worker.stacks, counts))
    }

    fn each<A: Clone + Default + Send>(
        &self,
        batch: &RayBatch,
        control: &Control,
        work: impl Fn(&mut Worker, &mut [A]) + Sync,
    ) -> Result<Vec<A>, Cancelled> {
        let mut answers = vec![A::default(); batch.len()];
        control.start(answers.len());
        answers.par_chunks_mut(CHUNK).enumerate().try_for_each_init(Worker::default, |worker, (chunk, answers)| {
            control.advance(answers.len())?;
            worker.take(batch, chunk, answers.len());
            work(worker, answers);
            Ok(())
        })?;
        Ok(answers)
    }
}
