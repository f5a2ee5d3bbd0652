//! Light on grey matter: suns and points with hard shadows, a headlight where there is no light.

use std::f64::consts::PI;

use crate::geometry::{Ray, Vector, add_scaled, dot, normalise, subtract};
use crate::traverse::{PACKET, Stack, Tracer, Way};

/// Reflectance of every surface, that of Blender's default material.
const ALBEDO: f64 = 0.8;
/// Radiance of the headlight at a surface that faces it, and what of it is left beside other lights.
const HEADLIGHT: f64 = 1.0;
const FILL: f64 = 0.15;

/// A light of no size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Parallel light along `direction`; `irradiance` on a surface that faces it, in W/m².
    Sun {
        /// Where the light goes.
        direction: Vector,
        /// Red, green, blue.
        irradiance: [f64; 3],
    },
    /// Light from `position` to all sides; `power` in W.
    Point {
        /// Where the light comes from.
        position: Vector,
        /// Red, green, blue.
        power: [f64; 3],
    },
}

/// What shines on the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lighting {
    /// None: a headlight alone.
    pub lights: Vec<Light>,
    /// Whether lights are hidden by what stands before them.
    pub shadows: bool,
}

/// A point on a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface {
    pub position: Vector,
    /// Of unit length, towards the viewer.
    pub normal: Vector,
    /// The position is not further than this from the triangle.
    pub error: f64,
}

impl Lighting {
    /// Radiance of some surfaces, at most a packet of them, towards the viewers who look along `views`.
    pub(super) fn shade(
        &self,
        tracer: &Tracer,
        surfaces: &[Surface],
        views: &[Vector],
        stack: &mut Stack,
    ) -> [[f64; 3]; PACKET] {
        let mut radiance = [[0.0; 3]; PACKET];
        let ambient = if self.lights.is_empty() { HEADLIGHT } else { FILL };
        for ((radiance, surface), view) in radiance.iter_mut().zip(surfaces).zip(views) {
            *radiance = [ambient * ALBEDO * dot(&surface.normal, view).abs(); 3];
        }
        for light in &self.lights {
            let lit = Lit::by(light, surfaces);
            let hidden = if self.shadows { lit.hidden(tracer, stack) } else { [false; PACKET] };
            for i in (0..lit.len).filter(|&i| !hidden[i]) {
                for (channel, irradiance) in radiance[lit.surfaces[i]].iter_mut().zip(lit.irradiance[i]) {
                    *channel += ALBEDO / PI * irradiance * lit.cosines[i];
                }
            }
        }
        radiance
    }
}

/// The surfaces that face a light, and the rays to it.
struct Lit {
    len: usize,
    surfaces: [usize; PACKET],
    irradiance: [[f64; 3]; PACKET],
    cosines: [f64; PACKET],
    rays: [Ray; PACKET],
}

impl Lit {
    fn by(light: &Light, surfaces: &[Surface]) -> Self {
        let mut lit = Self {
            len: 0,
            surfaces: [0; PACKET],
            irradiance: [[0.0; 3]; PACKET],
            cosines: [0.0; PACKET],
            rays: [Ray::new([0.0; 3], [0.0; 3]); PACKET],
        };
        for (i, surface) in surfaces.iter().enumerate() {
            let (to_light, t_max, irradiance) = light.at(&surface.position);
            let cosine = dot(&normalise(&to_light), &surface.normal);
            if cosine > 0.0 {
                lit.surfaces[lit.len] = i;
                lit.irradiance[lit.len] = irradiance;
                lit.cosines[lit.len] = cosine;
                lit.rays[lit.len] = Ray { t_max, ..Ray::new(lifted(surface), to_light) };
                lit.len += 1;
            }
        }
        lit
    }

    /// Those before which something stands.
    fn hidden(&self, tracer: &Tracer, stack: &mut Stack) -> [bool; PACKET] {
        let rays = &self.rays[..self.len];
        let mut hidden = [false; PACKET];
        tracer.occluded(rays, Way::suited(tracer.tree, rays), stack, &mut hidden[..self.len]);
        hidden
    }
}

impl Light {
    /// The way to the light, where on it the light is, and its irradiance on a surface that faces it.
    fn at(&self, position: &Vector) -> (Vector, f64, [f64; 3]) {
        match self {
            Self::Sun { direction, irradiance } => (direction.map(|x| -x), f64::INFINITY, *irradiance),
            Self::Point { position: light, power } => {
                let to_light = subtract(light, position);
                let area = 4.0 * PI * dot(&to_light, &to_light);
                (to_light, 1.0, power.map(|power| power / area))
            }
        }
    }
}

/// The position, moved to the viewer's side by twice what it can lie behind its triangle.
fn lifted(surface: &Surface) -> Vector {
    add_scaled(&surface.position, 2.0 * surface.error, &surface.normal)
}
