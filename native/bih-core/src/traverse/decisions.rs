//! How many tests the filters of exact decisions leave over.

use super::scene::{Leaf, Scene, bits};
use super::search::{Search, Walker};
use super::slab::Slab;
use super::watertight::WatertightClosest;
use super::wide::search;
use super::{Stack, Uncounted};
use crate::build::Precision;
use crate::geometry::{Ray, Triangles};
use crate::intersect::Means;
use crate::simd::{Lanes, Scalar};
use crate::tree::Tree;

/// Tests of one ray against triangles on the way to its nearest hit: those that came to each means of deciding, because
/// the one before it could not tell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Decisions {
    /// Those in single precision.
    pub single: u32,
    /// Those in double precision; all where single precision has no room.
    pub double: u32,
    /// Those in sums of two doubles.
    pub pairs: u32,
    /// Those in whole numbers of a fixed length.
    pub whole: u32,
    /// Those in big integers.
    pub big: u32,
}

impl Decisions {
    /// In this order.
    pub fn counts(&self) -> [u32; 5] {
        [self.single, self.double, self.pairs, self.whole, self.big]
    }

    fn add(&mut self, means: Means) {
        self.double += 1;
        self.pairs += u32::from(means >= Means::Pairs);
        self.whole += u32::from(means >= Means::Whole);
        self.big += u32::from(means >= Means::Big);
    }
}

/// Those of a valid ray. None over binary nodes, nor in precision `fast`.
pub(super) fn decisions(tree: &Tree, triangles: &Triangles, ray: &Ray, stack: &mut Stack) -> Decisions {
    match &tree.wide {
        Some(wide) if tree.precision != Precision::Fast => {
            let scene = Scene::new(wide, tree, triangles);
            // Every instruction set decides the same.
            search::<Scalar, Counting, _>(&scene, ray, &mut stack.wide, &mut Uncounted)
        }
        _ => Decisions::default(),
    }
}

/// A search that counts what it does.
#[derive(Debug, Clone, Copy)]
struct Counting {
    search: WatertightClosest,
    decisions: Decisions,
}

impl Walker for Counting {
    fn slab(&self, ray: &Ray, scene: &Scene) -> Option<Slab> {
        self.search.slab(ray, scene)
    }

    fn ray(&self) -> Ray {
        self.search.ray()
    }

    fn limit(&self) -> f32 {
        self.search.limit()
    }

    fn test<L: Lanes>(&mut self, scene: &Scene, leaf: Leaf, _: f32) -> bool {
        let (is_filtered, doubtful) = self.search.doubtful::<L>(scene, leaf);
        self.decisions.single += if is_filtered { leaf.count as u32 } else { 0 };
        let mut nearest = self.search.nearest(scene);
        for lane in bits(doubtful) {
            let corners = scene.corners(leaf, lane);
            self.decisions.add(nearest.means(&corners));
            nearest.offer((leaf.first + lane) as u32, corners, |reference| scene.row(reference as usize));
        }
        if doubtful != 0 {
            self.search.decide(scene, leaf, doubtful);
        }
        false
    }
}

impl Search for Counting {
    type Answer = Decisions;

    fn new(ray: &Ray, scene: &Scene) -> Self {
        Self { search: WatertightClosest::new(ray, scene), decisions: Decisions::default() }
    }

    fn answer(&self, _: &Scene) -> Decisions {
        self.decisions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{BuildOptions, Layout, build};
    use crate::control::Control;
    use crate::geometry::Vertices;

    #[test]
    fn most_rays_need_no_double_and_those_in_a_slanted_plane_of_the_grid_need_whole_numbers() {
        const SIDE: usize = 12;
        let height = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32 * 0.03;
        let vertex = |x: usize, y: usize| [x as f32 * 0.125, y as f32 * 0.125, height(x, y)];
        let mut soup = Vec::new();
        for (x, y) in (0..SIDE - 1).flat_map(|x| (0..SIDE - 1).map(move |y| (x, y))) {
            let [a, b, c, d] = [vertex(x, y), vertex(x + 1, y), vertex(x, y + 1), vertex(x + 1, y + 1)];
            soup.extend([a, b, c, b, d, c]);
        }
        let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
        let tree = |precision| {
            let options = BuildOptions { layout: Layout::Wide, precision, ..Default::default() };
            build(&triangles, &options, &Control::default()).unwrap()
        };
        let [tree, fast] = [Precision::Watertight, Precision::Fast].map(tree);
        let total = |rays: &[Ray]| {
            let mut sum = Decisions::default();
            for ray in rays {
                let one = decisions(&tree, &triangles, ray, &mut Stack::default());
                assert!(one.counts().is_sorted_by(|more, less| more >= less), "{one:?}");
                assert_eq!(decisions(&fast, &triangles, ray, &mut Stack::default()), Decisions::default());
                sum.single += one.single;
                sum.double += one.double;
                sum.pairs += one.pairs;
                sum.whole += one.whole;
                sum.big += one.big;
            }
            sum
        };
        let place = |i: usize| [(i % 37) as f64 * 0.0371 + 0.01, (i % 29) as f64 * 0.0473 + 0.01];
        let down: Vec<_> = (0..1000).map(|i| Ray::new([place(i)[0], place(i)[1], 2.0], [0.003, 0.002, -1.0])).collect();
        let anywhere = total(&down);
        assert!(anywhere.single > 1000 && anywhere.double < 20 && anywhere.whole == 0, "{anywhere:?}");
        let through = |direction| -> Vec<_> {
            let origin = |x: usize, y: usize| [x as f64 * 0.125, y as f64 * 0.125, 2.0];
            (1..SIDE - 1).flat_map(|x| (1..SIDE - 1).map(move |y| Ray::new(origin(x, y), direction))).collect()
        };
        let along_an_axis = total(&through([0.0, 0.0, -1.0]));
        assert!(along_an_axis.pairs > 100 && along_an_axis.whole == 0, "{along_an_axis:?}");
        let in_a_plane = total(&through([0.03, 0.0, -1.0]));
        assert!(in_a_plane.double > 100 && in_a_plane.whole == 0, "{in_a_plane:?}");
        let in_a_slanted_plane = total(&through([0.03, -0.03, -1.0]));
        assert!(in_a_slanted_plane.whole > 100 && in_a_slanted_plane.big == 0, "{in_a_slanted_plane:?}");
    }
}
