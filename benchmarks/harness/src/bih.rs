//! Our sides: the Bounding Interval Hierarchy and the rivals in the same house.

use std::time::Instant;

use bih_core::build::{self, Build, Heuristic, Layout, Precision};
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::{Hits, Limits, RayBatch, Stack, Tracer, Vectors, Way};
use bih_core::{BuildOptions, Control, Hit, Tree, Triangles};
use rayon::prelude::*;
use serde_json::{Map, Value, json};

use crate::mesh::Mesh;
use crate::rays::{Found, Ray};
use crate::side::{Answers, Call, RaySet, Structure};

/// Rays that a thread takes at a time where they are given one by one.
const CHUNK: usize = 1024;

pub struct BihSide {
    pub options: BuildOptions,
}

impl BihSide {
    /// Each word sets one option; the place to add a layout, heuristic, precision or presort.
    pub fn parse(structure: build::Structure, words: &[&str]) -> Result<Self, String> {
        let mut options = BuildOptions::of(structure);
        for &word in words {
            match word {
                "classic" => options.layout = Layout::Classic,
                "wide" => options.layout = Layout::Wide,
                "compact" => options.layout = Layout::Compact,
                "fast" => options.precision = Precision::Fast,
                "global" => options.heuristic = Heuristic::Global,
                "local" => options.heuristic = Heuristic::Local,
                "sah" => options.heuristic = Heuristic::Sah,
                "presort" => options.presort = Some(true),
                "inplace" => options.presort = Some(false),
                "exact" => options.precision = Precision::Exact,
                "watertight" => options.precision = Precision::Watertight,
                "eager" => options.build = Build::Eager,
                "demand" => options.build = Build::OnDemand,
                _ => match (size(word, "leaf"), size(word, "piece")) {
                    (Some(leaf), _) => options.leaf_size = Some(leaf),
                    (_, Some(piece)) => options.piece = Some(piece),
                    _ => return Err(format!("no option {word:?}")),
                },
            }
        }
        options.check().map_err(|error| error.to_string())?;
        Ok(Self { options })
    }

    pub fn build<'m>(&self, mesh: &'m Mesh) -> BihTree<'m> {
        let triangles = mesh.borrowed();
        let tree = bih_core::build(&triangles, &self.options, &Control::default()).expect("nothing cancels it");
        BihTree { tree, triangles }
    }
}

/// The number behind a name, as in leaf4.
fn size(word: &str, name: &str) -> Option<usize> {
    word.strip_prefix(name)?.parse().ok()
}

pub struct BihTree<'m> {
    pub tree: Tree,
    pub triangles: Triangles<'m>,
}

impl Structure for BihTree<'_> {
    fn trace(&self, rays: &RaySet, call: Call) -> (f64, Answers) {
        let way = match call {
            Call::Single => Some(Way::Alone),
            Call::Flight => Some(Way::InFlight),
            Call::TwoByTwo => Some(Way::TwoByTwo),
            _ => None,
        };
        let is_any = rays.kind.is_any();
        let control = Control::default();
        match (way, is_any) {
            (Some(way), true) => {
                let mut hidden = vec![false; rays.rays.len()];
                let seconds = self.each(&rays.rays, &mut hidden, |tracer, rays, stack, hidden: &mut [bool]| {
                    tracer.occluded(rays, way, stack, hidden);
                });
                (seconds, Answers::Hidden(hidden))
            }
            (Some(way), false) => {
                let mut nearest = vec![(f32::INFINITY, u32::MAX); rays.rays.len()];
                let seconds = self.each(&rays.rays, &mut nearest, |tracer, rays, stack, nearest: &mut [Found]| {
                    let mut hits = [None; CHUNK];
                    let hits = &mut hits[..rays.len()];
                    tracer.closest(rays, way, stack, hits);
                    for (slot, hit) in nearest.iter_mut().zip(hits) {
                        *slot = found(*hit);
                    }
                });
                (seconds, Answers::Nearest(nearest))
            }
            (None, true) => {
                let start = Instant::now();
                let hidden = batch(rays).occluded(&self.tree, &self.triangles, &control).expect("nothing cancels it");
                (start.elapsed().as_secs_f64(), Answers::Hidden(hidden))
            }
            (None, false) => {
                let start = Instant::now();
                let hits: Hits<f32> =
                    batch(rays).closest(&self.tree, &self.triangles, &control).expect("nothing cancels it");
                let seconds = start.elapsed().as_secs_f64();
                // A miss is row -1 there, the largest row here.
                let found = hits.t.into_iter().zip(hits.triangle.iter().map(|row| row.cast_unsigned()));
                (seconds, Answers::Nearest(found.collect()))
            }
        }
    }

    fn facts(&self, rays: Option<&RaySet>) -> Map<String, Value> {
        let mut facts = Map::new();
        match rays {
            None => {
                let stats = self.tree.stats();
                facts.insert("nodes".to_owned(), json!(stats.nodes));
                facts.insert("leaves".to_owned(), json!(stats.leaves));
                facts.insert("references".to_owned(), json!(stats.references));
                facts.insert("depth".to_owned(), json!(stats.depth));
                facts.insert("tree_bytes".to_owned(), json!(stats.tree_bytes));
                facts.insert("bound_bytes".to_owned(), json!(stats.bound_bytes));
                facts.insert("stated_peak_bytes".to_owned(), json!(stats.peak_build_bytes));
            }
            Some(rays) => {
                let costs = batch(rays).cost(&self.tree, &self.triangles, &Control::default());
                let costs = costs.expect("nothing cancels it");
                let mean = |count: u64| json!(count as f64 / costs.len().max(1) as f64);
                facts.insert("nodes_a_ray".to_owned(), mean(costs.iter().map(|cost| u64::from(cost.nodes)).sum()));
                let tests = costs.iter().map(|cost| u64::from(cost.triangles)).sum();
                facts.insert("triangles_a_ray".to_owned(), mean(tests));
            }
        }
        facts
    }
}

fn batch(rays: &RaySet) -> RayBatch<'_> {
    let arrays = &rays.arrays;
    RayBatch {
        origins: Vectors::F32(&arrays.origins),
        directions: Vectors::F32(&arrays.directions),
        t_min: Limits::All(0.0),
        t_max: Limits::Each(&arrays.t_max),
    }
}

fn found(hit: Option<Hit>) -> Found {
    hit.map_or((f32::INFINITY, u32::MAX), |hit| (hit.t as f32, hit.triangle))
}

impl BihTree<'_> {
    /// Answers for all rays, on all threads; as its peers, with rays as the core takes them and memory for answers made
    /// before the clock runs, which is what it answers.
    fn each<A: Send>(
        &self,
        rays: &[Ray],
        answers: &mut [A],
        ask: impl Fn(&Tracer, &[bih_core::Ray], &mut Stack, &mut [A]) + Sync,
    ) -> f64 {
        let rays: Vec<_> = rays.iter().map(wide).collect();
        let tracer = Tracer::new(&self.tree, &self.triangles);
        let start = Instant::now();
        answers.par_chunks_mut(CHUNK).zip(rays.par_chunks(CHUNK)).for_each(|(answers, rays)| {
            let _standard = FloatEnvironment::standard();
            ask(&tracer, rays, &mut Stack::default(), answers);
        });
        start.elapsed().as_secs_f64()
    }
}

fn wide(ray: &Ray) -> bih_core::Ray {
    bih_core::Ray {
        origin: ray.origin.map(f64::from),
        direction: ray.direction.map(f64::from),
        t_min: f64::from(ray.t_min),
        t_max: f64::from(ray.t_max),
    }
}
