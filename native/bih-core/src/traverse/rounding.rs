//! The last step of precision `exact`: distances and weights of hits, each as near to the truth as doubles come, for many
//! rays together.

use super::Hit;
use crate::geometry::{Corners, Ray, Triangles};
use crate::intersect::{rounded, rounded_quickly};
use crate::simd::{InstructionSet, Kernel, Lanes, dispatch_to};

/// Hits that are rounded together: their numbers fit into the first-level cache.
const TOGETHER: usize = 64;

/// Put t and the weights into hits whose triangles are known.
pub(super) fn round_hits(set: InstructionSet, triangles: &Triangles, rays: &[Ray], hits: &mut [Option<Hit>]) {
    dispatch_to(set, Rounding { triangles, rays, hits });
}

/// The same for all hits of one ray.
pub(super) fn round_all(set: InstructionSet, triangles: &Triangles, ray: &Ray, hits: &mut [Hit]) {
    let rays = [*ray; TOGETHER];
    for hits in hits.chunks_mut(TOGETHER) {
        let mut some: [Option<Hit>; TOGETHER] = std::array::from_fn(|place| hits.get(place).copied());
        round_hits(set, triangles, &rays, &mut some);
        for (hit, rounded) in hits.iter_mut().zip(some.into_iter().flatten()) {
            *hit = rounded;
        }
    }
}

struct Rounding<'a> {
    triangles: &'a Triangles<'a>,
    rays: &'a [Ray],
    hits: &'a mut [Option<Hit>],
}

impl Kernel for Rounding<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let mut columns = Columns { numbers: [[0.0; TOGETHER]; 15], answers: [[0.0; TOGETHER]; 3] };
        let mut found = [0; TOGETHER];
        for (rays, hits) in self.rays.chunks(TOGETHER).zip(self.hits.chunks_mut(TOGETHER)) {
            let mut count = 0;
            for (place, (ray, hit)) in rays.iter().zip(&*hits).enumerate() {
                if let Some(hit) = hit {
                    columns.put(count, ray, &self.triangles.corners(hit.triangle));
                    found[count] = place;
                    count += 1;
                }
            }
            columns.round(count);
            for (lane, &place) in found[..count].iter().enumerate() {
                let Some(hit) = &mut hits[place] else { continue };
                let (ray, quickly) = (&rays[place], columns.answers.map(|answers| answers[lane]));
                let corners = || self.triangles.corners(hit.triangle);
                if let Some(numbers) = rounded(quickly, &ray.origin, &ray.direction, corners) {
                    [hit.t, hit.u, hit.v] = numbers;
                }
            }
        }
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
}
