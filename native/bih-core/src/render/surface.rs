//! Where camera rays meet surfaces.

use super::appearance::GREY;
use super::sampling::Sampler;
use super::traced::{Seen, Traced};
use super::vectors::{Lengths, Numbers, Vectors, ZEROS, at, put};
use super::visible::Visible;
use crate::build::Precision;
use crate::geometry::{Ray, Vector, add_scaled, cross, dot, normal, normalise, subtract};
use crate::simd::{Kernel, Lanes, dispatch_common};
use crate::traverse::PACKET;

/// The rays of a block and what they meet; of a ray that meets nothing the numbers mean nothing.
pub(super) struct Points {
    pub origin: Vectors,
    /// Where the viewer looks.
    pub view: Vectors,
    /// Where rays end.
    pub t_max: Numbers,
    /// Which rays meet something.
    pub are_there: [bool; PACKET],
    /// Where the picture is empty nevertheless.
    pub are_holdouts: [bool; PACKET],
    pub position: Vectors,
    /// Of the triangle itself, of unit length, on the viewer's side.
    pub ground: Vectors,
    /// Those to shade by.
    pub normal: Vectors,
    /// The position, moved to the viewer's side by twice what it can lie behind its triangle.
    pub lifted: Vectors,
    pub base: Vectors,
    pub emission: Vectors,
    /// Of which pixels and which sample they are.
    pub pixels: [[u32; 2]; PACKET],
    pub sample: u32,
    pub seed: u64,
    hits: Hits,
}

impl Points {
    pub fn new(seed: u64) -> Self {
        Self {
            origin: ZEROS,
            view: ZEROS,
            t_max: [0.0; PACKET],
            are_there: [false; PACKET],
            are_holdouts: [false; PACKET],
            position: ZEROS,
            ground: ZEROS,
            normal: ZEROS,
            lifted: ZEROS,
            base: GREY.base.map(|x| [x; PACKET]),
            emission: GREY.emission.map(|x| [x; PACKET]),
            pixels: [[0; 2]; PACKET],
            sample: 0,
            seed,
            hits: Hits::new(),
        }
    }

    /// Take what the rays see; without normals where nothing needs them.
    pub fn find<T: Traced>(&mut self, scene: &Visible<T>, seen: &[Option<Seen>; PACKET], has_normals: bool) {
        for (is_there, seen) in self.are_there.iter_mut().zip(seen) {
            *is_there = seen.is_some();
        }
        if !self.are_any() {
            return;
        }
        self.hits.take(scene.traced, seen);
        let precision = scene.traced.precision();
        dispatch_common(Find { points: self, precision, has_normals });
        if !scene.appearance.is_plain() {
            self.look(scene, seen, has_normals);
        }
    }

    /// Surfaces, smooth normals and flags.
    fn look<T: Traced>(&mut self, scene: &Visible<T>, seen: &[Option<Seen>; PACKET], has_normals: bool) {
        for (i, seen) in seen.iter().enumerate() {
            let Some(seen) = seen else { continue };
            let object = scene.appearance.object(seen);
            let surface = scene.appearance.surface(scene.traced, seen, &object);
            self.are_holdouts[i] = object.is_holdout;
            put(&mut self.base, i, &surface.base);
            put(&mut self.emission, i, &surface.emission);
            if has_normals {
                let normal = smooth(scene, seen, &at(&self.ground, i));
                put(&mut self.normal, i, &normal);
            }
        }
    }

    /// The rays themselves.
    pub fn rays(&self, rays: &mut [Ray; PACKET]) {
        for (i, ray) in rays.iter_mut().enumerate() {
            *ray = Ray { origin: at(&self.origin, i), direction: at(&self.view, i), t_min: 0.0, t_max: self.t_max[i] };
        }
    }

    /// Whether any ray meets anything.
    pub fn are_any(&self) -> bool {
        self.are_there.iter().fold(false, |any, is_there| any | is_there)
    }

    /// The places that are there.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        self.are_there.into_iter().enumerate().filter_map(|(i, is_there)| is_there.then_some(i))
    }

    pub fn sampler(&self, i: usize) -> Sampler {
        Sampler::new(self.seed, self.pixels[i], self.sample)
    }
}

/// What was hit, and where on it.
struct Hits {
    corners: [Vectors; 3],
    t: Numbers,
    u: Numbers,
    v: Numbers,
}

impl Hits {
    /// Triangles of some size, so that no number is out of range where nothing is hit.
    fn new() -> Self {
        let mut corners = [ZEROS; 3];
        corners[1][0].fill(1.0);
        corners[2][1].fill(1.0);
        Self { corners, t: [0.0; PACKET], u: [0.0; PACKET], v: [0.0; PACKET] }
    }

    /// Those from the first corner.
    #[inline(always)]
    fn edges(&self, i: usize) -> [Vector; 2] {
        let [a, b, c] = [0, 1, 2].map(|corner| at(&self.corners[corner], i));
        [subtract(&b, &a), subtract(&c, &a)]
    }

    fn take<T: Traced>(&mut self, traced: &T, seen: &[Option<Seen>; PACKET]) {
        // Corners lie anywhere in memory: all are asked for before the first is waited for.
        for seen in seen.iter().flatten() {
            traced.prefetch_row(seen);
        }
        for seen in seen.iter().flatten() {
            traced.prefetch_corners(seen);
        }
        for (i, seen) in seen.iter().enumerate() {
            let Some(seen) = seen else { continue };
            for (vectors, corner) in self.corners.iter_mut().zip(&traced.corners(seen)) {
                put(vectors, i, corner);
            }
            (self.t[i], self.u[i], self.v[i]) = (seen.hit.t, seen.hit.u, seen.hit.v);
        }
    }
}

/// Positions, and with normals what is computed from them.
struct Find<'a> {
    points: &'a mut Points,
    precision: Precision,
    has_normals: bool,
}

impl Kernel for Find<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { points, precision, has_normals } = self;
        let error = match precision {
            Precision::Watertight | Precision::Exact => points.along(),
            Precision::Fast => points.within(),
        };
        if has_normals {
            points.stand(&error);
        }
    }
}

impl Points {
    /// Find where rays are at their hits, and how far that can be from the triangle.
    #[inline(always)]
    fn along(&mut self) -> Numbers {
        // The hit is right to 2^-40 of t, the roundings of origin + t · direction are far below that of the larger of both.
        let mut error = [0.0; PACKET];
        for (i, error) in error.iter_mut().enumerate() {
            let t = self.hits.t[i];
            let mut largest = t;
            for axis in 0..3 {
                let origin = self.origin[axis][i];
                largest = largest.max(origin.abs());
                self.position[axis][i] = origin + t * self.view[axis][i];
            }
            *error = 2.0 * largest / (1u64 << 40) as f64;
        }
        error
    }

    /// Find the points of triangles that the weights of hits name, and how far rays of single precision may see them
    /// elsewhere.
    #[inline(always)]
    fn within(&mut self) -> Numbers {
        // The weights, however wrong, leave the point in the triangle's plane; a ray that starts there is rounded by half a
        // unit in the last place of a coordinate, and finds the plane with a few such errors.
        let mut error = [0.0; PACKET];
        for (i, error) in error.iter_mut().enumerate() {
            let Hits { corners: [a, b, c], u, v, .. } = &self.hits;
            let mut largest = 0.0f64;
            for axis in 0..3 {
                let (a, b, c) = (a[axis][i], b[axis][i], c[axis][i]);
                largest = largest.max(a.abs()).max(b.abs()).max(c.abs());
                self.position[axis][i] = a + u[i] * (b - a) + v[i] * (c - a);
            }
            *error = 8.0 * f64::from(f32::EPSILON) * largest;
        }
        error
    }

    /// Find how surfaces stand, and points above them.
    #[inline(always)]
    fn stand(&mut self, error: &Numbers) {
        for i in 0..PACKET {
            let [ab, ac] = self.hits.edges(i);
            let ground = cross(&ab, &ac);
            put(&mut self.ground, i, &ground);
        }
        let mut lengths = Lengths::of(|i| at(&self.ground, i));
        lengths.each_extreme(|i| {
            let [ab, ac] = self.hits.edges(i);
            put(&mut self.ground, i, &normal(&ab, &ac));
        });
        for (i, &error) in error.iter().enumerate() {
            let inverse = lengths.inverse(i);
            let ground = at(&self.ground, i).map(|x| x * inverse);
            let away = dot(&ground, &at(&self.view, i));
            let ground = ground.map(|x| if away > 0.0 { -x } else { x });
            put(&mut self.ground, i, &ground);
            put(&mut self.normal, i, &ground);
            put(&mut self.lifted, i, &add_scaled(&at(&self.position, i), 2.0 * error, &ground));
        }
    }
}

/// The normal between those of the corners, on the side of the triangle's own; that one where there are none.
fn smooth<T: Traced>(scene: &Visible<T>, seen: &Seen, ground: &Vector) -> Vector {
    let look = scene.appearance.meshes.get(scene.traced.tree_of(seen.instance));
    let Some(normals) = look.and_then(|look| look.corner_normals) else { return *ground };
    let (u, v) = (seen.hit.u, seen.hit.v);
    let [a, b, c] = normals[seen.hit.triangle as usize].map(|normal| normal.map(f64::from));
    let between = std::array::from_fn(|i| (1.0 - u - v) * a[i] + u * b[i] + v * c[i]);
    let normal = normalise(&scene.traced.normal_in_world(seen.instance, &between));
    let side = dot(&normal, ground);
    if side > 0.0 {
        normal
    } else if side < 0.0 {
        normal.map(|x| -x)
    } else {
        *ground
    }
}
