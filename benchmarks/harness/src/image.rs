//! One picture from nothing: build, camera rays, one shadow ray to a point light, the same shading on every side.

use std::f32::consts::PI;

use bih_core::Control;
use bih_core::render::{Camera, Light, Lighting, RenderOptions, Tile, render, sample_offset};
use rayon::prelude::*;

use crate::bih::BihTree;
use crate::embree::{Arguments, EmbreeScene, Flushed, Packet};
use crate::mesh::{Mesh, View};
use crate::rays::{HEIGHT, Pinhole, Ray, WIDTH, diagonal};
use crate::vector::{Vector, add_scaled, dot, length, subtract, unit};

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
pub fn by_bih(built: &BihTree, view: &View, samples: u32) -> Picture {
    let camera = Camera::new(clip_to_world(view), WIDTH as u32, HEIGHT as u32).expect("the view has an inverse");
    let light = Light::Point { position: view.light.map(f64::from), power: [f64::from(power(view)); 3] };
    let options = RenderOptions {
        tile: Tile { x: 0, y: 0, width: WIDTH as u32, height: HEIGHT as u32 },
        samples,
        seed: 0,
        lighting: Lighting { lights: vec![light], shadows: true },
        combined: true,
        cost: false,
    };
    let passes = render(&built.tree, &built.triangles, &camera, &options, &Control::default());
    passes.expect("nothing cancels it").pixels.into_iter().map(|pixel| pixel.combined[0]).collect()
}

/// The pinhole as the matrix that bih-core takes: its near plane a thousandth of the way to the target, none far.
fn clip_to_world(view: &View) -> [[f64; 4]; 4] {
    let Pinhole { eye, forward, right, up } = Pinhole::new(view);
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
    let shader = Shader {
        scene,
        pinhole: Pinhole::new(&mesh.view),
        light: mesh.view.light,
        power: power(&mesh.view),
        offset: 1e-5 * diagonal(&mesh.bounds()),
        samples,
    };
    let mut picture = vec![0.0; WIDTH * HEIGHT];
    picture.par_chunks_mut(SIDE * WIDTH).enumerate().for_each(|(band, rows)| {
        let _flushed = Flushed::new();
        let mut arguments = Arguments::new(true);
        for block in 0..WIDTH / SIDE {
            let corner = (block * SIDE, band * SIDE);
            let radiance = shader.block(corner, &mut arguments);
            for (lane, value) in radiance.into_iter().enumerate() {
                rows[(lane / SIDE) * WIDTH + corner.0 + lane % SIDE] = value / samples as f32;
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
    offset: f32,
    samples: u32,
}

impl Shader<'_> {
    /// The sum over all samples.
    fn block(&self, corner: (usize, usize), arguments: &mut Arguments) -> [f32; LANES] {
        let mut sum = [0.0; LANES];
        for sample in 0..self.samples {
            let [x, y] = sample_offset(sample, 0).map(|offset| offset as f32);
            let rays: [Ray; LANES] = std::array::from_fn(|lane| {
                let (column, row) = (corner.0 + lane % SIDE, corner.1 + lane / SIDE);
                self.pinhole.ray(column as f32 + x, row as f32 + y)
            });
            let hits = self.scene.nearest_of(&Packet::<LANES>::new(&rays), arguments);
            let mut shadow = rays;
            let mut lit = [0.0; LANES];
            let mut valid = [0; LANES];
            for lane in 0..LANES {
                if hits.triangle[lane] == u32::MAX {
                    continue;
                }
                let normal = unit(hits.normal.map(|axis| axis[lane]));
                let away = dot(normal, rays[lane].direction);
                let normal = if away > 0.0 { normal.map(|x| -x) } else { normal };
                sum[lane] += FILL * ALBEDO * away.abs();
                let position = add_scaled(rays[lane].origin, hits.t[lane], rays[lane].direction);
                let origin = add_scaled(position, self.offset, normal);
                let to_light = subtract(self.light, position);
                let squared = dot(to_light, to_light);
                let cosine = dot(to_light, normal) / squared.sqrt();
                if cosine > 0.0 {
                    lit[lane] = ALBEDO / PI * cosine * self.power / (4.0 * PI * squared);
                    valid[lane] = -1;
                    shadow[lane] = Ray { origin, t_min: 0.0, direction: subtract(self.light, origin), t_max: 1.0 };
                }
            }
            if valid == [0; LANES] {
                continue;
            }
            let hidden = self.scene.hidden_of(&Packet { valid, ..Packet::new(&shadow) }, arguments);
            for lane in 0..LANES {
                if hidden[lane] >= 0.0 {
                    sum[lane] += lit[lane];
                }
            }
        }
        sum
    }
}

/// How many pixels differ by more than a hundredth of the brightest.
pub fn differing(picture: &[f32], reference: &[f32]) -> usize {
    let brightest = reference.iter().copied().fold(0.0, f32::max);
    picture.iter().zip(reference).filter(|(a, b)| (*a - *b).abs() > 0.01 * brightest).count()
}
