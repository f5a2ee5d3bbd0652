//! The construction: one tree whatever the strategy and the number of threads, of a depth that is bounded.

use bih_core::build::{Heuristic, Layout, Precision, Structure};
use bih_core::tree::{self, Kind, MAX_DEPTH};
use bih_core::{BuildOptions, Control, Error, Tree, Triangles, Vertices, build};

const HEURISTICS: [Heuristic; 3] = [Heuristic::Global, Heuristic::Local, Heuristic::Sah];

fn grow(triangles: &Triangles, options: BuildOptions) -> Tree {
    let tree = build(triangles, &options, &Control::default()).unwrap();
    tree::validate(&tree, triangles).unwrap();
    assert!(tree.stats().tree_bytes <= tree.stats().bound_bytes, "{:?}", tree.stats());
    assert!(tree.stats().peak_build_bytes >= tree.stats().tree_bytes, "{:?}", tree.stats());
    tree
}

/// The same numbers on every machine.
fn random(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

/// Small triangles anywhere; every hundredth without area, every thousandth with a coordinate that is not finite.
fn soup(count: usize) -> Vec<[f32; 3]> {
    let mut random = random(1);
    let mut vertices = Vec::new();
    for row in 0..count {
        let centre: [f32; 3] = std::array::from_fn(|_| random());
        let mut corners: [[f32; 3]; 3] = std::array::from_fn(|_| centre.map(|x| x + 0.05 * random()));
        if row % 100 == 7 {
            corners[1] = corners[0];
        }
        if row % 1000 == 500 {
            corners[2][row % 3] = f32::INFINITY;
        }
        vertices.extend(corners);
    }
    vertices
}

fn same(a: &Tree, b: &Tree) {
    assert!(a.nodes() == b.nodes() && a.order() == b.order() && a.wide() == b.wide() && a.bounds() == b.bounds());
}

#[test]
fn one_tree_for_any_number_of_threads_and_with_or_without_bucket_sort() {
    let vertices = soup(60_000);
    let doubles: Vec<[f64; 3]> = vertices.iter().map(|v| v.map(|x| f64::from(x) + 1.0 / 3.0)).collect();
    for vertices in [Vertices::F32(&vertices), Vertices::F64(&doubles)] {
        let triangles = Triangles::new(vertices, None).unwrap();
        for heuristic in HEURISTICS {
            for layout in [Layout::Classic, Layout::Wide] {
                let mut first: Option<Tree> = None;
                for threads in [1, 2, 5] {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    for presort in [Some(false), Some(true), None] {
                        let options = BuildOptions { layout, heuristic, presort, ..Default::default() };
                        let tree = pool.install(|| grow(&triangles, options));
                        assert_eq!(tree.stats().rejected, 660);
                        match &first {
                            Some(first) => same(first, &tree),
                            None => first = Some(tree),
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn an_indexed_mesh_and_its_soup_make_one_tree() {
    let vertices = soup(5000);
    let rows: Vec<[u32; 3]> = (0..5000).map(|row| [3 * row, 3 * row + 1, 3 * row + 2]).collect();
    for heuristic in HEURISTICS {
        let options = BuildOptions { layout: Layout::Wide, heuristic, ..Default::default() };
        let indexed = grow(&Triangles::new(Vertices::F32(&vertices), Some(&rows)).unwrap(), options);
        same(&indexed, &grow(&Triangles::new(Vertices::F32(&vertices), None).unwrap(), options));
    }
}

/// The slides' example: a box of 18 x 10 x 10 is cut at x = 9, then y = 5, then z = 5.
#[test]
fn the_slides_box_is_cut_at_nine_then_five_then_five() {
    let mut vertices: Vec<[f32; 3]> = Vec::new();
    // In each corner of each of the eight cells, and just beside the planes.
    for x in [0.0, 8.9, 9.0, 17.9] {
        for y in [0.0, 4.9, 5.0, 9.9] {
            for z in [0.0, 4.9, 5.0, 9.9] {
                vertices.extend([[x, y, z], [x + 0.1, y, z + 0.1], [x, y + 0.1, z + 0.1]]);
            }
        }
    }
    let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
    for presort in [Some(false), Some(true)] {
        let tree = grow(&triangles, BuildOptions { leaf_size: Some(1), presort, ..Default::default() });
        assert_eq!(tree.bounds().upper, [18.0, 10.0, 10.0]);
        let planes = [9.0, 5.0, 5.0];
        let mut level = vec![0];
        for (axis, plane) in planes.into_iter().enumerate() {
            let mut next = Vec::new();
            for node in level {
                let Kind::Inner { axis: found, left, clip } = tree.nodes()[node].kind() else { panic!("a leaf") };
                assert_eq!(found, axis);
                assert_eq!(clip, [plane, plane]);
                next.extend([left, left + 1]);
            }
            level = next;
        }
        assert_eq!(level.len(), 8);
        for node in level {
            assert!(matches!(tree.nodes()[node].kind(), Kind::Inner { axis: 0, .. }));
        }
    }
}

#[test]
fn coincident_centres_are_halved_by_row_where_the_objects_are_longest() {
    // All about the origin, longest along y, in descending size.
    let vertices: Vec<[f32; 3]> = (0..64)
        .flat_map(|row| {
            let size = (64 - row) as f32;
            [[-size, -2.0 * size, 0.0], [size, 2.0 * size, 0.0], [0.0, 0.0, 0.0]].map(|v| [v[0], v[1], v[2]])
        })
        .enumerate()
        .map(|(i, v)| if i % 3 == 2 { [0.5, 0.25, 0.0] } else { v })
        .collect();
    let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
    for heuristic in HEURISTICS {
        let tree = grow(&triangles, BuildOptions { leaf_size: Some(1), heuristic, ..Default::default() });
        let expected: Vec<u32> = (0..64).collect();
        assert_eq!(tree.order(), expected);
        assert_eq!(tree.stats().depth, 6);
        assert!(tree.nodes().iter().all(|node| !matches!(node.kind(), Kind::Inner { axis: 0 | 2, .. })));
    }
}

/// Centres that halve their way to the origin, and many in one place at the end.
#[test]
fn no_tree_is_deeper_than_its_bound() {
    let mut vertices: Vec<[f32; 3]> = Vec::new();
    for exponent in 0..148 {
        let size = 2f32.powi(-exponent);
        vertices.extend([[size, size, size], [1.5 * size, size, size], [size, 1.5 * size, size]]);
    }
    for _ in 0..100_000 {
        vertices.extend([[1e-45, 0.0, 0.0], [0.0, 1e-45, 0.0], [0.0, 0.0, 1e-45]]);
    }
    let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
    for heuristic in HEURISTICS {
        for layout in [Layout::Classic, Layout::Wide] {
            let tree = grow(&triangles, BuildOptions { leaf_size: Some(1), heuristic, layout, ..Default::default() });
            assert!(tree.stats().depth <= MAX_DEPTH as usize, "{heuristic:?} {}", tree.stats().depth);
        }
    }
}

#[test]
fn no_triangle_no_node() {
    let nan = [[f32::NAN; 3]; 3];
    for vertices in [&[][..], &nan[..]] {
        let triangles = Triangles::new(Vertices::F32(vertices), None).unwrap();
        for heuristic in HEURISTICS {
            for layout in [Layout::Classic, Layout::Wide] {
                let tree = grow(&triangles, BuildOptions { layout, heuristic, ..Default::default() });
                assert_eq!((tree.stats().nodes, tree.stats().leaves, tree.stats().depth), (0, 0, 0));
                assert_eq!(tree.order().len(), vertices.len() / 3);
            }
        }
    }
}

#[test]
fn coordinates_beyond_float32_are_built_over() {
    let far = [1e300, -1e300, 3e-320, f64::MAX, f64::MIN, 0.0];
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for (i, x) in far.into_iter().enumerate() {
        for (j, y) in far.into_iter().enumerate() {
            vertices.extend([[x, y, 0.0], [y, x, i as f64], [j as f64, y, x]]);
        }
    }
    let triangles = Triangles::new(Vertices::F64(&vertices), None).unwrap();
    for heuristic in HEURISTICS {
        for layout in [Layout::Classic, Layout::Wide] {
            grow(&triangles, BuildOptions { layout, heuristic, leaf_size: Some(1), ..Default::default() });
        }
    }
}

/// In single precision the leaves of a mesh of doubles hold its vertices rounded.
#[test]
fn rows_are_there_where_they_are_traced() {
    let vertices: Vec<[f64; 3]> = soup(500).iter().map(|v| v.map(|x| f64::from(x) / 3.0)).collect();
    let triangles = Triangles::new(Vertices::F64(&vertices), None).unwrap();
    for (precision, numbers) in [(Precision::Watertight, 0), (Precision::Fast, 9 * 495 + 8)] {
        let tree = grow(&triangles, BuildOptions { layout: Layout::Wide, precision, ..Default::default() });
        assert_eq!(tree.wide().unwrap().rows.len(), numbers);
    }
}

#[test]
fn a_bvh_is_one_for_any_number_of_threads_and_refers_to_each_triangle_once() {
    let vertices = soup(20_000);
    let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
    for layout in [Layout::Wide, Layout::Compact] {
        let options = BuildOptions { layout, ..BuildOptions::of(Structure::Bvh) };
        let one = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| grow(&triangles, options))
        };
        let tree = one(1);
        assert_eq!((tree.structure(), tree.stats().references), (Structure::Bvh, 20_000 - 220));
        same(&tree, &one(2));
        same(&tree, &one(5));
    }
}

#[test]
fn a_kd_tree_behind_the_same_tree_says_how_often_it_refers_to_triangles() {
    let vertices = soup(5000);
    let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
    let tree = build(&triangles, &BuildOptions::of(Structure::KdTree), &Control::default()).unwrap();
    tree::validate(&tree, &triangles).unwrap();
    let stats = tree.stats();
    assert!(stats.references > 4945 && stats.references == tree.references().len(), "{stats:?}");
    assert_eq!(tree.order().len(), stats.references + 55);
    assert_eq!((stats.rejected, stats.bound_bytes), (55, 0));
}

#[test]
fn options_that_do_not_go_together_are_refused() {
    let triangles = Triangles::new(Vertices::F32(&[]), None).unwrap();
    let of = BuildOptions::of;
    for options in [
        BuildOptions { layout: Layout::Wide, ..of(Structure::KdTree) },
        BuildOptions { leaf_size: Some(4), ..of(Structure::KdTree) },
        BuildOptions { heuristic: Heuristic::Global, ..of(Structure::KdTree) },
        BuildOptions { layout: Layout::Classic, ..of(Structure::Bvh) },
        BuildOptions { heuristic: Heuristic::Local, ..of(Structure::Bvh) },
        BuildOptions { presort: Some(true), ..of(Structure::Bvh) },
    ] {
        let refused = build(&triangles, &options, &Control::default()).unwrap_err();
        assert!(matches!(refused, Error::Incompatible { .. }), "{options:?} {refused:?}");
    }
}
