//! Exact decisions: every finite double is a whole number times a power of two, so sums and products of them are too.
//!
//! What the filters of `watertight` and `distance` leave over comes here. Most of it has room in numbers of a fixed length
//! (`whole`), the rest is decided in big ones, which are slow.

use std::cmp::Ordering;

use num_bigint::{BigInt, BigUint, Sign};

use super::Means;
use super::fixed::{parts, scale};
use super::real::Real;
use super::whole::Question;
use crate::geometry::Vector;

/// mantissa · 2^exponent
#[derive(Debug, Clone)]
pub struct Dyadic {
    mantissa: BigInt,
    exponent: i64,
}

pub type Point = [Dyadic; 3];

impl Dyadic {
    pub fn new(x: f64) -> Self {
        debug_assert!(x.is_finite());
        let (magnitude, exponent) = parts(x);
        let mantissa = BigInt::from(magnitude);
        let mantissa = if x.is_sign_negative() { -mantissa } else { mantissa };
        Self { mantissa, exponent: i64::from(exponent) }
    }

    fn combine(&self, other: &Self, join: impl Fn(BigInt, BigInt) -> BigInt) -> Self {
        let exponent = self.exponent.min(other.exponent);
        let aligned = |x: &Self| &x.mantissa << (x.exponent - exponent) as u64;
        Self { mantissa: join(aligned(self), aligned(other)), exponent }
    }

    pub fn plus(&self, other: &Self) -> Self {
        self.combine(other, |a, b| a + b)
    }

    fn minus(&self, other: &Self) -> Self {
        self.combine(other, |a, b| a - b)
    }

    pub fn times(&self, other: &Self) -> Self {
        Self { mantissa: &self.mantissa * &other.mantissa, exponent: self.exponent + other.exponent }
    }

    /// The nearest double, of two that are as near the even one; infinite beyond the largest.
    pub fn to_f64(&self) -> f64 {
        let bits = self.mantissa.bits() as i64;
        // The power of two that the last bit of the double stands for.
        let last = (self.exponent + bits - i64::from(f64::MANTISSA_DIGITS)).max(-1074);
        let dropped = (last - self.exponent).max(0) as u64;
        let magnitude = self.mantissa.magnitude();
        let mut rounded = magnitude >> dropped;
        let rest = magnitude - (&rounded << dropped);
        let half = (dropped > 0).then(|| rest.cmp(&(BigUint::from(1u8) << (dropped - 1))));
        if half == Some(Ordering::Greater) || half == Some(Ordering::Equal) && rounded.bit(0) {
            rounded += 1u8;
        }
        // At most 54 bits, the last of which is zero then; scaling is exact.
        let value = rounded.iter_u64_digits().next().unwrap_or(0) as f64;
        let value = scale(value, self.exponent + dropped as i64);
        if self.sign() == Ordering::Less { -value } else { value }
    }

    pub fn sign(&self) -> Ordering {
        match self.mantissa.sign() {
            Sign::Minus => Ordering::Less,
            Sign::NoSign => Ordering::Equal,
            Sign::Plus => Ordering::Greater,
        }
    }
}

fn point(v: &Vector) -> Point {
    v.map(Dyadic::new)
}

/// a · p + b
pub(super) fn sum_of_products(a: &Vector, p: &Vector, b: f64) -> Dyadic {
    let term = |i: usize| Dyadic::new(a[i]).times(&Dyadic::new(p[i]));
    term(0).plus(&term(1)).plus(&term(2)).plus(&Dyadic::new(b))
}

fn difference(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|i| a[i].minus(&b[i]))
}

fn cross(a: &Point, b: &Point) -> Point {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j].times(&b[k]).minus(&a[k].times(&b[j]))
    })
}

fn dot(a: &Point, b: &Point) -> Dyadic {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

/// Edge values of a triangle seen from a ray: each is the signed volume of the ray's direction and one edge, opposite
/// to the vertex of the same number.
pub(super) fn edges<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> [Dyadic; 3] {
    let origin = point(origin);
    let direction = point(direction);
    let [a, b, c] = corners.points().map(|corner| difference(&corner, &origin));
    [dot(&direction, &cross(&b, &c)), dot(&direction, &cross(&c, &a)), dot(&direction, &cross(&a, &b))]
}

/// What fixed lengths say, and where they have no room what big integers say.
fn decided<T>(fixed: Option<T>, big: impl FnOnce() -> T) -> (T, Means) {
    fixed.map_or_else(|| (big(), Means::Big), |answer| (answer, Means::Whole))
}

/// Whether the line of the ray meets the closed triangle: all edge values of one sign or zero, and not all zero. Some of
/// the signs may be known.
pub fn is_inside<T: Real>(
    corners: &T,
    origin: &Vector,
    direction: &Vector,
    known: [Option<Ordering>; 3],
) -> (bool, Means) {
    decided(Question::new(origin, direction, &[corners]).is_inside(corners, known), || {
        let signs = edges(corners, origin, direction).map(|edge| edge.sign());
        signs.contains(&Ordering::Less) != signs.contains(&Ordering::Greater)
    })
}

/// The order of the distances of two triangles that the ray is not parallel to.
pub fn compare_distances<T: Real>(first: &T, second: &T, origin: &Vector, direction: &Vector) -> (Ordering, Means) {
    decided(Question::new(origin, direction, &[first, second]).compare(first, second), || {
        let [first, second] = [first, second].map(|corners| Fraction::distance(corners, origin, direction));
        first.compare(&second)
    })
}

/// The order of such a distance and a double; infinities compare as they should.
pub fn compare_distance_with<T: Real>(corners: &T, origin: &Vector, direction: &Vector, x: f64) -> (Ordering, Means) {
    if x.is_infinite() {
        return (if x > 0.0 { Ordering::Less } else { Ordering::Greater }, Means::Double);
    }
    decided(Question::new(origin, direction, &[corners]).compare_with(corners, x), || {
        Fraction::distance(corners, origin, direction).compare_with(x)
    })
}

/// Such a distance, off by hardly more than half a unit in the last place; the largest finite number for all beyond it.
pub fn distance<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> f64 {
    Question::new(origin, direction, &[corners])
        .distance(corners)
        .unwrap_or_else(|| Fraction::distance(corners, origin, direction).to_f64())
}

/// Barycentric weights of the second and third vertex where the ray meets the triangle, as near to the truth.
pub fn weights<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> [f64; 2] {
    Question::new(origin, direction, &[corners])
        .weights(corners)
        .unwrap_or_else(|| Fraction::weights(corners, origin, direction).map(|weight| weight.to_f64()))
}

/// Whether the line of the ray crosses the triangle once the origin is moved by (ε, ε², ε³), whatever small number ε is:
/// edge values of one sign, where the sign of one that is zero is that of the first component of d × edge that is not.
pub fn is_crossed<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> bool {
    let [a, b, c] = corners.points();
    let ends = [(&b, &c), (&c, &a), (&a, &b)];
    let edges = edges(corners, origin, direction);
    let direction = point(direction);
    let signs: [Ordering; 3] = std::array::from_fn(|i| {
        let (start, end) = ends[i];
        edges[i].sign().then_with(|| {
            let turned = cross(&direction, &difference(end, start));
            turned.iter().map(Dyadic::sign).find(|&sign| sign != Ordering::Equal).unwrap_or(Ordering::Equal)
        })
    });
    // Zero is left only for an edge that runs along the line, and then the others differ.
    signs[0] != Ordering::Equal && signs == [signs[0]; 3]
}

/// The sign of (a − p) × (b − p) in a plane.
pub fn side(a: &[f64; 2], b: &[f64; 2], p: &[f64; 2]) -> Ordering {
    let [a, b, p] = [a, b, p].map(|v| v.map(Dyadic::new));
    let [ax, ay] = [a[0].minus(&p[0]), a[1].minus(&p[1])];
    let [bx, by] = [b[0].minus(&p[0]), b[1].minus(&p[1])];
    ax.times(&by).minus(&ay.times(&bx)).sign()
}

/// Whether the three corners lie on a line.
pub fn is_degenerate<T: Real>(corners: &T) -> bool {
    let [a, b, c] = corners.points();
    cross(&difference(&b, &a), &difference(&c, &a)).iter().all(|x| x.sign() == Ordering::Equal)
}

/// A quotient of two dyadic numbers with a positive divisor.
#[derive(Debug, Clone)]
pub(crate) struct Fraction {
    numerator: Dyadic,
    denominator: Dyadic,
}

impl Fraction {
    fn new(mut numerator: Dyadic, mut denominator: Dyadic) -> Self {
        debug_assert!(denominator.sign() != Ordering::Equal);
        if denominator.sign() == Ordering::Less {
            numerator.mantissa = -numerator.mantissa;
            denominator.mantissa = -denominator.mantissa;
        }
        Self { numerator, denominator }
    }

    /// Where the ray meets the plane of a triangle that it is not parallel to.
    pub fn distance<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> Self {
        let [a, b, c] = corners.points();
        let normal = cross(&difference(&b, &a), &difference(&c, &a));
        Self::new(dot(&normal, &difference(&a, &point(origin))), dot(&normal, &point(direction)))
    }

    /// Barycentric weights of the second and third vertex where the ray meets the triangle.
    pub fn weights<T: Real>(corners: &T, origin: &Vector, direction: &Vector) -> [Self; 2] {
        let [e0, e1, e2] = edges(corners, origin, direction);
        let sum = e0.plus(&e1).plus(&e2);
        [Self::new(e1, sum.clone()), Self::new(e2, sum)]
    }

    pub fn compare(&self, other: &Self) -> Ordering {
        self.numerator.times(&other.denominator).minus(&other.numerator.times(&self.denominator)).sign()
    }

    /// Against a finite double.
    pub fn compare_with(&self, x: f64) -> Ordering {
        self.numerator.minus(&self.denominator.times(&Dyadic::new(x))).sign()
    }

    /// The nearest double, with the largest finite one for all beyond it.
    pub fn to_f64(&self) -> f64 {
        const BITS: i64 = 64;
        let (above, below) = (&self.numerator.mantissa, &self.denominator.mantissa);
        let shift = BITS + 1 + below.bits() as i64 - above.bits() as i64;
        let above = above.magnitude() << shift.max(0) as u64;
        let below = below.magnitude() << (-shift).max(0) as u64;
        let quotient = &above / &below;
        let inexact = &quotient * &below != above;
        // The quotient has 65 or 66 bits: the upper 64 of them with what follows folded into the last round as one.
        let extra = quotient.bits().saturating_sub(BITS as u64);
        let head = (&quotient >> extra).iter_u64_digits().next().unwrap_or(0);
        let lost = inexact || (&quotient >> extra << extra) != quotient;
        let exponent = self.numerator.exponent - self.denominator.exponent - shift + extra as i64;
        let magnitude = scale((head | u64::from(lost)) as f64, exponent).min(f64::MAX);
        if self.numerator.sign() == Ordering::Less { -magnitude } else { magnitude }
    }
}

#[cfg(test)]
impl Fraction {
    /// How far a number is from this, in units of the last place of doubles around this.
    pub fn error(&self, value: f64) -> f64 {
        let away = match self.compare_with(value) {
            Ordering::Less => value.next_down(),
            Ordering::Equal => return 0.0,
            Ordering::Greater => value.next_up(),
        };
        let difference = self.numerator.minus(&self.denominator.times(&Dyadic::new(value)));
        let unit = self.denominator.times(&Dyadic::new(away).minus(&Dyadic::new(value)));
        Self::new(difference, unit).to_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubles_survive_the_round_trip() {
        for x in [0.0, 1.0, -1.5, 0.1, 1e300, -1e-300, f64::MIN_POSITIVE / 64.0, f64::MAX, 5e-324] {
            let fraction = Fraction::new(Dyadic::new(x), Dyadic::new(1.0));
            assert_eq!(fraction.to_f64(), x);
            assert_eq!(fraction.compare_with(x), Ordering::Equal);
        }
    }

    #[test]
    fn quotients_round_to_the_nearest_double() {
        for (a, b) in [(1.0, 3.0), (-2.0, 7.0), (1e200, 3e-100), (0.1, 0.3), (5.0, 1e-20), (1.0, f64::MAX)] {
            let fraction = Fraction::new(Dyadic::new(a), Dyadic::new(b));
            assert_eq!(fraction.to_f64(), a / b, "{a} / {b}");
        }
        let beyond = Fraction::new(Dyadic::new(1e200), Dyadic::new(1e-200));
        assert_eq!(beyond.to_f64(), f64::MAX);
    }

    #[test]
    fn one_third_lies_between_its_neighbours() {
        let third = Fraction::new(Dyadic::new(-1.0), Dyadic::new(-3.0));
        assert_eq!(third.compare_with((1.0f64 / 3.0).next_down()), Ordering::Greater);
        assert_eq!(third.compare_with((1.0f64 / 3.0).next_up()), Ordering::Less);
    }
}
