//! The tree against the naive intersector, on meshes and rays made to be awkward.

use bih_core::build::{Heuristic, Layout, Precision, Structure};
use bih_core::intersect::{SingleHit, SingleRay};
use bih_core::simd::instruction_sets;
use bih_core::traverse::{Hit, Stack, Tracer, Way, naive_closest, naive_occluded};
use bih_core::{BuildOptions, Control, Ray, Tree, Triangles, Vertices, build, tree};
use proptest::prelude::*;

fn build_tree(triangles: &Triangles, layout: Layout, precision: Precision, leaf_size: usize) -> Tree {
    build_as(triangles, &BuildOptions { layout, precision, leaf_size: Some(leaf_size), ..Default::default() })
}

fn build_as(triangles: &Triangles, options: &BuildOptions) -> Tree {
    let tree = build(triangles, options, &Control::default()).unwrap();
    tree::validate(&tree, triangles).unwrap();
    let has_bound = options.structure != Structure::KdTree;
    assert!(!has_bound || tree.stats().tree_bytes <= tree.stats().bound_bytes, "{:?}", tree.stats());
    tree
}

const PRECISIONS: [Precision; 3] = [Precision::Watertight, Precision::Exact, Precision::Fast];

const STRATEGIES: [(Heuristic, Option<bool>); 4] = [
    (Heuristic::Global, Some(false)),
    (Heuristic::Global, Some(true)),
    (Heuristic::Local, None),
    (Heuristic::Sah, None),
];

fn nearest(tree: &Tree, triangles: &Triangles, ray: &Ray) -> Option<Hit> {
    let mut hit = [None];
    Tracer::new(tree, triangles).closest(&[*ray], Way::Alone, &mut Stack::default(), &mut hit);
    hit[0]
}

/// Every way of tracing rays in an instruction set against what the naive intersector finds for each valid ray.
fn agree_in(tracer: &Tracer, rays: &[Ray], truths: &[Option<Hit>]) {
    let mut stack = Stack::default();
    let (mut hits, mut hidden) = (vec![None; rays.len()], vec![false; rays.len()]);
    let mut expected = None;
    for way in [Way::Alone, Way::InFlight, Way::Packets, Way::TwoByTwo] {
        tracer.closest(rays, way, &mut stack, &mut hits);
        tracer.occluded(rays, way, &mut stack, &mut hidden);
        for ((ray, found), (truth, is_hidden)) in rays.iter().zip(&hits).zip(truths.iter().zip(&hidden)) {
            assert_eq!(*is_hidden, found.is_some(), "{way:?} {ray:?}");
            match tracer.tree.precision() {
                Precision::Watertight | Precision::Exact => assert_eq!(found, truth, "{way:?} {ray:?}"),
                Precision::Fast => assert_possible(tracer.triangles, ray, *found, *truth),
            }
        }
        let expected = expected.get_or_insert_with(|| hits.clone());
        assert_eq!(hits, *expected, "{way:?} and alone");
    }
}

/// In single precision a computed t may lie before the box, which is rounded outward from the truth: then it is moved
/// there, or the triangle is not found. What is found is there, and no nearer than the nearest.
fn assert_possible(triangles: &Triangles, ray: &Ray, found: Option<Hit>, truth: Option<Hit>) {
    let Some(found) = found else { return };
    let corners = triangles.corners(found.triangle).map(|corner| corner.map(|x| x as f32));
    let SingleHit { t, u, v } = SingleRay::new(ray).meet(&corners).expect("a triangle that is hit");
    assert!(found.t >= f64::from(t) && [found.u, found.v] == [u, v].map(f64::from), "{ray:?} {found:?} {t}");
    let truth = truth.expect("a nearest one where there is one");
    assert!((truth.t, truth.triangle) <= (found.t, found.triangle), "{ray:?}");
}

/// Whether few and small meshes are asked for: a machine that is emulated takes a hundred times as long.
fn is_short() -> bool {
    cfg!(miri) || std::env::var_os("PROPTEST_CASES").is_some()
}

fn agree(triangles: &Triangles, leaf_size: usize, rays: &[Ray]) {
    // Each layout in each precision, and each strategy in one; each structure in each of its layouts.
    let leaf_size = Some(leaf_size);
    let mut variants = Vec::new();
    for layout in [Layout::Classic, Layout::Wide, Layout::Compact] {
        let options = BuildOptions { layout, leaf_size, presort: STRATEGIES[0].1, ..Default::default() };
        variants.extend(PRECISIONS.map(|precision| BuildOptions { precision, ..options }));
    }
    for layout in [Layout::Classic, Layout::Wide] {
        variants.extend(STRATEGIES[1..].iter().map(|&(heuristic, presort)| BuildOptions {
            layout,
            heuristic,
            presort,
            leaf_size,
            ..Default::default()
        }));
    }
    let bvh = BuildOptions { leaf_size, ..BuildOptions::of(Structure::Bvh) };
    variants.push(BuildOptions { layout: Layout::Compact, ..bvh });
    for options in [bvh, BuildOptions::of(Structure::KdTree)] {
        variants.extend(PRECISIONS.map(|precision| BuildOptions { precision, ..options }));
    }
    // What is true depends on the precision alone.
    let mut truths = PRECISIONS.map(|_| None);
    for options in variants {
        let tree = build_as(triangles, &options);
        let truths = truths[options.precision as usize].get_or_insert_with(|| {
            let truth = |ray: &Ray| {
                let truth = naive_closest(&tree, triangles, ray);
                assert_eq!(naive_occluded(&tree, triangles, ray), truth.is_some(), "{ray:?}");
                truth
            };
            rays.iter().map(|ray| if ray.is_valid() { truth(ray) } else { None }).collect::<Vec<_>>()
        });
        for set in instruction_sets() {
            agree_in(&Tracer { tree: &tree, triangles, set: *set }, rays, truths);
        }
    }
}

/// Small whole numbers, so that rays meet edges, vertices and planes exactly; both zeros.
fn grid() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![(-3i32..=3).prop_map(f64::from), Just(-0.0)]
}

/// Any size that float32 has, subnormal ones too.
fn wild() -> impl Strategy<Value = f64> + Clone {
    (-1.0f64..1.0, -148i32..120).prop_map(|(x, exponent)| f64::from((x * 2f64.powi(exponent)) as f32))
}

fn point(x: impl Strategy<Value = f64>) -> impl Strategy<Value = [f64; 3]> {
    proptest::collection::vec(x, 3).prop_map(|v| [v[0], v[1], v[2]])
}

fn rays(x: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = Vec<Ray>> {
    let end = prop_oneof![4 => Just(None), 1 => (-2i32..6).prop_map(|t| Some(f64::from(t) / 2.0))];
    let ray = (point(x.clone()), point(x), end.clone(), end).prop_map(|(origin, direction, t_min, t_max)| Ray {
        origin,
        direction,
        t_min: t_min.unwrap_or(f64::NEG_INFINITY),
        t_max: t_max.unwrap_or(f64::INFINITY),
    });
    proptest::collection::vec(ray, 1..20)
}

fn single(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|p| p.map(|x| x as f32)).collect()
}

proptest! {
    #[test]
    fn on_a_grid(points in proptest::collection::vec(point(grid()), 0..60), rays in rays(grid()), leaf_size in 1usize..5) {
        let soup = single(&points[..points.len() / 3 * 3]);
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), leaf_size, &rays);
    }

    #[test]
    fn at_every_size(points in proptest::collection::vec(point(wild()), 0..30), rays in rays(wild())) {
        let soup = single(&points[..points.len() / 3 * 3]);
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 1, &rays);
    }

    #[test]
    fn in_double_precision(
        points in proptest::collection::vec(point(-1.0f64..1.0), 0..60),
        rays in rays(-1.0f64..1.0),
        offset in prop_oneof![Just(0.0), Just(1e6), Just(1e300)],
    ) {
        let moved = |p: [f64; 3]| p.map(|x| x + offset);
        let soup: Vec<_> = points[..points.len() / 3 * 3].iter().map(|p| moved(*p)).collect();
        let rays: Vec<_> = rays.iter().map(|ray| Ray { origin: moved(ray.origin), ..*ray }).collect();
        agree(&Triangles::new(Vertices::F64(&soup), None).unwrap(), 2, &rays);
    }
}

/// Triangles whose centres halve their way to the origin on all axes: the deepest tree that halving makes.
#[test]
#[cfg_attr(miri, ignore = "takes a quarter of an hour under Miri")]
fn a_tree_as_deep_as_halving_allows_needs_no_more_stack_than_it_has() {
    let mut soup = Vec::new();
    for exponent in 0..148 {
        for axis in 0..3 {
            let mut corner = [0f32; 3];
            corner[axis] = 2f32.powi(-exponent);
            let mut side = [0f32; 3];
            side[(axis + 1) % 3] = 2f32.powi(-exponent - 1);
            soup.extend([corner, side, [0.0; 3]]);
        }
    }
    // Coincident centres below that: median splits.
    for _ in 0..if is_short() { 10 } else { 1000 } {
        soup.extend([[1e-45, 0.0, 0.0], [0.0, 1e-45, 0.0], [0.0, 0.0, 1e-45]]);
    }
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let tree = build_tree(&triangles, Layout::Classic, Precision::Watertight, 1);
    assert!(tree.stats().depth > 90, "{}", tree.stats().depth);
    assert!(tree.stats().depth <= tree::MAX_DEPTH as usize);
    let origins = [[1.0, 1.0, 1.0], [1e-40, 1e-40, 1e-40], [-1.0, -1.0, -1.0]];
    let rays: Vec<_> = origins.iter().map(|&o| Ray::new(o, o.map(|x| -x))).collect();
    agree(&triangles, 1, &rays);
}

#[test]
fn a_million_triangles_with_one_centre_make_a_shallow_tree() {
    let count = if is_short() { 1000 } else { 1_000_000 };
    let soup: Vec<[f32; 3]> = (0..count).flat_map(|_| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).collect();
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let tree = build_tree(&triangles, Layout::Classic, Precision::Watertight, 4);
    assert!(tree.stats().depth <= 20, "{}", tree.stats().depth);
    assert!(build_tree(&triangles, Layout::Wide, Precision::Watertight, 8).stats().depth <= 10);
    let ray = Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
    let hit = nearest(&tree, &triangles, &ray).unwrap();
    assert_eq!((hit.t, hit.triangle), (1.0, 0));
}

#[test]
fn triangles_that_cannot_be_hit_are_rejected_and_the_rest_works() {
    let nan = f32::NAN;
    let soup = [
        [[nan, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]],
        [[0.0, 0.0, f32::INFINITY], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    ];
    let triangles = Triangles::new(Vertices::F32(soup.as_flattened()), None).unwrap();
    let tree = build_tree(&triangles, Layout::Classic, Precision::Watertight, 1);
    assert_eq!(tree.stats().rejected, 3);
    assert_eq!(tree.order(), [1, 0, 2, 3]);
    assert_eq!(tree.bounds().upper, [1.0, 1.0, 0.0]);
    agree(&triangles, 1, &[Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])]);
}

/// Rays at the vertices and edges of a surface, where single precision alone would lose hits.
#[test]
fn aimed_at_edges() {
    let side = if cfg!(miri) {
        2
    } else if is_short() {
        8
    } else {
        24
    };
    let height = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32 * 0.013;
    let vertex = |x: usize, y: usize| [x as f32 * 0.1, y as f32 * 0.1, height(x, y)];
    let mut soup = Vec::new();
    for (x, y) in (0..side - 1).flat_map(|x| (0..side - 1).map(move |y| (x, y))) {
        let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
        soup.extend([a, b, c, b, d, c]);
    }
    let origins = [[1.13, 0.77, 4.1], [-7.3, 2.9, 5.7], [0.3, 11.9, 1.7]];
    let mut rays = Vec::new();
    for origin in origins {
        for corners in soup.chunks_exact(3) {
            for weight in [0.0, 0.5, 0.3, 0.83] {
                let target: [f64; 3] = std::array::from_fn(|i| {
                    f64::from(corners[0][i]) + weight * (f64::from(corners[1][i]) - f64::from(corners[0][i]))
                });
                rays.push(Ray::new(origin, std::array::from_fn(|i| target[i] - origin[i])));
            }
        }
    }
    agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 4, &rays);
}

/// What is infinite or zero once it is rounded to single precision.
#[test]
fn rays_beyond_single_precision() {
    let soup: Vec<_> = (0..300).map(|i| [(i % 7) as f32, (i % 11) as f32, (i % 13) as f32]).collect();
    let mut rays = Vec::new();
    for size in [1e300, -1e300, 1e39, 3e38, 1e-39, 1e-46, 1e-300, 5e-324] {
        for axis in 0..3 {
            let mut direction = [0.0; 3];
            direction[axis] = size;
            rays.push(Ray::new([1.0, 2.0, 3.0], direction));
            direction[(axis + 1) % 3] = 1.0;
            rays.push(Ray::new([1.0, 2.0, 3.0], direction));
            rays.push(Ray::new(direction, [-1.0, -2.0, 3.0]));
        }
    }
    agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 2, &rays);
}

/// Where nothing is degenerate, single precision leaves out nothing that it would find.
#[test]
fn fast_finds_what_all_triangles_one_after_another_give() {
    let mut state = 7u64;
    let mut number = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f64 / (1u64 << 24) as f64
    };
    let mut soup = Vec::new();
    let (triangles, rays) = if is_short() { (400, 300) } else { (2000, 3000) };
    for _ in 0..triangles {
        let centre = [number(), number(), number()];
        soup.extend([(); 3].map(|()| centre.map(|x| (x + 0.1 * (number() - 0.5)) as f32)));
    }
    let ray = |_| Ray::new([number(), number(), number()], [number() - 0.5, number() - 0.5, number() - 0.5]);
    let rays: Vec<_> = (0..rays).map(ray).collect();
    let double: Vec<_> = soup.iter().map(|corner| corner.map(f64::from)).collect();
    for vertices in [Vertices::F32(&soup), Vertices::F64(&double)] {
        let triangles = Triangles::new(vertices, None).unwrap();
        for layout in [Layout::Classic, Layout::Wide, Layout::Compact] {
            let tree = build_tree(&triangles, layout, Precision::Fast, 8);
            let mut hits = vec![None; rays.len()];
            Tracer::new(&tree, &triangles).closest(&rays, Way::InFlight, &mut Stack::default(), &mut hits);
            for (ray, found) in rays.iter().zip(&hits) {
                assert_eq!(*found, naive_closest(&tree, &triangles, ray), "{layout:?} {ray:?}");
            }
            assert!(hits.iter().flatten().count() > rays.len() / if is_short() { 10 } else { 3 });
        }
    }
}
