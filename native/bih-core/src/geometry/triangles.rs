//! Views of triangle meshes: single or double precision, indexed or a soup.

use super::Vector;
use crate::error::Error;

/// The three vertices of a triangle.
pub type Corners = [Vector; 3];

/// Borrowed vertices in the precision they came in.
#[derive(Debug, Clone, Copy)]
pub enum Vertices<'a> {
    /// Single precision.
    F32(&'a [[f32; 3]]),
    /// Double precision.
    F64(&'a [[f64; 3]]),
}

impl Vertices<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Vertex `row`; NaN where there is none, which only a borrowed array that was changed behind our back can bring about.
    #[inline(always)]
    fn get(&self, row: usize) -> Vector {
        match self {
            Self::F32(v) => v.get(row).map_or([f64::NAN; 3], |p| p.map(f64::from)),
            Self::F64(v) => v.get(row).copied().unwrap_or([f64::NAN; 3]),
        }
    }
}

/// A borrowed mesh: vertices, and rows of three of them; without rows each three vertices are one triangle.
#[derive(Debug, Clone, Copy)]
pub struct Triangles<'a> {
    vertices: Vertices<'a>,
    rows: Option<&'a [[u32; 3]]>,
}

impl<'a> Triangles<'a> {
    /// The most triangles one tree can hold: two nodes a triangle in a 30-bit child index.
    pub const LIMIT: usize = 1 << 29;

    /// Check the shape: every row names vertices that are there, and no more triangles than a tree can hold.
    pub fn new(vertices: Vertices<'a>, rows: Option<&'a [[u32; 3]]>) -> Result<Self, Error> {
        let count = vertices.len();
        match rows {
            None if !count.is_multiple_of(3) => return Err(Error::RaggedSoup { vertices: count }),
            None => {}
            Some(rows) => {
                for (row, corners) in rows.iter().enumerate() {
                    if let Some(&vertex) = corners.iter().find(|&&vertex| vertex as usize >= count) {
                        return Err(Error::VertexOutOfRange { row, vertex, vertices: count });
                    }
                }
            }
        }
        let triangles = Self::unchecked(vertices, rows);
        if triangles.len() > Self::LIMIT {
            return Err(Error::TooManyTriangles { triangles: triangles.len(), limit: Self::LIMIT });
        }
        Ok(triangles)
    }

    /// A view of a mesh that `new` accepted before. A row that names no vertex is a triangle that nothing hits.
    pub fn unchecked(vertices: Vertices<'a>, rows: Option<&'a [[u32; 3]]>) -> Self {
        Self { vertices, rows }
    }

    /// How many triangles there are.
    pub fn len(&self) -> usize {
        self.rows.map_or(self.vertices.len() / 3, <[_]>::len)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the coordinates are doubles.
    pub fn is_double(&self) -> bool {
        matches!(self.vertices, Vertices::F64(_))
    }

    /// The vertices.
    pub(crate) fn vertices(&self) -> Vertices<'a> {
        self.vertices
    }

    /// The rows of three vertices each; none for a soup.
    pub(crate) fn rows(&self) -> Option<&'a [[u32; 3]]> {
        self.rows
    }

    /// The corners of triangle `row`.
    #[inline(always)]
    pub fn corners(&self, row: u32) -> Corners {
        let row = row as usize;
        let [a, b, c] = match self.rows {
            Some(rows) => rows.get(row).map_or([usize::MAX; 3], |r| r.map(|v| v as usize)),
            None => [3 * row, 3 * row + 1, 3 * row + 2],
        };
        [self.vertices.get(a), self.vertices.get(b), self.vertices.get(c)]
    }
}
