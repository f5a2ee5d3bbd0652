//! Trees that are built when rays come to them: the same answers as of trees that are built at once.

use std::sync::Barrier;

use bih_core::build::{Build, Heuristic, Layout, Precision};
use bih_core::traverse::{Hits, Limits, RayBatch, Vectors};
use bih_core::tree::{node_table, validate};
use bih_core::{BuildOptions, Control, Tree, Triangles, Vertices, build};

fn random(mut state: u64) -> impl FnMut() -> f32 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

/// Small triangles anywhere, a heap of them at one place, and some that no ray can hit.
fn soup(count: usize) -> Vec<[f32; 3]> {
    let mut random = random(1);
    let mut vertices = Vec::new();
    for row in 0..count {
        let size = if row % 3 == 0 { 1e-6 } else { 1.0 };
        let centre: [f32; 3] = std::array::from_fn(|_| size * random());
        let mut corners: [[f32; 3]; 3] = std::array::from_fn(|_| centre.map(|x| x + size * 0.05 * random()));
        if row % 100 == 7 {
            corners[1] = corners[0];
        }
        vertices.extend(corners);
    }
    vertices
}

/// From the heap and from all around, through the unit cube.
fn rays(count: usize) -> [Vec<[f64; 3]>; 2] {
    let mut random = random(7);
    let mut point = |size: f32| std::array::from_fn(|_| f64::from(size * random()));
    let origins =
        (0..count).map(|i| if i % 4 == 0 { point(1e-6) } else { point(1.0).map(|x| 3.0 * x - 1.0) }).collect();
    let directions = (0..count).map(|_| point(1.0).map(|x| x - 0.4)).collect();
    [origins, directions]
}

struct Fixture {
    vertices: Vec<[f32; 3]>,
    rays: [Vec<[f64; 3]>; 2],
}

impl Fixture {
    fn new(triangles: usize, count: usize) -> Self {
        Self { vertices: soup(triangles), rays: rays(count) }
    }

    fn triangles(&self) -> Triangles<'_> {
        Triangles::new(Vertices::F32(&self.vertices), None).unwrap()
    }

    fn batch(&self) -> RayBatch<'_> {
        let [origins, directions] = &self.rays;
        let (origins, directions) = (Vectors::F64(origins), Vectors::F64(directions));
        RayBatch { origins, directions, t_min: Limits::All(0.0), t_max: Limits::All(f64::INFINITY) }
    }

    fn tree(&self, options: BuildOptions) -> Tree {
        build(&self.triangles(), &options, &Control::default()).unwrap()
    }

    fn hits(&self, tree: &Tree) -> Hits<f64> {
        self.batch().closest(tree, &self.triangles(), &Control::default()).unwrap()
    }

    fn hidden(&self, tree: &Tree) -> Vec<bool> {
        self.batch().occluded(tree, &self.triangles(), &Control::default()).unwrap()
    }
}

const LAYOUTS: [Layout; 3] = [Layout::Classic, Layout::Wide, Layout::Compact];
const HEURISTICS: [Heuristic; 3] = [Heuristic::Global, Heuristic::Local, Heuristic::Sah];
const PRECISIONS: [Precision; 3] = [Precision::Watertight, Precision::Exact, Precision::Fast];

fn each(count: usize, mut check: impl FnMut(&Fixture, BuildOptions)) {
    let fixture = Fixture::new(count, if cfg!(miri) { 20 } else { 2000 });
    for layout in LAYOUTS {
        for heuristic in HEURISTICS {
            for precision in PRECISIONS {
                let options = BuildOptions { layout, heuristic, precision, ..Default::default() };
                check(&fixture, options);
            }
        }
    }
}

/// Sizes of a mesh that has pieces, and the most triangles of one.
const SOME: usize = if cfg!(miri) { 60 } else { 12_000 };
const PIECE: usize = if cfg!(miri) { 16 } else { 500 };

#[test]
fn answers_are_those_of_the_eager_tree_while_it_grows() {
    each(SOME, |fixture, options| {
        let triangles = fixture.triangles();
        let control = Control::default();
        let eager = fixture.tree(BuildOptions { piece: Some(PIECE), ..options });
        let lazy = fixture.tree(BuildOptions { build: Build::OnDemand, piece: Some(PIECE), ..options });
        let nothing = lazy.stats();
        assert!(nothing.unbuilt > SOME / PIECE && nothing.leaves == 0, "{nothing:?}");
        validate(&lazy, &triangles).unwrap();
        assert_eq!(fixture.hits(&lazy), fixture.hits(&eager), "{options:?}");
        validate(&lazy, &triangles).unwrap();
        let some = lazy.stats();
        assert!(some.unbuilt < nothing.unbuilt && some.leaves > 0, "{some:?}");
        assert!(some.tree_bytes <= some.bound_bytes && some.peak_build_bytes >= some.tree_bytes, "{some:?}");
        assert_eq!(fixture.hidden(&lazy), fixture.hidden(&eager), "{options:?}");
        let counts = |tree: &Tree| fixture.batch().cost(tree, &triangles, &control).unwrap();
        assert_eq!(counts(&lazy), counts(&eager), "{options:?}");

        lazy.build_all(&triangles, &control).unwrap();
        validate(&lazy, &triangles).unwrap();
        let (all, expected) = (lazy.stats(), eager.stats());
        assert_eq!(
            (all.unbuilt, all.nodes, all.leaves, all.depth),
            (0, expected.nodes, expected.leaves, expected.depth)
        );
        assert!(all.tree_bytes <= all.bound_bytes, "{all:?}");
        assert_eq!(lazy.order(), eager.order(), "{options:?}");
        assert_eq!(fixture.hits(&lazy), fixture.hits(&eager), "{options:?}");
    });
}

#[test]
fn the_size_of_pieces_does_not_matter() {
    let fixture = Fixture::new(SOME, 2000);
    for layout in LAYOUTS {
        let eager = fixture.tree(BuildOptions { layout, ..Default::default() });
        for piece in [1, 9, 100, 10_000] {
            let lazy =
                fixture.tree(BuildOptions { layout, build: Build::OnDemand, piece: Some(piece), ..Default::default() });
            assert_eq!(fixture.hits(&lazy), fixture.hits(&eager), "{layout:?} {piece}");
            assert_eq!(fixture.hidden(&lazy), fixture.hidden(&eager), "{layout:?} {piece}");
            let stats = lazy.stats();
            assert!(stats.tree_bytes <= stats.bound_bytes, "{stats:?}");
        }
    }
}

#[test]
fn many_threads_from_the_first_ray() {
    const THREADS: usize = if cfg!(miri) { 4 } else { 64 };
    each(SOME, |fixture, options| {
        let eager = fixture.tree(options);
        let expected = (fixture.hits(&eager), fixture.hidden(&eager));
        let lazy = fixture.tree(BuildOptions { build: Build::OnDemand, piece: Some(PIECE), ..options });
        let before = lazy.stats().unbuilt;
        let start = Barrier::new(THREADS);
        std::thread::scope(|scope| {
            for thread in 0..THREADS {
                let (start, lazy, expected) = (&start, &lazy, &expected);
                scope.spawn(move || {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
                    start.wait();
                    pool.install(|| match thread % 8 {
                        7 => validate(lazy, &fixture.triangles()).unwrap(),
                        6 => assert_eq!(lazy.order().len(), SOME),
                        0..3 => assert_eq!(fixture.hits(lazy), expected.0, "{options:?}"),
                        _ => assert_eq!(fixture.hidden(lazy), expected.1, "{options:?}"),
                    });
                });
            }
        });
        // A piece that was built twice would be counted twice, and its records too.
        lazy.build_all(&fixture.triangles(), &Control::default()).unwrap();
        let stats = lazy.stats();
        let eager = fixture.tree(BuildOptions { piece: Some(PIECE), ..options }).stats();
        assert!(before > 0 && stats.unbuilt == 0);
        assert_eq!((stats.nodes, stats.leaves), (eager.nodes, eager.leaves));
    });
}

#[test]
fn the_table_shows_what_is_unbuilt() {
    let fixture = Fixture::new(SOME, 3);
    let triangles = fixture.triangles();
    for layout in LAYOUTS {
        let options = BuildOptions { layout, piece: Some(PIECE), ..Default::default() };
        let lazy = fixture.tree(BuildOptions { build: Build::OnDemand, ..options });
        let rows = |tree| node_table(tree, &triangles, u32::MAX, usize::MAX, &Control::default()).unwrap();
        fixture.hits(&lazy);
        let table = rows(&lazy);
        let unbuilt: Vec<_> = table.iter().filter(|row| row.kind == 2).collect();
        assert_eq!(unbuilt.len(), lazy.stats().unbuilt);
        assert!(unbuilt.iter().all(|row| { row.count } as usize <= PIECE && row.axis == -1));
        assert_eq!(table.iter().filter(|row| row.kind == 1).count(), lazy.stats().leaves);
        lazy.build_all(&triangles, &Control::default()).unwrap();
        assert_eq!(bytemuck::cast_slice::<_, u8>(&rows(&lazy)), bytemuck::cast_slice(&rows(&fixture.tree(options))));
    }
}

#[test]
fn a_cancelled_build_all_leaves_a_usable_tree() {
    let fixture = Fixture::new(SOME, 100);
    let triangles = fixture.triangles();
    let lazy = fixture.tree(BuildOptions { build: Build::OnDemand, piece: Some(PIECE), ..Default::default() });
    let control = Control::default();
    control.cancel();
    assert!(lazy.build_all(&triangles, &control).is_err());
    assert!(fixture.batch().closest::<f64>(&lazy, &triangles, &control).is_err());
    assert_eq!(fixture.hits(&lazy), fixture.hits(&fixture.tree(BuildOptions::default())));
    validate(&lazy, &triangles).unwrap();
}

#[test]
fn a_mesh_of_one_piece_is_finished_at_once() {
    let fixture = Fixture::new(20, 100);
    let lazy = fixture.tree(BuildOptions { build: Build::OnDemand, ..Default::default() });
    let stats = lazy.stats();
    assert_eq!((stats.unbuilt, stats.left_out.last().unwrap().0.as_str()), (0, "unbuilt nodes"));
    assert_eq!(fixture.hits(&lazy), fixture.hits(&fixture.tree(BuildOptions::default())));
}
