//! Many rays through a scene, on all threads of the pool that the caller runs in.

use rayon::prelude::*;

use super::tracer::SceneTracer;
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::Ray;
use crate::memory::{self, Headroom};
use crate::render::{Seen, Traced};
use crate::simd::FloatEnvironment;
use crate::traverse::{Counts, Float, HitLists, Hits, Lists, RayBatch, Stack};

/// Rays that a thread takes at a time: who asks to stop is heard before the next ones.
const CHUNK: usize = 256;
/// The same where each may meet every triangle.
const FEW: usize = 16;

/// The nearest hits of many rays, and the instances that they are in.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneHits<F> {
    /// Where, and which triangles of the models.
    pub hits: Hits<F>,
    /// Rows of the instances; -1 for a miss.
    pub instance: Vec<i32>,
}

/// All hits of many rays, and the instances that they are in.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneHitLists<F> {
    /// Where, and which triangles of the models.
    pub lists: HitLists<F>,
    /// Rows of the instances.
    pub instance: Vec<i32>,
}

impl<F: Float> SceneHitLists<F> {
    fn with_room(rays: usize, hits: usize) -> Self {
        Self { lists: HitLists::with_room(rays, hits), instance: Vec::with_capacity(hits) }
    }

    fn bytes(rays: usize, hits: usize) -> usize {
        HitLists::<F>::bytes(rays, hits) + hits * size_of::<i32>()
    }

    fn new(lists: &mut Lists<Seen>) -> Result<Self, Error> {
        lists.allowance.take(lists.hits.len() * size_of::<i32>())?;
        let instance = lists.hits.iter().map(|seen| seen.instance as i32).collect();
        Ok(Self { lists: HitLists::new(lists, |seen| &seen.hit)?, instance })
    }

    fn append(&mut self, other: Self) {
        self.lists.append(other.lists);
        self.instance.extend(other.instance);
    }
}

/// What a thread keeps from one chunk of rays to the next.
struct Worker {
    _standard: FloatEnvironment,
    rays: Vec<Ray>,
    stack: Stack,
}

impl Default for Worker {
    fn default() -> Self {
        Self { _standard: FloatEnvironment::standard(), rays: Vec::with_capacity(CHUNK), stack: Stack::default() }
    }
}

impl Worker {
    fn take(&mut self, batch: &RayBatch, first: usize, count: usize) {
        self.rays.clear();
        self.rays.extend((first..first + count).map(|row| batch.ray(row)));
    }
}

impl SceneTracer<'_> {
    /// The nearest hit of each ray of a batch; a miss where there is none and for an invalid ray.
    pub fn closest_of<F: Float>(&self, batch: &RayBatch, control: &Control) -> Result<SceneHits<F>, Error> {
        self.room("the hits", batch.len() * (3 * size_of::<F>() + 2 * size_of::<i32>() + size_of::<Option<Seen>>()))?;
        let hits = each(self, CHUNK, batch, control, |worker, hits: &mut [Option<Seen>]| {
            self.closest(&worker.rays, &mut worker.stack, hits);
        })?;
        let of = |value: fn(&Seen) -> f64, miss: F| -> Vec<F> {
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
    pub fn occluded_of(&self, batch: &RayBatch, control: &Control) -> Result<Vec<bool>, Error> {
        each(self, CHUNK, batch, control, |worker, hidden| self.occluded(&worker.rays, &mut worker.stack, hidden))
    }

    /// All hits of each ray of a batch, of each the nearest `most`; none for an invalid ray.
    pub fn all_of<F: Float>(
        &self,
        batch: &RayBatch,
        most: usize,
        control: &Control,
    ) -> Result<SceneHitLists<F>, Error> {
        const WHAT: &str = "the hits";
        let (count, parts) = (batch.len(), batch.len().div_ceil(FEW));
        // Twice the lists of the parts while they are put in a row.
        self.room(WHAT, 2 * size_of::<SceneHitLists<F>>() * parts)?;
        let headroom = Headroom::new(WHAT);
        control.start(count);
        let parts: Vec<SceneHitLists<F>> = (0..parts)
            .into_par_iter()
            .map_init(Worker::default, |worker, part| {
                let first = part * FEW;
                worker.take(batch, first, FEW.min(count - first));
                control.advance(worker.rays.len())?;
                let mut lists = Lists::of(&headroom);
                self.all(&worker.rays, most, &mut worker.stack, &mut lists)?;
                SceneHitLists::new(&mut lists)
            })
            .collect::<Result<_, Error>>()?;
        let hits = parts.iter().map(|part| part.instance.len()).sum();
        memory::room(WHAT, SceneHitLists::<F>::bytes(count, hits))?;
        let mut lists = SceneHitLists::with_room(count, hits);
        parts.into_iter().for_each(|part| lists.append(part));
        Ok(lists)
    }

    /// How many images of triangles each ray of a batch crosses; none for an invalid ray.
    pub fn count_of(&self, batch: &RayBatch, control: &Control) -> Result<Vec<i32>, Error> {
        each(self, FEW, batch, control, |worker, counts| self.count(&worker.rays, &mut worker.stack, counts))
    }

    /// What the nearest hit of each ray of a batch costs; nothing for an invalid ray.
    pub fn cost_of(&self, batch: &RayBatch, control: &Control) -> Result<Vec<Counts>, Error> {
        each(self, CHUNK, batch, control, |worker, counts| self.cost(&worker.rays, &mut worker.stack, counts))
    }

    /// Ask for memory before rays are traced: for answers of so many bytes, and for pieces of the model that takes most.
    fn room(&self, what: &'static str, bytes: usize) -> Result<(), Error> {
        memory::room(what, bytes + self.piece_bytes())
    }
}

/// Answers for all rays, of which a thread takes so many at a time.
fn each<A: Clone + Default + Send>(
    tracer: &SceneTracer,
    size: usize,
    batch: &RayBatch,
    control: &Control,
    work: impl Fn(&mut Worker, &mut [A]) + Sync,
) -> Result<Vec<A>, Error> {
    tracer.room("the answers", 2 * batch.len() * size_of::<A>())?;
    let mut answers = vec![A::default(); batch.len()];
    control.start(answers.len());
    answers.par_chunks_mut(size).enumerate().try_for_each_init(Worker::default, |worker, (chunk, answers)| {
        control.advance(answers.len())?;
        worker.take(batch, chunk * size, answers.len());
        work(worker, answers);
        Ok::<_, Cancelled>(())
    })?;
    Ok(answers)
}
