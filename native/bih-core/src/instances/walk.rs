//! One ray from instance to instance, and through the tree of each that it comes near to.

use std::marker::PhantomData;

use super::queries::Query;
use super::scene::{Model, Scene, Way};
use crate::geometry::{Corners, Ray, Triangles, Vertices};
use crate::simd::Lanes;
use crate::traverse::{Aim, Counter, Stack, Visitor, every_near};

/// What a ray has put off: among the instances, and within one.
#[derive(Debug, Default)]
pub struct Stacks {
    upper: Stack,
    lower: Stack,
}

/// The answer for one valid ray.
#[inline(always)]
pub(super) fn search<L: Lanes, Q: Query, C: Counter + Default>(
    scene: &Scene,
    models: &[Model],
    ray: &Ray,
    stacks: &mut Stacks,
    counters: &mut [C; 2],
) -> Q::Answer {
    let [upper, lower] = counters;
    let Stacks { upper: waiting, lower: stack } = stacks;
    let query = Q::new(ray);
    let mut visitor = Instances::<L, Q, C> { scene, models, ray, query, stack, counter: lower, lanes: PhantomData };
    // Where the boxes are is known to the tree.
    let boxes = Triangles::unchecked(Vertices::F32(&[]), None);
    every_near::<L, _, C>(&scene.upper, &boxes, &Aim::exact(ray), waiting, &mut visitor, upper);
    visitor.query.answer()
}

/// Visits instances instead of triangles.
struct Instances<'a, L, Q, C> {
    scene: &'a Scene,
    models: &'a [Model<'a>],
    ray: &'a Ray,
    query: Q,
    stack: &'a mut Stack,
    counter: &'a mut C,
    lanes: PhantomData<L>,
}

impl<L: Lanes, Q: Query, C: Counter> Visitor for Instances<'_, L, Q, C> {
    #[inline(always)]
    fn visit(&mut self, row: u32, _: &Corners) -> bool {
        let instance = &self.scene.instances[row as usize];
        let Model { tree, triangles } = &self.models[instance.model as usize];
        // What is behind the nearest hit does not matter.
        let ray = Ray { t_max: self.query.limit(), ..*self.ray };
        let (tree, aim) = match &instance.way {
            Way::Inverse(inverse) => (*tree, inverse.aim(&instance.place, &ray)),
            Way::Flat(number) => (&self.scene.flat[*number as usize], Aim::exact(&ray)),
            Way::Empty => return false,
        };
        self.query.enter(row, instance);
        every_near::<L, _, C>(tree, triangles, &aim, self.stack, &mut self.query, self.counter)
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.query.limit()
    }
}
