//! Views of triangle meshes: single or double precision, indexed or a soup.

use super::Vector;
use crate::error::Error;
use crate::simd::prefetch;

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
            Self::F32(v) => v.get(row).map_or([f64::NAN; 3], |&[x, y, z]| [f64::from(x), f64::from(y), f64::from(z)]),
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

    /// Tell the processor that `prefetch_corners` comes next.
    #[inline(always)]
    pub(crate) fn prefetch_row(&self, row: u32) {
        if let Some(rows) = self.rows {
            prefetch::<1, _>(rows, row as usize);
        }
    }

    /// Tell the processor that the corners of triangle `row` are read soon.
    #[inline(always)]
    pub(crate) fn prefetch_corners(&self, row: u32) {
        for vertex in self.vertices_of(row) {
            match self.vertices {
                Vertices::F32(vertices) => prefetch::<1, _>(vertices, vertex),
                Vertices::F64(vertices) => prefetch::<1, _>(vertices, vertex),
            }
        }
    }

    /// The rows of its vertices.
    #[inline(always)]
    fn vertices_of(&self, row: u32) -> [usize; 3] {
        let row = row as usize;
        match self.rows {
            Some(rows) => rows.get(row).map_or([usize::MAX; 3], |&[a, b, c]| [a as usize, b as usize, c as usize]),
            None => [3 * row, 3 * row + 1, 3 * row + 2],
        }
    }

    /// The corners of triangle `row`, rounded to single precision.
    #[inline(always)]
    pub fn single_corners(&self, row: u32) -> [[f32; 3]; 3] {
        match (self.vertices, self.rows) {
            (Vertices::F32(vertices), Some(rows)) => {
                let corner = |vertex: u32| vertices.get(vertex as usize).copied().unwrap_or([f32::NAN; 3]);
                rows.get(row as usize).map_or([[f32::NAN; 3]; 3], |corners| corners.map(corner))
            }
            _ => self.corners(row).map(|corner| corner.map(|x| x as f32)),
        }
    }

    /// The corners of triangle `row`.
    #[inline(always)]
    pub fn corners(&self, row: u32) -> Corners {
        let [a, b, c] = self.vertices_of(row);
        [self.vertices.get(a), self.vertices.get(b), self.vertices.get(c)]
    }
}
