//! All hits, crossings and points inside, by every tree against all triangles one after another.

use bih_core::build::{Heuristic, Layout, Precision, Structure};
use bih_core::simd::instruction_sets;
use bih_core::traverse::{Hit, Lists, Stack, Tracer, Way, naive_all, naive_contains, naive_count};
use bih_core::{BuildOptions, Control, Ray, Triangles, Vertices, build};
use proptest::prelude::*;

fn variants() -> Vec<BuildOptions> {
    let bih = BuildOptions { leaf_size: Some(3), ..Default::default() };
    let mut variants: Vec<_> = [Layout::Classic, Layout::Wide, Layout::Compact]
        .into_iter()
        .flat_map(|layout| {
            [Heuristic::Global, Heuristic::Sah].map(|heuristic| BuildOptions { layout, heuristic, ..bih })
        })
        .collect();
    variants.extend([Structure::Bvh, Structure::KdTree].map(BuildOptions::of));
    variants
}

fn all(tracer: &Tracer, rays: &[Ray], most: usize) -> Vec<Vec<Hit>> {
    let mut lists = Lists::default();
    tracer.all(rays, most, &mut Stack::default(), &mut lists).unwrap();
    let Lists { hits, ends, .. } = lists;
    let starts = std::iter::once(0).chain(ends.iter().copied());
    starts.zip(&ends).map(|(start, &end)| hits[start..end].to_vec()).collect()
}

fn agree(triangles: &Triangles, rays: &[Ray]) {
    let points: Vec<_> = rays.iter().map(|ray| ray.origin).collect();
    let mut crossings_and_insides = None;
    for precision in [Precision::Watertight, Precision::Exact, Precision::Fast] {
        let mut every_hit = None;
        for options in variants() {
            let tree = build(triangles, &BuildOptions { precision, ..options }, &Control::default()).unwrap();
            // What is crossed and what is inside does not depend on the precision.
            let (counts, inside) = crossings_and_insides.get_or_insert_with(|| {
                let counts: Vec<_> = rays.iter().map(|ray| naive_count(&tree, triangles, ray) as i32).collect();
                let inside: Vec<_> = points.iter().map(|point| naive_contains(&tree, triangles, point)).collect();
                (counts, inside)
            });
            let hits = every_hit
                .get_or_insert_with(|| rays.iter().map(|ray| naive_all(&tree, triangles, ray)).collect::<Vec<_>>());
            for &set in instruction_sets() {
                let tracer = Tracer { tree: &tree, triangles, set };
                let stack = &mut Stack::default();
                let (mut found, mut answers) = (vec![0; rays.len()], vec![false; rays.len()]);
                tracer.count(rays, stack, &mut found);
                assert_eq!(found, *counts, "{precision:?} {options:?}");
                tracer.contains(&points, stack, &mut answers);
                assert_eq!(answers, *inside, "{precision:?} {options:?}");
                let every = all(&tracer, rays, usize::MAX);
                if precision == Precision::Fast {
                    assert_sound(&tracer, rays);
                } else {
                    assert_eq!(every, *hits, "{precision:?} {options:?}");
                }
                for most in 1..4 {
                    for (some, every) in all(&tracer, rays, most).iter().zip(&every) {
                        assert_eq!(some[..], every[..every.len().min(most)], "{precision:?} {options:?} {most}");
                    }
                }
            }
        }
    }
}

/// In single precision: in order, no row twice, and with records the first is the nearest.
fn assert_sound(tracer: &Tracer, rays: &[Ray]) {
    let mut nearest = vec![None; rays.len()];
    tracer.closest(rays, Way::Alone, &mut Stack::default(), &mut nearest);
    for ((ray, hits), nearest) in rays.iter().zip(all(tracer, rays, usize::MAX)).zip(nearest) {
        let keys: Vec<_> = hits.iter().map(|hit| (hit.t, hit.triangle)).collect();
        assert!(keys.is_sorted(), "{ray:?} {keys:?}");
        let mut rows: Vec<_> = hits.iter().map(|hit| hit.triangle).collect();
        rows.sort_unstable();
        rows.dedup();
        assert_eq!(rows.len(), hits.len(), "{ray:?}");
        if tracer.tree.wide().is_some() {
            assert_eq!(hits.first().copied(), nearest, "{ray:?}");
        }
    }
}

/// Small whole numbers, so that rays meet edges, vertices and planes exactly; both zeros.
fn grid() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![(-2i32..=2).prop_map(f64::from), Just(-0.0)]
}

/// Any size that float32 has, subnormal ones too.
fn wild() -> impl Strategy<Value = f64> + Clone {
    (-1.0f64..1.0, -148i32..120).prop_map(|(x, exponent)| f64::from((x * 2f64.powi(exponent)) as f32))
}

fn point(x: impl Strategy<Value = f64>) -> impl Strategy<Value = [f64; 3]> {
    proptest::collection::vec(x, 3).prop_map(|v| [v[0], v[1], v[2]])
}

fn rays(x: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Vec<Ray>> {
    let end = prop_oneof![3 => Just(None), 1 => (-4i32..5).prop_map(|t| Some(f64::from(t) / 2.0))];
    let ray = (point(x.clone()), point(x), end.clone(), end).prop_map(|(origin, direction, t_min, t_max)| Ray {
        origin,
        // None that is zero: those have no answer.
        direction: if direction == [0.0; 3] { [0.0, 0.0, -1.0] } else { direction },
        t_min: t_min.unwrap_or(f64::NEG_INFINITY),
        t_max: t_max.unwrap_or(f64::INFINITY),
    });
    proptest::collection::vec(ray, 1..20)
}

fn whole_triangles(points: &[[f64; 3]]) -> &[[f64; 3]] {
    &points[..points.len() / 3 * 3]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 1 } else { 24 }))]

    #[test]
    fn on_a_grid(points in proptest::collection::vec(point(grid()), 0..60), rays in rays(grid())) {
        let soup: Vec<_> = whole_triangles(&points).iter().map(|p| p.map(|x| x as f32)).collect();
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), &rays);
    }

    #[test]
    fn at_every_size(points in proptest::collection::vec(point(wild()), 0..30), rays in rays(wild())) {
        let soup: Vec<_> = whole_triangles(&points).iter().map(|p| p.map(|x| x as f32)).collect();
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), &rays);
    }

    #[test]
    fn in_double_precision(
        points in proptest::collection::vec(point(-1.0f64..1.0), 0..45),
        rays in rays(-1.0f64..1.0),
        scale in prop_oneof![Just(1.0), Just(1e-200), Just(1e300)],
    ) {
        let soup: Vec<_> = whole_triangles(&points).iter().map(|p| p.map(|x| x * scale)).collect();
        let rays: Vec<_> = rays.iter().map(|ray| Ray { origin: ray.origin.map(|x| x * scale), ..*ray }).collect();
        agree(&Triangles::new(Vertices::F64(&soup), None).unwrap(), &rays);
    }

    /// A closed surface: a point is inside by an odd number of crossings, in whatever direction they are counted.
    #[test]
    fn parity_does_not_depend_on_the_direction(
        corners in proptest::collection::vec(point(grid()), 4),
        points in proptest::collection::vec(point(grid()), 1..12),
        directions in proptest::collection::vec(point(grid()), 1..6),
    ) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| corners[i].map(|x| x as f32));
        let soup = [a, b, c, a, b, d, a, c, d, b, c, d];
        let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
        let tree = build(&triangles, &BuildOptions::default(), &Control::default()).unwrap();
        let tracer = Tracer::new(&tree, &triangles);
        let mut inside = vec![false; points.len()];
        tracer.contains(&points, &mut Stack::default(), &mut inside);
        for (point, is_inside) in points.iter().zip(inside) {
            for direction in directions.iter().filter(|direction| **direction != [0.0; 3]) {
                let is_odd = naive_count(&tree, &triangles, &Ray::new(*point, *direction)) % 2 == 1;
                let as_expected = if is_upon(&triangles, point) { is_inside } else { is_inside == is_odd };
                prop_assert!(as_expected, "{point:?} {direction:?}");
            }
        }
    }
}

/// Whether a point is on a triangle that some direction of the axes does not lie in.
fn is_upon(triangles: &Triangles, point: &[f64; 3]) -> bool {
    let tree = build(triangles, &BuildOptions::default(), &Control::default()).unwrap();
    (0..3).any(|axis| {
        let mut direction = [0.0; 3];
        direction[axis] = 1.0;
        let ray = Ray { t_max: 0.0, ..Ray::new(*point, direction) };
        !naive_all(&tree, triangles, &ray).is_empty()
    })
}

/// Once as the nearest of each list, a million at one distance and in the order of their rows.
#[test]
fn a_million_times_the_same_triangle() {
    let count = if cfg!(miri) { 100 } else { 1_000_000 };
    let vertices = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let rows = vec![[0u32, 1, 2]; count];
    let triangles = Triangles::new(Vertices::F32(&vertices), Some(&rows)).unwrap();
    for precision in [Precision::Watertight, Precision::Exact, Precision::Fast] {
        let options = BuildOptions { precision, ..Default::default() };
        let tree = build(&triangles, &options, &Control::default()).unwrap();
        let tracer = Tracer::new(&tree, &triangles);
        let ray = [Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])];
        let hits = all(&tracer, &ray, usize::MAX).remove(0);
        assert!(hits.iter().map(|hit| hit.triangle as usize).eq(0..count));
        assert!(hits.iter().all(|hit| hit.t == 1.0));
        let few = all(&tracer, &ray, 7).remove(0);
        assert_eq!(few, hits[..7]);
        let mut crossings = [0];
        tracer.count(&ray, &mut Stack::default(), &mut crossings);
        assert_eq!(crossings[0] as usize, count);
    }
}
