//! Trees in files: the same answers after, and no file that breaks anything.

use bih_core::build::{Build, Heuristic, Layout, Precision, Structure};
use bih_core::geometry::{Ray, Vertices};
use bih_core::saved::{self, Access, Bytes, Saved};
use bih_core::traverse::{Hit, Stack, Tracer, Way};
use bih_core::{BuildOptions, Control, Error, Tree, Triangles, build};

/// A mesh with rejected rows, and rays at it.
struct Fixture {
    single: Vec<[f32; 3]>,
    double: Vec<[f64; 3]>,
    rows: Vec<[u32; 3]>,
    rays: Vec<Ray>,
}

impl Fixture {
    fn new(count: u32) -> Self {
        let number = |i: u32| f64::from(i.wrapping_mul(0x9e37_79b9) >> 8) / f64::from(1 << 24);
        let mut double: Vec<[f64; 3]> =
            (0..3 * count).map(|i| [number(3 * i), number(3 * i + 1), number(3 * i + 2)]).collect();
        for i in (0..double.len()).step_by(3) {
            let first = double[i];
            for corner in &mut double[i + 1..i + 3] {
                *corner = std::array::from_fn(|axis| first[axis] + 0.1 * (corner[axis] - 0.5));
            }
        }
        if count > 4 {
            double[4] = [f64::NAN; 3];
            double[9] = double[10];
        }
        let rows = (0..count).map(|i| [3 * i + 2, 3 * i, 3 * i + 1]).collect();
        let rays = (0..200).map(|i| {
            let target = [number(7 * i + 1), number(7 * i + 2), number(7 * i + 3)];
            Ray::new([-1.0, 0.4, 0.3], [target[0] + 1.0, target[1] - 0.4, target[2] - 0.3])
        });
        let single = double.iter().map(|corner| corner.map(|x| x as f32)).collect();
        Self { single, double, rows, rays: rays.collect() }
    }

    fn triangles(&self, is_double: bool, is_indexed: bool) -> Triangles<'_> {
        let vertices = if is_double { Vertices::F64(&self.double) } else { Vertices::F32(&self.single) };
        Triangles::new(vertices, is_indexed.then_some(&self.rows[..])).unwrap()
    }

    fn hits(&self, tree: &Tree, triangles: &Triangles) -> Vec<Option<Hit>> {
        let trace = |way| {
            let mut hits = vec![None; self.rays.len()];
            Tracer::new(tree, triangles).closest(&self.rays, way, &mut Stack::default(), &mut hits);
            hits
        };
        [Way::Alone, Way::InFlight, Way::Packets].into_iter().flat_map(trace).collect()
    }
}

fn all_options() -> Vec<BuildOptions> {
    let mut all = Vec::new();
    for precision in [Precision::Fast, Precision::Watertight, Precision::Exact] {
        for layout in [Layout::Classic, Layout::Wide, Layout::Compact] {
            for heuristic in [Heuristic::Global, Heuristic::Local, Heuristic::Sah] {
                let eager = BuildOptions { layout, heuristic, precision, ..Default::default() };
                all.extend([eager, on_demand(eager)]);
            }
        }
        all.push(BuildOptions { precision, ..BuildOptions::of(Structure::KdTree) });
        for layout in [Layout::Wide, Layout::Compact] {
            all.push(BuildOptions { layout, precision, leaf_size: Some(3), ..BuildOptions::of(Structure::Bvh) });
        }
    }
    all
}

/// In small pieces.
fn on_demand(options: BuildOptions) -> BuildOptions {
    BuildOptions { build: Build::OnDemand, piece: Some(16), ..options }
}

fn written(tree: &Tree, triangles: &Triangles) -> Vec<u8> {
    let mut bytes = Vec::new();
    saved::write(tree, triangles, &mut bytes).unwrap();
    bytes
}

fn parsed(bytes: &[u8]) -> Result<Saved, Error> {
    saved::parse(Bytes::read(&mut &bytes[..], bytes.len()).unwrap(), "a file")
}

#[test]
fn a_loaded_tree_answers_with_the_same_bits() {
    let fixture = Fixture::new(if cfg!(miri) { 40 } else { 300 });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tree.bihtree");
    for options in all_options() {
        for (is_double, is_indexed) in [(false, false), (false, true), (true, false), (true, true)] {
            let triangles = fixture.triangles(is_double, is_indexed);
            let tree = build(&triangles, &options, &Control::default()).unwrap();
            saved::save(&tree, &triangles, &path, &Control::default()).unwrap();
            for access in [Access::Map, Access::Read] {
                let Saved { tree: loaded, mesh } = saved::load(&path, access).unwrap();
                let name = format!("{options:?} {is_double} {is_indexed} {access:?}");
                assert_eq!(fixture.hits(&loaded, &mesh.triangles()), fixture.hits(&tree, &triangles), "{name}");
                assert_eq!(mesh.triangles().len(), triangles.len());
                tree.build_all(&triangles, &Control::default()).unwrap();
                if options.build == Build::Eager {
                    assert_eq!(loaded.order(), tree.order(), "{name}");
                    assert_eq!(loaded.stats(), tree.stats(), "{name}");
                }
            }
        }
    }
}

#[test]
fn trees_of_nothing_and_of_one_triangle() {
    for count in [0, 1] {
        let fixture = Fixture::new(count);
        let triangles = fixture.triangles(false, false);
        for options in all_options() {
            let tree = build(&triangles, &options, &Control::default()).unwrap();
            let loaded = parsed(&written(&tree, &triangles)).unwrap();
            assert_eq!(fixture.hits(&loaded.tree, &loaded.mesh.triangles()), fixture.hits(&tree, &triangles));
        }
    }
}

#[test]
fn a_tree_on_demand_is_saved_as_the_eager_one() {
    let fixture = Fixture::new(200);
    let triangles = fixture.triangles(false, true);
    let folder = tempfile::tempdir().unwrap();
    let save = |options: BuildOptions| {
        let tree = build(&triangles, &options, &Control::default()).unwrap();
        let path = folder.path().join("tree");
        saved::save(&tree, &triangles, &path, &Control::default()).unwrap();
        assert_eq!(tree.stats().unbuilt > 0, options.build == Build::OnDemand);
        let mut bytes = std::fs::read(&path).unwrap();
        // Checksum, bytes and seconds of the build.
        bytes[24..28].fill(0);
        bytes[64..80].fill(0);
        bytes
    };
    let eager = BuildOptions { layout: Layout::Wide, ..Default::default() };
    assert!(save(eager) == save(on_demand(eager)));
}

#[test]
fn every_flipped_bit_and_every_cut_is_found() {
    let fixture = Fixture::new(6);
    let triangles = fixture.triangles(false, true);
    for options in [BuildOptions::default(), BuildOptions { layout: Layout::Compact, ..Default::default() }] {
        let tree = build(&triangles, &options, &Control::default()).unwrap();
        let good = written(&tree, &triangles);
        assert!(parsed(&good).is_ok());
        for byte in 0..good.len() {
            for bit in 0..8 {
                let mut bad = good.clone();
                bad[byte] ^= 1 << bit;
                assert!(parsed(&bad).is_err(), "bit {bit} of byte {byte}");
            }
            assert!(parsed(&good[..byte]).is_err(), "cut at {byte}");
        }
        assert!(parsed(&[&good[..], &[0]].concat()).is_err());
    }
}

#[test]
fn a_file_that_cannot_be_written_leaves_nothing() {
    let fixture = Fixture::new(6);
    let triangles = fixture.triangles(false, true);
    let tree = build(&triangles, &BuildOptions::default(), &Control::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let save = |path: &std::path::Path| saved::save(&tree, &triangles, path, &Control::default());
    for path in [folder.path().join("missing/tree"), folder.path().to_path_buf(), "/dev/null".into()] {
        assert!(matches!(save(&path), Err(Error::File { .. })), "{path:?}");
    }
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
    let there = folder.path().join("tree");
    std::fs::write(&there, b"something else").unwrap();
    save(&there).unwrap();
    assert!(saved::load(&there, Access::Map).is_ok());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}
