//! Instances and the tree over them.

use std::time::Instant;

use rayon::prelude::*;

use super::affine::Affine;
use super::boxes::{Extent, NOTHING, nodes_over, tree_over};
use super::inverse::Inverse;
use crate::build::Precision;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Bounds, Corners, Triangles, round_down, round_up};
use crate::memory;
use crate::simd::FloatEnvironment;
use crate::tree::{NodeRow, Stats, Tree};

/// A tree and the triangles that it was built over.
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// Those it was built over.
    pub triangles: Triangles<'a>,
}

/// Instances of models that it does not hold: every query is given the same ones.
#[derive(Debug)]
pub struct Scene {
    pub(super) instances: Vec<Instance>,
    /// Trees over the images of the triangles of single instances.
    pub(super) flat: Vec<Tree>,
    pub(super) upper: Tree,
    pub(super) precision: Precision,
    stats: Stats,
}

/// A model where a matrix takes it.
#[derive(Debug)]
pub(super) struct Instance {
    /// Row of the model.
    pub model: u32,
    pub place: Affine,
    /// Holds all that can be hit.
    pub bounds: Bounds,
    pub way: Way,
}

/// How a ray finds what it hits in an instance.
#[derive(Debug)]
pub(super) enum Way {
    /// Through the tree of the model, led by the inverse.
    Inverse(Inverse),
    /// The matrix has none: through a tree of its own.
    Flat(u32),
    /// There is nothing.
    Empty,
}

impl Scene {
    /// Put models to their places: `rows` say which, as many as there are matrices from object to world. All numbers are
    /// finite, all rows are those of models, and all models have one precision.
    pub fn new(models: &[Model], rows: &[u32], matrices: &[[[f64; 4]; 4]], control: &Control) -> Result<Self, Error> {
        assert_eq!(rows.len(), matrices.len());
        if rows.len() > Triangles::LIMIT {
            return Err(Error::TooManyInstances { instances: rows.len(), limit: Triangles::LIMIT });
        }
        // In parts, and then in a row; the tree over them asks for its own.
        memory::room("the instances", 2 * size_of::<Placed>() * rows.len())?;
        let start = Instant::now();
        let _standard = FloatEnvironment::standard();
        control.start(rows.len());
        const CHUNK: usize = 1 << 12;
        let placed: Vec<_> = rows
            .par_chunks(CHUNK)
            .zip(matrices.par_chunks(CHUNK))
            .map(|(rows, matrices)| {
                let _standard = FloatEnvironment::standard();
                control.advance(rows.len())?;
                rows.iter().zip(matrices).map(|(&row, matrix)| Placed::new(models, row, matrix, control)).collect()
            })
            .collect::<Result<Vec<Vec<_>>, Error>>()?;
        let (mut instances, mut flat) = (Vec::with_capacity(rows.len()), Vec::new());
        for Placed { mut instance, tree } in placed.into_iter().flatten() {
            if let Some(tree) = tree {
                instance.way = Way::Flat(flat.len() as u32);
                flat.push(*tree);
            }
            instances.push(instance);
        }
        let upper = tree_over(instances.iter().map(Instance::extent), control)?;
        let precision = models.first().map(|model| model.tree.precision()).unwrap_or_default();
        let mut scene = Self { instances, flat, upper, precision, stats: Stats::default() };
        scene.stats = scene.counted(models, start.elapsed().as_secs_f64());
        Ok(scene)
    }

    fn counted(&self, models: &[Model], build_seconds: f64) -> Stats {
        let upper = self.upper.stats();
        let trees: usize = self.flat.iter().map(|tree| tree.stats().tree_bytes).sum();
        let own = size_of_val(&self.instances[..]) + trees;
        let mut left_out = Vec::new();
        if !self.flat.is_empty() {
            let reason = format!("{} instances, whose matrices have none, have trees of their own", self.flat.len());
            left_out.push(("inverse".to_owned(), reason));
        }
        Stats {
            triangles: self.instances.iter().map(|instance| models[instance.model as usize].triangles.len()).sum(),
            tree_bytes: upper.tree_bytes + own,
            bound_bytes: upper.bound_bytes + own,
            peak_build_bytes: upper.peak_build_bytes + own,
            build_seconds,
            left_out,
            ..upper
        }
    }

    /// How many instances there are.
    pub fn len(&self) -> usize {
        self.instances.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// Bounds of all that can be hit; empty where there is nothing.
    pub fn bounds(&self) -> &Bounds {
        self.upper.bounds()
    }

    /// What the upper tree is, and what it cost with all that is kept of instances. `triangles` are those of all instances
    /// together, `references` the instances that can be hit, `rejected` the others.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// Rows of the upper tree's nodes, as `node_table` has them.
    pub fn nodes(&self, max_depth: u32, limit: usize, control: &Control) -> Result<Vec<NodeRow>, Error> {
        nodes_over(&self.upper, self.instances.iter().map(Instance::extent), max_depth, limit, control)
    }
}

impl Instance {
    /// Its box in doubles, for the tree over it.
    fn extent(&self) -> Extent {
        let within = |x: f32| f64::from(x).clamp(f64::MIN, f64::MAX);
        match self.way {
            Way::Empty => NOTHING,
            Way::Inverse(_) | Way::Flat(_) => [self.bounds.lower.map(within), self.bounds.upper.map(within)],
        }
    }
}

/// An instance, and the tree of its own that it may need.
struct Placed {
    instance: Instance,
    /// In a box: few have one, and it is larger than all the rest.
    tree: Option<Box<Tree>>,
}

impl Placed {
    fn new(models: &[Model], row: u32, matrix: &[[f64; 4]; 4], control: &Control) -> Result<Self, Error> {
        let Model { tree, triangles } = &models[row as usize];
        let (place, object) = (Affine::new(matrix), tree.bounds());
        let instance = |bounds, way| Instance { model: row, place, bounds, way };
        if is_empty(object) {
            return Ok(Self { instance: instance(Bounds::EMPTY, Way::Empty), tree: None });
        }
        let world = place.bounds(object);
        if let Some(inverse) = Inverse::new(&place, object, &world) {
            let [lower, upper] = world;
            let bounds = Bounds { lower: lower.map(round_down), upper: upper.map(round_up) };
            return Ok(Self { instance: instance(bounds, Way::Inverse(inverse)), tree: None });
        }
        let images = (0..triangles.len()).map(|row| image_box(&place, &triangles.corners(row as u32)));
        let tree = tree_over(images, control)?;
        // Its number is known once all instances are.
        let (bounds, way) = (*tree.bounds(), if is_empty(tree.bounds()) { Way::Empty } else { Way::Flat(0) });
        Ok(Self { instance: instance(bounds, way), tree: Some(Box::new(tree)).filter(|tree| !is_empty(tree.bounds())) })
    }
}

fn is_empty(bounds: &Bounds) -> bool {
    bounds.lower[0] > bounds.upper[0]
}

/// A box around the image of a triangle, rounded or not; nothing where it has no area or lies beyond the largest double.
fn image_box(place: &Affine, corners: &Corners) -> Extent {
    if !corners.as_flattened().iter().all(|x| x.is_finite()) || place.has_no_area(corners) {
        return NOTHING;
    }
    let [a, b, c] = place.corners(corners);
    if !a.iter().chain(&b).chain(&c).all(|x| x.is_finite()) {
        return NOTHING;
    }
    [
        std::array::from_fn(|axis| a[axis].min(b[axis]).min(c[axis]).next_down().max(f64::MIN)),
        std::array::from_fn(|axis| a[axis].max(b[axis]).max(c[axis]).next_up().min(f64::MAX)),
    ]
}
