//! The node record.

use bytemuck::{Pod, Zeroable};

const LEAF: u32 = 0b11;
const PIECE: u32 = 1 << 2 | LEAF;

/// Twelve bytes, as Wächter and Keller 2006, section 3.1:
///
/// | bits | inner node | leaf |
/// | --- | --- | --- |
/// | 0 – 1 | split axis, 0 x, 1 y, 2 z | 3 |
/// | 2 – 31 | index of the left child; the right one is next to it | 0; 1 for a piece that is built on demand |
/// | 32 – 63 | upper clip plane of the left child | first reference; number of the piece |
/// | 64 – 95 | lower clip plane of the right child | number of references |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Node {
    index: u32,
    items: [u32; 2],
}

/// What a node is, unpacked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Two children side by side, cut along one axis.
    Inner {
        /// 0 x, 1 y, 2 z.
        axis: usize,
        /// Index of the left child; the right one follows.
        left: usize,
        /// Upper plane of the left child and lower plane of the right child.
        clip: [f32; 2],
    },
    /// A range of references.
    Leaf {
        /// Where it starts.
        first: usize,
        /// How many there are.
        count: usize,
    },
}

impl Node {
    /// Bytes of one node.
    pub const BYTES: usize = size_of::<Self>();

    /// An inner node whose children are `left` and `left + 1`.
    pub fn inner(axis: usize, left: usize, clip: [f32; 2]) -> Self {
        debug_assert!(axis < 3 && left < 1 << 30);
        Self { index: (left as u32) << 2 | axis as u32, items: clip.map(f32::to_bits) }
    }

    /// A leaf of `count` references from `first`.
    pub fn leaf(first: usize, count: usize) -> Self {
        Self { index: LEAF, items: [first as u32, count as u32] }
    }

    /// A piece that is built on demand: a leaf without references.
    pub(crate) fn piece(number: usize) -> Self {
        Self { index: PIECE, items: [number as u32, 0] }
    }

    /// The number of the piece that is built on demand in the place of this node; none for others.
    #[inline(always)]
    pub(crate) fn piece_number(&self) -> Option<usize> {
        (self.index == PIECE).then_some(self.items[0] as usize)
    }

    /// The same, its children so many nodes further on.
    pub(crate) fn moved(&self, offset: usize) -> Self {
        let is_leaf = self.index & LEAF == LEAF;
        Self { index: self.index + if is_leaf { 0 } else { (offset as u32) << 2 }, ..*self }
    }

    /// The record, unpacked.
    #[inline(always)]
    pub fn kind(&self) -> Kind {
        match self.index & LEAF {
            LEAF => Kind::Leaf { first: self.items[0] as usize, count: self.items[1] as usize },
            axis => Kind::Inner {
                axis: axis as usize,
                left: (self.index >> 2) as usize,
                clip: self.items.map(f32::from_bits),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_is_twelve_bytes_and_bits_lie_where_the_slides_put_them() {
        assert_eq!(Node::BYTES, 12);
        let inner = Node::inner(2, 5, [1.5, -0.0]);
        assert_eq!(bytemuck::cast::<Node, [u32; 3]>(inner), [5 << 2 | 2, 1.5f32.to_bits(), 1 << 31]);
        let leaf = Node::leaf(7, 3);
        assert_eq!(bytemuck::cast::<Node, [u32; 3]>(leaf), [3, 7, 3]);
    }

    #[test]
    fn every_kind_survives_packing() {
        for axis in 0..3 {
            let kind = Kind::Inner { axis, left: (1 << 30) - 2, clip: [f32::MAX, f32::MIN] };
            let Kind::Inner { axis, left, clip } = kind else { unreachable!() };
            assert_eq!(Node::inner(axis, left, clip).kind(), kind);
        }
        let kind = Kind::Leaf { first: 1 << 29, count: 1 << 29 };
        assert_eq!(Node::leaf(1 << 29, 1 << 29).kind(), kind);
        assert_eq!(Node::leaf(1 << 29, 1 << 29).piece_number(), None);
        assert_eq!(Node::piece(1 << 28).moved(9).piece_number(), Some(1 << 28));
    }
}
