//! Small trees of every size, so that whole vectors are read at the end of every array: for AddressSanitizer and Miri,
//! which see what is read (`make test-memory`). Rays in general position, because exact decisions take minutes in Miri.

use std::sync::Barrier;

use bih_core::build::{Build, Layout, Precision};
use bih_core::saved::{self, Bytes, Saved};
use bih_core::simd::instruction_sets;
use bih_core::traverse::{Hits, Limits, RayBatch, Stack, Tracer, Vectors, Way, naive_closest};
use bih_core::tree::validate;
use bih_core::{BuildOptions, Control, Ray, Triangles, Vertices, build};

/// Triangles of about the same size in a row along a diagonal, and for each of them a ray through its inside.
fn row_of(count: usize) -> (Vec<[f32; 3]>, Vec<Ray>) {
    let (mut soup, mut rays) = (Vec::new(), Vec::new());
    for row in 0..count {
        let at = |offset: [f64; 3]| offset.map(|x| x + row as f64 * 1.37);
        let corners = [at([0.11, 0.23, 0.05]), at([1.03, 0.17, 0.31]), at([0.29, 1.13, 0.43])];
        let inside: [f64; 3] =
            std::array::from_fn(|i| (corners[0][i] + 2.0 * corners[1][i] + 3.0 * corners[2][i]) / 6.0);
        let direction = [0.31, -0.27 + row as f64 * 0.01, 1.9];
        rays.push(Ray::new(std::array::from_fn(|i| inside[i] - 2.1 * direction[i]), direction));
        soup.extend(corners.map(|corner| corner.map(|x| x as f32)));
    }
    (soup, rays)
}

fn trace(tracer: &Tracer, rays: &[Ray]) {
    let mut stack = Stack::default();
    let (mut hits, mut hidden) = (vec![None; rays.len()], vec![false; rays.len()]);
    // Packets take Miri twenty times as long; they go through the trees that are built on demand.
    let ways: &[Way] = if cfg!(miri) { &[Way::InFlight] } else { &[Way::Alone, Way::InFlight, Way::Packets] };
    for &way in ways {
        tracer.closest(rays, way, &mut stack, &mut hits);
        tracer.occluded(rays, way, &mut stack, &mut hidden);
        for ((ray, found), is_hidden) in rays.iter().zip(&hits).zip(&hidden) {
            assert!(found.is_some() && *is_hidden);
            assert_eq!(*found, naive_closest(tracer.tree, tracer.triangles, ray));
        }
    }
}

#[test]
fn nothing_is_read_behind_the_last_leaf() {
    let sizes = if cfg!(miri) { vec![9] } else { (1..=40).collect() };
    for count in sizes {
        let (soup, mut rays) = row_of(count);
        if cfg!(miri) {
            rays.drain(..count - 1);
        }
        let double: Vec<_> = soup.iter().map(|corner| corner.map(f64::from)).collect();
        let origins: Vec<_> = rays.iter().map(|ray| ray.origin).collect();
        let directions: Vec<_> = rays.iter().map(|ray| ray.direction).collect();
        let (t_min, t_max) = (Limits::All(0.0), Limits::All(f64::INFINITY));
        let batch = RayBatch { origins: Vectors::F64(&origins), directions: Vectors::F64(&directions), t_min, t_max };
        for vertices in [Vertices::F32(&soup), Vertices::F64(&double)].into_iter().take(if cfg!(miri) { 1 } else { 2 })
        {
            let triangles = Triangles::new(vertices, None).unwrap();
            for layout in [Layout::Classic, Layout::Wide, Layout::Compact] {
                let options = BuildOptions { layout, ..Default::default() };
                let control = Control::default();
                let tree = build(&triangles, &options, &control).unwrap();
                for set in instruction_sets() {
                    trace(&Tracer { tree: &tree, triangles: &triangles, set: *set }, &rays);
                }
                let hits: Hits<f32> = batch.closest(&tree, &triangles, &control).unwrap();
                assert!(hits.triangle.iter().all(|&row| row >= 0));
                assert!(batch.occluded(&tree, &triangles, &control).unwrap().iter().all(|&is_hit| is_hit));
            }
        }
    }
}

/// A tree that stands in the bytes of a file, read into memory: Miri knows no files that are mapped.
#[test]
fn a_tree_is_read_where_it_lies() {
    let (soup, rays) = row_of(9);
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    for layout in [Layout::Compact, Layout::Wide, Layout::Classic].into_iter().take(if cfg!(miri) { 1 } else { 3 }) {
        let options = BuildOptions { layout, ..Default::default() };
        let tree = build(&triangles, &options, &Control::default()).unwrap();
        let mut file = Vec::new();
        saved::write(&tree, &triangles, &mut file).unwrap();
        let bytes = Bytes::read(&mut &file[..], file.len()).unwrap();
        let Saved { tree, mesh } = saved::parse(bytes, "a file").unwrap();
        trace(&Tracer::new(&tree, &mesh.triangles()), &rays[8..]);
    }
}

/// Pieces side by side in the arrays, and copies of leaves, built by some threads while others read their neighbours, from
/// different ends.
#[test]
fn nothing_is_read_that_is_in_the_making() {
    const WAYS: [Way; 3] = [Way::Alone, Way::InFlight, Way::Packets];
    let (soup, rays) = row_of(36);
    let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
    let rays: Vec<_> = rays.into_iter().step_by(if cfg!(miri) { 12 } else { 1 }).collect();
    for layout in [Layout::Compact, Layout::Wide, Layout::Classic].into_iter().take(if cfg!(miri) { 1 } else { 3 }) {
        for precision in [Precision::Watertight, Precision::Fast].into_iter().take(if cfg!(miri) { 1 } else { 2 }) {
            let options =
                BuildOptions { layout, precision, build: Build::OnDemand, piece: Some(9), ..Default::default() };
            let tree = build(&triangles, &options, &Control::default()).unwrap();
            assert!(tree.stats().unbuilt >= 4, "{:?}", tree.stats());
            let start = Barrier::new(WAYS.len());
            std::thread::scope(|scope| {
                for (thread, way) in WAYS.into_iter().enumerate() {
                    let (tree, triangles, start, mut rays) = (&tree, &triangles, &start, rays.clone());
                    scope.spawn(move || {
                        let third = rays.len() / WAYS.len();
                        rays.rotate_left(third * thread);
                        let mut hits = vec![None; rays.len()];
                        start.wait();
                        for _ in 0..2 {
                            Tracer::new(tree, triangles).closest(&rays, way, &mut Stack::default(), &mut hits);
                            assert!(hits.iter().all(Option::is_some), "{layout:?} {way:?}");
                        }
                    });
                }
            });
            validate(&tree, &triangles).unwrap();
            tree.build_all(&triangles, &Control::default()).unwrap();
            assert_eq!(tree.stats().unbuilt, 0);
            validate(&tree, &triangles).unwrap();
        }
    }
}
