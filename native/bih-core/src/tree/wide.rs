//! Records of eight children with their boxes: several levels of the binary tree collapsed into one, for vector units.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::{CompactRecord, Copies, LeafRows, Shared};
use crate::geometry::Bounds;
use crate::simd::Lanes;

/// Children of a record, and triangles of a leaf at most.
pub const WIDTH: usize = 8;

const LEAF: u32 = 1 << 31;
const SPECIAL: u32 = 1 << 30;
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
    pub(super) children: [Child; WIDTH],
    orders: Orders,
}

/// The lanes from the farthest to the nearest, four bits each, for each octant of directions: bit 0 of the octant is set
/// where x is negative, bit 1 for y, bit 2 for z. Lanes in use stand in the highest places, the nearest uppermost; below
/// them the free ones, the highest of them lowest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Orders([u32; WIDTH]);

impl Orders {
    /// One child, in lane 0.
    pub const ONE: Self = Self([0x0123_4567; WIDTH]);

    pub(crate) fn new(orders: [u32; WIDTH]) -> Self {
        Self(orders)
    }

    /// The order for an octant.
    #[inline(always)]
    pub fn of(&self, octant: usize) -> u32 {
        self.0[octant & 7]
    }
}

/// Bit 31: a leaf. Then bits 28 – 30 hold its count less one, the rest its first reference. Otherwise bit 30: the rest is
/// the number of a piece that is built on demand. Otherwise the index of a record.
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
    /// A piece that is built on demand, and its number.
    Piece(usize),
}

impl Child {
    pub(crate) fn record(index: usize) -> Self {
        Self(index as u32)
    }

    pub(crate) fn leaf(first: usize, count: usize) -> Self {
        debug_assert!((1..=WIDTH).contains(&count) && first <= INDEX_MASK as usize);
        Self(LEAF | (count as u32 - 1) << COUNT_SHIFT | first as u32)
    }

    /// A piece that is built on demand.
    pub(crate) fn piece(number: usize) -> Self {
        debug_assert!(number <= INDEX_MASK as usize);
        Self(SPECIAL | number as u32)
    }

    /// A word that is neither a leaf nor a record nor a piece there can be.
    pub const NONE: u32 = (LEAF - 1) ^ INDEX_MASK;

    /// Whether the word is that of a piece, or none.
    #[inline(always)]
    pub fn is_special(word: u32) -> bool {
        word & (LEAF | SPECIAL) == SPECIAL
    }

    /// Whether the word stands for a leaf.
    #[inline(always)]
    pub fn is_leaf(word: u32) -> bool {
        word & LEAF != 0
    }

    /// Of a record, or of the first reference of a leaf.
    #[inline(always)]
    pub fn index(word: u32) -> usize {
        (word & INDEX_MASK) as usize
    }

    /// As a record holds it.
    #[inline(always)]
    pub fn from_word(word: u32) -> Self {
        Self(word)
    }

    /// The word, unpacked.
    #[inline(always)]
    pub fn target(self) -> Target {
        let index = (self.0 & INDEX_MASK) as usize;
        if self.0 & LEAF != 0 {
            Target::Leaf { first: index, count: (self.0 >> COUNT_SHIFT & 7) as usize + 1 }
        } else if Self::is_special(self.0) {
            Target::Piece(index)
        } else {
            Target::Record(self.0 as usize)
        }
    }

    /// The word.
    pub(crate) fn word(self) -> u32 {
        self.0
    }
}

impl Record {
    /// Bytes of one record.
    pub const BYTES: usize = size_of::<Self>();

    /// Without children.
    pub(crate) const EMPTY: Self = Self {
        lower: [[f32::INFINITY; WIDTH]; 3],
        upper: [[f32::NEG_INFINITY; WIDTH]; 3],
        children: [Child(0); WIDTH],
        orders: Orders::ONE,
    };

    pub(crate) fn set_orders(&mut self, orders: Orders) {
        self.orders = orders;
    }

    /// The same, its children so many records further on.
    #[inline(always)]
    pub(crate) fn moved(&self, offset: usize) -> Self {
        // A lane without a child has the word of the root, which is nobody's child.
        let children = self.children.map(|child| {
            let is_record = child.0 & LEAF == 0 && child.0 != 0;
            Child(child.0 + if is_record { offset as u32 } else { 0 })
        });
        Self { children, ..*self }
    }

    /// The boxes as they stand: lower x, y, z and upper x, y, z of all lanes; two rows more that are no numbers.
    #[inline(always)]
    pub fn planes(&self) -> &[[f32; WIDTH]; 8] {
        bytemuck::cast_ref(self)
    }

    /// The words of all lanes.
    #[inline(always)]
    pub fn words(&self) -> &[u32; WIDTH] {
        bytemuck::cast_ref(&self.children)
    }

    /// The word of the lane at the last of some places of an order; of the first place where there is none.
    #[inline(always)]
    pub fn last(&self, order: u32, places: u8) -> u32 {
        let place = (places | 1).ilog2();
        self.words()[(order >> (4 * place) & 7) as usize]
    }

    /// The lanes from the farthest to the nearest for an octant of directions.
    #[inline(always)]
    pub fn order(&self, octant: usize) -> u32 {
        self.orders.of(octant)
    }

    /// Whether each lane stands in one place of each order.
    pub(super) fn orders_are_whole(&self) -> bool {
        (0..WIDTH).all(|octant| {
            let order = self.order(octant);
            let lanes = (0..WIDTH).fold(0u32, |lanes, place| lanes | 1 << (order >> (4 * place) & 15));
            lanes == (1 << WIDTH) - 1
        })
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

    pub(crate) fn set(&mut self, lane: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.lower[axis][lane] = bounds.lower[axis];
            self.upper[axis][lane] = bounds.upper[axis];
        }
        self.children[lane] = child;
    }
}

/// Records in one of two forms.
#[derive(Debug, PartialEq)]
pub enum Records {
    /// As they are traced.
    Full(Shared<Record>),
    /// With quantised boxes, unpacked where they are traced.
    Compact(Shared<CompactRecord>),
}

impl Records {
    /// With quantised boxes, those of full ones.
    pub(crate) fn compacted(records: &[Record]) -> Vec<CompactRecord> {
        records.par_iter().with_min_len(1024).map(CompactRecord::new).collect()
    }

    /// How many there is room for.
    pub fn len(&self) -> usize {
        match self {
            Self::Full(records) => records.len(),
            Self::Compact(records) => records.len(),
        }
    }

    /// Whether there is room for none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that one takes.
    #[inline(always)]
    pub fn stride(&self) -> usize {
        match self {
            Self::Full(_) => Record::BYTES,
            Self::Compact(_) => CompactRecord::BYTES,
        }
    }

    /// Whether `Record::order` is known; if not, children are sorted by where a ray enters them.
    pub fn are_ordered(&self) -> bool {
        matches!(self, Self::Full(_))
    }

    /// The record at `index`; `space` is where it may be unpacked.
    #[inline(always)]
    pub(crate) fn get<'a, L: Lanes>(&'a self, index: usize, space: &'a mut Record) -> &'a Record {
        match self {
            Self::Full(records) => records.get(index),
            Self::Compact(records) => records.get(index).unpacked::<L>(space),
        }
    }

    /// Where they are.
    #[inline(always)]
    pub(crate) fn start(&self) -> *const u8 {
        match self {
            Self::Full(records) => records.start().cast(),
            Self::Compact(records) => records.start().cast(),
        }
    }
}

/// Records, the root first, and the triangles of the leaves in the order of the references.
#[derive(Debug, PartialEq)]
pub struct Wide {
    /// All records; children stand behind their parents.
    pub records: Records,
    /// Nine rows a leaf: x, y, z of the first vertex of each of its triangles, then of the second and third. `WIDTH`
    /// numbers more follow the last, so that whole vectors can be read. Empty for double precision, and for compact
    /// records.
    pub rows: Shared<f32>,
    /// Instead of the rows, where leaves are built on demand.
    pub copies: Option<Copies>,
    /// Depth of the deepest leaf in records; on demand of the deepest piece.
    pub depth: usize,
}

impl Wide {
    /// The most triangles that a leaf's 28 bits can refer to.
    pub const LIMIT: usize = 1 << COUNT_SHIFT;
}

impl Wide {
    /// Bytes that the records and rows have room in.
    pub fn bytes(&self) -> usize {
        self.records.len() * self.records.stride() + self.rows.len() * size_of::<f32>()
    }

    /// The rows of a leaf that is there, if the tree holds its vertices.
    #[inline(always)]
    pub(crate) fn leaf_rows(&self, first: usize, count: usize) -> Option<LeafRows<'_>> {
        match &self.copies {
            Some(copies) => copies.get(first, count),
            None => (!self.rows.is_empty()).then(|| self.rows.leaf(9 * first, count)),
        }
    }

    /// Whether its leaves are to hold vertices, which are of single precision then.
    #[inline(always)]
    pub(crate) fn has_rows(&self) -> bool {
        self.copies.is_some() || !self.rows.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_child_survives_packing_up_to_the_limits() {
        for index in [0, 1, INDEX_MASK as usize] {
            assert_eq!(Child::record(index).target(), Target::Record(index));
            assert_eq!(Child::piece(index).target(), Target::Piece(index));
            assert!(Child::is_special(Child::piece(index).word()) && !Child::is_special(Child::record(index).word()));
            assert_ne!(Child::piece(index).word(), Child::NONE);
        }
        assert!(Child::is_special(Child::NONE));
        for count in 1..=WIDTH {
            let first = Wide::LIMIT - count;
            assert_eq!(Child::leaf(first, count).target(), Target::Leaf { first, count });
            assert!(!Child::is_special(Child::leaf(first, count).word()));
        }
    }
}
