//! Numbers and vectors of the rays of a block, side by side: loops over them become vector instructions.

use crate::geometry::{PLAIN_SQUARES, Vector, dot};
use crate::traverse::PACKET;

/// A number for each ray.
pub(super) type Numbers = [f64; PACKET];
/// A vector for each, one axis after another.
pub(super) type Vectors = [Numbers; 3];

pub(super) const ZEROS: Vectors = [[0.0; PACKET]; 3];

#[inline(always)]
pub(super) fn at(vectors: &Vectors, i: usize) -> Vector {
    [vectors[0][i], vectors[1][i], vectors[2][i]]
}

#[inline(always)]
pub(super) fn put(vectors: &mut Vectors, i: usize, vector: &Vector) {
    vectors[0][i] = vector[0];
    vectors[1][i] = vector[1];
    vectors[2][i] = vector[2];
}

/// Lengths of vectors, to divide by; where a square overflows or underflows, the vector is looked at again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lengths {
    squares: Numbers,
}

impl Lengths {
    /// The lengths that vectors have, by their places.
    #[inline(always)]
    pub fn of(vector: impl Fn(usize) -> Vector) -> Self {
        let mut squares = [0.0; PACKET];
        for (i, square) in squares.iter_mut().enumerate() {
            let vector = vector(i);
            *square = dot(&vector, &vector);
        }
        Self { squares }
    }

    /// The few places where the squares say too little: what is there is to be divided by its length in another way, and
    /// then counts as of unit length.
    #[inline(always)]
    pub fn each_extreme(&mut self, mut divide: impl FnMut(usize)) {
        let is_extreme = |square: &f64| !PLAIN_SQUARES.contains(square);
        let is_any = self.squares.iter().fold(false, |any, square| any | is_extreme(square));
        if is_any {
            for (i, square) in self.squares.iter_mut().enumerate().filter(|(_, square)| is_extreme(square)) {
                divide(i);
                *square = 1.0;
            }
        }
    }

    /// What a vector is to be multiplied with.
    #[inline(always)]
    pub fn inverse(&self, i: usize) -> f64 {
        1.0 / self.squares[i].sqrt()
    }
}
