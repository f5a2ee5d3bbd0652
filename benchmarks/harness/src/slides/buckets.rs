//! "Grid resolution = scene bounding box / average object size", times a scaling factor; count, place, and sort the boxes
//! of the buckets in the objects' place.

use bih_core::Bounds;

use super::boxes::Boxes;
use super::build::{Ends, Leaves, Range, SlidesNode, subdivide};

/// The tree over the buckets, and in each the tree over its objects. The scaling factor is such that the grid has at most
/// so many cells for each object.
pub fn build(boxes: &Boxes, order: &mut [u32], cells: f64) -> Vec<SlidesNode> {
    let grid = Grid::new(boxes, cells);
    let starts = grid.sort(boxes, order);
    let mut full = Vec::new();
    let mut bounds = Vec::new();
    for pair in starts.windows(2) {
        let (first, end) = (pair[0] as usize, pair[1] as usize);
        if first < end {
            full.push((first, end));
            let objects = order[first..end].iter().map(|&object| &boxes.each[object as usize]);
            bounds.push(objects.fold(Bounds::EMPTY, |all, bounds| all.union(bounds)));
        }
    }
    let buckets = Boxes::new(bounds);
    let mut items: Vec<u32> = (0..full.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * order.len());
    nodes.push(SlidesNode::default());
    let whole = Range { node: 0, first: 0, end: items.len(), cell: boxes.whole, halvings: 0 };
    let mut ends = Buckets { boxes, order, full: &full, bounds: &buckets.each };
    subdivide(&buckets, &mut items, 0, whole, &mut nodes, &mut ends);
    nodes
}

/// An item is a bucket.
struct Buckets<'a> {
    boxes: &'a Boxes,
    order: &'a mut [u32],
    full: &'a [(usize, usize)],
    bounds: &'a [Bounds],
}

impl Ends for Buckets<'_> {
    fn end(&mut self, nodes: &mut Vec<SlidesNode>, node: usize, bucket: u32, _: usize) {
        let (first, end) = self.full[bucket as usize];
        let whole = Range { node, first: 0, end: end - first, cell: self.bounds[bucket as usize], halvings: 0 };
        subdivide(self.boxes, &mut self.order[first..end], first, whole, nodes, &mut Leaves);
    }
}

struct Grid {
    lower: [f32; 3],
    /// Cells for each unit of length.
    scale: [f32; 3],
    size: [usize; 3],
}

impl Grid {
    fn new(boxes: &Boxes, cells: f64) -> Self {
        let count = boxes.each.len() as f64;
        let extent = |bounds: &Bounds, axis: usize| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis]);
        let resolution: [f64; 3] = std::array::from_fn(|axis| {
            let average = boxes.each.iter().map(|bounds| extent(bounds, axis)).sum::<f64>() / count;
            let whole = extent(&boxes.whole, axis);
            if average > 0.0 { whole / average } else { 1.0 }
        });
        let factor = (cells * count / resolution.iter().product::<f64>()).cbrt().min(1.0);
        let size = resolution.map(|cells| ((factor * cells) as usize).clamp(1, 2048));
        let scale = std::array::from_fn(|axis| {
            let whole = boxes.whole.upper[axis] - boxes.whole.lower[axis];
            if whole > 0.0 { size[axis] as f32 / whole } else { 0.0 }
        });
        Self { lower: boxes.whole.lower, scale, size }
    }

    /// The cell of the centre of an object's box.
    fn cell(&self, boxes: &Boxes, object: u32) -> usize {
        let [x, y, z] = std::array::from_fn(|axis| {
            let place = (0.5 * boxes.place(object, axis) - self.lower[axis]) * self.scale[axis];
            (place as usize).min(self.size[axis] - 1)
        });
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Counters, their sums, and each object to its bucket; where buckets start, and the end of the last.
    fn sort(&self, boxes: &Boxes, order: &mut [u32]) -> Vec<u32> {
        let mut starts = vec![0u32; self.size.iter().product::<usize>() + 1];
        let cells: Vec<u32> = (0..order.len() as u32).map(|object| self.cell(boxes, object) as u32).collect();
        for &cell in &cells {
            starts[cell as usize + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        for (object, &cell) in cells.iter().enumerate() {
            let place = &mut next[cell as usize];
            order[*place as usize] = object as u32;
            *place += 1;
        }
        starts
    }
}
