//! All hits of a ray, nearest first.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use super::aim::Aim;
use super::closest::{distance_within, hit_at, walk};
use super::every::{Visitor, every};
use super::rounding::round_all;
use super::scene::{Leaf, Scene, bits};
use super::search::Walker;
use super::single::meet;
use super::slab::Slab;
use super::trace::Tracer;
use super::{Hit, Stack, Uncounted, wide};
use crate::build::Precision;
use crate::error::Error;
use crate::geometry::{Corners, Ray, Triangles};
use crate::intersect::{Distance, RayTest, SingleHit, SingleRay};
use crate::memory::{Allowance, Headroom};
use crate::simd::{Kernel, Lanes, dispatch_common_to};
use crate::tree::Tree;

impl Tracer<'_> {
    /// Append the hits of each ray to the lists, nearest first and of equal distances the lower row first, at most so many
    /// of each; none for an invalid ray. An error where memory for them is refused.
    pub fn all(&self, rays: &[Ray], most: usize, stack: &mut Stack, lists: &mut Lists) -> Result<(), Error> {
        let (first, mut start) = (lists.ends.len(), lists.hits.len());
        dispatch_common_to(self.set, All { tracer: self, rays, most, stack, lists })?;
        let Lists { hits, ends, .. } = lists;
        if self.tree.precision == Precision::Exact {
            for (ray, &end) in rays.iter().zip(&ends[first..]) {
                round_all(self, ray, &mut hits[start..end]);
                start = end;
            }
        }
        Ok(())
    }
}

/// The hits of some rays, one ray after another.
#[derive(Debug)]
pub struct Lists<'a, H = Hit> {
    /// All of them.
    pub hits: Vec<H>,
    /// Where those of each ray end.
    pub ends: Vec<usize>,
    /// What they may take.
    pub allowance: Allowance<'a>,
}

impl<H> Default for Lists<'_, H> {
    fn default() -> Self {
        Self { hits: Vec::new(), ends: Vec::new(), allowance: Allowance::default() }
    }
}

impl<'a, H> Lists<'a, H> {
    pub(crate) fn of(headroom: &'a Headroom) -> Self {
        Self { allowance: Allowance::of(headroom), ..Self::default() }
    }

    pub(crate) fn extend(&mut self, hits: impl ExactSizeIterator<Item = H>) -> Result<(), Error> {
        if self.hits.capacity() - self.hits.len() < hits.len() {
            self.allowance.grow(&mut self.hits, hits.len())?;
        }
        self.hits.extend(hits);
        Ok(())
    }
}

struct All<'a, 'b> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    most: usize,
    stack: &'a mut Stack,
    lists: &'a mut Lists<'b>,
}

impl Kernel for All<'_, '_> {
    type Output = Result<(), Error>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let Self { tracer: Tracer { tree, triangles, .. }, rays, most, stack, lists } = self;
        for ray in rays {
            if ray.is_valid() {
                match tree.precision {
                    Precision::Fast => fast::<L>(tree, triangles, ray, most, stack, lists)?,
                    Precision::Watertight | Precision::Exact => exact::<L>(tree, triangles, ray, most, stack, lists)?,
                }
            }
            lists.ends.push(lists.hits.len());
        }
        Ok(())
    }
}

/// The nearest of what it is given, at most so many.
pub(crate) struct Kept<'a, 'b, T> {
    items: Vec<T>,
    most: usize,
    /// How many there may be before all but the nearest are dropped.
    room: usize,
    allowance: &'a mut Allowance<'b>,
    /// Why there was no memory for one.
    refused: Option<Error>,
}

impl<'a, 'b, T> Kept<'a, 'b, T> {
    pub fn new(most: usize, allowance: &'a mut Allowance<'b>) -> Self {
        Self { items: Vec::new(), most, room: most, allowance, refused: None }
    }

    /// Add one, whether it is near or not. Whether it is time for `arrange`: so seldom that sorting costs no more than the
    /// items do.
    #[inline(always)]
    pub fn add(&mut self, item: T) -> bool {
        if self.items.len() == self.items.capacity() && self.is_refused() {
            return false;
        }
        self.items.push(item);
        self.items.len() >= self.room
    }

    /// Whether there is no memory for one more.
    #[cold]
    fn is_refused(&mut self) -> bool {
        if self.refused.is_none() {
            self.refused = self.allowance.grow(&mut self.items, 1).err();
        }
        self.refused.is_some()
    }

    /// Those that were kept, unless there was no memory for all.
    pub fn all(self) -> Result<Vec<T>, Error> {
        self.refused.map_or(Ok(self.items), Err)
    }

    /// Keep the nearest, in order, and one of those that are the same.
    pub fn arrange(&mut self, sort: impl FnOnce(&mut [T]), are_same: impl Fn(&T, &T) -> bool) {
        sort(&mut self.items);
        self.items.dedup_by(|a, b| are_same(a, b));
        self.items.truncate(self.most);
        self.room = self.items.len().saturating_mul(2).max(self.most);
    }

    /// The last one, if there are as many as there can be.
    pub fn last(&self) -> Option<&T> {
        self.items.last().filter(|_| self.items.len() == self.most)
    }
}

/// A triangle that is hit.
#[derive(Debug, Clone, Copy)]
struct Met {
    row: u32,
    distance: Distance,
}

/// All that is hit, decided exactly.
struct Exact<'a, 'b> {
    ray: &'a Ray,
    test: RayTest,
    triangles: &'a Triangles<'a>,
    kept: Kept<'a, 'b, Met>,
    limit: f64,
}

impl Exact<'_, '_> {
    fn arrange(&mut self) {
        let (test, triangles) = (&self.test, self.triangles);
        self.kept.arrange(|met| sort(met, test, triangles), |a, b| a.row == b.row);
        if let Some(last) = self.kept.last() {
            self.limit = last.distance.upper();
        }
    }
}

/// The true order: where distances cannot be told apart, whole numbers tell.
fn sort(met: &mut [Met], test: &RayTest, triangles: &Triangles) {
    // Nearly everything is in order after this, which costs less. Neither asks for memory.
    met.sort_unstable_by(|a, b| order(a.distance.t, b.distance.t).then(a.row.cmp(&b.row)));
    met.sort_unstable_by(|a, b| {
        if a.distance.upper() < b.distance.lower() {
            return Ordering::Less;
        }
        if a.row == b.row {
            return Ordering::Equal;
        }
        let [one, other] = [a, b].map(|met| triangles.corners(met.row));
        a.distance.compare(&one, &b.distance, &other, test).then(a.row.cmp(&b.row))
    });
}

impl Visitor for Exact<'_, '_> {
    #[inline(always)]
    fn visit<L: Lanes>(&mut self, row: u32, corners: &Corners) -> bool {
        if let Some(distance) = distance_within(self.ray, &self.test, corners)
            && self.kept.add(Met { row, distance })
        {
            self.arrange();
        }
        false
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.limit
    }
}

#[inline(always)]
fn exact<L: Lanes>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    most: usize,
    stack: &mut Stack,
    lists: &mut Lists,
) -> Result<(), Error> {
    let test = RayTest::new(ray, tree.bounds());
    let mut search = Exact { ray, test, triangles, kept: Kept::new(most, &mut lists.allowance), limit: ray.t_max };
    every::<L, _>(tree, triangles, ray, stack, &mut search);
    search.arrange();
    // Those of precision `exact` are rounded together.
    let is_rounded_later = tree.precision == Precision::Exact;
    let met = search.kept.all()?;
    lists.extend(met.iter().map(|Met { row, distance }| match is_rounded_later {
        true => Hit { t: distance.t, triangle: *row, u: 0.0, v: 0.0 },
        false => hit_at(&test, *row, &triangles.corners(*row), distance),
    }))
}

/// The order of two numbers, neither of which is NaN.
#[inline(always)]
fn order<F: PartialOrd>(a: F, b: F) -> Ordering {
    a.partial_cmp(&b).unwrap_or(Ordering::Equal)
}

/// All that is hit, in single precision.
struct Fast<'a, 'b> {
    /// Ends where nothing matters any more.
    ray: SingleRay,
    kept: Kept<'a, 'b, (SingleHit, u32)>,
}

impl Fast<'_, '_> {
    fn arrange(&mut self) {
        let sort = |hits: &mut [(SingleHit, u32)]| {
            hits.sort_unstable_by(|(a, row), (b, other)| order(a.t, b.t).then(row.cmp(other)));
        };
        self.kept.arrange(sort, |a, b| a.1 == b.1);
    }
}

impl Walker for Fast<'_, '_> {
    #[inline(always)]
    fn slab(&self, _: &Ray, scene: &Scene) -> Option<Slab> {
        Slab::single(&self.ray, scene)
    }

    fn ray(&self) -> Ray {
        self.ray.widened()
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.ray.t_max
    }

    #[inline(always)]
    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, near: f32) -> bool {
        let (within, t, meeting) = self.ray.meet_eight::<L>(scene, leaf, near);
        let (t, u, v, size) = (t.store(), meeting.u.store(), meeting.v.store(), meeting.size.store());
        for lane in bits(within) {
            let hit = SingleHit { t: t[lane], u: u[lane] / size[lane], v: v[lane] / size[lane] };
            if self.kept.add((hit, scene.row(leaf.first + lane))) {
                self.arrange();
                if let Some((last, _)) = self.kept.last() {
                    self.ray.t_max = last.t;
                }
            }
        }
        false
    }
}

#[inline(always)]
fn fast<L: Lanes>(
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    most: usize,
    stack: &mut Stack,
    lists: &mut Lists,
) -> Result<(), Error> {
    let mut search = Fast { ray: SingleRay::new(ray), kept: Kept::new(most, &mut lists.allowance) };
    match &tree.wide {
        Some(wide) => {
            let scene = Scene::new(wide, tree, triangles);
            wide::visit::<L, _, _>(&scene, ray, &mut search, &mut stack.wide, &mut Uncounted);
        }
        // A computed t may lie before the node: all nodes are visited, so that which hits are kept does not depend on it.
        None => walk(tree, triangles, &Aim::exact(&search.ray.widened()), stack, &mut Uncounted, |rows| {
            for &row in rows {
                if let Some(hit) = meet(&search.ray, row, triangles)
                    && search.kept.add((hit, row))
                {
                    search.arrange();
                }
            }
            ControlFlow::Continue(f64::from(search.ray.t_max))
        }),
    }
    search.arrange();
    let met = search.kept.all()?;
    lists.extend(met.iter().map(|&(hit, row)| Hit::single(hit, row)))
}
