//! The node record.

use bytemuck::{Pod, Zeroable};

use crate::tree::Kind;

const LEAF: u32 = 0b11;

/// Eight bytes, as Wald 2004, "Realtime Ray Tracing and Interactive Global Illumination":
///
/// | bits | inner node | leaf |
/// | --- | --- | --- |
/// | 0 – 1 | split axis, 0 x, 1 y, 2 z | 3 |
/// | 2 – 31 | index of the left child; the right one is next to it | number of references |
/// | 32 – 63 | split plane | first reference |
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct KdNode {
    index: u32,
    item: u32,
}

impl KdNode {
    /// Bytes of one node.
    pub const BYTES: usize = size_of::<Self>();

    /// An inner node whose children are `left` and `left + 1`.
    pub fn inner(axis: usize, left: usize, plane: f32) -> Self {
        debug_assert!(axis < 3 && left < 1 << 30);
        Self { index: (left as u32) << 2 | axis as u32, item: plane.to_bits() }
    }

    /// A leaf of `count` references from `first`.
    pub fn leaf(first: usize, count: usize) -> Self {
        debug_assert!(first < 1 << 32 && count < 1 << 30);
        Self { index: (count as u32) << 2 | LEAF, item: first as u32 }
    }

    /// The record, unpacked as one of the Bounding Interval Hierarchy whose two clip planes coincide.
    #[inline(always)]
    pub fn kind(&self) -> Kind {
        let index = (self.index >> 2) as usize;
        match self.index & LEAF {
            LEAF => Kind::Leaf { first: self.item as usize, count: index },
            axis => Kind::Inner { axis: axis as usize, left: index, clip: [f32::from_bits(self.item); 2] },
        }
    }

    /// The same node where its children stand `nodes` further on and its references `references`.
    pub(super) fn moved(self, nodes: usize, references: usize) -> Self {
        match self.kind() {
            Kind::Inner { axis, left, clip } => Self::inner(axis, left + nodes, clip[0]),
            Kind::Leaf { first, count } => Self::leaf(first + references, count),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn record_is_eight_bytes_and_every_kind_survives_packing() {
        assert_eq!(KdNode::BYTES, 8);
        for axis in 0..3 {
            let kind = Kind::Inner { axis, left: (1 << 30) - 2, clip: [-f32::MIN_POSITIVE; 2] };
            assert_eq!(KdNode::inner(axis, (1 << 30) - 2, -f32::MIN_POSITIVE).kind(), kind);
        }
        let kind = Kind::Leaf { first: (1 << 32) - 1, count: (1 << 30) - 1 };
        assert_eq!(KdNode::leaf((1 << 32) - 1, (1 << 30) - 1).kind(), kind);
    }
}
