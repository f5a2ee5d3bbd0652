//! Packets against single rays and the naive intersector, on rays that are coherent and on rays that are not.

use bih_core::build::{Layout, Precision};
use bih_core::simd::instruction_sets;
use bih_core::traverse::{Hit, Stack, Tracer, Way, naive_closest};
use bih_core::{BuildOptions, Control, Ray, Tree, Triangles, Vertices, build};
use proptest::prelude::*;

fn build_tree(triangles: &Triangles, precision: Precision, leaf_size: usize) -> Tree {
    let options = BuildOptions { layout: Layout::Wide, precision, leaf_size: Some(leaf_size), ..Default::default() };
    build(triangles, &options, &Control::default()).unwrap()
}

/// The answers to some rays, taken together as many at a time.
fn answers(tracer: &Tracer, rays: &[Ray], together: usize, way: Way) -> (Vec<Option<Hit>>, Vec<bool>) {
    let mut stack = Stack::default();
    let (mut hits, mut hidden) = (vec![None; rays.len()], vec![false; rays.len()]);
    for ((rays, hits), hidden) in rays.chunks(together).zip(hits.chunks_mut(together)).zip(hidden.chunks_mut(together))
    {
        tracer.closest(rays, way, &mut stack, hits);
        tracer.occluded(rays, way, &mut stack, hidden);
    }
    (hits, hidden)
}

/// Decided exactly: packets of any size answer what single rays do, and these what the naive intersector does.
fn agree(triangles: &Triangles, leaf_size: usize, rays: &[Ray]) -> usize {
    let [watertight, exact] =
        [Precision::Watertight, Precision::Exact].map(|precision| agree_in(precision, triangles, leaf_size, rays));
    assert_eq!(watertight, exact);
    exact
}

fn agree_in(precision: Precision, triangles: &Triangles, leaf_size: usize, rays: &[Ray]) -> usize {
    let tree = build_tree(triangles, precision, leaf_size);
    let truth: Vec<_> =
        rays.iter().map(|ray| if ray.is_valid() { naive_closest(&tree, triangles, ray) } else { None }).collect();
    let is_hit: Vec<_> = truth.iter().map(Option::is_some).collect();
    for set in instruction_sets() {
        let tracer = Tracer { tree: &tree, triangles, set: *set };
        let (hits, hidden) = answers(&tracer, rays, 1, Way::Alone);
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!(hits[i], truth[i], "{set:?} {ray:?}");
            assert_eq!(hidden[i], is_hit[i], "{set:?} {ray:?}");
        }
        for together in [64, 7, 1] {
            let (hits, hidden) = answers(&tracer, rays, together, Way::Packets);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hits[i], truth[i], "{set:?} {together} {ray:?}");
                assert_eq!(hidden[i], is_hit[i], "{set:?} {together} {ray:?}");
            }
        }
    }
    is_hit.iter().filter(|&&is_hit| is_hit).count()
}

/// Fast: the bits of single rays, however rays are put together, on every instruction set.
fn repeat(triangles: &Triangles, leaf_size: usize, rays: &[Ray]) -> usize {
    let tree = build_tree(triangles, Precision::Fast, leaf_size);
    let mut expected: Option<Vec<_>> = None;
    for set in instruction_sets() {
        for (together, way) in [(64, Way::Alone), (1, Way::Packets), (7, Way::Packets), (64, Way::Packets)] {
            let tracer = Tracer { tree: &tree, triangles, set: *set };
            let (hits, hidden) = answers(&tracer, rays, together, way);
            for (i, ray) in rays.iter().enumerate() {
                assert_eq!(hidden[i], hits[i].is_some(), "{set:?} {together} {ray:?}");
            }
            let bits: Vec<_> = hits
                .iter()
                .map(|hit| hit.map(|hit| (hit.triangle, hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits())))
                .collect();
            match &expected {
                None => expected = Some(bits),
                Some(expected) => assert_eq!(*expected, bits, "{set:?} {together}"),
            }
        }
    }
    expected.into_iter().flatten().flatten().count()
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

fn rays(x: impl Strategy<Value = f64> + Clone, count: usize) -> impl Strategy<Value = Vec<Ray>> {
    let end =
        prop_oneof![4 => Just(None), 1 => (-2i32..6).prop_map(|t| Some(f64::from(t) / 2.0)), 1 => Just(Some(0.0))];
    let ray = (point(x.clone()), point(x), end.clone(), end).prop_map(|(origin, direction, t_min, t_max)| Ray {
        origin,
        direction,
        t_min: t_min.unwrap_or(0.0),
        t_max: t_max.unwrap_or(f64::INFINITY),
    });
    proptest::collection::vec(ray, 1..count)
}

fn single(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|p| p.map(|x| x as f32)).collect()
}

proptest! {
    #[test]
    fn on_a_grid(points in proptest::collection::vec(point(grid()), 0..60), rays in rays(grid(), 100), leaf_size in 1usize..9) {
        let soup = single(&points[..points.len() / 3 * 3]);
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), leaf_size, &rays);
        repeat(&Triangles::new(Vertices::F32(&soup), None).unwrap(), leaf_size, &rays);
    }

    #[test]
    fn at_every_size(points in proptest::collection::vec(point(wild()), 0..30), rays in rays(wild(), 40)) {
        let soup = single(&points[..points.len() / 3 * 3]);
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 2, &rays);
    }

    #[test]
    fn in_double_precision(points in proptest::collection::vec(point(-1.0f64..1.0), 0..60), rays in rays(-1.0f64..1.0, 40)) {
        let soup = &points[..points.len() / 3 * 3];
        agree(&Triangles::new(Vertices::F64(soup), None).unwrap(), 4, &rays);
    }

    /// As a camera makes them, wherever the scene stands.
    #[test]
    fn from_a_common_origin(
        points in proptest::collection::vec(point(-1.0f64..1.0), 3..200),
        eye in point(-3.0f64..3.0),
        to in point(-1.0f64..1.0),
        spread in prop_oneof![Just(0.0), Just(1e-9), Just(0.05), Just(1.0)],
        offset in prop_oneof![Just(0.0), Just(1e3), Just(1e6), Just(1e15)],
    ) {
        let moved = |p: [f64; 3]| p.map(|x| f64::from((x + offset) as f32));
        let soup = single(&points[..points.len() / 3 * 3].iter().map(|p| moved(*p)).collect::<Vec<_>>());
        let rays: Vec<_> = (0..64)
            .map(|i| {
                let (x, y) = ((i % 8) as f64 / 8.0, (i / 8) as f64 / 8.0);
                let target = [to[0] + spread * x, to[1] + spread * y, to[2] - spread * x * y];
                Ray::new(moved(eye), std::array::from_fn(|axis| target[axis] - eye[axis]))
            })
            .collect();
        agree(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 8, &rays);
        repeat(&Triangles::new(Vertices::F32(&soup), None).unwrap(), 8, &rays);
    }
}

/// A surface of hills, and rays of 8 x 8 pixels at all of it, past its edge and at its vertices.
#[test]
fn a_surface_and_its_silhouette() {
    // As many as the emulated processor of `make test-neon` traces in a second.
    let every = if std::env::var_os("PROPTEST_CASES").is_some() { 7 } else { 1 };
    const SIDE: usize = 24;
    let height = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32 * 0.013;
    let vertex = |x: usize, y: usize| [x as f32 * 0.1, y as f32 * 0.1, height(x, y)];
    let mut soup = Vec::new();
    for (x, y) in (0..SIDE - 1).flat_map(|x| (0..SIDE - 1).map(move |y| (x, y))) {
        let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
        soup.extend([a, b, c, b, d, c]);
    }
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let mut rays = Vec::new();
    for eye in [[1.13, 0.77, 4.1], [-1.0, 1.1, 0.05], [0.3, 11.9, 1.7]] {
        for tile in (0..36).step_by(every) {
            for pixel in 0..64 {
                let (x, y) = (tile % 6 * 8 + pixel % 8, tile / 6 * 8 + pixel / 8);
                let target = [f64::from(x - 8) * 0.0725, f64::from(y - 8) * 0.0725, 0.05];
                rays.push(Ray::new(eye, std::array::from_fn(|i| target[i] - eye[i])));
            }
        }
        for corner in soup[..640].iter().step_by(every) {
            rays.push(Ray::new(eye, std::array::from_fn(|i| f64::from(corner[i]) - eye[i])));
        }
    }
    assert!(agree(&triangles, 8, &rays) > if every == 1 { 3000 } else { 200 });
    assert!(repeat(&triangles, 8, &rays) > if every == 1 { 3000 } else { 200 });
}

/// Rays that no answer can be given for, and ends that leave nothing, among others.
#[test]
fn inactive_rays_change_nothing() {
    let soup = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let down = Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
    let nan = f64::NAN;
    let odd = [
        Ray { origin: [nan, 0.0, 0.0], ..down },
        Ray { direction: [0.0; 3], ..down },
        Ray { direction: [-0.0; 3], ..down },
        Ray { t_max: 0.5, ..down },
        Ray { t_max: 1.0, ..down },
        Ray { t_min: 1.0, ..down },
        Ray { t_min: 2.0, ..down },
        Ray { t_min: 2.0, t_max: 0.5, ..down },
        Ray { t_max: nan, ..down },
        Ray { t_max: -1.0, ..down },
        Ray { t_min: f64::NEG_INFINITY, ..down },
        Ray { t_min: f64::INFINITY, ..down },
        Ray { t_min: 1e300, ..down },
        Ray { direction: [0.0, 0.0, -1e300], ..down },
        Ray { direction: [0.0, 0.0, -1e-300], ..down },
        Ray { origin: [1e300, 0.25, 1.0], ..down },
        Ray { direction: [-0.0, 1e-44, -1.0], ..down },
        down,
    ];
    let mut rays = Vec::new();
    for shift in 0..odd.len() {
        rays.extend(odd[shift..].iter().chain(&odd[..shift]).copied());
    }
    assert_eq!(agree(&triangles, 8, &rays), 7 * odd.len());
}
