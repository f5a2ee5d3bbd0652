//! Records of eight children with their boxes: several levels of the binary tree collapsed into one, for vector units.

use bytemuck::{Pod, Zeroable};

use super::{Kind, Node};
use crate::control::{Cancelled, Control};
use crate::geometry::{Bounds, Corners, Triangles};

/// Children of a record, and triangles of a leaf at most.
pub const WIDTH: usize = 8;

const LEAF: u32 = 1 << 31;
const COUNT_SHIFT: u32 = 28;
const INDEX_MASK: u32 = (1 << COUNT_SHIFT) - 1;

/// 256 bytes, four cache lines: the boxes of eight children axis by axis, what the children are, and in which order a ray
/// meets them. A lane without a child has a box that nothing meets.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Record {
    /// Lower coordinates along x, y and z.
    pub lower: [[f32; WIDTH]; 3],
    /// Upper coordinates along x, y and z.
    pub upper: [[f32; WIDTH]; 3],
    children: [Child; WIDTH],
    orders: Orders,
}

/// The lanes from the farthest to the nearest, four bits each, for each octant of directions: bit 0 of the octant is set
/// where x is negative, bit 1 for y, bit 2 for z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Orders([u32; WIDTH]);

impl Orders {
    /// One child, in lane 0.
    pub const ONE: Self = Self([0x0123_4567; WIDTH]);

    /// Divide the child in `lane` along `axis`: it becomes the lower part, the upper part goes to lane `new`, which is
    /// the next one that is free.
    #[must_use]
    pub fn split(mut self, lane: usize, new: usize, axis: usize) -> Self {
        debug_assert!(lane < new && new < WIDTH);
        for (octant, order) in self.0.iter_mut().enumerate() {
            *order = divided(*order, lane as u32, new as u32, octant >> axis & 1 == 0);
        }
        self
    }

    /// The order for an octant.
    #[inline(always)]
    pub fn of(&self, octant: usize) -> u32 {
        self.0[octant & 7]
    }
}

/// Bit 31: a leaf. Then bits 28 – 30 hold its count less one, the rest its first reference. Otherwise the index of a
/// record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(transparent)]
pub struct Child(u32);

/// A child, unpacked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A record and its index.
    Record(usize),
    /// A range of references.
    Leaf {
        /// Where it starts.
        first: usize,
        /// How many there are, 1 to 8.
        count: usize,
    },
}

impl Child {
    fn record(index: usize) -> Self {
        Self(index as u32)
    }

    fn leaf(first: usize, count: usize) -> Self {
        debug_assert!((1..=WIDTH).contains(&count) && first <= INDEX_MASK as usize);
        Self(LEAF | (count as u32 - 1) << COUNT_SHIFT | first as u32)
    }

    /// The word, unpacked.
    #[inline(always)]
    pub fn target(self) -> Target {
        let index = (self.0 & INDEX_MASK) as usize;
        if self.0 & LEAF == 0 {
            Target::Record(self.0 as usize)
        } else {
            Target::Leaf { first: index, count: (self.0 >> COUNT_SHIFT & 7) as usize + 1 }
        }
    }
}

/// Lanes in use stand in the highest places, the nearest uppermost; below them the free ones, `new` first.
fn divided(order: u32, lane: u32, new: u32, lower_is_near: bool) -> u32 {
    let below = |place: u32| (1u32 << (4 * place)) - 1;
    let others = order ^ (0x1111_1111 * lane);
    let place = (others.wrapping_sub(0x1111_1111) & !others & 0x8888_8888).trailing_zeros() / 4;
    let nearer = order & !(below(place) << 4 | 0xf);
    let farther = order & below(place) & !below(8 - new);
    let free = order & below(7 - new);
    let [first, second] = if lower_is_near { [lane, new] } else { [new, lane] };
    nearer | first << (4 * place) | second << (4 * (place - 1)) | farther >> 4 | free
}

impl Record {
    /// Bytes of one record.
    pub const BYTES: usize = size_of::<Self>();

    const EMPTY: Self = Self {
        lower: [[f32::INFINITY; WIDTH]; 3],
        upper: [[f32::NEG_INFINITY; WIDTH]; 3],
        children: [Child(0); WIDTH],
        orders: Orders::ONE,
    };

    /// The words of all lanes.
    #[inline(always)]
    pub fn words(&self) -> &[u32; WIDTH] {
        bytemuck::cast_ref(&self.children)
    }

    /// The lanes from the farthest to the nearest for an octant of directions.
    #[inline(always)]
    pub fn order(&self, octant: usize) -> u32 {
        self.orders.of(octant)
    }

    /// What stands in a lane.
    #[inline(always)]
    pub fn child(&self, lane: usize) -> Child {
        self.children[lane]
    }

    /// The box of a lane; empty where there is no child.
    pub fn bounds(&self, lane: usize) -> Bounds {
        Bounds { lower: self.lower.map(|axis| axis[lane]), upper: self.upper.map(|axis| axis[lane]) }
    }

    fn set(&mut self, lane: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.lower[axis][lane] = bounds.lower[axis];
            self.upper[axis][lane] = bounds.upper[axis];
        }
        self.children[lane] = child;
    }
}

/// Records, the root first, and the triangles of the leaves in the order of the references.
#[derive(Debug, Clone, PartialEq)]
pub struct Wide {
    /// All records; children stand behind their parents.
    pub records: Vec<Record>,
    /// Nine rows a leaf: x, y, z of the first vertex of each of its triangles, then of the second and third. `WIDTH`
    /// numbers more follow the last, so that whole vectors can be read. Empty for double precision.
    pub rows: Vec<f32>,
    /// Depth of the deepest leaf in records.
    pub depth: usize,
}

impl Wide {
    /// The most triangles that a leaf's 28 bits can refer to.
    pub const LIMIT: usize = 1 << COUNT_SHIFT;

    /// Bytes that the records and rows take.
    pub fn bytes(&self) -> usize {
        self.records.len() * Record::BYTES + self.rows.len() * size_of::<f32>()
    }

    /// The corners of the triangle in a lane of a leaf; none for double precision.
    #[inline(always)]
    pub fn corners(&self, first: usize, count: usize, lane: usize) -> Option<Corners> {
        let rows = self.rows.get(9 * first..9 * (first + count))?;
        let at = |row: usize| f64::from(rows[row * count + lane]);
        Some([[at(0), at(1), at(2)], [at(3), at(4), at(5)], [at(6), at(7), at(8)]])
    }

    /// Collapse a binary tree whose leaves have at most `WIDTH` triangles.
    pub fn collapse(
        nodes: &[Node],
        references: &[u32],
        triangles: &Triangles,
        control: &Control,
    ) -> Result<Self, Cancelled> {
        if nodes.is_empty() {
            return Ok(Self { records: Vec::new(), rows: Vec::new(), depth: 0 });
        }
        let bounds = node_bounds(nodes, references, triangles);
        let rows = if triangles.is_double() { Vec::new() } else { leaf_rows(nodes, references, triangles) };
        let mut records = vec![Record::EMPTY];
        let mut depth = 0;
        let mut tasks = vec![(0, 0, 1)];
        while let Some((index, node, level)) = tasks.pop() {
            control.check()?;
            depth = depth.max(level);
            let (lanes, orders) = children_of(node, nodes, &bounds);
            records[index].orders = orders;
            for (lane, &child) in lanes.iter().enumerate() {
                let target = match nodes[child].kind() {
                    Kind::Leaf { first, count } => Child::leaf(first, count),
                    Kind::Inner { .. } => {
                        records.push(Record::EMPTY);
                        tasks.push((records.len() - 1, child, level + 1));
                        Child::record(records.len() - 1)
                    }
                };
                records[index].set(lane, &bounds[child], target);
            }
        }
        records.shrink_to_fit();
        Ok(Self { records, rows, depth })
    }
}

/// The nodes that become children of one record: the largest inner one, the higher one of equals, is replaced by its two
/// children while there is room.
fn children_of(node: usize, nodes: &[Node], bounds: &[Bounds]) -> (Vec<usize>, Orders) {
    // A node and how far it is below the first.
    let mut lanes = vec![(node, 0)];
    let mut orders = Orders::ONE;
    while lanes.len() < WIDTH {
        let mut largest: Option<(usize, usize, usize)> = None;
        for (lane, &(node, depth)) in lanes.iter().enumerate() {
            let Kind::Inner { axis, left, .. } = nodes[node].kind() else { continue };
            let precedes = largest.is_none_or(|(other, ..)| {
                let (node_there, depth_there) = lanes[other];
                let (area, other_area) = (half_area(&bounds[node]), half_area(&bounds[node_there]));
                area > other_area || area == other_area && depth < depth_there
            });
            if precedes {
                largest = Some((lane, left, axis));
            }
        }
        let Some((lane, left, axis)) = largest else { break };
        let depth = lanes[lane].1 + 1;
        orders = orders.split(lane, lanes.len(), axis);
        lanes[lane] = (left, depth);
        lanes.push((left + 1, depth));
    }
    (lanes.into_iter().map(|(node, _)| node).collect(), orders)
}

fn half_area(bounds: &Bounds) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| f64::from(bounds.upper[axis]) - f64::from(bounds.lower[axis]));
    x * y + y * z + z * x
}

/// The bounds of the triangles below each node; children stand behind their parents.
fn node_bounds(nodes: &[Node], references: &[u32], triangles: &Triangles) -> Vec<Bounds> {
    let mut bounds = vec![Bounds::EMPTY; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        bounds[index] = match node.kind() {
            Kind::Inner { left, .. } => bounds[left].union(&bounds[left + 1]),
            Kind::Leaf { first, count } => references[first..first + count]
                .iter()
                .map(|&row| Bounds::of_triangle(&triangles.corners(row)))
                .fold(Bounds::EMPTY, |all, one| all.union(&one)),
        };
    }
    bounds
}

fn leaf_rows(nodes: &[Node], references: &[u32], triangles: &Triangles) -> Vec<f32> {
    let mut rows = vec![0.0; 9 * references.len() + WIDTH];
    for node in nodes {
        if let Kind::Leaf { first, count } = node.kind() {
            for lane in 0..count {
                let corners = triangles.corners(references[first + lane]);
                for (row, &value) in corners.as_flattened().iter().enumerate() {
                    rows[9 * first + row * count + lane] = value as f32;
                }
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_follow_the_splits() {
        assert_eq!(size_of::<Record>(), 256);
        // Lane 0 is cut along x, then its lower part along y: lanes 0 below 2, both left of 1.
        let orders = Orders::ONE.split(0, 1, 0).split(0, 2, 1);
        let nearest_first = |octant: usize| [7, 6, 5].map(|place| orders.of(octant) >> (4 * place) & 7);
        assert_eq!(nearest_first(0b000), [0, 2, 1]);
        assert_eq!(nearest_first(0b001), [1, 0, 2]);
        assert_eq!(nearest_first(0b010), [2, 0, 1]);
        assert_eq!(nearest_first(0b111), [1, 2, 0]);
        let full = (1..WIDTH).fold(Orders::ONE, |orders, new| orders.split(new / 2, new, new % 3));
        for octant in 0..8 {
            let mut lanes: Vec<_> = (0..8).map(|place| full.of(octant) >> (4 * place) & 15).collect();
            lanes.sort_unstable();
            assert_eq!(lanes, [0, 1, 2, 3, 4, 5, 6, 7]);
        }
    }

    #[test]
    fn every_child_survives_packing_up_to_the_limits() {
        for index in [0, 1, INDEX_MASK as usize, (1 << 31) - 1] {
            assert_eq!(Child::record(index).target(), Target::Record(index));
        }
        for count in 1..=WIDTH {
            let first = Wide::LIMIT - count;
            assert_eq!(Child::leaf(first, count).target(), Target::Leaf { first, count });
        }
    }
}
