//! Where camera rays meet surfaces.

use super::sampling::Sampler;
use super::shade::Point;
use super::traced::{Seen, Traced};
use super::visible::Visible;
use crate::build::Precision;
use crate::geometry::{Corners, Ray, Vector, add_scaled, dot, normal, normalise, subtract};
use crate::traverse::{Hit, PACKET};

/// What is hit in a block, and through which of its pixels.
pub(super) struct Found {
    len: usize,
    pixels: [usize; PACKET],
    holdouts: [bool; PACKET],
    points: [Point; PACKET],
}

impl Found {
    pub fn new() -> Self {
        Self { len: 0, pixels: [0; PACKET], holdouts: [false; PACKET], points: [Point::default(); PACKET] }
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Add what a ray sees through one of the pixels; without its normal where nothing needs it.
    pub fn push<T: Traced>(
        &mut self,
        pixel: usize,
        scene: &Visible<T>,
        ray: &Ray,
        seen: &Seen,
        has_normal: bool,
        sampler: Sampler,
    ) {
        let (traced, appearance) = (scene.traced, scene.appearance);
        let corners = traced.corners(seen);
        let object = appearance.object(seen);
        let surface = appearance.surface(traced, seen, &object);
        let ground = if has_normal { facing(&corners, ray) } else { [0.0; 3] };
        let (position, error) = match traced.precision() {
            Precision::Watertight | Precision::Exact => along(ray, &seen.hit),
            Precision::Fast => within(&corners, &seen.hit),
        };
        let normal = if has_normal { smooth(scene, seen, &ground) } else { ground };
        self.pixels[self.len] = pixel;
        self.holdouts[self.len] = object.is_holdout;
        self.points[self.len] = Point {
            position,
            ground,
            normal,
            error,
            view: ray.direction,
            base: surface.base,
            emission: surface.emission,
            sampler,
        };
        self.len += 1;
    }

    pub fn pixels(&self) -> &[usize] {
        &self.pixels[..self.len]
    }

    pub fn holdouts(&self) -> &[bool] {
        &self.holdouts[..self.len]
    }

    pub fn points(&self) -> &[Point] {
        &self.points[..self.len]
    }
}

/// The unit normal of a triangle on the side that a ray comes from.
fn facing([a, b, c]: &Corners, ray: &Ray) -> Vector {
    let normal = normal(&subtract(b, a), &subtract(c, a));
    let away = dot(&normal, &ray.direction) > 0.0;
    if away { normal.map(|x| -x) } else { normal }
}

/// The normal between those of the corners, on the side of the triangle's own; that one where there are none.
fn smooth<T: Traced>(scene: &Visible<T>, seen: &Seen, ground: &Vector) -> Vector {
    let look = scene.appearance.meshes.get(scene.traced.tree_of(seen.instance));
    let Some(normals) = look.and_then(|look| look.corner_normals) else { return *ground };
    let hit = &seen.hit;
    let [a, b, c] = normals[hit.triangle as usize].map(|normal| normal.map(f64::from));
    let between = std::array::from_fn(|i| (1.0 - hit.u - hit.v) * a[i] + hit.u * b[i] + hit.v * c[i]);
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

/// Where a ray is at a hit, and how far that can be from the triangle.
fn along(ray: &Ray, hit: &Hit) -> (Vector, f64) {
    // The hit is right to 2^-40 of t, the roundings of origin + t · direction are far below that of the larger of both.
    let largest = ray.origin.iter().fold(hit.t, |largest, x| largest.max(x.abs()));
    (add_scaled(&ray.origin, hit.t, &ray.direction), 2.0 * largest / (1u64 << 40) as f64)
}

/// The point of a triangle that the weights of a hit name, and how far rays of single precision may see it elsewhere.
fn within(corners: &Corners, hit: &Hit) -> (Vector, f64) {
    let [a, b, c] = corners;
    let position = add_scaled(&add_scaled(a, hit.u, &subtract(b, a)), hit.v, &subtract(c, a));
    // The weights, however wrong, leave the point in the triangle's plane; a ray that starts there is rounded by half a
    // unit in the last place of a coordinate, and finds the plane with a few such errors.
    let largest = corners.as_flattened().iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    (position, 8.0 * f64::from(f32::EPSILON) * largest)
}
