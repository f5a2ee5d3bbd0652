//! A mesh and how it is looked at, as the driver writes them: little-endian, no padding.
//!
//! "BIHBENCH", the numbers of vertices and triangles (u64), then as f64 the eye, the point looked at, up, the angle of view
//! in degrees (vertical), the point light; then the vertices (f32) and the triangles (u32).

use std::fs;
use std::io;
use std::path::Path;

use bih_core::{Bounds, Triangles, Vertices};

use crate::vector::Vector;

/// Where a picture is taken from, and the light.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub eye: Vector,
    pub target: Vector,
    pub up: Vector,
    /// Vertical, in degrees.
    pub angle: f32,
    pub light: Vector,
}

#[derive(Debug)]
pub struct Mesh {
    pub view: View,
    /// And a spare row: Embree reads 16 bytes from the last one on.
    padded_vertices: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn read(path: &Path) -> io::Result<Self> {
        let bytes = fs::read(path)?;
        Self::parse(&bytes).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "not a mesh of the driver"))
    }

    fn parse(bytes: &[u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(b"BIHBENCH")?;
        let vertices = u64::from_le_bytes(take(&mut rest)?) as usize;
        let triangles = u64::from_le_bytes(take(&mut rest)?) as usize;
        let mut number = || Some(f64::from_le_bytes(take(&mut rest)?) as f32);
        let mut point = || Some([number()?, number()?, number()?]);
        let (eye, target, up) = (point()?, point()?, point()?);
        let view = View { eye, target, up, angle: number()?, light: [number()?, number()?, number()?] };
        let (coordinates, rows) = rest.split_at_checked(vertices.checked_mul(12)?)?;
        if rows.len() != triangles.checked_mul(12)? {
            return None;
        }
        let (coordinates, _) = coordinates.as_chunks();
        let (rows, _) = rows.as_chunks();
        Some(Self {
            view,
            padded_vertices: coordinates.iter().map(|row| triple(row, f32::from_le_bytes)).chain([[0.0; 3]]).collect(),
            triangles: rows.iter().map(|row| triple(row, u32::from_le_bytes)).collect(),
        })
    }

    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.padded_vertices[..self.padded_vertices.len() - 1]
    }

    /// The view that bih-core builds on.
    pub fn borrowed(&self) -> Triangles<'_> {
        Triangles::new(Vertices::F32(self.vertices()), Some(&self.triangles)).expect("the driver writes valid rows")
    }

    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for vertex in self.vertices() {
            bounds = bounds.union(&Bounds { lower: *vertex, upper: *vertex });
        }
        bounds
    }

    pub fn corners(&self, triangle: u32) -> [Vector; 3] {
        self.triangles[triangle as usize].map(|row| self.padded_vertices[row as usize])
    }
}

fn take<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*first)
}

fn triple<T>(row: &[u8; 12], number: impl Fn([u8; 4]) -> T) -> [T; 3] {
    std::array::from_fn(|axis| number(std::array::from_fn(|byte| row[4 * axis + byte])))
}
