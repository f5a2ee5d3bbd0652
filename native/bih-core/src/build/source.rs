//! Reading a mesh in the one form that it has: loops over many triangles are compiled for each form and instruction set.

use crate::geometry::{Triangles, Vertices, round_down, round_up};
use crate::simd::{Kernel, Lanes, dispatch, prefetch};

/// A coordinate as the mesh holds it.
pub trait Coordinate: Copy + PartialOrd + Into<f64> + Send + Sync {
    const NAN: Self;
    const INFINITY: Self;
    const NEG_INFINITY: Self;
    /// What a doubled centre is multiplied by, so that no coordinate overflows.
    const CENTRE_SCALE: f64;
    /// The nearest float32.
    fn single(self) -> f32;
    /// How far it is above another one, in single precision: rounded twice at most, infinite where that overflows.
    fn above_by(self, other: Self) -> f32;
    /// The largest float32 that is not above.
    fn below(self) -> f32;
    /// The smallest float32 that is not below.
    fn above(self) -> f32;
}

impl Coordinate for f32 {
    const NAN: Self = f32::NAN;
    const INFINITY: Self = f32::INFINITY;
    const NEG_INFINITY: Self = f32::NEG_INFINITY;
    const CENTRE_SCALE: f64 = 1.0;
    #[inline(always)]
    fn single(self) -> f32 {
        self
    }
    #[inline(always)]
    fn above_by(self, other: Self) -> f32 {
        self - other
    }
    #[inline(always)]
    fn below(self) -> f32 {
        self
    }
    #[inline(always)]
    fn above(self) -> f32 {
        self
    }
}

impl Coordinate for f64 {
    const NAN: Self = f64::NAN;
    const INFINITY: Self = f64::INFINITY;
    const NEG_INFINITY: Self = f64::NEG_INFINITY;
    const CENTRE_SCALE: f64 = 0.25;
    #[inline(always)]
    fn single(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn above_by(self, other: Self) -> f32 {
        (self - other) as f32
    }
    #[inline(always)]
    fn below(self) -> f32 {
        round_down(self)
    }
    #[inline(always)]
    fn above(self) -> f32 {
        round_up(self)
    }
}

/// The corners of triangles by row.
pub trait Source: Copy + Sync {
    type Scalar: Coordinate;
    /// NaN where a row names no vertex.
    fn corners(self, row: usize) -> [[Self::Scalar; 3]; 3];
    /// Bring near what `prefetch_corners` reads.
    fn prefetch_row(self, row: usize);
    /// Bring near what `corners` reads.
    fn prefetch_corners(self, row: usize);
}

#[derive(Clone, Copy)]
struct Indexed<'a, T> {
    vertices: &'a [[T; 3]],
    rows: &'a [[u32; 3]],
}

#[derive(Clone, Copy)]
struct Soup<'a, T> {
    vertices: &'a [[T; 3]],
}

impl<T: Coordinate> Source for Indexed<'_, T> {
    type Scalar = T;
    #[inline(always)]
    fn corners(self, row: usize) -> [[T; 3]; 3] {
        let [a, b, c] = self.rows.get(row).copied().unwrap_or([u32::MAX; 3]);
        [vertex(self.vertices, a as usize), vertex(self.vertices, b as usize), vertex(self.vertices, c as usize)]
    }
    #[inline(always)]
    fn prefetch_row(self, row: usize) {
        prefetch::<1, _>(self.rows, row);
    }
    #[inline(always)]
    fn prefetch_corners(self, row: usize) {
        for index in self.rows.get(row).copied().unwrap_or_default() {
            prefetch::<1, _>(self.vertices, index as usize);
        }
    }
}

impl<T: Coordinate> Source for Soup<'_, T> {
    type Scalar = T;
    #[inline(always)]
    fn corners(self, row: usize) -> [[T; 3]; 3] {
        [vertex(self.vertices, 3 * row), vertex(self.vertices, 3 * row + 1), vertex(self.vertices, 3 * row + 2)]
    }
    #[inline(always)]
    fn prefetch_row(self, _: usize) {}
    #[inline(always)]
    fn prefetch_corners(self, row: usize) {
        for index in [3 * row, 3 * row + 2] {
            prefetch::<1, _>(self.vertices, index);
        }
    }
}

#[inline(always)]
fn vertex<T: Coordinate>(vertices: &[[T; 3]], index: usize) -> [T; 3] {
    vertices.get(index).copied().unwrap_or([T::NAN; 3])
}

/// A loop over triangles. `run` and all that it calls must be inlined, to be compiled for the instruction set.
pub trait Reading {
    type Output;
    fn run<S: Source>(self, source: S) -> Self::Output;
}

struct ReadFrom<R, S>(R, S);

impl<R: Reading, S: Source> Kernel for ReadFrom<R, S> {
    type Output = R::Output;
    #[inline(always)]
    fn run<L: Lanes>(self) -> R::Output {
        self.0.run(self.1)
    }
}

/// Do it, in the form that the mesh has.
pub fn read<R: Reading>(triangles: &Triangles, reading: R) -> R::Output {
    match (triangles.vertices(), triangles.rows()) {
        (Vertices::F32(vertices), Some(rows)) => dispatch(ReadFrom(reading, Indexed { vertices, rows })),
        (Vertices::F32(vertices), None) => dispatch(ReadFrom(reading, Soup { vertices })),
        (Vertices::F64(vertices), Some(rows)) => dispatch(ReadFrom(reading, Indexed { vertices, rows })),
        (Vertices::F64(vertices), None) => dispatch(ReadFrom(reading, Soup { vertices })),
    }
}

/// The corners of some rows, which lie anywhere: memory is asked for those that come soon.
pub fn each_row<S: Source>(source: S, rows: &[u32]) -> EachRow<'_, S> {
    EachRow { source, rows, place: 0 }
}

/// An iterator, since a closure is a function of its own, which may not have the instruction set of the loop.
pub struct EachRow<'a, S> {
    source: S,
    rows: &'a [u32],
    place: usize,
}

impl<S: Source> Iterator for EachRow<'_, S> {
    type Item = [[S::Scalar; 3]; 3];

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        const AHEAD: usize = 16;
        let Self { source, rows, place } = *self;
        let row = *rows.get(place)?;
        if let Some(&later) = rows.get(place + 2 * AHEAD) {
            source.prefetch_row(later as usize);
        }
        if let Some(&later) = rows.get(place + AHEAD) {
            source.prefetch_corners(later as usize);
        }
        self.place += 1;
        Some(source.corners(row as usize))
    }
}

/// The smaller one; the second where either is NaN.
#[inline(always)]
pub fn least<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The larger one; the second where either is NaN.
#[inline(always)]
pub fn most<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// Lower and upper corner of a triangle's box.
#[inline(always)]
pub fn box_of<T: Coordinate>([a, b, c]: &[[T; 3]; 3]) -> [[T; 3]; 2] {
    [
        std::array::from_fn(|axis| least(least(a[axis], b[axis]), c[axis])),
        std::array::from_fn(|axis| most(most(a[axis], b[axis]), c[axis])),
    ]
}

/// Twice the centre of a box, times `CENTRE_SCALE`.
#[inline(always)]
pub fn doubled_centre<T: Coordinate>([lower, upper]: &[[T; 3]; 2]) -> [f64; 3] {
    std::array::from_fn(|axis| T::CENTRE_SCALE * lower[axis].into() + T::CENTRE_SCALE * upper[axis].into())
}
