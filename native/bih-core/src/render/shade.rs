//! Light on matter that scatters it evenly (Lambert): direct light, the light of the surroundings, and what shines itself.

use std::f64::consts::PI;

use super::light::{Arriving, Light, Shape};
use super::sampling::by_cosine;
use super::surface::Points;
use super::traced::Traced;
use super::vectors::{Numbers, Vectors, ZEROS, at};
use super::visible::Visible;
use crate::geometry::{Ray, Vector, dot};
use crate::simd::{Kernel, Lanes, dispatch_common};
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

/// What a thread shades a block with.
pub(super) struct Shader {
    /// What comes from each point towards the viewer.
    pub radiance: Vectors,
    arriving: Arriving,
    rays: Rays,
}

impl Shader {
    pub fn new() -> Self {
        Self { radiance: ZEROS, arriving: Arriving::new(), rays: Rays::new() }
    }

    /// Find the radiance of the points.
    pub fn shade<T: Traced>(&mut self, lighting: &Lighting, scene: &Visible<T>, points: &Points, stack: &mut T::Stack) {
        let Self { radiance, arriving, rays } = self;
        let open = lighting.open(scene, points, rays, stack);
        dispatch_common(Around { lighting, points, open: open.as_ref(), radiance });
        for (light, dimension) in lighting.lights.iter().zip(OCCLUSION + 1..) {
            if light.shape == Shape::Headlight {
                continue;
            }
            light.towards(points, dimension, arriving);
            if lighting.shadows && light.casts_shadows {
                rays.clear();
                for i in points.places().filter(|&i| arriving.amount[i] > 0.0) {
                    let way = Ray::new(at(&points.lifted, i), at(&arriving.to_light, i));
                    rays.push(i, Ray { t_max: arriving.t_max[i], ..way });
                }
                rays.each_hidden(scene, stack, |i| arriving.amount[i] = 0.0);
            }
            let amount = &arriving.amount;
            dispatch_common(Lit { base: &points.base, colour: &light.colour, amount, radiance });
        }
    }
}

impl Lighting {
    /// Which points the surroundings reach, by one direction each; none: all.
    fn open<T: Traced>(
        &self,
        scene: &Visible<T>,
        points: &Points,
        rays: &mut Rays,
        stack: &mut T::Stack,
    ) -> Option<[bool; PACKET]> {
        let distance = self.occlusion?;
        let mut open = [true; PACKET];
        rays.clear();
        for i in points.places() {
            let direction = by_cosine(&at(&points.normal, i), points.sampler(i).square(OCCLUSION));
            // Beneath the triangle that is hit there is matter.
            open[i] = dot(&direction, &at(&points.ground, i)) > 0.0;
            if open[i] {
                rays.push(i, Ray { t_max: distance, ..Ray::new(at(&points.lifted, i), direction) });
            }
        }
        rays.each_hidden(scene, stack, |i| open[i] = false);
        Some(open)
    }
}

/// What comes from the headlights, from everywhere, and from the points themselves.
struct Around<'a> {
    lighting: &'a Lighting,
    points: &'a Points,
    open: Option<&'a [bool; PACKET]>,
    radiance: &'a mut Vectors,
}

impl Kernel for Around<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { lighting: Lighting { lights, ambient, .. }, points, open, radiance } = self;
        let mut facing = [0.0; PACKET];
        for (i, facing) in facing.iter_mut().enumerate() {
            *facing = dot(&at(&points.normal, i), &at(&points.view, i)).abs();
        }
        for (channel, radiance) in radiance.iter_mut().enumerate() {
            let strength = if lights.is_empty() { HEADLIGHT } else { FILL };
            for (around, facing) in radiance.iter_mut().zip(&facing) {
                *around = ambient.map_or(facing * strength, |ambient| ambient[channel]);
            }
            for light in lights.iter().filter(|light| light.shape == Shape::Headlight) {
                for (around, facing) in radiance.iter_mut().zip(&facing) {
                    *around += facing * light.colour[channel];
                }
            }
            if let Some(open) = open {
                for (around, is_open) in radiance.iter_mut().zip(open) {
                    *around = if *is_open { *around } else { 0.0 };
                }
            }
            let (base, emission) = (&points.base[channel], &points.emission[channel]);
            for (i, radiance) in radiance.iter_mut().enumerate() {
                *radiance = base[i] * *radiance + emission[i];
            }
        }
    }
}

/// What a light adds.
struct Lit<'a> {
    base: &'a Vectors,
    colour: &'a Vector,
    amount: &'a Numbers,
    radiance: &'a mut Vectors,
}

impl Kernel for Lit<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { base, colour, amount, radiance } = self;
        for (channel, radiance) in radiance.iter_mut().enumerate() {
            for (i, radiance) in radiance.iter_mut().enumerate() {
                *radiance += base[channel][i] / PI * colour[channel] * amount[i];
            }
        }
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

    fn clear(&mut self) {
        self.len = 0;
    }

    fn push(&mut self, point: usize, ray: Ray) {
        self.points[self.len] = point;
        self.rays[self.len] = ray;
        self.len += 1;
    }

    /// Tell the points of those in whose way something stands.
    fn each_hidden<T: Traced>(&self, scene: &Visible<T>, stack: &mut T::Stack, mut tell: impl FnMut(usize)) {
        let mut hidden = [false; PACKET];
        scene.occluded(&self.rays[..self.len], stack, &mut hidden[..self.len]);
        for (&point, hidden) in self.points[..self.len].iter().zip(hidden) {
            if hidden {
                tell(point);
            }
        }
    }
}
