//! Some rays through a scene. This is where kernels begin: everything below is compiled once for each instruction set.

use super::lists::{All, Crossings};
use super::queries::{Any, Nearest};
use super::scene::{Model, Scene};
use super::shape::Shape;
use super::walk::search;
use crate::build::Precision;
use crate::error::Error;
use crate::geometry::{Corners, Ray};
use crate::intersect::Image;
use crate::render::Seen;
use crate::simd::{Kernel, Lanes, dispatch_common};
use crate::traverse::{Counts, Lists, Stack, Uncounted};

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
    pub fn closest(&self, rays: &[Ray], stack: &mut Stack, hits: &mut [Option<Seen>]) {
        assert_eq!(rays.len(), hits.len());
        hits.fill(None);
        dispatch_common(In { tracer: self, work: Closest { rays, stack, hits } });
    }

    /// Whether each ray hits anything; an invalid ray does not.
    pub fn occluded(&self, rays: &[Ray], stack: &mut Stack, hidden: &mut [bool]) {
        assert_eq!(rays.len(), hidden.len());
        hidden.fill(false);
        dispatch_common(In { tracer: self, work: Occluded { rays, stack, hidden } });
    }

    /// Append the hits of each ray, nearest first, of equal distances that of the lower instance first and there the lower
    /// row, at most so many of each, one at least; none for an invalid ray. An error where memory for them is refused.
    pub fn all(&self, rays: &[Ray], most: usize, stack: &mut Stack, lists: &mut Lists<Seen>) -> Result<(), Error> {
        dispatch_common(In { tracer: self, work: ListAll { rays, most: most.max(1), stack, lists } })
    }

    /// How many images of triangles each ray crosses between its ends, once it is moved by less than any number; none for
    /// an invalid ray.
    pub fn count(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [i32]) {
        assert_eq!(rays.len(), counts.len());
        counts.fill(0);
        dispatch_common(In { tracer: self, work: CountCrossings { rays, stack, counts } });
    }

    /// What the nearest hit of each ray costs; nothing for an invalid ray. Nodes are those of all trees.
    pub fn cost(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [Counts]) {
        assert_eq!(rays.len(), counts.len());
        counts.fill(Counts::default());
        dispatch_common(In { tracer: self, work: Cost { rays, stack, counts } });
    }
}

/// Work on some rays that is written once for both forms of images.
trait Work {
    type Output;
    fn run<L: Lanes, S: Shape>(self, tracer: &SceneTracer) -> Self::Output;
}

struct In<'a, W> {
    tracer: &'a SceneTracer<'a>,
    work: W,
}

impl<W: Work> Kernel for In<'_, W> {
    type Output = W::Output;
    #[inline(always)]
    fn run<L: Lanes>(self) -> W::Output {
        match self.tracer.scene.precision {
            Precision::Exact => self.work.run::<L, Image>(self.tracer),
            Precision::Fast | Precision::Watertight => self.work.run::<L, Corners>(self.tracer),
        }
    }
}

struct Closest<'a> {
    rays: &'a [Ray],
    stack: &'a mut Stack,
    hits: &'a mut [Option<Seen>],
}

impl Work for Closest<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes, S: Shape>(self, SceneTracer { scene, models }: &SceneTracer) {
        for (ray, hit) in self.rays.iter().zip(self.hits).filter(|(ray, _)| ray.is_valid()) {
            let mut nearest = Nearest::<S>::new(ray);
            search::<L, _, _>(scene, models, ray, &mut nearest, self.stack, &mut [Uncounted; 2]);
            *hit = nearest.answer();
        }
    }
}

struct Occluded<'a> {
    rays: &'a [Ray],
    stack: &'a mut Stack,
    hidden: &'a mut [bool],
}

impl Work for Occluded<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes, S: Shape>(self, SceneTracer { scene, models }: &SceneTracer) {
        for (ray, is_hidden) in self.rays.iter().zip(self.hidden).filter(|(ray, _)| ray.is_valid()) {
            let mut any = Any::<S>::new(ray);
            search::<L, _, _>(scene, models, ray, &mut any, self.stack, &mut [Uncounted; 2]);
            *is_hidden = any.answer();
        }
    }
}

struct ListAll<'a, 'b> {
    rays: &'a [Ray],
    most: usize,
    stack: &'a mut Stack,
    lists: &'a mut Lists<'b, Seen>,
}

impl Work for ListAll<'_, '_> {
    type Output = Result<(), Error>;
    #[inline(always)]
    fn run<L: Lanes, S: Shape>(self, SceneTracer { scene, models }: &SceneTracer) -> Self::Output {
        let Self { rays, most, stack, lists } = self;
        for ray in rays {
            if ray.is_valid() {
                let mut all = All::<S>::new(ray, most, &mut lists.allowance);
                search::<L, _, _>(scene, models, ray, &mut all, stack, &mut [Uncounted; 2]);
                let hits = all.finish()?;
                lists.extend(hits)?;
            }
            lists.ends.push(lists.hits.len());
        }
        Ok(())
    }
}

struct CountCrossings<'a> {
    rays: &'a [Ray],
    stack: &'a mut Stack,
    counts: &'a mut [i32],
}

impl Work for CountCrossings<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes, S: Shape>(self, SceneTracer { scene, models }: &SceneTracer) {
        for (ray, count) in self.rays.iter().zip(self.counts).filter(|(ray, _)| ray.is_valid()) {
            let mut crossings = Crossings::<S>::new(ray);
            search::<L, _, _>(scene, models, ray, &mut crossings, self.stack, &mut [Uncounted; 2]);
            *count = crossings.total() as i32;
        }
    }
}

struct Cost<'a> {
    rays: &'a [Ray],
    stack: &'a mut Stack,
    counts: &'a mut [Counts],
}

impl Work for Cost<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes, S: Shape>(self, SceneTracer { scene, models }: &SceneTracer) {
        for (ray, counts) in self.rays.iter().zip(self.counts).filter(|(ray, _)| ray.is_valid()) {
            let mut both = [Counts::default(); 2];
            search::<L, _, _>(scene, models, ray, &mut Nearest::<S>::new(ray), self.stack, &mut both);
            let [upper, lower] = both;
            // The upper tree's leaves hold instances.
            *counts = Counts { nodes: upper.nodes + lower.nodes, triangles: lower.triangles };
        }
    }
}
