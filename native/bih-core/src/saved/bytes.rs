//! The bytes of a file: mapped, or read into memory.

#![expect(unsafe_code, reason = "the memory map: another process may change what is mapped")]

use std::fs::File;
use std::io::{self, Read};
use std::ops::Deref;

use bytemuck::{Pod, Zeroable};
use memmap2::{Mmap, MmapOptions};

/// As far as any section is aligned.
pub const ALIGNMENT: usize = 64;

/// The bytes of a file, aligned to `ALIGNMENT`.
pub struct Bytes(Held);

enum Held {
    Mapped(Mmap),
    Read { lines: Vec<Line>, len: usize },
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u8; ALIGNMENT]);

impl Bytes {
    /// The first `len` bytes of a file, read from the disk where they are used.
    pub fn map(file: &File, len: usize) -> io::Result<Self> {
        // SAFETY: the map is private and nobody writes through it. What is left is another process that changes the file
        // in its place, which no program can rule out: docs/format.md says what then happens, and `save` never does it.
        // No check is left out because of what the bytes are: they are plain numbers, and each index among them is
        // compared with the length of its array where it is used, as that of any tree.
        let map = unsafe { MmapOptions::new().len(len).map_copy_read_only(file)? };
        Ok(Self(Held::Mapped(map)))
    }

    /// The first `len` bytes, from now on independent of the file.
    pub fn read(file: &mut impl Read, len: usize) -> io::Result<Self> {
        let mut lines = Vec::new();
        let count = len.div_ceil(ALIGNMENT);
        if lines.try_reserve_exact(count).is_err() {
            return Err(io::Error::new(io::ErrorKind::OutOfMemory, format!("{len} bytes of memory are needed")));
        }
        lines.resize(count, Line::zeroed());
        file.read_exact(&mut bytemuck::cast_slice_mut(&mut lines)[..len])?;
        Ok(Self(Held::Read { lines, len }))
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match &self.0 {
            Held::Mapped(map) => map,
            Held::Read { lines, len } => &bytemuck::cast_slice(lines)[..*len],
        }
    }
}
