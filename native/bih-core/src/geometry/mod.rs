//! Bounds, rays and views of triangles.

mod bounds;
mod ray;
mod triangles;

pub use bounds::{Bounds, round_down, round_up};
pub use ray::Ray;
pub use triangles::{Corners, Triangles, Vertices};

/// A point or direction in double precision.
pub type Vector = [f64; 3];

/// a - b
#[inline(always)]
pub fn subtract(a: &Vector, b: &Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + s b
#[inline(always)]
pub fn add_scaled(a: &Vector, s: f64, b: &Vector) -> Vector {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// a × b
#[inline(always)]
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a · b
#[inline(always)]
pub fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a divided by its length; the zero vector stays zero.
#[inline]
pub fn normalise(a: &Vector) -> Vector {
    unit(a).unwrap_or_else(|| normalise_slowly(a))
}

/// The unit normal of a triangle with these two edges; zero where it has no area.
#[inline]
pub fn normal(a: &Vector, b: &Vector) -> Vector {
    unit(&cross(a, b)).unwrap_or_else(|| normalise(&cross(&normalise(a), &normalise(b))))
}

/// Squares of lengths that neither overflowed nor underflowed.
pub(crate) const PLAIN_SQUARES: std::ops::Range<f64> = 1e-200..1e200;

/// a divided by its length where the squares neither overflow nor underflow.
#[inline(always)]
fn unit(a: &Vector) -> Option<Vector> {
    let squared = dot(a, a);
    PLAIN_SQUARES.contains(&squared).then(|| {
        let inverse = 1.0 / squared.sqrt();
        a.map(|x| x * inverse)
    })
}

#[cold]
fn normalise_slowly(a: &Vector) -> Vector {
    // Scaling by the largest component first keeps the squares in range.
    let largest = a[0].abs().max(a[1].abs()).max(a[2].abs());
    if largest == 0.0 || !largest.is_finite() {
        return *a;
    }
    let b = [a[0] / largest, a[1] / largest, a[2] / largest];
    let length = dot(&b, &b).sqrt();
    [b[0] / length, b[1] / length, b[2] / length]
}
