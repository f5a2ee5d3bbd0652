//! Numbers and vectors of the rays of a block, side by side: loops over them become vector instructions.

use crate::geometry::{Vector, normalise};
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
    for (numbers, &x) in vectors.iter_mut().zip(vector) {
        numbers[i] = x;
    }
}

/// Write each number by its place. Vectors are written where they are to be: to give them back would copy them.
#[inline(always)]
pub(super) fn write(numbers: &mut Numbers, number: impl Fn(usize) -> f64) {
    for (i, x) in numbers.iter_mut().enumerate() {
        *x = number(i);
    }
}

/// Each number by its place.
#[inline(always)]
pub(super) fn each(number: impl Fn(usize) -> f64) -> Numbers {
    let mut numbers = [0.0; PACKET];
    write(&mut numbers, number);
    numbers
}

/// a · b
#[inline(always)]
pub(super) fn dots(a: &Vectors, b: &Vectors) -> Numbers {
    each(|i| a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i])
}

/// Write a × b.
#[inline(always)]
pub(super) fn cross_each(a: &Vectors, b: &Vectors, product: &mut Vectors) {
    for (axis, product) in product.iter_mut().enumerate() {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        write(product, |i| a[j][i] * b[k][i] - a[k][i] * b[j][i]);
    }
}

/// Each divided by its length.
#[inline(always)]
pub(super) fn normalise_each(vectors: &mut Vectors) {
    normalise_or(vectors, |vectors, i| normalise(&at(vectors, i)));
}

/// Each divided by its length; the few whose squares may overflow or underflow are given by their places.
#[inline(always)]
pub(super) fn normalise_or(vectors: &mut Vectors, slowly: impl Fn(&Vectors, usize) -> Vector) {
    let squares = dots(vectors, vectors);
    let mut inverse = each(|i| 1.0 / squares[i].sqrt());
    let are_plain = squares.iter().fold(true, |all, square| all & (1e-200..1e200).contains(square));
    if !are_plain {
        for i in (0..PACKET).filter(|&i| !(1e-200..1e200).contains(&squares[i])) {
            let unit = slowly(vectors, i);
            put(vectors, i, &unit);
            inverse[i] = 1.0;
        }
    }
    for numbers in vectors {
        for (x, inverse) in numbers.iter_mut().zip(&inverse) {
            *x *= inverse;
        }
    }
}
