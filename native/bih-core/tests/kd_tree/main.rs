//! The kd-tree, alone and in packets, against the naive intersector.

mod queries;

use std::array::from_fn;
use std::ops::ControlFlow;

use bih_core::kd_tree::{self, Costs, ExpectedCost, KdTree, MAX_DEPTH, Stack, walk};
use bih_core::traverse::Counts;
use bih_core::tree::Kind;
use bih_core::{BuildOptions, Control, Error, Ray, Triangles, Vertices, build};
use proptest::prelude::*;
use queries::*;

fn build_kd(triangles: &Triangles) -> KdTree {
    let tree = kd_tree::build(triangles, &Costs::default(), &Control::default()).unwrap();
    tree.validate(triangles).unwrap();
    tree
}

fn soup(points: &[[f32; 3]]) -> Triangles<'_> {
    Triangles::new(Vertices::F32(points), None).unwrap()
}

fn agree(triangles: &Triangles, rays: &[Ray]) -> KdTree {
    let classic = build(triangles, &BuildOptions::default(), &Control::default()).unwrap();
    let tree = build_kd(triangles);
    assert_eq!(tree.bounds(), classic.bounds());
    assert_eq!(tree.rejected(), &classic.order()[classic.references().len()..]);
    agree_on(&tree, &classic, triangles, rays);
    agree_on(&classic, &classic, triangles, rays);
    tree
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
    points[..points.len() / 3 * 3].iter().map(|p| p.map(|x| x as f32)).collect()
}

proptest! {
    #[test]
    fn on_a_grid(points in proptest::collection::vec(point(grid()), 0..90), rays in rays(grid())) {
        agree(&soup(&single(&points)), &rays);
    }

    #[test]
    fn at_every_size(points in proptest::collection::vec(point(wild()), 0..60), rays in rays(wild())) {
        agree(&soup(&single(&points)), &rays);
    }

    /// Small triangles beside each other, so that the tree is many levels deep.
    #[test]
    fn in_a_crowd(
        places in proptest::collection::vec((point(grid()), proptest::collection::vec(point(-0.6f64..0.6), 3)), 0..120),
        rays in rays(-3.0f64..3.0),
    ) {
        let corners = |(place, offsets): &([f64; 3], Vec<[f64; 3]>)| -> [[f64; 3]; 3] {
            from_fn(|corner| from_fn(|i| place[i] + offsets[corner][i]))
        };
        let points: Vec<_> = places.iter().flat_map(corners).collect();
        agree(&soup(&single(&points)), &rays);
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
        agree(&Triangles::new(Vertices::F64(&soup), None).unwrap(), &rays);
    }

    /// Each point of a triangle lies in the cell of a leaf that refers to it.
    #[test]
    fn every_point_is_in_a_leaf(points in proptest::collection::vec(point((-128i32..=128).prop_map(|x| f64::from(x) / 16.0)), 0..90)) {
        let points = single(&points);
        let triangles = soup(&points);
        let tree = build_kd(&triangles);
        for row in (0..triangles.len() as u32).filter(|row| !tree.rejected().contains(row)) {
            let corners = triangles.corners(row);
            for (u, v) in (0..=8).flat_map(|u| (0..=8 - u).map(move |v| (f64::from(u) / 8.0, f64::from(v) / 8.0))) {
                let p = from_fn(|i| corners[0][i] * (1.0 - u - v) + corners[1][i] * u + corners[2][i] * v);
                prop_assert!(is_referred_to(&tree, row, &p, 0), "{row} {p:?}");
            }
        }
    }
}

fn is_referred_to(tree: &KdTree, row: u32, point: &[f64; 3], node: usize) -> bool {
    match tree.nodes()[node].kind() {
        Kind::Leaf { first, count } => tree.references()[first..first + count].contains(&row),
        Kind::Inner { axis, left, clip } => {
            let plane = f64::from(clip[0]);
            (point[axis] <= plane && is_referred_to(tree, row, point, left))
                || (point[axis] >= plane && is_referred_to(tree, row, point, left + 1))
        }
    }
}

/// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn point(&mut self, size: f64) -> [f32; 3] {
        from_fn(|_| (size * self.next()) as f32)
    }

    fn rays(&mut self, count: usize, size: f64) -> Vec<Ray> {
        let point = |random: &mut Self| random.point(size).map(f64::from);
        (0..count).map(|_| Ray::new(point(self), point(self))).collect()
    }
}

fn surface(side: usize) -> Vec<[f32; 3]> {
    let height = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32 * 0.013;
    let vertex = |x: usize, y: usize| [x as f32 * 0.1, y as f32 * 0.1, height(x, y)];
    let mut soup = Vec::new();
    for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
        let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
        soup.extend([a, b, c, b, d, c]);
    }
    soup
}

#[test]
fn the_same_tree_for_any_number_of_threads() {
    let points = surface(120);
    let triangles = soup(&points);
    let one = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build_kd(&triangles))
    };
    let tree = one(1);
    assert!(tree.stats().leaves > 10_000);
    for threads in [2, 3, 8] {
        assert!(one(threads) == tree, "{threads} threads");
    }
}

#[test]
fn no_one_and_two_triangles() {
    let points =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [30.0, 0.0, 0.0], [31.0, 0.0, 0.0], [30.0, 1.0, 0.5]];
    let down = |x| Ray::new([x, 0.25, 9.0], [0.0, 0.0, -1.0]);
    let rays = [down(0.25), down(30.25), down(2.0), Ray::new([-1.0, 0.25, 0.1], [1.0, 0.0, 0.0])];
    for (count, nodes) in [(0, 0), (1, 1)] {
        assert_eq!(agree(&soup(&points[..3 * count]), &rays).nodes().len(), nodes);
    }
    // The ends of a long box, and nothing between.
    let tree = agree(&soup(&points), &rays);
    assert!(tree.stats().empty_leaves > 0 && tree.stats().references == 2, "{:?}", tree.stats());
    assert_eq!(tree.stats().leaves, tree.stats().empty_leaves + 2);
}

#[test]
fn triangles_that_cannot_be_hit_are_rejected_and_the_rest_works() {
    let nan = f32::NAN;
    let points = [
        [[nan, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]],
        [[0.0, 0.0, f32::INFINITY], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    ];
    let tree = agree(&soup(points.as_flattened()), &[Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0])]);
    assert_eq!((tree.references(), tree.rejected()), ([1].as_slice(), [0, 2, 3].as_slice()));
}

#[test]
fn a_huge_triangle_among_tiny_ones() {
    let random = &mut Random(1);
    let mut points: Vec<[f32; 3]> = Vec::new();
    for _ in 0..3000 {
        let place = random.point(1.0);
        points.extend([0, 1, 2].map(|_| {
            let d = random.point(0.01);
            from_fn::<f32, 3, _>(|i| place[i] + d[i])
        }));
    }
    points.extend([[-900.0, -1000.0, -800.0], [1000.0, -900.0, 700.0], [10.0, 1200.0, 30.0]]);
    let tree = agree(&soup(&points), &random.rays(300, 2.0));
    assert!(tree.stats().references_per_triangle() < 8.0, "{:?}", tree.stats());
    agree(&soup(&points), &random.rays(300, 2000.0));
}

#[test]
fn flat_meshes() {
    let random = &mut Random(2);
    for axis in 0..3 {
        let flat = |mut p: [f32; 3]| {
            p[axis] = 0.1;
            p
        };
        let mut points: Vec<_> = (0..600).map(|_| flat(random.point(1.0))).collect();
        let mut rays = random.rays(200, 2.0);
        rays.extend((0..50).map(|_| {
            // Straight down at a corner, and within the plane.
            let corner = points[(random.next().abs() * 599.0) as usize].map(f64::from);
            let along: [f64; 3] = from_fn(|i| f64::from(u8::from(i == axis)));
            Ray::new(from_fn(|i| corner[i] - 3.0 * along[i]), along)
        }));
        rays.extend((0..50).map(|_| {
            Ray::new(flat(random.point(2.0)).map(f64::from), from_fn(|i| if i == axis { 0.0 } else { random.next() }))
        }));
        let tree = agree(&soup(&points), &rays);
        assert!(tree.stats().leaves > 100);
        // Two walls at the ends of a box.
        let other: Vec<_> = points
            .iter()
            .map(|p| {
                let mut p = *p;
                p[axis] = 0.7;
                p
            })
            .collect();
        points.extend(other);
        agree(&soup(&points), &rays);
    }
}

#[test]
fn a_million_coincident_triangles_take_no_more_than_they_must() {
    let points: Vec<[f32; 3]> =
        (0..1_000_000).flat_map(|_| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.25]]).collect();
    let triangles = soup(&points);
    let tree = build_kd(&triangles);
    assert!(tree.stats().references < 4_000_000, "{:?}", tree.stats());
    let ray = Ray::new([0.25, 0.25, 2.0], [0.0, 0.0, -1.0]);
    assert_eq!(closest(&tree, &triangles, &ray).unwrap().triangle, 0);
}

/// Each of the triangles meets nearly every cell near the centre.
#[test]
fn triangles_through_one_point_stay_within_the_bound() {
    let random = &mut Random(3);
    let mut points: Vec<[f32; 3]> = Vec::new();
    for _ in 0..4000 {
        let [a, b] = [random.point(1.0), random.point(1.0)];
        points.extend([a, b, from_fn(|i| -a[i] - b[i])]);
    }
    let triangles = soup(&points);
    let tree = build_kd(&triangles);
    assert!(tree.stats().tree_bytes <= tree.stats().bound_bytes);
    assert!(tree.stats().references <= 16 * triangles.len(), "{:?}", tree.stats());
    agree(&soup(&points[..900]), &random.rays(200, 1.0));
}

/// Triangles that halve their way to the origin: each split takes one away.
#[test]
fn a_tree_as_deep_as_is_allowed_needs_no_more_stack_than_it_has() {
    let mut points = Vec::new();
    for exponent in 0..140 {
        let x = 2f32.powi(-exponent);
        points.extend([[x, x, x], [0.9 * x, x, x], [x, 0.9 * x, 0.9 * x]]);
    }
    let origins = [[1.0, 1.0, 1.0], [1e-40, 1e-40, 1e-40], [-1.0, -1.0, -1.0], [1.0, 0.9, 0.8]];
    let rays: Vec<_> = origins.iter().map(|&o| Ray::new(o, o.map(|x| -x))).collect();
    let tree = agree(&soup(&points), &rays);
    assert!(tree.stats().depth > 40 && tree.stats().depth <= MAX_DEPTH as usize, "{:?}", tree.stats());
}

#[test]
fn a_surface_of_many_levels() {
    let points = surface(60);
    let random = &mut Random(4);
    let mut rays: Vec<Ray> = Vec::new();
    for _ in 0..400 {
        let at = points[(random.next().abs() * (points.len() - 1) as f64) as usize].map(f64::from);
        let origin = random.point(9.0).map(f64::from);
        rays.push(Ray::new(origin, from_fn(|i| at[i] - origin[i])));
    }
    let tree = agree(&soup(&points), &rays);
    // A ray need not look at more than a few dozen of 7200.
    let triangles = soup(&points);
    let mut counts = Counts::default();
    for ray in &rays {
        let mut nearest = Nearest::new(&tree, &triangles, ray);
        walk(&tree, ray, &mut Stack::default(), &mut counts, |rows| {
            nearest.offer(rows);
            ControlFlow::Continue(nearest.limit())
        });
    }
    assert!(counts.triangles < 20 * rays.len() as u32, "{counts:?}");
}

#[test]
fn the_expected_cost_of_a_leaf_and_of_two() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]];
    let cost = build_kd(&soup(&points)).expected_cost();
    assert_eq!(cost, ExpectedCost { traversals: 0.0, leaves: 1.0, intersections: 1.0 });
    assert_eq!(cost.total(&Costs::default()), 20.0);
}

/// Lines that nothing stops, evenly over all lines that meet the bounds, meet as much as the heuristic expects.
#[test]
fn the_expected_cost_is_what_lines_meet() {
    let points = surface(60);
    let triangles = soup(&points);
    let tree = build_kd(&triangles);
    let expected = tree.expected_cost();
    let random = &mut Random(5);
    let (mut counts, mut met) = (Counts::default(), 0);
    let radius = 4.5;
    for _ in 0..40_000 {
        // Two points of a sphere, each evenly, are an even choice of the lines through it.
        let mut on_sphere = || loop {
            let p: [f64; 3] = from_fn(|_| random.next());
            let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (0.1..1.0).contains(&length) {
                break p.map(|x| x / length * radius);
            }
        };
        let (a, b) = (on_sphere(), on_sphere());
        let origin = [3.0 + a[0], 3.0 + a[1], a[2]];
        let before = counts.nodes;
        let line = Ray { t_min: f64::NEG_INFINITY, ..Ray::new(origin, from_fn(|i| b[i] - a[i])) };
        walk(&tree, &line, &mut Stack::default(), &mut counts, |_| ControlFlow::Continue(f64::INFINITY));
        met += u32::from(counts.nodes > before);
    }
    let [nodes, tests] = [counts.nodes, counts.triangles].map(|count| f64::from(count) / f64::from(met));
    assert!((nodes / (expected.traversals + expected.leaves) - 1.0).abs() < 0.05, "{nodes} {expected:?}");
    assert!((tests / expected.intersections - 1.0).abs() < 0.05, "{tests} {expected:?}");
}

#[test]
fn progress_ends_at_one_and_a_cancelled_build_stops() {
    let points = surface(120);
    let control = Control::default();
    kd_tree::build(&soup(&points), &Costs::default(), &control).unwrap();
    assert_eq!(control.fraction(), 1.0);
    control.cancel();
    assert!(matches!(kd_tree::build(&soup(&points), &Costs::default(), &control), Err(Error::Cancelled(_))));
}
