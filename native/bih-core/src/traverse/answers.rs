//! What a batch of rays is answered with.

use super::Hit;

/// A number that answers are given in.
pub trait Float: Copy + Send + 'static {
    /// The distance of a miss.
    const INFINITY: Self;
    /// The weights of a miss.
    const ZERO: Self;
    /// The nearest one; a finite number stays finite: infinity means a miss.
    fn narrowed(x: f64) -> Self;
}

impl Float for f32 {
    const INFINITY: Self = f32::INFINITY;
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn narrowed(x: f64) -> Self {
        if x.is_finite() { (x as f32).clamp(f32::MIN, f32::MAX) } else { x as f32 }
    }
}

impl Float for f64 {
    const INFINITY: Self = f64::INFINITY;
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn narrowed(x: f64) -> Self {
        x
    }
}

/// The nearest hits of many rays.
#[derive(Debug, Clone, PartialEq)]
pub struct Hits<F> {
    /// Distances; infinite for a miss.
    pub t: Vec<F>,
    /// Rows of the triangles; -1 for a miss.
    pub triangle: Vec<i32>,
    /// Weights of their second vertices.
    pub u: Vec<F>,
    /// Weights of their third vertices.
    pub v: Vec<F>,
    /// How many rays no answer can be given for.
    pub invalid: usize,
}

/// Where the answers of a thread's rays go.
pub(super) trait Answers<A> {
    fn len(&self) -> usize;
    fn put(&mut self, place: usize, answer: A);
}

impl<A> Answers<A> for &mut [A] {
    fn len(&self) -> usize {
        <[A]>::len(self)
    }
    #[inline(always)]
    fn put(&mut self, place: usize, answer: A) {
        self[place] = answer;
    }
}

/// A part of `Hits`, filled with misses.
pub(super) struct HitsMut<'a, F> {
    pub t: &'a mut [F],
    pub triangle: &'a mut [i32],
    pub u: &'a mut [F],
    pub v: &'a mut [F],
}

impl<F: Float> Answers<Option<Hit>> for HitsMut<'_, F> {
    fn len(&self) -> usize {
        self.t.len()
    }
    #[inline(always)]
    fn put(&mut self, place: usize, answer: Option<Hit>) {
        if let Some(hit) = answer {
            self.t[place] = F::narrowed(hit.t);
            self.triangle[place] = hit.triangle as i32;
            self.u[place] = F::narrowed(hit.u);
            self.v[place] = F::narrowed(hit.v);
        }
    }
}
