//! Images of points and triangles as the real numbers that they are.

use super::EPSILON;
use super::exact::{self, Dyadic};
use super::watertight::{LARGEST, UNDERFLOW};
use crate::geometry::{Corners, Vector, subtract};

/// a · p + b of finite numbers, rounded once; infinite beyond the largest double.
#[cold]
pub fn rounded_sum(a: &Vector, p: &Vector, b: f64) -> f64 {
    let is_finite = a.iter().chain(p).chain([&b]).all(|x| x.is_finite());
    if is_finite { coordinate(a, p, b).to_f64() } else { f64::NAN }
}

fn coordinate(a: &Vector, p: &Vector, b: f64) -> Dyadic {
    let term = |i: usize| Dyadic::new(a[i]).times(&Dyadic::new(p[i]));
    term(0).plus(&term(1)).plus(&term(2)).plus(&Dyadic::new(b))
}

/// Whether the images of three corners, not rounded, lie on a line; `rounded` are the images, rounded once.
pub fn image_has_no_area(linear: &[Vector; 3], shift: &Vector, rounded: &Corners, corners: &Corners) -> bool {
    let (a, b) = (subtract(&rounded[1], &rounded[0]), subtract(&rounded[2], &rounded[0]));
    let largest = rounded.as_flattened().iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    // Each difference carries a rounding of its own and those of two images.
    let off = 2.1 * EPSILON * largest + f64::MIN_POSITIVE;
    let has_area = (0..3).any(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = (a[j] * b[k], a[k] * b[j]);
        let size = a[j].abs() + a[k].abs() + b[j].abs() + b[k].abs() + 2.0 * off;
        (p - q).abs() > 5.0 * EPSILON * (p.abs() + q.abs()) + 1.1 * off * size + UNDERFLOW
    });
    if largest < LARGEST && has_area {
        return false;
    }
    let point = |corner: &Vector| std::array::from_fn(|axis| coordinate(&linear[axis], corner, shift[axis]));
    exact::are_on_a_line(&corners.each_ref().map(point))
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDENTITY: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn is_flat(linear: &[Vector; 3], corners: &Corners) -> bool {
        let shift = [1e6, 0.0, 0.1];
        let image = |p: &Vector| std::array::from_fn(|i| rounded_sum(&linear[i], p, shift[i]));
        image_has_no_area(linear, &shift, &corners.each_ref().map(image), corners)
    }

    #[test]
    fn sums_are_rounded_once() {
        let tiny = f64::EPSILON / 2.0;
        assert_eq!(rounded_sum(&[1.0, tiny, 0.0], &[1.0, 1.0, 5.0], 0.0), 1.0);
        assert_eq!(rounded_sum(&[1.0, tiny, tiny], &[1.0, 1.0, tiny], 0.0), 1.0f64.next_up());
        assert_eq!(rounded_sum(&[1.0, tiny, -tiny], &[1.0, 1.0, tiny], 0.0), 1.0);
        assert_eq!(rounded_sum(&[1e200, 1.0, 0.0], &[1e200, 1.0, 0.0], 0.0), f64::INFINITY);
        assert_eq!(rounded_sum(&[1e200, -1e200, 0.0], &[1e200, 1e200, 0.0], -3.0), -3.0);
        assert_eq!(rounded_sum(&[1e-200, 0.0, 0.0], &[1e-123, 0.0, 0.0], 0.0), 1e-323);
        assert_eq!(rounded_sum(&[0.0; 3], &[1.0; 3], -0.0), 0.0);
        assert!(rounded_sum(&[0.0; 3], &[f64::INFINITY; 3], 0.0).is_nan());
    }

    #[test]
    fn an_area_of_the_image_is_told_exactly() {
        let corners: Corners = [[0.1, 0.2, 0.3], [1.1, 0.2, 0.7], [0.3, 1.7, 0.3]];
        assert!(!is_flat(&IDENTITY, &corners));
        assert!(is_flat(&[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]], &corners));
        assert!(is_flat(&[[0.0; 3]; 3], &corners));
        assert!(
            is_flat(&IDENTITY, &[[0.1; 3], [0.2; 3], [0.3; 3]])
                == exact::is_degenerate(&[[0.1; 3], [0.2; 3], [0.3; 3]])
        );
        // The images of the corners are rounded to one line, but do not lie on it.
        let thin: Corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 1e-30]];
        assert!(!is_flat(&IDENTITY, &thin));
        assert!(!is_flat(&[[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-300]], &thin));
    }
}
