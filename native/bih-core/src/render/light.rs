//! Lights, in the units of Blender: what of each reaches a point, and from where.

use std::f64::consts::PI;

use super::sampling::{Sampler, in_cone, on_disk, sine_cosine};
use super::surface::Points;
use super::vectors::{Lengths, Numbers, Vectors, ZEROS, at, put};
use crate::geometry::{Vector, add_scaled, dot, normalise, subtract};
use crate::simd::{Kernel, Lanes, dispatch_common};
use crate::traverse::PACKET;

/// A light. With a size it is sampled, and its shadows are soft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Where it is and how it spreads.
    pub shape: Shape,
    /// Red, green, blue: of a headlight the radiance of a white surface that faces it, of a sun the irradiance of a
    /// surface that faces it (W/m²), of all others the power (W).
    pub colour: [f64; 3],
    /// Whether what stands before it hides it.
    pub casts_shadows: bool,
}

/// What a light is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// At the camera: it shines along every camera ray, at any distance, and casts no shadow that is seen.
    Headlight,
    /// A disk infinitely far away.
    Sun {
        /// Where its light goes.
        direction: Vector,
        /// As it is seen, from side to side, in radians.
        angle: f64,
    },
    /// A sphere that shines to all sides.
    Point {
        /// Its centre.
        position: Vector,
        /// Of the sphere.
        radius: f64,
    },
    /// A sphere that shines into a cone.
    Spot {
        /// Its centre.
        position: Vector,
        /// Of the sphere.
        radius: f64,
        /// The axis of the cone.
        direction: Vector,
        /// Of the cone, from side to side, in radians.
        angle: f64,
        /// What share of the cone's height, seen along the axis, fades out.
        blend: f64,
    },
    /// A rectangle or an ellipse that shines to one side as matter does.
    Area {
        /// Its centre.
        position: Vector,
        /// The side it shines to.
        direction: Vector,
        /// From side to side, and across that.
        axes: [Vector; 2],
        /// Whether it is an ellipse.
        is_round: bool,
    },
}

/// What one sample of a light sends to a point.
#[derive(Debug, Clone, Copy)]
struct Incoming {
    /// The way to the light, of any length.
    to_light: Vector,
    /// Where on it the light is.
    t_max: f64,
    /// On a surface that faces it, relative to the light's colour.
    irradiance: f64,
}

/// What one sample of a light sends to each point of a block.
pub(super) struct Arriving {
    /// The way to the light, of any length.
    pub to_light: Vectors,
    /// Where on it the light is.
    pub t_max: Numbers,
    /// On the surface as it stands, relative to the light's colour; 0 where nothing arrives.
    pub amount: Numbers,
}

impl Arriving {
    pub fn new() -> Self {
        Self { to_light: ZEROS, t_max: [0.0; PACKET], amount: [0.0; PACKET] }
    }
}

impl Light {
    /// A sun of no size.
    pub fn sun(direction: Vector, irradiance: [f64; 3]) -> Self {
        Self { shape: Shape::Sun { direction, angle: 0.0 }, colour: irradiance, casts_shadows: true }
    }

    /// A point light of no size.
    pub fn point(position: Vector, power: [f64; 3]) -> Self {
        Self { shape: Shape::Point { position, radius: 0.0 }, colour: power, casts_shadows: true }
    }

    /// One sample of what reaches each point of a block; `dimension` is the light's own. Nothing of a headlight, which
    /// depends on the view.
    pub(super) fn towards(&self, points: &Points, dimension: u32, arriving: &mut Arriving) {
        let Arriving { to_light, t_max, amount } = arriving;
        let centre = match self.shape {
            Shape::Point { position, radius } if radius <= 0.0 => {
                t_max.fill(1.0);
                Some(position)
            }
            _ => {
                amount.fill(0.0);
                for i in points.places() {
                    let sample = self.at(&at(&points.position, i), &points.sampler(i), dimension);
                    if let Some(incoming) = sample {
                        put(to_light, i, &incoming.to_light);
                        (t_max[i], amount[i]) = (incoming.t_max, incoming.irradiance);
                    }
                }
                None
            }
        };
        dispatch_common(Fall { points, centre: centre.as_ref(), to_light, amount });
    }

    /// One sample of what reaches a point.
    fn at(&self, point: &Vector, sampler: &Sampler, dimension: u32) -> Option<Incoming> {
        match &self.shape {
            Shape::Headlight => None,
            Shape::Sun { direction, angle } => {
                let to_light = direction.map(|x| -x);
                if *angle <= 0.0 {
                    return Some(Incoming { to_light, t_max: f64::INFINITY, irradiance: 1.0 });
                }
                let (sine, cosine) = sine_cosine(0.5 * angle);
                let depth = sine * sine / (1.0 + cosine);
                let to_light = in_cone(&normalise(&to_light), depth, sampler.square(dimension));
                Some(Incoming { to_light, t_max: f64::INFINITY, irradiance: 2.0 / (1.0 + cosine) })
            }
            Shape::Point { position, radius } => Some(from_sphere(point, position, *radius, sampler, dimension)),
            Shape::Spot { position, radius, direction, angle, blend } => {
                let share = in_spot(point, position, direction, *angle, *blend);
                (share > 0.0).then(|| {
                    let incoming = from_sphere(point, position, *radius, sampler, dimension);
                    Incoming { irradiance: share * incoming.irradiance, ..incoming }
                })
            }
            Shape::Area { position, direction, axes, is_round } => {
                let square = sampler.square(dimension);
                let [a, b] = if *is_round { on_disk(square).map(|x| 0.5 * x) } else { square.map(|x| x - 0.5) };
                let to_light = subtract(&add_scaled(&add_scaled(position, a, &axes[0]), b, &axes[1]), point);
                let cosine = -dot(&normalise(&to_light), &normalise(direction));
                (cosine > 0.0).then(|| {
                    let irradiance = cosine / (PI * dot(&to_light, &to_light));
                    Incoming { to_light, t_max: 1.0, irradiance }
                })
            }
        }
    }
}

/// Turns what would fall on surfaces that face a light into what falls on them as they stand; of a light that is but a
/// point, with its centre, all of it.
struct Fall<'a> {
    points: &'a Points,
    centre: Option<&'a Vector>,
    to_light: &'a mut Vectors,
    amount: &'a mut Numbers,
}

impl Kernel for Fall<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { points, centre, to_light, amount } = self;
        if let Some(centre) = centre {
            for (i, amount) in amount.iter_mut().enumerate() {
                let way = subtract(centre, &at(&points.position, i));
                put(to_light, i, &way);
                *amount = 1.0 / (4.0 * PI * dot(&way, &way));
            }
        }
        let mut lengths = Lengths::of(|i| at(to_light, i));
        let mut cosine = [0.0; PACKET];
        for (i, cosine) in cosine.iter_mut().enumerate() {
            let inverse = lengths.inverse(i);
            *cosine = dot(&at(to_light, i).map(|x| x * inverse), &at(&points.normal, i));
        }
        lengths.each_extreme(|i| cosine[i] = dot(&normalise(&at(to_light, i)), &at(&points.normal, i)));
        for (i, (amount, cosine)) in amount.iter_mut().zip(cosine).enumerate() {
            let is_lit = points.are_there[i] & (cosine > 0.0);
            *amount = if is_lit { *amount * cosine } else { 0.0 };
        }
    }
}

/// The part of a sphere's surface that is seen, by its solid angle.
fn from_sphere(point: &Vector, centre: &Vector, radius: f64, sampler: &Sampler, dimension: u32) -> Incoming {
    let to_centre = subtract(centre, point);
    let squared = dot(&to_centre, &to_centre);
    if radius <= 0.0 {
        return Incoming { to_light: to_centre, t_max: 1.0, irradiance: 1.0 / (4.0 * PI * squared) };
    }
    let square = sampler.square(dimension);
    let axis = normalise(&to_centre);
    let sine = radius * radius / squared;
    if sine >= 1.0 {
        // From inside it is seen all around.
        let direction = in_cone(&axis, 2.0, square);
        let along = dot(&to_centre, &direction);
        let t_max = along + (along * along + radius * radius - squared).max(0.0).sqrt();
        return Incoming { to_light: direction, t_max, irradiance: 1.0 / (PI * radius * radius) };
    }
    let cosine = (1.0 - sine).sqrt();
    let direction = in_cone(&axis, sine / (1.0 + cosine), square);
    let along = dot(&to_centre, &direction);
    let t_max = along - (along * along + radius * radius - squared).max(0.0).sqrt();
    Incoming { to_light: direction, t_max, irradiance: 1.0 / (2.0 * PI * squared * (1.0 + cosine)) }
}

/// What share of a spot's light goes towards a point: all within the inner cone, none outside the outer one.
fn in_spot(point: &Vector, position: &Vector, direction: &Vector, angle: f64, blend: f64) -> f64 {
    let (_, edge) = sine_cosine(0.5 * angle);
    let inside = dot(&normalise(&subtract(point, position)), &normalise(direction)) - edge;
    if inside <= 0.0 {
        return 0.0;
    }
    let share = (inside / (blend * (1.0 - edge)).max(1e-5)).min(1.0);
    share * share * (3.0 - 2.0 * share)
}
