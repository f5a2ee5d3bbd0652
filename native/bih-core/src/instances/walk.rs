//! One ray from instance to instance, and through the tree of each that it comes near to.

use super::queries::Query;
use super::scene::{Model, Scene, Way};
use crate::geometry::{Corners, Ray};
use crate::simd::Lanes;
use crate::traverse::{Aim, Counter, Stack, Visitor, every_box, every_in_boxes, every_near};

/// Ask the instances that a valid ray comes near to, of which those behind the query's limit do not matter.
#[inline(always)]
pub(super) fn search<L: Lanes, Q: Query, C: Counter>(
    scene: &Scene,
    models: &[Model],
    ray: &Ray,
    query: &mut Q,
    stack: &mut Stack,
    [upper, lower]: &mut [C; 2],
) {
    // The walk through an instance begins while that among them goes on.
    let mut inner = stack.take_inner();
    let mut visitor = Instances { scene, models, ray, query, stack: &mut inner, counter: lower };
    every_box::<L, _, C>(&scene.upper, ray, stack, &mut visitor, upper);
    stack.give_inner(inner);
}

/// Visits instances instead of triangles.
struct Instances<'a, Q, C> {
    scene: &'a Scene,
    models: &'a [Model<'a>],
    ray: &'a Ray,
    query: &'a mut Q,
    stack: &'a mut Stack,
    counter: &'a mut C,
}

impl<Q: Query, C: Counter> Visitor for Instances<'_, Q, C> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, _: &Corners) -> bool {
        let instance = &self.scene.instances[row as usize];
        let Model { tree, triangles } = &self.models[instance.model as usize];
        // What is behind the nearest hit does not matter.
        let ray = Ray { t_max: self.query.limit(), ..*self.ray };
        self.query.enter(row, instance);
        let Self { stack, query, counter, .. } = self;
        match &instance.way {
            Way::Inverse(inverse) => {
                let aim = inverse.aim(&instance.place, &ray);
                every_near::<L, _, C>(tree, triangles, &aim, stack, *query, counter)
            }
            Way::Flat(number) => {
                let tree = &self.scene.flat[*number as usize];
                every_in_boxes::<L, _, C>(tree, triangles, &Aim::exact(&ray), stack, *query, counter)
            }
            Way::Empty => false,
        }
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.query.limit()
    }
}
