//! Images of triangles as the real numbers that they are: filters that know of their rounding, and then exactly.

use super::distance::{Approximation, Distance, quotient, relative, triple_product};
use super::exact;
use super::real::Image;
use super::watertight::{LARGEST, UNDERFLOW};
use super::{EPSILON, RayTest};
use crate::geometry::{Bounds, Ray, Vector, subtract};

/// a · p + b of finite numbers, rounded once; infinite beyond the largest double.
#[cold]
pub fn rounded_sum(a: &Vector, p: &Vector, b: f64) -> f64 {
    let is_finite = a.iter().chain(p).chain([&b]).all(|x| x.is_finite());
    if is_finite { exact::sum_of_products(a, p, b).to_f64() } else { f64::NAN }
}

/// What rounding takes from a coordinate of this size at most: half a unit in the last place.
fn rounding(size: f64) -> f64 {
    1.001 * EPSILON * size + f64::MIN_POSITIVE
}

impl RayTest {
    /// For images within some bounds.
    pub fn of_images(ray: &Ray, bounds: &Bounds) -> Self {
        let size = |axis: usize| f64::from(bounds.lower[axis].abs().max(bounds.upper[axis].abs()));
        Self::of_rounded(ray, bounds, &std::array::from_fn(|axis| rounding(size(axis))))
    }
}

impl Image {
    /// Whether it is made of finite numbers that double precision holds.
    pub fn is_finite(&self) -> bool {
        self.rounded.as_flattened().iter().chain(self.corners.as_flattened()).all(|x| x.is_finite())
    }

    /// What rounding took from a coordinate at most.
    fn off(&self) -> f64 {
        rounding(self.rounded.as_flattened().iter().fold(0.0, |largest: f64, x| largest.max(x.abs())))
    }

    /// Whether the line of the ray meets the closed image; exact. `test` is one of images.
    #[inline(always)]
    pub fn is_met(&self, test: &RayTest) -> bool {
        test.is_clearly_inside(&self.rounded).unwrap_or_else(|| self.is_met_exactly(test))
    }

    #[cold]
    fn is_met_exactly(&self, test: &RayTest) -> bool {
        self.is_finite() && exact::is_inside(self, &test.origin, &test.direction, [None; 3]).0
    }

    /// Whether the line, moved by less than any number, crosses the image; exact.
    #[inline(always)]
    pub fn is_crossed(&self, test: &RayTest) -> bool {
        test.is_clearly_inside(&self.rounded).unwrap_or_else(|| self.is_crossed_exactly(test))
    }

    #[cold]
    fn is_crossed_exactly(&self, test: &RayTest) -> bool {
        self.is_finite() && exact::is_crossed(self, &test.origin, &test.direction)
    }

    /// `t` of an image that the ray's line meets.
    #[inline]
    pub fn distance(&self, test: &RayTest) -> Distance {
        let [to_corner, e1, e2] = relative(test, &self.rounded);
        let off = self.off();
        let above = moved(triple_product(&to_corner, &e1, &e2), [&to_corner, &e1, &e2], [off, 2.0 * off, 2.0 * off]);
        let below =
            moved(triple_product(&test.direction, &e1, &e2), [&test.direction, &e1, &e2], [0.0, 2.0 * off, 2.0 * off]);
        let Approximation { value, error } = quotient(above, below);
        if test.is_in_range() && error < f64::INFINITY {
            return Distance { t: value, error };
        }
        let t = exact::distance(self, &test.origin, &test.direction);
        Distance { t, error: 2.0 * EPSILON * t.abs() + f64::MIN_POSITIVE }
    }

    /// t, u and v where the ray's line meets the image, each off by hardly more than half a unit in the last place.
    pub fn numbers(&self, test: &RayTest) -> [f64; 3] {
        let (origin, direction) = (&test.origin, &test.direction);
        let [u, v] = exact::weights(self, origin, direction);
        [exact::distance(self, origin, direction), u, v]
    }

    /// Whether the corners, all finite, lie on a line.
    pub fn has_no_area(&self) -> bool {
        let [first, second, third] = &self.rounded;
        let (a, b) = (subtract(second, first), subtract(third, first));
        // Each difference carries a rounding of its own and those of two corners.
        let off = 2.0 * self.off();
        let has_area = (0..3).any(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (p, q) = (a[j] * b[k], a[k] * b[j]);
            let size = a[j].abs() + a[k].abs() + b[j].abs() + b[k].abs() + 2.0 * off;
            (p - q).abs() > 5.0 * EPSILON * (p.abs() + q.abs()) + 1.1 * off * size + UNDERFLOW
        });
        let is_in_range = self.rounded.as_flattened().iter().all(|x| x.abs() < LARGEST);
        !(is_in_range && has_area) && exact::is_degenerate(self)
    }
}

/// A triple product of vectors whose components are off by so much each.
#[inline(always)]
fn moved(product: Approximation, vectors: [&Vector; 3], off: [f64; 3]) -> Approximation {
    let [a, b, c] = vectors.map(|v| 1.001 * v[0].abs().max(v[1].abs()).max(v[2].abs()));
    let [da, db, dc] = off;
    // Six products of three components.
    let error = 6.0 * (da * (b + db) * (c + dc) + a * db * (c + dc) + a * b * dc);
    Approximation { error: product.error + 1.001 * error, ..product }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Corners;

    const IDENTITY: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn image(linear: &[Vector; 3], corners: &Corners) -> Image {
        let shift = [1e6, 0.0, 0.1];
        let image = |p: &Vector| std::array::from_fn(|i| rounded_sum(&linear[i], p, shift[i]));
        Image { linear: *linear, shift, corners: *corners, rounded: corners.each_ref().map(image) }
    }

    fn is_flat(linear: &[Vector; 3], corners: &Corners) -> bool {
        image(linear, corners).has_no_area()
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
