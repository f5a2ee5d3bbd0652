//! Meshes and rays: every structure and layout, in every way and instruction set, against the naive intersector.

use bih_core::build::{Build, Heuristic, Layout, Precision, Structure};
use bih_core::saved::{Bytes, parse, write};
use bih_core::simd::instruction_sets;
use bih_core::traverse::{Hit, Stack, Tracer, Way, naive_closest, naive_occluded};
use bih_core::{BuildOptions, Control, Ray, Tree, Triangles, Vertices, build, tree};

use super::numbers::Numbers;

const WAYS: [Way; 4] = [Way::Alone, Way::InFlight, Way::Packets, Way::TwoByTwo];
const MOST_VERTICES: usize = 60;
/// More than a packet.
const MOST_RAYS: usize = 80;

/// The bytes are a mesh and rays, for one in `share` of all trees, which the bytes choose: most of what finds new bytes
/// is quick then.
pub fn queries(data: &[u8], share: usize) {
    let mut numbers = Numbers(data);
    let chosen = data.iter().fold(0usize, |sum, &byte| sum + usize::from(byte));
    let form = numbers.byte();
    let (is_double, is_indexed, has_limits) = (form & 1 != 0, form & 2 != 0, form & 4 != 0);
    let leaf_size = 1 + usize::from(form >> 3) % 8;
    let count = 3 + 3 * (usize::from(numbers.byte()) % (MOST_VERTICES / 3));
    let double: Vec<[f64; 3]> = (0..count).map(|_| numbers.point()).collect();
    let single: Vec<[f32; 3]> = double.iter().map(|point| point.map(|x| x as f32)).collect();
    let triangles = usize::from(numbers.byte()) % 64;
    let rows: Vec<[u32; 3]> = if is_indexed {
        (0..triangles).map(|_| std::array::from_fn(|_| u32::from(numbers.byte()) % count as u32)).collect()
    } else {
        Vec::new()
    };
    let vertices = if is_double { Vertices::F64(&double) } else { Vertices::F32(&single) };
    let triangles = Triangles::new(vertices, is_indexed.then_some(&rows[..])).expect("rows of vertices that are there");
    let rays = rays(&mut numbers, &triangles, has_limits);
    // What is true depends on the precision alone.
    let mut truths: [Option<Vec<Option<Hit>>>; 2] = [None, None];
    let all = all_options(leaf_size).into_iter().enumerate();
    for (_, options) in all.filter(|(tree, _)| (tree + chosen).is_multiple_of(share)) {
        let tree = build(&triangles, &options, &Control::default()).expect("a tree over any mesh");
        let place =
            [Precision::Watertight, Precision::Exact].iter().position(|&precision| precision == options.precision);
        let truth = place.map(|place| &*truths[place].get_or_insert_with(|| naive(&tree, &triangles, &rays)));
        let truth = truth.map(Vec::as_slice);
        agree(&tree, &triangles, &rays, truth);
        tree::validate(&tree, &triangles).expect("a tree that keeps its rules");
        if options.build == Build::Eager {
            let mut file = Vec::new();
            write(&tree, &triangles, &mut file).expect("memory takes all");
            let loaded = parse(Bytes::read(&mut &file[..], file.len()).expect("as long"), "a file")
                .expect("a file that was written");
            agree(&loaded.tree, &loaded.mesh.triangles(), &rays, truth);
        }
    }
}

fn rays(numbers: &mut Numbers, triangles: &Triangles, has_limits: bool) -> Vec<Ray> {
    let mut rays = Vec::new();
    while !numbers.is_empty() && rays.len() < MOST_RAYS {
        let way = numbers.byte();
        let origin = numbers.point();
        let mut direction = numbers.point();
        if way & 1 != 0 && !triangles.is_empty() {
            // At a vertex, or at the middle of an edge.
            let [a, b, _] = triangles.corners(u32::from(way >> 2) % triangles.len() as u32);
            let target = |axis: usize| if way & 2 != 0 { a[axis] } else { (a[axis] + b[axis]) / 2.0 };
            direction = std::array::from_fn(|axis| target(axis) - origin[axis]);
        }
        let mut ray = Ray::new(origin, direction);
        if has_limits {
            [ray.t_min, ray.t_max] = [numbers.coordinate(), numbers.coordinate()];
        }
        rays.push(ray);
    }
    rays
}

fn all_options(leaf_size: usize) -> Vec<BuildOptions> {
    let leaf_size = Some(leaf_size);
    let of = |structure| BuildOptions { leaf_size, ..BuildOptions::of(structure) };
    let mut all = Vec::new();
    for precision in [Precision::Watertight, Precision::Fast] {
        for (layout, heuristic) in [
            (Layout::Classic, Heuristic::Global),
            (Layout::Wide, Heuristic::Global),
            (Layout::Compact, Heuristic::Local),
            (Layout::Wide, Heuristic::Sah),
        ] {
            all.push(BuildOptions { layout, heuristic, precision, ..of(Structure::Bih) });
        }
        let on_demand = BuildOptions { build: Build::OnDemand, piece: Some(4), precision, ..of(Structure::Bih) };
        all.extend([Layout::Classic, Layout::Wide].map(|layout| BuildOptions { layout, ..on_demand }));
        all.push(BuildOptions { precision, ..of(Structure::Bvh) });
        all.push(BuildOptions { precision, ..BuildOptions::of(Structure::KdTree) });
    }
    let exact = |options| BuildOptions { precision: Precision::Exact, ..options };
    all.extend([of(Structure::Bih), of(Structure::Bvh), BuildOptions::of(Structure::KdTree)].map(exact));
    all
}

/// What the naive intersector finds.
pub fn naive(tree: &Tree, triangles: &Triangles, rays: &[Ray]) -> Vec<Option<Hit>> {
    let hit = |ray: &Ray| {
        let hit = naive_closest(tree, triangles, ray);
        assert_eq!(naive_occluded(tree, triangles, ray), hit.is_some(), "{ray:?}");
        hit
    };
    rays.iter().map(|ray| if ray.is_valid() { hit(ray) } else { None }).collect()
}

/// All ways give one answer, and the true one where it is known.
pub fn agree(tree: &Tree, triangles: &Triangles, rays: &[Ray], truth: Option<&[Option<Hit>]>) {
    let mut stack = Stack::default();
    let mut expected = truth.map(<[_]>::to_vec);
    for &set in instruction_sets() {
        let tracer = Tracer { tree, triangles, set };
        for way in WAYS {
            let (mut hits, mut hidden) = (vec![None; rays.len()], vec![false; rays.len()]);
            tracer.closest(rays, way, &mut stack, &mut hits);
            tracer.occluded(rays, way, &mut stack, &mut hidden);
            let expected = expected.get_or_insert_with(|| hits.clone());
            for (((ray, hit), is_hidden), expected) in rays.iter().zip(&hits).zip(&hidden).zip(expected) {
                assert_eq!(hit, expected, "{set:?} {way:?} {ray:?}");
                assert_eq!(*is_hidden, hit.is_some(), "{set:?} {way:?} {ray:?}");
            }
        }
    }
}
