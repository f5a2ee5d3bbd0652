//! Triangles whose corners are real numbers that doubles make up: what exact decisions are about.

use std::array::from_fn;

use super::exact::{self, Dyadic};
use super::fixed::Int;
use super::whole::Span;
use crate::geometry::{Corners, Vector};

/// Three corners, all finite.
pub trait Real {
    /// What all coordinates are multiples of, and how large they are.
    fn span(&self) -> Span;

    /// The coordinates over 2^`exponent`, which has to be one that `span` allows.
    fn whole<const A: usize>(&self, exponent: i32) -> [[Int<A>; 3]; 3];

    /// The corners, if each coordinate is one double.
    fn doubles(&self) -> Option<&Corners>;

    /// In numbers of any length.
    fn points(&self) -> [exact::Point; 3];
}

impl Real for Corners {
    #[inline(always)]
    fn span(&self) -> Span {
        Span::of(self.as_flattened().iter())
    }

    #[inline(always)]
    fn whole<const A: usize>(&self, exponent: i32) -> [[Int<A>; 3]; 3] {
        self.map(|corner| corner.map(|x| Int::scaled(x, exponent)))
    }

    #[inline(always)]
    fn doubles(&self) -> Option<&Corners> {
        Some(self)
    }

    fn points(&self) -> [exact::Point; 3] {
        self.map(|corner| corner.map(Dyadic::new))
    }
}

/// The image of a triangle as a matrix makes it, not rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Image {
    /// The matrix, row by row.
    pub linear: [Vector; 3],
    /// What is added.
    pub shift: Vector,
    /// The corners that are moved.
    pub corners: Corners,
    /// Where they go, each coordinate rounded once.
    pub rounded: Corners,
}

impl Image {
    fn coordinates<T>(&self, coordinate: impl Fn(&Vector, &Vector, f64) -> T) -> [[T; 3]; 3] {
        from_fn(|corner| from_fn(|axis| coordinate(&self.linear[axis], &self.corners[corner], self.shift[axis])))
    }
}

impl Real for Image {
    fn span(&self) -> Span {
        let spans = self.coordinates(|row, corner, shift| {
            let terms = from_fn::<_, 3, _>(|i| Span::of_product(row[i], corner[i]));
            // A sum of four is below four times the largest.
            terms.into_iter().fold(Span::of([&shift].into_iter()), Span::joined).wider(2)
        });
        spans.into_iter().flatten().fold(Span::NONE, Span::joined)
    }

    fn whole<const A: usize>(&self, exponent: i32) -> [[Int<A>; 3]; 3] {
        self.coordinates(|row, corner, shift| {
            let term = |i: usize| Int::product(row[i], corner[i], exponent);
            term(0).plus(&term(1)).plus(&term(2)).plus(&Int::scaled(shift, exponent))
        })
    }

    fn doubles(&self) -> Option<&Corners> {
        None
    }

    fn points(&self) -> [exact::Point; 3] {
        self.coordinates(exact::sum_of_products)
    }
}
