//! One number for the hits, the counts and a picture of each layout: the same on every processor, which
//! `make test-neon` checks by running this on two.

use bih_core::build::{Layout, Precision};
use bih_core::render::{Appearance, Camera, Light, Lighting, RenderOptions, Shape, Tile, Wanted, render};
use bih_core::traverse::{Hits, Limits, RayBatch, Tracer, Vectors};
use bih_core::{BuildOptions, Control, Triangles, Vertices, build};

const SIDE: usize = 40;
const PRECISIONS: [Precision; 3] = [Precision::Fast, Precision::Watertight, Precision::Exact];

/// FNV-1a over what is shown of a value: numbers are shown with all their digits.
struct Digest(u64);

impl Digest {
    fn add(&mut self, value: &impl std::fmt::Debug) {
        for byte in format!("{value:?}").bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

fn numbers(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    }
}

fn main() {
    let mut number = numbers(1);
    let heights: Vec<f64> = (0..SIDE * SIDE).map(|_| 0.02 * number()).collect();
    let vertex = |x: usize, y: usize| [x as f64 / SIDE as f64, y as f64 / SIDE as f64, heights[y * SIDE + x]];
    let mut double = Vec::new();
    for (x, y) in (0..SIDE - 1).flat_map(|x| (0..SIDE - 1).map(move |y| (x, y))) {
        let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
        double.extend([a, b, c, b, d, c]);
    }
    let single: Vec<_> = double.iter().map(|corner| corner.map(|x| x as f32)).collect();
    let origins: Vec<_> = (0..2000).map(|_| [number(), number(), 1.0 + number()]).collect();
    // Half of them at vertices, where much is decided in whole numbers.
    let directions: Vec<[f64; 3]> = origins
        .iter()
        .enumerate()
        .map(|(row, origin)| {
            let target = if row % 2 == 0 { double[row] } else { [number(), number(), 0.01] };
            std::array::from_fn(|i| target[i] - origin[i])
        })
        .collect();
    let (t_min, t_max) = (Limits::All(0.0), Limits::All(f64::INFINITY));
    let batch = RayBatch { origins: Vectors::F64(&origins), directions: Vectors::F64(&directions), t_min, t_max };
    let clip_to_world = [[0.5, 0.0, 0.0, 0.5], [0.0, 0.5, 0.1, 0.5], [0.0, -0.1, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let camera = Camera::new(clip_to_world, 40, 30).expect("an orthographic camera");
    let options = RenderOptions {
        tile: Tile { x: 0, y: 0, width: 40, height: 30 },
        samples: 2,
        first_sample: 0,
        seed: 1,
        lighting: Lighting {
            lights: vec![Light {
                shape: Shape::Point { position: [0.2, 0.4, 2.0], radius: 0.3 },
                colour: [9.0; 3],
                casts_shadows: true,
            }],
            shadows: true,
            ambient: Some([0.1; 3]),
            occlusion: Some(0.5),
        },
        background: [0.0; 4],
        wanted: Wanted::ALL,
    };
    let control = Control::default();
    let mut digest = Digest(0xcbf2_9ce4_8422_2325);
    for vertices in [Vertices::F32(&single), Vertices::F64(&double)] {
        let triangles = Triangles::new(vertices, None).expect("a soup");
        let layouts = [Layout::Classic, Layout::Wide, Layout::Compact];
        for (layout, precision) in
            layouts.into_iter().flat_map(|layout| PRECISIONS.map(|precision| (layout, precision)))
        {
            let build_options = BuildOptions { layout, precision, ..Default::default() };
            let tree = build(&triangles, &build_options, &control).expect("a tree");
            digest.add(&tree.order());
            let hits: Hits<f64> = batch.closest(&tree, &triangles, &control).expect("hits");
            digest.add(&hits);
            digest.add(&batch.occluded(&tree, &triangles, &control).expect("shadows"));
            digest.add(&batch.cost(&tree, &triangles, &control).expect("counts"));
            let (tracer, looks) = (Tracer::new(&tree, &triangles), Appearance::default());
            digest.add(&render(&tracer, &looks, &camera, &options, &control).expect("a picture"));
        }
    }
    println!("{:016x}", digest.0);
}
