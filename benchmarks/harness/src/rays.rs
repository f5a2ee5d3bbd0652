//! The rays that every side is given.

use bih_core::Bounds;

use crate::mesh::{Mesh, View};
use crate::vector::{Vector, add_scaled, cross, dot, length, subtract, unit};

/// In single precision, 32 bytes.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: Vector,
    pub t_min: f32,
    pub direction: Vector,
    pub t_max: f32,
}

/// What a set of rays is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Through the centres of the pixels.
    Primary,
    /// A cosine-weighted direction from each primary hit, shuffled.
    Bounce,
    /// From a sphere around the scene to points in its bounds.
    Random,
    /// From each primary hit that faces the light to the light.
    Shadow,
    /// A short cosine-weighted ray from each primary hit.
    Ambient,
    /// From a sphere around the scene to vertices.
    Vertices,
    /// Along an axis, through vertices.
    Axis,
}

impl Kind {
    pub const ALL: [Self; 7] =
        [Self::Primary, Self::Bounce, Self::Random, Self::Shadow, Self::Ambient, Self::Vertices, Self::Axis];

    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Bounce => "bounce",
            Self::Random => "random",
            Self::Shadow => "shadow",
            Self::Ambient => "ambient",
            Self::Vertices => "vertices",
            Self::Axis => "axis",
        }
    }

    /// Whether any hit will do.
    pub fn is_any(self) -> bool {
        matches!(self, Self::Shadow | Self::Ambient)
    }
}

/// The nearest hits that later rays start from: distance and row, of a miss infinity.
pub type Found = (f32, u32);

/// SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// From 0 to 1, all of single precision's.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }

    fn direction(&mut self) -> Vector {
        let z = 2.0 * self.unit() - 1.0;
        let angle = std::f32::consts::TAU * self.unit();
        let radius = (1.0 - z * z).sqrt();
        [radius * angle.cos(), radius * angle.sin(), z]
    }
}

/// A pinhole: directions through the picture are `forward + x right + y up`, x and y from -1 to 1.
#[derive(Debug, Clone, Copy)]
pub struct Pinhole {
    pub eye: Vector,
    pub forward: Vector,
    pub right: Vector,
    pub up: Vector,
    width: f32,
    height: f32,
}

impl Pinhole {
    pub fn new(view: &View) -> Self {
        let forward = unit(subtract(view.target, view.eye));
        let right = unit(cross(forward, view.up));
        let tangent = (0.5 * view.angle.to_radians()).tan();
        let (width, height) = (view.width as f32, view.height as f32);
        let up = cross(right, forward).map(|x| x * tangent);
        Self { eye: view.eye, forward, right: right.map(|x| x * tangent * width / height), up, width, height }
    }

    /// From -1 to 1, of a place counted in pixels from the lower left.
    #[inline(always)]
    pub fn place(&self, x: f32, y: f32) -> [f32; 2] {
        [2.0 * x / self.width - 1.0, 2.0 * y / self.height - 1.0]
    }

    /// Through a place in the picture, counted in pixels from the lower left.
    #[inline(always)]
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let [x, y] = self.place(x, y);
        let direction = unit(add_scaled(add_scaled(self.forward, x, self.right), y, self.up));
        Ray { origin: self.eye, t_min: 0.0, direction, t_max: f32::INFINITY }
    }
}

/// Pixels in tiles of 8 x 8, those in blocks of 4 x 4: neighbours in packets of 8, 16 and 64.
fn pixel(place: usize, width: usize) -> (usize, usize) {
    let (tile, within) = (place / 64, place % 64);
    let (tile_x, tile_y) = (tile % (width / 8), tile / (width / 8));
    let (block, within) = (within / 16, within % 16);
    (8 * tile_x + 4 * (block % 2) + within % 4, 8 * tile_y + 4 * (block / 2) + within / 4)
}

pub fn primary(view: &View) -> Vec<Ray> {
    let pinhole = Pinhole::new(view);
    let pixels = (0..view.width * view.height).map(|place| pixel(place, view.width));
    pixels.map(|(x, y)| pinhole.ray(x as f32 + 0.5, y as f32 + 0.5)).collect()
}

/// What later rays start from.
struct Surface {
    position: Vector,
    /// Of unit length, towards the viewer.
    normal: Vector,
}

/// How far a hit is lifted off its triangle: what single precision cannot tell, with a margin, whatever the scene's size.
#[inline(always)]
pub fn lift(origin: Vector, t: f32) -> f32 {
    let largest = origin.iter().fold(0.0f32, |largest, x| largest.max(x.abs()));
    (2e-5 * t).max(1e-6 * largest)
}

/// The primary hits, lifted off their triangles.
fn surfaces<'a>(mesh: &'a Mesh, rays: &'a [Ray], found: &'a [Found]) -> impl Iterator<Item = Surface> + 'a {
    rays.iter().zip(found).filter(|(_, (t, _))| t.is_finite()).map(move |(ray, &(t, triangle))| {
        let [a, b, c] = mesh.corners(triangle);
        let normal = unit(cross(unit(subtract(b, a)), unit(subtract(c, a))));
        let normal = if dot(normal, ray.direction) > 0.0 { normal.map(|x| -x) } else { normal };
        let position = add_scaled(add_scaled(ray.origin, t, ray.direction), lift(ray.origin, t), normal);
        Surface { position, normal }
    })
}

fn diagonal(bounds: &Bounds) -> f32 {
    length(subtract(bounds.upper, bounds.lower))
}

fn cosine_weighted(random: &mut Random, normal: Vector) -> Vector {
    // A point on the unit sphere that touches the surface; not quite, so that the sum is never zero.
    unit(add_scaled(normal, 0.999, random.direction()))
}

pub fn bounce(mesh: &Mesh, rays: &[Ray], found: &[Found]) -> Vec<Ray> {
    let mut random = Random(99);
    let mut bounced: Vec<_> = surfaces(mesh, rays, found)
        .map(|surface| Ray {
            origin: surface.position,
            t_min: 0.0,
            direction: cosine_weighted(&mut random, surface.normal),
            t_max: f32::INFINITY,
        })
        .collect();
    // Fisher and Yates.
    for last in (1..bounced.len()).rev() {
        bounced.swap(last, random.below(last + 1));
    }
    bounced
}

pub fn ambient(mesh: &Mesh, rays: &[Ray], found: &[Found]) -> Vec<Ray> {
    let mut random = Random(77);
    let reach = 0.1 * diagonal(&mesh.bounds());
    surfaces(mesh, rays, found)
        .map(|surface| Ray {
            origin: surface.position,
            t_min: 0.0,
            direction: cosine_weighted(&mut random, surface.normal),
            t_max: reach,
        })
        .collect()
}

pub fn shadow(mesh: &Mesh, rays: &[Ray], found: &[Found]) -> Vec<Ray> {
    surfaces(mesh, rays, found)
        .filter_map(|surface| {
            let to_light = subtract(mesh.view.light, surface.position);
            let distance = length(to_light);
            (dot(to_light, surface.normal) > 0.0).then(|| Ray {
                origin: surface.position,
                t_min: 0.0,
                direction: to_light.map(|x| x / distance),
                t_max: distance,
            })
        })
        .collect()
}

pub fn random(mesh: &Mesh) -> Vec<Ray> {
    let mut random = Random(5);
    let bounds = mesh.bounds();
    let size = subtract(bounds.upper, bounds.lower);
    let centre = add_scaled(bounds.lower, 0.5, size);
    let radius = 0.6 * diagonal(&bounds);
    (0..mesh.view.width * mesh.view.height)
        .map(|_| {
            let origin = add_scaled(centre, radius, random.direction());
            let target: Vector = std::array::from_fn(|axis| bounds.lower[axis] + random.unit() * size[axis]);
            Ray { origin, t_min: 0.0, direction: unit(subtract(target, origin)), t_max: f32::INFINITY }
        })
        .collect()
}

/// Each as long as the distance, so that its end is the vertex as nearly as single precision has it.
pub fn at_vertices(mesh: &Mesh) -> Vec<Ray> {
    let mut random_row = Random(3);
    let aimed = |ray: Ray| {
        let vertex = mesh.vertices()[random_row.below(mesh.vertices().len())];
        Ray { direction: subtract(vertex, ray.origin), ..ray }
    };
    random(mesh).into_iter().map(aimed).collect()
}

pub fn along_axes(mesh: &Mesh) -> Vec<Ray> {
    let mut random = Random(4);
    let lower = mesh.bounds().lower;
    let reach = diagonal(&mesh.bounds());
    (0..mesh.view.width * mesh.view.height)
        .map(|place| {
            let axis = place % 3;
            let mut origin = mesh.vertices()[random.below(mesh.vertices().len())];
            origin[axis] = lower[axis] - 0.1 * reach;
            let mut direction = [0.0; 3];
            direction[axis] = 1.0;
            Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_comes_once_and_packets_are_blocks() {
        let (width, height) = (32, 16);
        let mut seen = vec![false; width * height];
        for place in 0..width * height {
            let (x, y) = pixel(place, width);
            assert!(!std::mem::replace(&mut seen[y * width + x], true));
        }
        for first in (0..width * height).step_by(16) {
            let (left, bottom) = pixel(first, width);
            for place in first..first + 16 {
                let (x, y) = pixel(place, width);
                assert!((left..left + 4).contains(&x) && (bottom..bottom + 4).contains(&y));
            }
        }
    }

    #[test]
    fn the_pinhole_looks_at_its_target_through_the_middle() {
        let view = View {
            eye: [1.0, 2.0, 3.0],
            target: [1.0, 2.0, -7.0],
            up: [0.0, 1.0, 0.0],
            angle: 90.0,
            light: [0.0; 3],
            width: 32,
            height: 16,
        };
        let pinhole = Pinhole::new(&view);
        assert_eq!(pinhole.ray(16.0, 8.0).direction, [0.0, 0.0, -1.0]);
        let [x, y, z] = pinhole.ray(32.0, 16.0).direction;
        assert!((x / -z - 2.0).abs() < 1e-6 && (y / -z - 1.0).abs() < 1e-6);
    }

    #[test]
    fn bounces_leave_the_surface_with_the_cosine_as_their_mean() {
        let (mut random, normal) = (Random(1), unit([1.0, 2.0, -2.0]));
        let cosines: Vec<_> = (0..100_000).map(|_| dot(cosine_weighted(&mut random, normal), normal)).collect();
        assert!(cosines.iter().all(|cosine| *cosine > 0.0));
        // The mean of the cosine under a density of cosine / pi is 2/3.
        let mean = cosines.iter().sum::<f32>() / cosines.len() as f32;
        assert!((mean - 2.0 / 3.0).abs() < 0.005, "{mean}");
    }
}
