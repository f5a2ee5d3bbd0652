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
    /// Pixels, multiples of 8.
    pub width: usize,
    pub height: usize,
}

#[derive(Debug)]
pub struct Mesh {
    pub view: View,
    /// And a spare row: Embree reads 16 bytes from the last one on.
    padded_vertices: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Triangles that share nothing, from one side of the unit cube.
    #[cfg(test)]
    pub fn of_soup(corners: &[[Vector; 3]], [width, height]: [usize; 2]) -> Self {
        let (eye, target) = ([0.5, 0.5, -1.5], [0.5, 0.5, 0.5]);
        let view = View { eye, target, up: [0.0, 1.0, 0.0], angle: 45.0, light: eye, width, height };
        let vertices = corners.as_flattened().iter().copied().chain([[0.0; 3]]).collect();
        let triangles = (0..corners.len() as u32).map(|row| [3 * row, 3 * row + 1, 3 * row + 2]).collect();
        Self { view, padded_vertices: vertices, triangles }
    }

    /// To be looked at in a picture of so many pixels.
    pub fn read(path: &Path, size: [usize; 2]) -> io::Result<Self> {
        let bytes = fs::read(path)?;
        Self::parse(&bytes, size).ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "not a mesh of the driver"))
    }

    fn parse(bytes: &[u8], [width, height]: [usize; 2]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(b"BIHBENCH")?;
        let vertices = u64::from_le_bytes(take(&mut rest)?) as usize;
        let triangles = u64::from_le_bytes(take(&mut rest)?) as usize;
        let mut number = || Some(f64::from_le_bytes(take(&mut rest)?) as f32);
        let mut point = || Some([number()?, number()?, number()?]);
        let (eye, target, up) = (point()?, point()?, point()?);
        let view = View { eye, target, up, angle: number()?, light: [number()?, number()?, number()?], width, height };
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

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> Vec<u8> {
        let mut bytes = b"BIHBENCH".to_vec();
        bytes.extend([3u64, 1].into_iter().flat_map(u64::to_le_bytes));
        bytes.extend((0..13).flat_map(|number| f64::from(number).to_le_bytes()));
        bytes.extend((0..9u8).flat_map(|number| f32::from(number).to_le_bytes()));
        bytes.extend([2u32, 1, 0].into_iter().flat_map(u32::to_le_bytes));
        bytes
    }

    #[test]
    fn a_file_is_read_as_it_was_written() {
        let mesh = Mesh::parse(&file(), [16, 8]).unwrap();
        assert_eq!(
            (mesh.view.eye, mesh.view.target, mesh.view.up),
            ([0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0])
        );
        assert_eq!((mesh.view.angle, mesh.view.light), (9.0, [10.0, 11.0, 12.0]));
        assert_eq!(mesh.vertices(), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]);
        assert_eq!(mesh.corners(0), [[6.0, 7.0, 8.0], [3.0, 4.0, 5.0], [0.0, 1.0, 2.0]]);
        assert_eq!((mesh.bounds().lower, mesh.bounds().upper), ([0.0, 1.0, 2.0], [6.0, 7.0, 8.0]));
    }

    #[test]
    fn a_file_cut_short_anywhere_is_refused() {
        let bytes = file();
        for length in 0..bytes.len() {
            assert!(Mesh::parse(&bytes[..length], [16, 8]).is_none(), "{length}");
        }
        assert!(Mesh::parse(&[&bytes[..], &[0]].concat(), [16, 8]).is_none());
    }
}
