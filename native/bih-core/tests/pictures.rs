//! Pictures, traced in packets, against single rays.

use bih_core::build::{Layout, Precision};
use bih_core::render::{
    Appearance, Camera, Light, Lighting, Passes, RenderOptions, Tile, Wanted, render, sample_offset,
};
use bih_core::simd::InstructionSet;
use bih_core::traverse::{Stack, Tracer, Way};
use bih_core::{BuildOptions, Control, Tree, Triangles, Vertices, build};

const SIDE: usize = 40;
const WIDTH: u32 = 77;
const HEIGHT: u32 = 53;

/// Hills over the unit square; the whole of them stands `offset` away from the origin.
fn hills(offset: f32) -> Vec<[f32; 3]> {
    let height = |x: usize, y: usize| 0.1 * ((x as f32 * 0.41).sin() + (y as f32 * 0.33).cos());
    let at = |i: usize| i as f32 / (SIDE - 1) as f32;
    let vertex = |x: usize, y: usize| [at(x) + offset, at(y) - offset, height(x, y) + offset];
    let mut soup = Vec::new();
    for (x, y) in (0..SIDE - 1).flat_map(|x| (0..SIDE - 1).map(move |y| (x, y))) {
        let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
        soup.extend([a, b, c, b, d, c]);
    }
    soup
}

fn tree(triangles: &Triangles, precision: Precision) -> Tree {
    let options = BuildOptions { layout: Layout::Wide, precision, ..Default::default() };
    build(triangles, &options, &Control::default()).unwrap()
}

/// Looks at the hills from above and aside, 53 degrees wide, clip planes at 0.1 and 10.
fn camera(offset: f64) -> Camera {
    // Columns: right, up, backwards, eye.
    let (eye, turn) = ([0.5, -0.8, 1.2], std::f64::consts::FRAC_PI_4);
    let view = [
        [1.0, 0.0, 0.0, eye[0] + offset],
        [0.0, turn.cos(), -turn.sin(), eye[1] - offset],
        [0.0, turn.sin(), turn.cos(), eye[2] + offset],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let (near, far, tangent) = (0.1, 10.0, 0.5);
    // From clip space to the camera's: w is one over the distance.
    let unproject = [
        [tangent, 0.0, 0.0, 0.0],
        [0.0, tangent * f64::from(HEIGHT) / f64::from(WIDTH), 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, (near - far) / (2.0 * near * far), (near + far) / (2.0 * near * far)],
    ];
    let product = |i: usize, j: usize| (0..4).map(|k| view[i][k] * unproject[k][j]).sum();
    Camera::new(std::array::from_fn(|i| std::array::from_fn(|j| product(i, j))), WIDTH, HEIGHT).unwrap()
}

fn options(offset: f64, samples: u32, cost: bool) -> RenderOptions {
    let lights = vec![
        Light::point([2.0 + offset, 1.5 - offset, 0.8 + offset], [40.0, 30.0, 20.0]),
        Light::sun([-0.5, 0.3, -0.4], [1.0; 3]),
    ];
    RenderOptions {
        tile: Tile { x: 0, y: 0, width: WIDTH, height: HEIGHT },
        samples,
        first_sample: 0,
        seed: 1,
        lighting: Lighting { lights, shadows: true, ..Default::default() },
        background: [0.0; 4],
        wanted: Wanted { cost, ..Wanted::ALL },
    }
}

fn picture_by(tree: &Tree, triangles: &Triangles, offset: f64, options: &RenderOptions) -> Passes {
    let tracer = Tracer::new(tree, triangles);
    render(&tracer, &Appearance::default(), &camera(offset), options, &Control::default()).unwrap()
}

fn picture(tree: &Tree, triangles: &Triangles, offset: f64, samples: u32, cost: bool) -> Passes {
    picture_by(tree, triangles, offset, &options(offset, samples, cost))
}

#[test]
fn pixels_show_what_single_rays_hit() {
    let soup = hills(0.0);
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    for precision in [Precision::Watertight, Precision::Exact, Precision::Fast] {
        let tree = tree(&triangles, precision);
        let passes = picture(&tree, &triangles, 0.0, 2, false);
        let tracer = Tracer { tree: &tree, triangles: &triangles, set: InstructionSet::Scalar };
        let mut stack = Stack::default();
        let mut hits = 0;
        assert!(passes.cost.is_empty());
        for (i, &triangle) in passes.triangle.iter().enumerate() {
            let ray = camera(0.0).ray(i as u32 % WIDTH, i as u32 / WIDTH, sample_offset(0, 1));
            let mut hit = [None];
            tracer.closest(&[ray], Way::Alone, &mut stack, &mut hit);
            let expected = hit[0].map_or(-1, |hit| hit.triangle as i32);
            assert_eq!(triangle, expected, "{precision:?} pixel {i}");
            hits += usize::from(expected >= 0);
        }
        assert!(hits > 1000 && hits < passes.triangle.len(), "{hits}");
    }
}

#[test]
fn the_cost_changes_nothing_else() {
    let soup = hills(0.0);
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let tree = tree(&triangles, Precision::Watertight);
    let [without, with] = [false, true].map(|cost| picture(&tree, &triangles, 0.0, 1, cost));
    assert!(with.cost.iter().all(|cost| cost[0] >= 1.0));
    assert_eq!(without, Passes { cost: Vec::new(), ..with });
}

/// Single precision finds no shadow of a surface on itself, also where its coordinates are large.
#[test]
fn fast_pictures_are_those_of_exact_ones_but_for_edges() {
    for offset in [0.0f32, 100.0] {
        let soup = hills(offset);
        let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
        let [exact, fast] = [Precision::Watertight, Precision::Fast]
            .map(|precision| picture(&tree(&triangles, precision), &triangles, f64::from(offset), 1, false));
        let differ = |(a, b): (&[f32; 4], &[f32; 4])| (0..4).any(|i| (a[i] - b[i]).abs() > 1e-2 * a[i].abs());
        let differing = exact.combined.iter().zip(&fast.combined).filter(|&pair| differ(pair)).count();
        let lit = exact.combined.iter().filter(|colour| colour[3] > 0.0).count();
        assert!(lit > 1000 && 200 * differing < lit, "{differing} of {lit} at {offset}");
    }
}

/// Each pass alone is what it is among all, and the passes of a tile are those of the picture.
#[test]
fn passes_that_nobody_wants_change_no_other() {
    let soup = hills(0.0);
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let tree = tree(&triangles, Precision::Watertight);
    let all = picture(&tree, &triangles, 0.0, 2, true);
    let none = Passes { width: WIDTH as usize, height: HEIGHT as usize, ..Passes::default() };
    let traced = |wanted: Wanted| {
        let options = RenderOptions { wanted, ..options(0.0, 2, true) };
        picture_by(&tree, &triangles, 0.0, &options)
    };
    let nothing = Wanted::default();
    assert_eq!(traced(nothing), none);
    let Passes { combined, depth, normal, position, triangle, instance, object_index, material_index, cost, .. } = all;
    assert_eq!(traced(Wanted { combined: true, ..nothing }), Passes { combined, ..none.clone() });
    assert_eq!(traced(Wanted { depth: true, ..nothing }), Passes { depth, ..none.clone() });
    assert_eq!(traced(Wanted { normal: true, ..nothing }), Passes { normal, ..none.clone() });
    assert_eq!(traced(Wanted { position: true, ..nothing }), Passes { position, ..none.clone() });
    assert_eq!(traced(Wanted { triangle: true, ..nothing }), Passes { triangle, ..none.clone() });
    assert_eq!(traced(Wanted { instance: true, ..nothing }), Passes { instance, ..none.clone() });
    assert_eq!(traced(Wanted { object_index: true, ..nothing }), Passes { object_index, ..none.clone() });
    assert_eq!(traced(Wanted { material_index: true, ..nothing }), Passes { material_index, ..none.clone() });
    assert_eq!(traced(Wanted { cost: true, ..nothing }), Passes { cost, ..none });
}
