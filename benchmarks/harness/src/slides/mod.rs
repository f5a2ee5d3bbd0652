//! The construction of the slides, with and without their bucket sort: one thread, one object a leaf, single precision.
//!
//! The product sorts by the cells of the construction itself and so makes one tree. Here buckets are sorted in the
//! objects' place, which makes another: the pair shows what that costs, and stands in the slides' own table.

mod boxes;
mod buckets;
mod build;
mod trace;

use std::time::Instant;

use serde_json::{Map, Value, json};

use self::boxes::Boxes;
use self::build::SlidesNode;
use crate::mesh::Mesh;
use crate::obvhs::each;
use crate::side::{Answers, Call, RaySet, Structure};

pub struct SlidesSide {
    /// The cells of the grid for each object, at most; none: no bucket sort.
    cells: Option<f64>,
}

impl SlidesSide {
    /// "plain", or "buckets" and, as a second word, the cells for each object (1).
    pub fn parse(words: &[&str]) -> Result<Self, String> {
        match words {
            ["plain"] => Ok(Self { cells: None }),
            ["buckets"] => Ok(Self { cells: Some(1.0) }),
            ["buckets", cells] => match cells.parse() {
                Ok(cells) if cells > 0.0 => Ok(Self { cells: Some(cells) }),
                _ => Err(format!("{cells:?} is no number of cells")),
            },
            _ => Err("neither plain nor buckets".to_owned()),
        }
    }

    pub fn build<'m>(&self, mesh: &'m Mesh) -> SlidesTree<'m> {
        let boxes = Boxes::of(mesh);
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let nodes = match self.cells {
            None => build::plain(&boxes, &mut order),
            Some(cells) => buckets::build(&boxes, &mut order, cells),
        };
        SlidesTree { mesh, nodes, order, bounds: boxes.whole }
    }
}

pub struct SlidesTree<'m> {
    mesh: &'m Mesh,
    nodes: Vec<SlidesNode>,
    /// The objects in the order of the leaves.
    order: Vec<u32>,
    bounds: bih_core::Bounds,
}

impl Structure for SlidesTree<'_> {
    fn trace(&self, rays: &RaySet, _: Call) -> (f64, Answers) {
        let start = Instant::now();
        if rays.kind.is_any() {
            let mut hidden = vec![false; rays.rays.len()];
            each(&rays.rays, &mut hidden, |ray| self.nearest(ray).0.is_finite());
            (start.elapsed().as_secs_f64(), Answers::Hidden(hidden))
        } else {
            let mut found = vec![(f32::INFINITY, u32::MAX); rays.rays.len()];
            each(&rays.rays, &mut found, |ray| self.nearest(ray));
            (start.elapsed().as_secs_f64(), Answers::Nearest(found))
        }
    }

    fn facts(&self, rays: Option<&RaySet>) -> Map<String, Value> {
        let mut facts = Map::new();
        if rays.is_none() {
            let leaves = self.nodes.iter().filter(|node| node.is_leaf()).count();
            facts.insert("nodes".to_owned(), json!(self.nodes.len()));
            facts.insert("leaves".to_owned(), json!(leaves));
            let bytes = size_of::<SlidesNode>() * self.nodes.len() + size_of::<u32>() * self.order.len();
            facts.insert("tree_bytes".to_owned(), json!(bytes));
        }
        facts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::{Kind, Random, primary};

    /// Triangles of one size in a cube, and some far larger ones.
    fn soup(count: usize) -> Mesh {
        let mut random = Random(3);
        let mut triangles = Vec::new();
        for row in 0..count {
            let size = if row % 97 == 0 { 0.5 } else { 0.15 };
            let centre: [f32; 3] = std::array::from_fn(|_| random.unit());
            triangles.push(std::array::from_fn(|_| centre.map(|x| x + size * (random.unit() - 0.5))));
        }
        Mesh::of_soup(&triangles, [64, 48])
    }

    #[test]
    fn both_trees_hold_every_object_once_and_hit_what_all_objects_hit() {
        for count in [1, 2, 3, 1000] {
            let mesh = soup(count);
            let rays = RaySet::new(Kind::Primary, primary(&mesh.view));
            let naive: Vec<_> = rays.rays.iter().map(|ray| trace::naive(&mesh, ray)).collect();
            assert!(count < 1000 || naive.iter().filter(|found| found.0.is_finite()).count() > 200);
            for words in [&["plain"][..], &["buckets"], &["buckets", "0.1"], &["buckets", "20"]] {
                let tree = SlidesSide::parse(words).unwrap().build(&mesh);
                let mut rows = tree.order.clone();
                rows.sort_unstable();
                assert!(rows.into_iter().eq(0..count as u32));
                assert_eq!(tree.nodes.iter().filter(|node| node.is_leaf()).count(), count);
                assert_eq!(tree.nodes.len(), 2 * count - 1);
                let Answers::Nearest(found) = tree.trace(&rays, Call::Batch).1 else { unreachable!() };
                let distances = |found: &[(f32, u32)]| found.iter().map(|(t, _)| *t).collect::<Vec<_>>();
                assert_eq!(distances(&found), distances(&naive), "{words:?}, {count} triangles");
            }
        }
    }

    #[test]
    fn objects_in_one_place_end_in_leaves_of_one_all_the_same() {
        let corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh::of_soup(&[corner; 300], [8, 8]);
        for words in [&["plain"][..], &["buckets"]] {
            assert_eq!(SlidesSide::parse(words).unwrap().build(&mesh).nodes.len(), 599);
        }
    }

    #[test]
    fn other_words_are_refused() {
        for words in [&[][..], &["sorted"], &["plain", "1"], &["buckets", "0"], &["buckets", "x"]] {
            assert!(SlidesSide::parse(words).is_err());
        }
    }
}
