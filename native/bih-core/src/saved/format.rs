//! What stands where in a file: docs/format.md, byte by byte.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::bytes::ALIGNMENT;
use crate::build::{Heuristic, Layout, Precision, Structure};

/// The first eight bytes. No text begins like this, and what is sent as text does not arrive like this.
pub const MAGIC: [u8; 8] = *b"\x89BIH\r\n\x1a\n";

/// Of the format; raised with every change of a record or of what stands in the header.
pub const VERSION: u32 = 1;

/// As the machine that wrote the file holds it.
pub const BYTE_ORDER: u32 = 0x0102_0304;

/// The sections, in the order in which they stand.
pub const SECTIONS: [&str; 6] = ["vertices", "triangles", "order", "nodes", "rows", "left_out"];

/// The first bytes of a file.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    pub magic: [u8; 8],
    pub version: u32,
    pub byte_order: u32,
    /// Of the whole file.
    pub file_bytes: u64,
    /// Of this header, with zero in the place of the checksum.
    pub checksum: u32,
    pub sections: u32,
    pub structure: u8,
    pub layout: u8,
    pub heuristic: u8,
    pub precision: u8,
    /// Bytes of a coordinate.
    pub coordinate: u8,
    pub is_indexed: u8,
    pub is_presorted: u8,
    pub zero: u8,
    pub leaf_size: u32,
    pub depth: u32,
    pub rejected: u64,
    pub leaves: u64,
    pub peak_build_bytes: u64,
    pub build_seconds: f64,
    /// Lower and upper corner.
    pub bounds: [[f32; 3]; 2],
    pub zeros: [u64; 3],
    pub table: [Section; SECTIONS.len()],
}

/// Where a section is, of what, and its checksum.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Section {
    pub start: u64,
    pub bytes: u64,
    pub item_bytes: u32,
    pub checksum: u32,
}

impl Header {
    /// Its checksum as it should be.
    pub fn sum(&self) -> u32 {
        crc32fast::hash(bytemuck::bytes_of(&Self { checksum: 0, ..*self }))
    }
}

/// Where the next section begins behind one that ends here; none where no file is that long.
pub fn aligned(end: u64) -> Option<u64> {
    end.checked_next_multiple_of(ALIGNMENT as u64)
}

/// The checksum of a section: CRC-32, by all threads of the pool.
pub fn checksum(bytes: &[u8]) -> u32 {
    const PART: usize = 1 << 20;
    let parts = bytes.par_chunks(PART).map(|part| {
        let mut sum = crc32fast::Hasher::new();
        sum.update(part);
        sum
    });
    let joined = parts.reduce(crc32fast::Hasher::new, |mut sum, next| {
        sum.combine(&next);
        sum
    });
    joined.finalize()
}

/// A choice that a number in the header stands for.
pub trait Coded: Sized + Copy + PartialEq + 'static {
    /// The name of the argument.
    const NAME: &'static str;
    /// All there are, each in the place of its number.
    const ALL: &'static [Self];
    /// The number. A match, so that none is forgotten.
    fn code(self) -> u8;

    /// The choice of a number.
    fn of(code: u8) -> Result<Self, String> {
        Self::ALL.get(usize::from(code)).copied().ok_or_else(|| format!("{}: {code} is unknown", Self::NAME))
    }
}

impl Coded for Structure {
    const NAME: &'static str = "structure";
    const ALL: &'static [Self] = &[Self::Bih, Self::KdTree, Self::Bvh];
    fn code(self) -> u8 {
        match self {
            Self::Bih => 0,
            Self::KdTree => 1,
            Self::Bvh => 2,
        }
    }
}

impl Coded for Layout {
    const NAME: &'static str = "layout";
    const ALL: &'static [Self] = &[Self::Classic, Self::Wide, Self::Compact];
    fn code(self) -> u8 {
        match self {
            Self::Classic => 0,
            Self::Wide => 1,
            Self::Compact => 2,
        }
    }
}

impl Coded for Heuristic {
    const NAME: &'static str = "heuristic";
    const ALL: &'static [Self] = &[Self::Global, Self::Local, Self::Sah];
    fn code(self) -> u8 {
        match self {
            Self::Global => 0,
            Self::Local => 1,
            Self::Sah => 2,
        }
    }
}

impl Coded for Precision {
    const NAME: &'static str = "precision";
    const ALL: &'static [Self] = &[Self::Fast, Self::Watertight, Self::Exact];
    fn code(self) -> u8 {
        match self {
            Self::Fast => 0,
            Self::Watertight => 1,
            Self::Exact => 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_is_as_documented() {
        assert_eq!((size_of::<Section>(), size_of::<Header>()), (24, 272));
        assert_eq!(std::mem::offset_of!(Header, structure), 32);
        assert_eq!(std::mem::offset_of!(Header, bounds), 80);
        assert_eq!(std::mem::offset_of!(Header, table), 128);
    }

    #[test]
    fn numbers_and_choices_belong_together() {
        fn check<T: Coded + std::fmt::Debug>() {
            for (place, &choice) in T::ALL.iter().enumerate() {
                assert_eq!(usize::from(choice.code()), place);
                assert_eq!(T::of(choice.code()), Ok(choice));
            }
            assert!(T::of(T::ALL.len() as u8).is_err());
        }
        check::<Structure>();
        check::<Layout>();
        check::<Heuristic>();
        check::<Precision>();
    }

    #[test]
    fn checksum_in_parts_is_that_of_the_whole() {
        let bytes: Vec<u8> = (0..(5 << 19) + 17u32).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 24) as u8).collect();
        for end in [0, 1, 1 << 20, bytes.len()] {
            assert_eq!(checksum(&bytes[..end]), crc32fast::hash(&bytes[..end]));
        }
    }
}
