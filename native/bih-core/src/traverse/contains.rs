//! Whether points are inside a closed surface or on it: decided exactly, whatever the precision of the tree.

use rayon::prelude::*;

use super::Stack;
use super::batch::{Vectors, Worker};
use super::count::Tally;
use super::every::{Visitor, every};
use super::lists::{TOGETHER, few};
use super::trace::Tracer;
use crate::control::{Cancelled, Control};
use crate::error::Error;
use crate::geometry::{Corners, Triangles, Vector};
use crate::intersect::{PointTest, Sight};
use crate::simd::{Kernel, Lanes, dispatch_common_to};
use crate::tree::Tree;

/// Whether each point is inside the surface or on it, on all threads of the pool that the caller runs in. Not so a point
/// that is not finite.
pub fn contains(points: &Vectors, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<Vec<bool>, Error> {
    tree.room("the answers", points.len())?;
    let mut answers = vec![false; points.len()];
    control.start(answers.len());
    let size = few(tree);
    answers.par_chunks_mut(size).enumerate().try_for_each_init(Worker::default, |worker, (chunk, answers)| {
        control.advance(answers.len())?;
        let mut some = [[f64::NAN; 3]; TOGETHER];
        for (place, point) in some.iter_mut().enumerate().take(answers.len()) {
            *point = points.get(chunk * size + place);
        }
        Tracer::new(tree, triangles).contains(&some[..answers.len()], &mut worker.stack, answers);
        Ok::<_, Cancelled>(())
    })?;
    Ok(answers)
}

impl Tracer<'_> {
    /// Whether each point is inside the surface or on it.
    pub fn contains(&self, points: &[Vector], stack: &mut Stack, answers: &mut [bool]) {
        assert_eq!(points.len(), answers.len());
        dispatch_common_to(self.set, Contains { tracer: self, points, stack, answers });
    }
}

struct Contains<'a> {
    tracer: &'a Tracer<'a>,
    points: &'a [Vector],
    stack: &'a mut Stack,
    answers: &'a mut [bool],
}

impl Kernel for Contains<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { tracer: Tracer { tree, triangles, .. }, points, stack, answers } = self;
        for (point, answer) in points.iter().zip(answers) {
            *answer = point.iter().all(|x| x.is_finite()) && is_inside::<L>(tree, triangles, point, stack);
        }
    }
}

/// What is above a point.
struct Above {
    test: PointTest,
    is_touched: bool,
    tally: Tally,
}

impl Visitor for Above {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        match self.test.sight(corners) {
            Sight::Apart => {}
            Sight::Above => self.tally.add(row),
            Sight::Touched => self.is_touched = true,
        }
        self.is_touched
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        f64::INFINITY
    }
}

#[inline(always)]
fn is_inside<L: Lanes>(tree: &Tree, triangles: &Triangles, point: &Vector, stack: &mut Stack) -> bool {
    let test = PointTest::new(point, tree.bounds());
    let mut above = Above { test, is_touched: false, tally: Tally::new(tree) };
    every::<L, _>(tree, triangles, &PointTest::way(point), stack, &mut above);
    above.is_touched || above.tally.total() % 2 == 1
}
