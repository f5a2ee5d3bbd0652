//! Light on grey matter: suns and points with hard shadows, a headlight where there is no light.

use std::f64::consts::PI;

use crate::geometry::{Ray, Triangles, Vector, add_scaled, dot, normalise, subtract};
use crate::simd::Lanes;
use crate::traverse::{Stack, Uncounted, occluded};
use crate::tree::Tree;

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
    /// Radiance towards the viewer who looks along `view`.
    #[inline(always)]
    pub(super) fn shade<L: Lanes>(
        &self,
        tree: &Tree,
        triangles: &Triangles,
        surface: &Surface,
        view: &Vector,
        stack: &mut Stack,
    ) -> [f64; 3] {
        let facing = dot(&surface.normal, view).abs();
        if self.lights.is_empty() {
            return [HEADLIGHT * ALBEDO * facing; 3];
        }
        let mut radiance = [FILL * ALBEDO * facing; 3];
        for light in &self.lights {
            let (to_light, t_max, irradiance) = light.at(&surface.position);
            let cosine = dot(&normalise(&to_light), &surface.normal);
            if cosine <= 0.0 {
                continue;
            }
            let shadow_ray = Ray { t_max, ..Ray::new(lifted(surface), to_light) };
            let is_hidden = self.shadows
                && shadow_ray.is_valid()
                && occluded::<L, _>(tree, triangles, &shadow_ray, stack, &mut Uncounted);
            if !is_hidden {
                for (channel, irradiance) in radiance.iter_mut().zip(irradiance) {
                    *channel += ALBEDO / PI * irradiance * cosine;
                }
            }
        }
        radiance
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
