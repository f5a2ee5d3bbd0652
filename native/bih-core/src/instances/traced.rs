//! A scene as what a picture is traced in.

use super::scene::Model;
use super::tracer::SceneTracer;
use crate::build::Precision;
use crate::geometry::{Corners, Ray, Vector};
use crate::render::{Seen, Traced};
use crate::traverse::{Counts, Lists, Stack};

impl Traced for SceneTracer<'_> {
    type Stack = Stack;

    /// What is decided in single precision otherwise is decided exactly here.
    fn precision(&self) -> Precision {
        match self.scene.precision {
            Precision::Fast | Precision::Watertight => Precision::Watertight,
            Precision::Exact => Precision::Exact,
        }
    }

    fn closest(&self, rays: &[Ray], stack: &mut Stack, seen: &mut [Option<Seen>]) {
        SceneTracer::closest(self, rays, stack, seen);
    }

    fn occluded(&self, rays: &[Ray], stack: &mut Stack, hidden: &mut [bool]) {
        SceneTracer::occluded(self, rays, stack, hidden);
    }

    fn all(&self, ray: &Ray, stack: &mut Stack, seen: &mut Vec<Seen>) {
        let mut lists = Lists::default();
        // A panic comes to Python as one; it ends no process.
        SceneTracer::all(self, &[*ray], usize::MAX, stack, &mut lists).expect("memory for the hits of one ray");
        seen.append(&mut lists.hits);
    }

    fn cost(&self, rays: &[Ray], stack: &mut Stack, counts: &mut [Counts]) {
        SceneTracer::cost(self, rays, stack, counts);
    }

    fn prefetch_row(&self, seen: &Seen) {
        self.model_of(seen).triangles.prefetch_row(seen.hit.triangle);
    }

    fn prefetch_corners(&self, seen: &Seen) {
        self.model_of(seen).triangles.prefetch_corners(seen.hit.triangle);
    }

    fn corners(&self, seen: &Seen) -> Corners {
        let corners = self.model_of(seen).triangles.corners(seen.hit.triangle);
        self.scene.instances[seen.instance as usize].place.corners(&corners)
    }

    fn tree_of(&self, instance: u32) -> usize {
        self.scene.instances[instance as usize].model as usize
    }

    fn piece_bytes(&self) -> usize {
        self.models.iter().map(|model| model.tree.piece_bytes()).max().unwrap_or(0)
    }

    fn normal_in_world(&self, instance: u32, normal: &Vector) -> Vector {
        self.scene.instances[instance as usize].place.normal(normal)
    }
}

impl SceneTracer<'_> {
    /// What an instance shows.
    fn model_of(&self, seen: &Seen) -> &Model<'_> {
        &self.models[self.scene.instances[seen.instance as usize].model as usize]
    }
}
