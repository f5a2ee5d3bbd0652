//! The last step: distances and weights of hits, of many rays together, as near to the truth as their precision promises.

use super::closest::hit_at;
use super::{Hit, Tracer};
use crate::build::Precision;
use crate::geometry::{Corners, Ray};
use crate::intersect::{Distance, RayTest, clamped, located_quickly, rounded, rounded_quickly};
use crate::simd::{Kernel, Lanes, dispatch_common_to};

/// Hits that are rounded together: their numbers fit into the first-level cache.
const TOGETHER: usize = 64;

/// Put t and the weights into hits of which only the triangles are known: all of precision `exact`, and those of precision
/// `watertight` that were found in wide records and have no weight yet.
pub(super) fn round_hits(tracer: &Tracer, rays: &[Ray], hits: &mut [Option<Hit>]) {
    let are_known = match tracer.tree.precision {
        Precision::Fast => true,
        Precision::Watertight => tracer.tree.wide.is_none(),
        Precision::Exact => false,
    };
    if !are_known {
        dispatch_common_to(tracer.set, Rounding { tracer, rays, hits });
    }
}

/// The same for all hits of one ray.
pub(super) fn round_all(tracer: &Tracer, ray: &Ray, hits: &mut [Hit]) {
    let rays = [*ray; TOGETHER];
    for hits in hits.chunks_mut(TOGETHER) {
        let mut some: [Option<Hit>; TOGETHER] = std::array::from_fn(|place| hits.get(place).copied());
        round_hits(tracer, &rays, &mut some);
        for (hit, rounded) in hits.iter_mut().zip(some.into_iter().flatten()) {
            *hit = rounded;
        }
    }
}

struct Rounding<'a> {
    tracer: &'a Tracer<'a>,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl Kernel for Rounding<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Tracer { tree, triangles, .. } = self.tracer;
        let is_exact = tree.precision == Precision::Exact;
        let is_finite = tree.bounds.lower.iter().chain(&tree.bounds.upper).all(|x| x.is_finite());
        let mut columns = Columns { numbers: [[0.0; TOGETHER]; 15], answers: [[f64::NAN; TOGETHER]; 3] };
        let mut found = [0; TOGETHER];
        for (rays, hits) in self.rays.chunks(TOGETHER).zip(self.hits.chunks_mut(TOGETHER)) {
            let is_open = |hit: &&Hit| is_exact || hit.u.is_nan();
            // Memory is waited for once, not hit by hit.
            let triangle = || hits.iter().flatten().filter(is_open).map(|hit| hit.triangle);
            triangle().for_each(|row| triangles.prefetch_row(row));
            triangle().for_each(|row| triangles.prefetch_corners(row));
            let mut count = 0;
            for (place, (ray, hit)) in rays.iter().zip(&*hits).enumerate() {
                if let Some(hit) = hit.as_ref().filter(is_open) {
                    columns.put(count, ray, &triangles.corners(hit.triangle));
                    found[count] = place;
                    count += 1;
                }
            }
            if is_exact {
                columns.round(count);
            } else if is_finite {
                columns.locate(count);
            }
            for (lane, &place) in found[..count].iter().enumerate() {
                let Some(hit) = &mut hits[place] else { continue };
                let (ray, quickly) = (&rays[place], columns.answers.map(|answers| answers[lane]));
                let corners = || triangles.corners(hit.triangle);
                if is_exact {
                    if let Some(numbers) = rounded(quickly, &ray.origin, &ray.direction, corners) {
                        [hit.t, hit.u, hit.v] = numbers;
                    } else if hit.u.is_nan() {
                        hit.u = 0.0;
                    }
                } else if quickly[0].is_nan() {
                    *hit = located(self.tracer, ray, hit, &corners());
                } else {
                    hit.t = quickly[0];
                    [hit.u, hit.v] = clamped([quickly[1], quickly[2]]);
                }
            }
        }
    }
}

/// What `locate` leaves open.
#[cold]
#[inline(never)]
fn located(tracer: &Tracer, ray: &Ray, hit: &Hit, corners: &Corners) -> Hit {
    let test = RayTest::new(ray, tracer.tree.bounds());
    // It is not if the caller has changed the mesh since it was built.
    let is_still_hit = test.is_inside(corners);
    if is_still_hit {
        hit_at(&test, hit.triangle, corners, &Distance::new(&test, corners))
    } else {
        Hit { u: 0.0, ..*hit }
    }
}

/// The numbers of some hits, a column for each of them, and their distances and weights.
struct Columns {
    numbers: [[f64; TOGETHER]; 15],
    answers: [[f64; TOGETHER]; 3],
}

impl Columns {
    #[inline(always)]
    fn put(&mut self, place: usize, ray: &Ray, corners: &Corners) {
        let values = ray.origin.iter().chain(&ray.direction).chain(corners.as_flattened());
        for (column, &value) in self.numbers.iter_mut().zip(values) {
            column[place] = value;
        }
    }

    /// The loop has no branch and no function: the compiler makes vectors of it.
    #[inline(always)]
    fn round(&mut self, count: usize) {
        let [ox, oy, oz, dx, dy, dz, ax, ay, az, bx, by, bz, cx, cy, cz] = &self.numbers;
        let [t, u, v] = &mut self.answers;
        // Whole vectors; what stands behind the last hit is finite.
        for i in 0..count.next_multiple_of(8).min(TOGETHER) {
            let corners = [[ax[i], ay[i], az[i]], [bx[i], by[i], bz[i]], [cx[i], cy[i], cz[i]]];
            [t[i], u[i], v[i]] = rounded_quickly(&[ox[i], oy[i], oz[i]], &[dx[i], dy[i], dz[i]], &corners);
        }
    }

    /// The same for precision `watertight`.
    #[inline(always)]
    fn locate(&mut self, count: usize) {
        let [ox, oy, oz, dx, dy, dz, ax, ay, az, bx, by, bz, cx, cy, cz] = &self.numbers;
        let [t, u, v] = &mut self.answers;
        for i in 0..count.next_multiple_of(8).min(TOGETHER) {
            let corners = [[ax[i], ay[i], az[i]], [bx[i], by[i], bz[i]], [cx[i], cy[i], cz[i]]];
            [t[i], u[i], v[i]] = located_quickly(&[ox[i], oy[i], oz[i]], &[dx[i], dy[i], dz[i]], &corners);
        }
    }
}
