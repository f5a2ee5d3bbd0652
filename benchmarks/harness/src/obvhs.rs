//! The peer obvhs, in Rust.

use std::time::{Duration, Instant};

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use crate::mesh::Mesh;
use crate::rays::{Found, Ray};
use crate::side::{Answers, Call, RaySet, Structure};

const CHUNK: usize = 1024;

#[derive(Debug, Clone, Copy)]
pub struct ObvhsSide {
    is_wide: bool,
    preset: fn() -> BvhBuildParams,
}

impl ObvhsSide {
    pub fn parse(words: &[&str]) -> Result<Self, String> {
        let [tree, preset] = words else { return Err("bvh2 or cwbvh, and a preset".to_owned()) };
        let is_wide = match *tree {
            "bvh2" => false,
            "cwbvh" => true,
            _ => return Err(format!("no tree {tree:?}")),
        };
        let preset = match *preset {
            "fastest" => BvhBuildParams::fastest_build,
            "fast" => BvhBuildParams::fast_build,
            "medium" => BvhBuildParams::medium_build,
            "slow" => BvhBuildParams::slow_build,
            _ => return Err(format!("no preset {preset:?}")),
        };
        Ok(Self { is_wide, preset })
    }

    pub fn build(&self, mesh: &Mesh) -> ObvhsTree {
        let corners = |row: &[u32; 3]| row.map(|vertex| Vec3A::from(mesh.vertices()[vertex as usize]));
        let triangles: Vec<_> = mesh
            .triangles
            .par_iter()
            .map(|row| {
                let [v0, v1, v2] = corners(row);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let (parameters, mut time) = ((self.preset)(), Duration::default());
        let (tree, order) = if self.is_wide {
            let tree = build_cwbvh_from_tris(&triangles, parameters, &mut time);
            let order = tree.primitive_indices.clone();
            (Bvh::Wide(tree), order)
        } else {
            let tree = build_bvh2_from_tris(&triangles, parameters, &mut time);
            let order = tree.primitive_indices.clone();
            (Bvh::Binary(tree), order)
        };
        // In leaf order, as its own examples have it.
        let triangles = order.par_iter().map(|&row| triangles[row as usize]).collect();
        ObvhsTree { tree, triangles, order }
    }
}

enum Bvh {
    Binary(Bvh2),
    Wide(CwBvh),
}

pub struct ObvhsTree {
    tree: Bvh,
    triangles: Vec<Triangle>,
    order: Vec<u32>,
}

impl Structure for ObvhsTree {
    fn trace(&self, rays: &RaySet, _: Call) -> (f64, Answers) {
        if rays.kind.is_any() {
            let mut hidden = vec![false; rays.rays.len()];
            let start = Instant::now();
            each(&rays.rays, &mut hidden, |ray| self.is_hidden(ray));
            (start.elapsed().as_secs_f64(), Answers::Hidden(hidden))
        } else {
            let mut found = vec![(f32::INFINITY, u32::MAX); rays.rays.len()];
            let start = Instant::now();
            each(&rays.rays, &mut found, |ray| self.nearest(ray));
            (start.elapsed().as_secs_f64(), Answers::Nearest(found))
        }
    }
}

/// The answer to each ray, on all threads.
pub fn each<A: Send>(rays: &[Ray], answers: &mut [A], answer: impl Fn(&Ray) -> A + Sync) {
    answers.par_chunks_mut(CHUNK).zip(rays.par_chunks(CHUNK)).for_each(|(answers, rays)| {
        for (slot, ray) in answers.iter_mut().zip(rays) {
            *slot = answer(ray);
        }
    });
}

fn converted(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}

impl ObvhsTree {
    fn nearest(&self, ray: &Ray) -> Found {
        let mut hit = RayHit::none();
        let test = |ray: &obvhs::ray::Ray, place: usize| self.triangles[place].intersect(ray);
        match &self.tree {
            Bvh::Binary(tree) => tree.ray_traverse(converted(ray), &mut hit, test),
            Bvh::Wide(tree) => tree.ray_traverse(converted(ray), &mut hit, test),
        };
        self.order.get(hit.primitive_id as usize).map_or((f32::INFINITY, u32::MAX), |&row| (hit.t, row))
    }

    fn is_hidden(&self, ray: &Ray) -> bool {
        let test = |ray: &obvhs::ray::Ray, place: usize| self.triangles[place].intersect(ray);
        let is_free = match &self.tree {
            Bvh::Binary(tree) => tree.ray_traverse_miss(converted(ray), test),
            Bvh::Wide(tree) => tree.ray_traverse_miss(converted(ray), test),
        };
        !is_free
    }
}
