//! One picture from nothing: build, camera rays, one shadow ray to a point light, the same shading on every side.

use std::f32::consts::PI;

use bih_core::Control;
use bih_core::render::{Appearance, Camera, Light, Lighting, RenderOptions, Tile, Wanted, render, sample_offset};
use bih_core::traverse::Tracer;
use rayon::prelude::*;

use crate::bih::BihTree;
use crate::embree::{Arguments, EmbreeScene, Flushed, Packet, PacketHit};
use crate::mesh::{Mesh, View};
use crate::rays::{Pinhole, lift};
use crate::vector::{Vector, length, subtract};

/// Red, row by row from the lower left.
pub type Picture = Vec<f32>;

/// As in bih-core's shading.
const ALBEDO: f32 = 0.8;
const FILL: f32 = 0.15;

/// A white surface at the distance of the target is as bright as the light can make it.
fn power(view: &View) -> f32 {
    let distance = length(subtract(view.light, view.target));
    4.0 * PI * distance * distance * PI
}

/// By bih-core's own renderer.
pub fn by_bih(built: &BihTree, view: &View, samples: u32, shadows: bool) -> Picture {
    let (width, height) = (view.width as u32, view.height as u32);
    let camera = Camera::new(clip_to_world(view), width, height).expect("the view has an inverse");
    let light = Light::point(view.light.map(f64::from), [f64::from(power(view)); 3]);
    let options = RenderOptions {
        tile: Tile { x: 0, y: 0, width, height },
        samples,
        first_sample: 0,
        seed: 0,
        lighting: Lighting { lights: vec![light], shadows, ..Default::default() },
        background: [0.0; 4],
        wanted: Wanted { combined: true, ..Wanted::default() },
    };
    let tracer = Tracer::new(&built.tree, &built.triangles);
    let passes = render(&tracer, &Appearance::default(), &camera, &options, &Control::default());
    passes.expect("nothing cancels it").combined.into_iter().map(|[red, ..]| red).collect()
}

/// The pinhole as the matrix that bih-core takes: its near plane a thousandth of the way to the target, none far.
fn clip_to_world(view: &View) -> [[f64; 4]; 4] {
    let Pinhole { eye, forward, right, up, .. } = Pinhole::new(view);
    let near = 1e-3 * f64::from(length(subtract(view.target, view.eye)));
    let row = |axis: usize| {
        let half_eye = 0.5 * f64::from(eye[axis]);
        [
            near * f64::from(right[axis]),
            near * f64::from(up[axis]),
            -half_eye,
            near * f64::from(forward[axis]) + half_eye,
        ]
    };
    [row(0), row(1), row(2), [0.0, 0.0, -0.5, 0.5]]
}

/// Pixels of a packet's sides.
const SIDE: usize = 4;
const LANES: usize = SIDE * SIDE;

/// By Embree in packets of 16 that are told to be coherent: 4 x 4 pixels, and their shadow rays.
pub fn by_embree(scene: &EmbreeScene, mesh: &Mesh, samples: u32) -> Picture {
    let shader =
        Shader { scene, pinhole: Pinhole::new(&mesh.view), light: mesh.view.light, power: power(&mesh.view), samples };
    let width = mesh.view.width;
    let mut picture = vec![0.0; width * mesh.view.height];
    picture.par_chunks_mut(SIDE * width).enumerate().for_each(|(band, rows)| {
        let _flushed = Flushed::new();
        let mut arguments = Arguments::new(true);
        for block in 0..width / SIDE {
            let corner = (block * SIDE, band * SIDE);
            let radiance = shader.block(corner, &mut arguments);
            for (lane, value) in radiance.into_iter().enumerate() {
                rows[(lane / SIDE) * width + corner.0 + lane % SIDE] = value / samples as f32;
            }
        }
    });
    picture
}

struct Shader<'a> {
    scene: &'a EmbreeScene<'a>,
    pinhole: Pinhole,
    light: Vector,
    power: f32,
    samples: u32,
}

/// A vector for each lane, side by side: loops over lanes become vector instructions.
type Wide = [[f32; LANES]; 3];

fn each(value: impl Fn(usize) -> f32) -> [f32; LANES] {
    std::array::from_fn(value)
}

fn dots(a: &Wide, b: &Wide) -> [f32; LANES] {
    each(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

impl Shader<'_> {
    /// The sum over all samples.
    fn block(&self, corner: (usize, usize), arguments: &mut Arguments) -> [f32; LANES] {
        let mut sum = [0.0; LANES];
        for sample in 0..self.samples {
            let camera = self.camera_rays(corner, sample_offset(sample, 0).map(|offset| offset as f32));
            let hits = self.scene.nearest_of(&camera, arguments);
            let is_hit: [bool; LANES] = std::array::from_fn(|lane| hits.triangle[lane] != u32::MAX);
            let (shadow, fill, lit) = self.shade(&camera, &hits, &is_hit);
            for lane in 0..LANES {
                sum[lane] += if is_hit[lane] { fill[lane] } else { 0.0 };
            }
            if shadow.valid == [0; LANES] {
                continue;
            }
            let hidden = self.scene.hidden_of(&shadow, arguments);
            for lane in 0..LANES {
                sum[lane] += if shadow.valid[lane] != 0 && hidden[lane] >= 0.0 { lit[lane] } else { 0.0 };
            }
        }
        sum
    }

    fn camera_rays(&self, corner: (usize, usize), offset: [f32; 2]) -> Packet<LANES> {
        let Pinhole { eye, forward, right, up, .. } = self.pinhole;
        let pixel = |lane: usize| ((corner.0 + lane % SIDE) as f32, (corner.1 + lane / SIDE) as f32);
        let x = each(|lane| self.pinhole.place(pixel(lane).0 + offset[0], 0.0)[0]);
        let y = each(|lane| self.pinhole.place(0.0, pixel(lane).1 + offset[1])[1]);
        let along: Wide =
            std::array::from_fn(|axis| each(|lane| forward[axis] + x[lane] * right[axis] + y[lane] * up[axis]));
        let squared = dots(&along, &along);
        let inverse = each(|lane| 1.0 / squared[lane].sqrt());
        Packet {
            origin: eye.map(|value| [value; LANES]),
            t_min: [0.0; LANES],
            direction: along.map(|axis| each(|lane| axis[lane] * inverse[lane])),
            t_max: [f32::INFINITY; LANES],
            valid: [-1; LANES],
        }
    }

    /// Rays to the light where it can shine, the headlight's part of the radiance, and the light's.
    fn shade(
        &self,
        camera: &Packet<LANES>,
        hits: &PacketHit<LANES>,
        is_hit: &[bool; LANES],
    ) -> (Packet<LANES>, [f32; LANES], [f32; LANES]) {
        let normal_length = dots(&hits.normal, &hits.normal).map(f32::sqrt);
        let away = dots(&hits.normal, &camera.direction);
        let scale = each(|lane| if away[lane] > 0.0 { -1.0 } else { 1.0 } / normal_length[lane]);
        let normal: Wide = hits.normal.map(|axis| each(|lane| axis[lane] * scale[lane]));
        let fill = each(|lane| FILL * ALBEDO * (away[lane] / normal_length[lane]).abs());
        let lifts = each(|lane| lift(self.pinhole.eye, hits.t[lane]));
        let origin: Wide = std::array::from_fn(|axis| {
            let (start, along) = (&camera.origin[axis], &camera.direction[axis]);
            each(|lane| start[lane] + hits.t[lane] * along[lane] + lifts[lane] * normal[axis][lane])
        });
        let to_light: Wide = std::array::from_fn(|axis| each(|lane| self.light[axis] - origin[axis][lane]));
        let squared = dots(&to_light, &to_light);
        let facing = dots(&to_light, &normal);
        let strength = ALBEDO / PI * self.power / (4.0 * PI);
        let lit = each(|lane| strength * facing[lane] / (squared[lane] * squared[lane].sqrt()));
        let valid = std::array::from_fn(|lane| if is_hit[lane] && facing[lane] > 0.0 { -1 } else { 0 });
        let shadow = Packet { origin, t_min: [0.0; LANES], direction: to_light, t_max: [1.0; LANES], valid };
        (shadow, fill, lit)
    }
}

/// How many pixels differ by more than a hundredth of the brightest.
pub fn differing(picture: &[f32], reference: &[f32]) -> usize {
    let brightest = reference.iter().copied().fold(0.0, f32::max);
    picture.iter().zip(reference).filter(|(a, b)| (*a - *b).abs() > 0.01 * brightest).count()
}
