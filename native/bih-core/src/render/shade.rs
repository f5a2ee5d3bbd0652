//! Light on matter that scatters it evenly (Lambert): direct light, the light of the surroundings, and what shines itself.

use std::f64::consts::PI;

use super::light::{Incoming, Light, Shape};
use super::sampling::{Sampler, by_cosine};
use super::traced::Traced;
use super::visible::Visible;
use crate::geometry::{Ray, Vector, add_scaled, dot, normalise};
use crate::traverse::PACKET;

/// Radiance of a white surface that faces the headlight, where there is no other light, and beside others.
const HEADLIGHT: f64 = 1.0;
const FILL: f64 = 0.15;
/// Dimension of the samples of ambient occlusion; those of the lights come after it.
const OCCLUSION: u32 = 0;

/// What shines on the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lighting {
    /// None, and nothing around: a headlight alone.
    pub lights: Vec<Light>,
    /// Whether lights are hidden by what stands before them.
    pub shadows: bool,
    /// Radiance of what surrounds the scene, in place of the dim headlight that else fills what lights do not reach.
    pub ambient: Option<[f64; 3]>,
    /// Up to this distance surfaces hide the surroundings and the headlight from each other; none: not at all.
    pub occlusion: Option<f64>,
}

/// A point on a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Point {
    pub position: Vector,
    /// The triangle's own, of unit length, on the viewer's side.
    pub ground: Vector,
    /// The one to shade by.
    pub normal: Vector,
    /// The position is not further than this from the triangle.
    pub error: f64,
    /// Where the viewer looks.
    pub view: Vector,
    pub base: [f64; 3],
    pub emission: [f64; 3],
    pub sampler: Sampler,
}

impl Lighting {
    /// Radiance of some points, at most a packet of them, towards the viewer.
    pub(super) fn shade<T: Traced>(
        &self,
        scene: &Visible<T>,
        points: &[Point],
        stack: &mut T::Stack,
    ) -> [[f64; 3]; PACKET] {
        let mut radiance = [[0.0; 3]; PACKET];
        let open = self.open(scene, points, stack);
        for ((radiance, point), open) in radiance.iter_mut().zip(points).zip(open) {
            let facing = dot(&point.normal, &point.view).abs();
            let around = self.around(facing).map(|light| if open { light } else { 0.0 });
            *radiance = std::array::from_fn(|i| point.base[i] * around[i] + point.emission[i]);
        }
        for (light, dimension) in self.lights.iter().zip(OCCLUSION + 1..) {
            let lit = Lit::by(light, points, dimension);
            let hidden =
                if self.shadows && light.casts_shadows { lit.rays.hidden(scene, stack) } else { [false; PACKET] };
            for ((&point, amount), _) in
                lit.rays.points().iter().zip(lit.amounts).zip(hidden).filter(|(_, is_hidden)| !is_hidden)
            {
                for (i, channel) in radiance[point].iter_mut().enumerate() {
                    *channel += points[point].base[i] / PI * light.colour[i] * amount;
                }
            }
        }
        radiance
    }

    /// What comes from the headlights and from everywhere, to a white surface seen by this cosine.
    fn around(&self, facing: f64) -> [f64; 3] {
        let mut sum = match self.ambient {
            Some(ambient) => ambient,
            None => [facing * if self.lights.is_empty() { HEADLIGHT } else { FILL }; 3],
        };
        for light in self.lights.iter().filter(|light| light.shape == Shape::Headlight) {
            for (sum, colour) in sum.iter_mut().zip(light.colour) {
                *sum += facing * colour;
            }
        }
        sum
    }

    /// Which points the surroundings reach, by one direction each.
    fn open<T: Traced>(&self, scene: &Visible<T>, points: &[Point], stack: &mut T::Stack) -> [bool; PACKET] {
        let mut open = [true; PACKET];
        let Some(distance) = self.occlusion else { return open };
        let mut rays = Rays::new();
        for (i, point) in points.iter().enumerate() {
            let direction = by_cosine(&point.normal, point.sampler.square(OCCLUSION));
            // Beneath the triangle that is hit there is matter.
            open[i] = dot(&direction, &point.ground) > 0.0;
            if open[i] {
                rays.push(i, Ray { t_max: distance, ..Ray::new(lifted(point), direction) });
            }
        }
        let hidden = rays.hidden(scene, stack);
        for (&i, hidden) in rays.points().iter().zip(hidden) {
            open[i] = !hidden;
        }
        open
    }
}

/// The points that face a light, and the rays to it.
struct Lit {
    rays: Rays,
    /// Irradiance of the points relative to the light's colour.
    amounts: [f64; PACKET],
}

impl Lit {
    fn by(light: &Light, points: &[Point], dimension: u32) -> Self {
        let mut lit = Self { rays: Rays::new(), amounts: [0.0; PACKET] };
        for (i, point) in points.iter().enumerate() {
            let Some(Incoming { to_light, t_max, irradiance }) = light.at(&point.position, &point.sampler, dimension)
            else {
                continue;
            };
            let cosine = dot(&normalise(&to_light), &point.normal);
            if cosine > 0.0 {
                lit.amounts[lit.rays.len] = irradiance * cosine;
                lit.rays.push(i, Ray { t_max, ..Ray::new(lifted(point), to_light) });
            }
        }
        lit
    }
}

/// Rays from some of the points.
struct Rays {
    len: usize,
    points: [usize; PACKET],
    rays: [Ray; PACKET],
}

impl Rays {
    fn new() -> Self {
        Self { len: 0, points: [0; PACKET], rays: [Ray::new([0.0; 3], [0.0; 3]); PACKET] }
    }

    fn push(&mut self, point: usize, ray: Ray) {
        self.points[self.len] = point;
        self.rays[self.len] = ray;
        self.len += 1;
    }

    fn points(&self) -> &[usize] {
        &self.points[..self.len]
    }

    /// Those in whose way something stands.
    fn hidden<T: Traced>(&self, scene: &Visible<T>, stack: &mut T::Stack) -> [bool; PACKET] {
        let mut hidden = [false; PACKET];
        scene.occluded(&self.rays[..self.len], stack, &mut hidden[..self.len]);
        hidden
    }
}

/// The position, moved to the viewer's side by twice what it can lie behind its triangle.
fn lifted(point: &Point) -> Vector {
    add_scaled(&point.position, 2.0 * point.error, &point.ground)
}
