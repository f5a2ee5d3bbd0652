//! The mesh that was saved with a tree.

use std::ops::Range;
use std::sync::Arc;

use super::Bytes;
use crate::geometry::{Triangles, Vertices};
use crate::tree::Shared;

/// Vertices, and rows of three of them, in a file.
#[derive(Debug)]
pub struct SavedMesh {
    vertices: SavedVertices,
    rows: Option<Shared<[u32; 3]>>,
}

#[derive(Debug)]
enum SavedVertices {
    F32(Shared<[f32; 3]>),
    F64(Shared<[f64; 3]>),
}

impl SavedMesh {
    /// Of the places in a file; none where one is not of whole items.
    pub(super) fn new(
        file: &Arc<Bytes>,
        is_double: bool,
        vertices: Range<usize>,
        rows: Option<Range<usize>>,
    ) -> Option<Self> {
        let vertices = if is_double {
            SavedVertices::F64(Shared::saved(file, vertices)?)
        } else {
            SavedVertices::F32(Shared::saved(file, vertices)?)
        };
        let rows = match rows {
            Some(rows) => Some(Shared::saved(file, rows)?),
            None => None,
        };
        Some(Self { vertices, rows })
    }

    /// The vertices.
    pub fn vertices(&self) -> Vertices<'_> {
        match &self.vertices {
            SavedVertices::F32(vertices) => Vertices::F32(vertices.slice(0..vertices.len())),
            SavedVertices::F64(vertices) => Vertices::F64(vertices.slice(0..vertices.len())),
        }
    }

    /// The rows of three vertices each; none for a soup.
    pub fn rows(&self) -> Option<&[[u32; 3]]> {
        self.rows.as_ref().map(|rows| rows.slice(0..rows.len()))
    }

    /// A view of the triangles, which were checked when they were loaded.
    pub fn triangles(&self) -> Triangles<'_> {
        Triangles::unchecked(self.vertices(), self.rows())
    }

    /// Bytes of vertices and rows.
    pub fn bytes(&self) -> usize {
        let vertices = match self.vertices() {
            Vertices::F32(vertices) => size_of_val(vertices),
            Vertices::F64(vertices) => size_of_val(vertices),
        };
        vertices + self.rows().map_or(0, size_of_val)
    }
}
