//! What `exact` decides, in whole numbers of fixed lengths where the coordinates have room in them: no memory is asked
//! for. Nearly all meshes have: 61 bits hold float32 numbers of which the largest is 2^37 times the smallest, 125 bits float64
//! ones with a ratio of 2^72.

use std::array::from_fn;
use std::cmp::Ordering;

use super::fixed::{Int, parts};
use super::real::Real;
use crate::geometry::Vector;

/// Numbers are multiples of 2^`exponent`, and below 2^`bits` times that.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    exponent: i32,
    bits: i32,
}

impl Span {
    /// Of zero alone.
    pub const NONE: Self = Self { exponent: 0, bits: 0 };

    /// Of both.
    #[inline(always)]
    pub fn joined(self, other: Self) -> Self {
        if self.bits == 0 || other.bits == 0 {
            return if self.bits == 0 { other } else { self };
        }
        let exponent = self.exponent.min(other.exponent);
        Self { exponent, bits: (self.exponent + self.bits).max(other.exponent + other.bits) - exponent }
    }

    /// Of the product of two finite numbers.
    pub fn of_product(a: f64, b: f64) -> Self {
        let [a, b] = [a, b].map(|x| Self::of([&x].into_iter()));
        if a.bits == 0 || b.bits == 0 {
            return Self::NONE;
        }
        Self { exponent: a.exponent + b.exponent, bits: a.bits + b.bits }
    }

    /// Of numbers that are below so many powers of two more, unless there are none.
    pub fn wider(self, bits: i32) -> Self {
        if self.bits == 0 { self } else { Self { bits: self.bits + bits, ..self } }
    }

    /// Of finite numbers.
    #[inline(always)]
    pub fn of<'a>(numbers: impl Iterator<Item = &'a f64>) -> Self {
        let (mut least, mut most) = (i32::MAX, i32::MIN);
        for &x in numbers {
            let (mantissa, exponent) = parts(x);
            if mantissa != 0 {
                least = least.min(exponent + mantissa.trailing_zeros() as i32);
                most = most.max(exponent + 64 - mantissa.leading_zeros() as i32);
            }
        }
        if least > most { Self { exponent: 0, bits: 0 } } else { Self { exponent: least, bits: most - least } }
    }
}

/// What one ray is asked about some triangles, and how many digits of 64 bits that takes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Question<'a> {
    origin: &'a Vector,
    direction: &'a Vector,
    lengths: Span,
    directions: Span,
}

/// Run a body with `Whole` of enough digits, if there are.
macro_rules! answered {
    ($question:expr, $whole:ident => $body:expr) => {{
        // Three bits less, so that a triple product of differences has room in three times as many digits.
        match ($question.lengths.bits, $question.directions.bits) {
            (..=61, ..=61) => {
                type $whole = Whole<1, 1, 2, 3, 8>;
                Some($body)
            }
            (..=61, 62..=125) => {
                type $whole = Whole<1, 2, 2, 4, 10>;
                Some($body)
            }
            (..=125, ..=125) => {
                type $whole = Whole<2, 2, 4, 6, 16>;
                Some($body)
            }
            (..=189, ..=125) => {
                type $whole = Whole<3, 2, 6, 9, 20>;
                Some($body)
            }
            (..=253, ..=125) => {
                type $whole = Whole<4, 2, 8, 12, 26>;
                Some($body)
            }
            _ => None,
        }
    }};
}

impl<'a> Question<'a> {
    /// All numbers are finite.
    #[inline(always)]
    pub fn new<T: Real>(origin: &'a Vector, direction: &'a Vector, triangles: &[&T]) -> Self {
        let lengths = triangles.iter().fold(Span::of(origin.iter()), |all, corners| all.joined(corners.span()));
        Self { origin, direction, lengths, directions: Span::of(direction.iter()) }
    }

    /// The power of two that t is multiplied by once all numbers are whole.
    fn exponent(&self) -> i32 {
        self.directions.exponent - self.lengths.exponent
    }

    /// Whether no two edge values have opposite signs and not all are zero, given the signs that are known.
    pub fn is_inside<T: Real>(&self, corners: &T, known: [Option<Ordering>; 3]) -> Option<bool> {
        answered!(self, W => W::new(self, corners).is_inside(known))
    }

    /// The order of the distances of two triangles.
    pub fn compare<T: Real>(&self, first: &T, second: &T) -> Option<Ordering> {
        answered!(self, W => W::compare(W::new(self, first).distance(), W::new(self, second).distance()))
    }

    /// The order of the distance of a triangle and a finite number.
    pub fn compare_with<T: Real>(&self, corners: &T, x: f64) -> Option<Ordering> {
        answered!(self, W => W::compare_with(W::new(self, corners).distance(), x, self.exponent()))
    }

    /// t, rounded.
    pub fn distance<T: Real>(&self, corners: &T) -> Option<f64> {
        answered!(self, W => {
            let [above, below] = W::new(self, corners).distance();
            above.over(&below, -self.exponent())
        })
    }

    /// u and v, rounded.
    pub fn weights<T: Real>(&self, corners: &T) -> Option<[f64; 2]> {
        answered!(self, W => {
            let [e0, e1, e2] = W::new(self, corners).edges();
            let sum = e0.plus(&e1).plus(&e2);
            [e1, e2].map(|edge| edge.over(&sum, 0))
        })
    }
}

type Point<const A: usize> = [Int<A>; 3];

/// A triangle and a ray in whole numbers: lengths of `A` digits, products of two of them in `B` = 2 `A`, directions of `D`,
/// triple products in `C`, `B` and the larger of `A` and `D`; `E` have room for what is compared, 2 `C` and two more.
struct Whole<const A: usize, const D: usize, const B: usize, const C: usize, const E: usize> {
    corners: [Point<A>; 3],
    origin: Point<A>,
    direction: Point<D>,
}

impl<const A: usize, const D: usize, const B: usize, const C: usize, const E: usize> Whole<A, D, B, C, E> {
    #[inline(always)]
    fn new<T: Real>(question: &Question, corners: &T) -> Self {
        Self {
            corners: corners.whole(question.lengths.exponent),
            origin: question.origin.map(|x| Int::scaled(x, question.lengths.exponent)),
            direction: question.direction.map(|x| Int::scaled(x, question.directions.exponent)),
        }
    }

    /// The signed volume of the ray's direction and the edge opposite to one of these corners less the origin.
    #[inline(always)]
    fn edge(&self, corners: &[Point<A>; 3], vertex: usize) -> Int<C> {
        dot(&cross::<A, B>(&corners[(vertex + 1) % 3], &corners[(vertex + 2) % 3]), &self.direction)
    }

    #[inline(always)]
    fn relative(&self) -> [Point<A>; 3] {
        self.corners.map(|corner| difference(&corner, &self.origin))
    }

    /// Those of all edges.
    fn edges(&self) -> [Int<C>; 3] {
        let corners = self.relative();
        from_fn(|vertex| self.edge(&corners, vertex))
    }

    fn is_inside(&self, known: [Option<Ordering>; 3]) -> bool {
        let corners = self.relative();
        let mut is_there = [Ordering::Less, Ordering::Greater].map(|sign| known.contains(&Some(sign)));
        for vertex in (0..3).filter(|&vertex| known[vertex].is_none()) {
            match self.edge(&corners, vertex).sign() {
                Ordering::Less => is_there[0] = true,
                Ordering::Equal => {}
                Ordering::Greater => is_there[1] = true,
            }
            if is_there == [true; 2] {
                return false;
            }
        }
        is_there[0] != is_there[1]
    }

    /// Above and below the line of the fraction that t is, the lower one positive.
    #[inline(always)]
    fn distance(&self) -> [Int<C>; 2] {
        let [a, b, c] = &self.corners;
        let normal: Point<B> = cross(&difference(b, a), &difference(c, a));
        let (above, below) = (dot(&normal, &difference(a, &self.origin)), dot(&normal, &self.direction));
        if below.sign() == Ordering::Less { [above.negative(), below.negative()] } else { [above, below] }
    }

    fn compare([above, below]: [Int<C>; 2], [other_above, other_below]: [Int<C>; 2]) -> Ordering {
        let (first, second): (Int<E>, Int<E>) = (above.times(&other_below), other_above.times(&below));
        first.minus(&second).sign()
    }

    /// `above` / `below` against x · 2^`exponent`.
    fn compare_with([above, below]: [Int<C>; 2], x: f64, exponent: i32) -> Ordering {
        let (mantissa, own) = parts(x);
        let product: Int<E> = below.times(&Int::<2>::of(mantissa));
        let product = if x < 0.0 { product.negative() } else { product };
        let above: Int<E> = above.widened();
        // A shift by so much makes the shifted one the larger one, whatever they are, unless it is zero.
        let most = 64 * C as i32;
        let shift = (own + exponent).clamp(-most - 54, most);
        let (above, product) = if shift < 0 {
            (above.shifted(shift.unsigned_abs()), product)
        } else {
            (above, product.shifted(shift.unsigned_abs()))
        };
        above.minus(&product).sign()
    }
}

#[inline(always)]
fn difference<const A: usize>(a: &Point<A>, b: &Point<A>) -> Point<A> {
    from_fn(|i| a[i].minus(&b[i]))
}

#[inline(always)]
fn cross<const A: usize, const B: usize>(a: &Point<A>, b: &Point<A>) -> Point<B> {
    from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j].times(&b[k]).minus(&a[k].times(&b[j]))
    })
}

#[inline(always)]
fn dot<const B: usize, const A: usize, const C: usize>(a: &Point<B>, b: &Point<A>) -> Int<C> {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Corners;
    use crate::intersect::exact::{Fraction, edges};

    /// Small whole numbers, which meet edges and planes exactly, times powers of two that are `spread` apart at most, and
    /// now and then a number with many digits.
    fn numbers(spread: u32) -> impl FnMut() -> f64 {
        let mut state = u64::from(spread) + 1;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let small = ((state >> 33) % 7) as f64 - 3.0;
            let exponent = (state >> 40) as u32 % (spread + 1);
            let long = if state >> 61 == 0 { (state >> 11) as f64 / (1u64 << 53) as f64 } else { 0.0 };
            (small + long) * 2f64.powi(exponent as i32)
        }
    }

    #[test]
    fn the_decisions_are_those_of_big_integers() {
        let mut answered = [0; 4];
        for spread in [0, 3, 30, 60, 150] {
            let mut number = numbers(spread);
            let mut other = numbers(spread / 2 + 40);
            for turn in 0..500 {
                let mut point = || -> Vector { from_fn(|_| number()) };
                let [first, second]: [Corners; 2] = from_fn(|_| from_fn(|_| point()));
                let (origin, direction) = (point(), if turn % 2 == 0 { point() } else { from_fn(|_| other()) });
                let question = Question::new(&origin, &direction, &[&first, &second]);
                let bits = question.lengths.bits.max(question.directions.bits);
                let is_mixed = question.lengths.bits <= 61 && (62..=125).contains(&question.directions.bits);
                answered[if is_mixed { 3 } else { usize::from(bits > 61) + usize::from(bits > 125) }] += 1;
                let signs = edges(&first, &origin, &direction).map(|edge| edge.sign());
                let is_there = |sign| signs.contains(&sign);
                let (negative, positive) = (is_there(Ordering::Less), is_there(Ordering::Greater));
                let known = signs.map(|sign| (number() > 1.0).then_some(sign));
                let Some(is_inside) = question.is_inside(&first, known) else {
                    assert!(bits > 125);
                    continue;
                };
                assert_eq!(is_inside, negative != positive, "{signs:?} {known:?}");
                let is_parallel = |corners: &Corners| {
                    let [a, b, c] = edges(corners, &origin, &direction);
                    a.plus(&b).plus(&c).sign() == Ordering::Equal
                };
                if is_parallel(&first) || is_parallel(&second) {
                    continue;
                }
                let [t, other] = [&first, &second].map(|corners| Fraction::distance(corners, &origin, &direction));
                assert_eq!(question.compare(&first, &second), Some(t.compare(&other)));
                assert_eq!(question.compare(&first, &first), Some(Ordering::Equal));
                let nearest = t.to_f64();
                for x in [nearest, nearest.next_up(), nearest.next_down(), 0.0, 1.0, -1e-300, 1e300, 5e-324] {
                    assert_eq!(question.compare_with(&first, x), Some(t.compare_with(x)), "{x}");
                }
                let value = question.distance(&first).expect("room for numbers that signs have");
                assert!(t.error(value) < 0.5001, "{value} {nearest}");
                let weights = Fraction::weights(&first, &origin, &direction);
                for (truth, value) in weights.iter().zip(question.weights(&first).expect("room")) {
                    assert!(truth.error(value) < 0.5001, "{value}");
                }
            }
        }
        assert!(answered.iter().all(|&count| count > 50), "{answered:?}");
    }
}
