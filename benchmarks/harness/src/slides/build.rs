//! "Hierarchically subdividing scene AABB; divide longest side in the middle until one object is left."

use bih_core::Bounds;

use super::boxes::Boxes;

const LEAF: u32 = 3;
/// Halvings after which objects are told apart by number alone.
const HALVINGS: usize = 128;

/// 12 bytes, as in the slides: the axis in the lower two bits (3: a leaf), the first of two children above them; the clip
/// planes of both, or of a leaf where its object stands in the order.
#[derive(Debug, Clone, Copy, Default)]
pub struct SlidesNode {
    index: u32,
    clip: [f32; 2],
}

impl SlidesNode {
    fn leaf(place: usize) -> Self {
        Self { index: LEAF, clip: [f32::from_bits(place as u32), 0.0] }
    }

    pub fn is_leaf(&self) -> bool {
        self.index & 3 == LEAF
    }

    /// Of a leaf, where its object stands in the order.
    pub fn place(&self) -> usize {
        self.clip[0].to_bits() as usize
    }

    pub fn axis(&self) -> usize {
        (self.index & 3) as usize
    }

    /// The first child; the second follows it.
    pub fn child(&self) -> usize {
        (self.index >> 2) as usize
    }

    /// The upper plane of the first child, the lower one of the second.
    pub fn clip(&self) -> [f32; 2] {
        self.clip
    }
}

/// What becomes of a range that holds one item: its place, and the node to fill.
pub trait Ends {
    fn end(&mut self, nodes: &mut Vec<SlidesNode>, node: usize, item: u32, place: usize);
}

/// An item is an object.
pub struct Leaves;

impl Ends for Leaves {
    fn end(&mut self, nodes: &mut Vec<SlidesNode>, node: usize, _: u32, place: usize) {
        nodes[node] = SlidesNode::leaf(place);
    }
}

/// The tree over all objects, which are sorted in place.
pub fn plain(boxes: &Boxes, order: &mut [u32]) -> Vec<SlidesNode> {
    let mut nodes = Vec::with_capacity(2 * order.len());
    nodes.push(SlidesNode::default());
    let whole = Range { node: 0, first: 0, end: order.len(), cell: boxes.whole, halvings: 0 };
    subdivide(boxes, order, 0, whole, &mut nodes, &mut Leaves);
    nodes
}

/// Items to subdivide, and the cell that they lie in.
#[derive(Clone, Copy)]
pub struct Range {
    pub node: usize,
    pub first: usize,
    pub end: usize,
    pub cell: Bounds,
    pub halvings: usize,
}

/// `offset` is where the first item stands in the order of all.
pub fn subdivide(
    boxes: &Boxes,
    items: &mut [u32],
    offset: usize,
    whole: Range,
    nodes: &mut Vec<SlidesNode>,
    ends: &mut impl Ends,
) {
    let mut ranges = vec![whole];
    while let Some(range) = ranges.pop() {
        let Range { node, first, end, mut cell, mut halvings } = range;
        if end - first == 1 {
            ends.end(nodes, node, items[first], offset + first);
            continue;
        }
        let (axis, middle, plane) = loop {
            let axis = longest(&cell);
            let plane = 0.5 * cell.lower[axis] + 0.5 * cell.upper[axis];
            halvings += 1;
            if halvings > HALVINGS {
                break (axis, first + (end - first) / 2, plane);
            }
            let middle = first + partition(&mut items[first..end], |item| boxes.place(item, axis) < 2.0 * plane);
            // A half without items makes no node.
            if middle == first {
                cell.lower[axis] = plane;
            } else if middle == end {
                cell.upper[axis] = plane;
            } else {
                break (axis, middle, plane);
            }
        };
        let upper = items[first..middle].iter().map(|&item| boxes.each[item as usize].upper[axis]);
        let lower = items[middle..end].iter().map(|&item| boxes.each[item as usize].lower[axis]);
        let clip = [upper.fold(f32::NEG_INFINITY, f32::max), lower.fold(f32::INFINITY, f32::min)];
        let child = nodes.len();
        nodes[node] = SlidesNode { index: (child as u32) << 2 | axis as u32, clip };
        nodes.resize(child + 2, SlidesNode::default());
        let (mut left, mut right) = (cell, cell);
        if halvings <= HALVINGS {
            (left.upper[axis], right.lower[axis]) = (plane, plane);
        }
        ranges.push(Range { node: child + 1, first: middle, end, cell: right, halvings });
        ranges.push(Range { node: child, first, end: middle, cell: left, halvings });
    }
}

fn longest(cell: &Bounds) -> usize {
    let size = |axis: usize| cell.upper[axis] - cell.lower[axis];
    (1..3).fold(0, |best, axis| if size(axis) > size(best) { axis } else { best })
}

/// Those for which it holds first, as quicksort does it; how many they are.
fn partition(items: &mut [u32], is_left: impl Fn(u32) -> bool) -> usize {
    let (mut left, mut right) = (0, items.len());
    while left < right {
        if is_left(items[left]) {
            left += 1;
        } else {
            right -= 1;
            items.swap(left, right);
        }
    }
    left
}
