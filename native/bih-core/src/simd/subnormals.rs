//! Where no number of the mesh is subnormal, none is computed with: many processors take a hundred times as long for
//! one, and a padded lane or a word read as a float easily holds one. The processor itself says whether it met any.

use std::hint::black_box;

use super::float_environment::register;
use super::instruction_sets;
use crate::build::{Layout, Precision};
use crate::traverse::{Stack, Tracer, Way};
use crate::{BuildOptions, Control, Ray, Triangles, Vertices, build};

/// Flags that the vector unit keeps: an operand, or a rounded result, was subnormal.
const SUBNORMAL: u32 = 0x12;

fn meets_subnormals(work: impl FnOnce()) -> bool {
    let before = register::read();
    register::write(register::STANDARD);
    work();
    let after = register::read();
    register::write(before);
    after & SUBNORMAL != 0
}

/// How many of the rays hit.
fn trace(tracer: &Tracer, rays: &[Ray], way: Way) -> usize {
    let mut stack = Stack::default();
    let (mut hits, mut hidden) = (vec![None; rays.len()], vec![false; rays.len()]);
    tracer.closest(rays, way, &mut stack, &mut hits);
    tracer.occluded(rays, way, &mut stack, &mut hidden);
    assert!(hits.iter().zip(&hidden).all(|(hit, is_hidden)| hit.is_some() == *is_hidden));
    hits.iter().flatten().count()
}

/// Triangles and rays in general position, about one unit from everything.
fn mesh_and_rays() -> (Vec<[f32; 3]>, Vec<Ray>) {
    let mut state = 1u64;
    let mut number = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    };
    let mut soup = Vec::new();
    for _ in 0..500 {
        let centre = [number(), number(), number()];
        soup.extend([(); 3].map(|()| centre.map(|x| (x + 0.2 * (number() - 0.5)) as f32)));
    }
    let rays =
        (0..500).map(|_| Ray::new([(); 3].map(|()| 2.0 + number()), [(); 3].map(|()| -0.5 - number()))).collect();
    (soup, rays)
}

#[test]
fn the_flags_tell() {
    assert!(meets_subnormals(|| assert!(black_box(f32::from_bits(1)) + black_box(1.0) == 1.0)));
    assert!(meets_subnormals(|| assert!(black_box(1e-30f32) * black_box(1e-10) > 0.0)));
    assert!(!meets_subnormals(|| assert!(black_box(0.0f32) * black_box(f32::NAN) != 0.0)));
}

#[test]
fn none_are_met_where_the_mesh_has_none() {
    let (soup, rays) = mesh_and_rays();
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let layouts = [Layout::Classic, Layout::Wide, Layout::Compact];
    let precisions = [Precision::Fast, Precision::Watertight, Precision::Exact];
    for (layout, precision) in layouts.into_iter().flat_map(|layout| precisions.map(|precision| (layout, precision))) {
        let options = BuildOptions { layout, precision, ..Default::default() };
        let tree = build(&triangles, &options, &Control::default()).unwrap();
        for set in instruction_sets() {
            let tracer = Tracer { tree: &tree, triangles: &triangles, set: *set };
            for way in [Way::Alone, Way::InFlight, Way::Packets] {
                let work = || assert!(trace(&tracer, &rays, way) > 100);
                assert!(!meets_subnormals(work), "{options:?} in {set:?}, {way:?}");
            }
        }
    }
}
