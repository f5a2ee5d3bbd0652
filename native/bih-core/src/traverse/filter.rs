//! What single precision knows of the triangles of a leaf: docs/accuracy.md, section 4.

use super::aim::Aim;
use super::fast::splat;
use super::known::{Errors, Known, Met};
use super::scene::{Leaf, Scene};
use crate::geometry::{Bounds, Corners, Ray, Vector, round_up};
use crate::intersect::Meeting;
use crate::simd::Lanes;
use crate::tree::WIDTH;

/// Half a unit in the last place of 1 in single precision.
const U: f64 = f32::EPSILON as f64 / 2.0;
/// Coordinates below this, and directions within `DIRECTIONS`, neither overflow nor underflow unseen.
pub(super) const RANGE: f64 = 1e12;
const DIRECTIONS: std::ops::Range<f64> = 1e-6..1e6;

/// A ray rounded to single precision, and what that and all that follows can amount to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Filter {
    origin: [f32; 3],
    direction: [f32; 3],
    /// No number of single precision before it counts.
    t_min: f32,
    /// Factors of the largest edge component and of its square in the error bounds.
    edge_error: f32,
    square_error: f32,
    above_error: f32,
    below_error: f32,
    least_above: f32,
}

/// No edge counts as shorter: of a difference below the normal numbers, rounding may take more than its part.
const SHORTEST: f32 = 1e-30;

impl Filter {
    /// None where the bounds do not hold.
    #[inline(always)]
    pub(super) fn new(ray: &Ray, bounds: &Bounds, is_double: bool) -> Option<Self> {
        if is_double { Self::around(&Aim::exact(ray), bounds, true) } else { Self::of_single(ray, bounds) }
    }

    /// For vertices of single precision. The bounds are computed in single precision, too: as those of packets.
    #[inline(always)]
    fn of_single(ray: &Ray, bounds: &Bounds) -> Option<Self> {
        const EDGE: f32 = (23.0 * U) as f32;
        const SQUARE: f32 = (39.0 * U) as f32;
        const DISTANCE: f32 = (20.0 * U) as f32;
        let (origin, direction) = (ray.origin.map(|x| x as f32), ray.direction.map(|x| x as f32));
        // The distance that a coordinate can have from the origin, and what rounding the origin adds.
        let reach: [f32; 3] = std::array::from_fn(|axis| {
            let [lower, upper] = [bounds.lower[axis] - origin[axis], bounds.upper[axis] - origin[axis]];
            lower.abs().max(upper.abs()) + origin[axis].abs()
        });
        let ([x, y, z], [dx, dy, dz]) = (reach, direction.map(f32::abs));
        let (distance, sum) = (x + y + z, dx + dy + dz);
        let is_usual = distance < RANGE as f32 && DIRECTIONS.contains(&f64::from(dx.max(dy).max(dz)));
        if !(ray.t_min >= 0.0 && is_usual) {
            return None;
        }
        let moment = x * (dy + dz) + y * (dx + dz) + z * (dx + dy);
        Some(Self {
            origin,
            direction,
            t_min: round_up(ray.t_min),
            edge_error: EDGE * moment + 2e-36,
            square_error: SQUARE * sum,
            above_error: DISTANCE * distance,
            below_error: DISTANCE * sum,
            // Not 2e-42 times the distance: that is no normal number of single precision.
            least_above: 2e-36 * (1.0 + 1e-6 * distance),
        })
    }

    /// For what is hit by the ray that this one leads to: that is hit by this one, too, from an origin within the spread.
    /// What is sure of this ray is not so of that.
    #[inline(always)]
    pub(super) fn around(Aim { ray, spread }: &Aim, bounds: &Bounds, is_double: bool) -> Option<Self> {
        // The distance that a coordinate can have from the origin, and what the origin can be off by, in units of what
        // rounding it to single precision takes.
        let mut reach = [0.0; 3];
        for (axis, reach) in reach.iter_mut().enumerate() {
            let origin = ray.origin[axis];
            let [lower, upper] = [f64::from(bounds.lower[axis]) - origin, f64::from(bounds.upper[axis]) - origin];
            let rounded = if is_double { 0.0 } else { origin.abs() };
            *reach = lower.abs().max(upper.abs()) + rounded + spread[axis] / U;
        }
        let [x, y, z] = reach;
        let [dx, dy, dz] = ray.direction.map(f64::abs);
        let sum = dx + dy + dz;
        if !(ray.t_min >= 0.0 && x + y + z < RANGE && DIRECTIONS.contains(&dx.max(dy).max(dz))) {
            return None;
        }
        let moment = x * (dy + dz) + y * (dx + dz) + z * (dx + dy);
        Some(Self {
            origin: ray.origin.map(|x| x as f32),
            direction: ray.direction.map(|x| x as f32),
            t_min: round_up(ray.t_min),
            edge_error: round_up(22.0 * U * moment + 1e-36),
            square_error: round_up(38.0 * U * sum),
            above_error: round_up(19.0 * U * (x + y + z)),
            below_error: round_up(19.0 * U * sum),
            least_above: round_up(1e-36 + 1e-42 * (x + y + z)),
        })
    }

    /// None if no triangle of a leaf is hit by the ray before `limit`.
    #[inline(always)]
    pub(super) fn known<L: Lanes>(&self, scene: &Scene, ray: &Ray, leaf: Leaf, limit: f32) -> Option<Known<L>> {
        let direction = splat(&self.direction);
        let meeting = if scene.triangles.is_double() {
            let [to_vertex, e1, e2] = differences::<L>(scene.all_corners(leaf), &ray.origin);
            Meeting::of(&to_vertex, e1, e2, &direction)
        } else {
            Meeting::new(&splat(&self.origin), &direction, &scene.vertices(leaf))
        };
        self.known_of(meeting, limit, leaf.lanes())
    }

    #[inline(always)]
    fn known_of<L: Lanes>(&self, meeting: Meeting<L>, limit: f32, lanes: u8) -> Option<Known<L>> {
        let Meeting { e1, e2, size, u, v, t } = meeting;
        let met = Met { size, u, v, t, longest: largest(&e1).maximum(largest(&e2)).maximum(L::splat(SHORTEST)) };
        let errors = Errors {
            edge: L::splat(self.edge_error),
            square: L::splat(self.square_error),
            above: L::splat(self.above_error),
            below: L::splat(self.below_error),
            least_above: L::splat(self.least_above),
        };
        errors.known(&met, L::splat(self.t_min), L::splat(limit), lanes)
    }
}

/// c = v₀ − o, e₁ = v₀ − v₁ and e₂ = v₂ − v₀ of eight triangles at most, subtracted in double precision; lanes without one
/// hold zeros.
#[inline(always)]
fn differences<L: Lanes>(triangles: impl Iterator<Item = Corners>, origin: &Vector) -> [[L; 3]; 3] {
    let mut rows = [[[0.0; WIDTH]; 3]; 3];
    let [c, e1, e2] = &mut rows;
    for (lane, [v0, v1, v2]) in triangles.take(WIDTH).enumerate() {
        for axis in 0..3 {
            c[axis][lane] = v0[axis] - origin[axis];
            e1[axis][lane] = v0[axis] - v1[axis];
            e2[axis][lane] = v2[axis] - v0[axis];
        }
    }
    [
        [L::rounded(&c[0]), L::rounded(&c[1]), L::rounded(&c[2])],
        [L::rounded(&e1[0]), L::rounded(&e1[1]), L::rounded(&e1[2])],
        [L::rounded(&e2[0]), L::rounded(&e2[1]), L::rounded(&e2[2])],
    ]
}

#[inline(always)]
fn largest<L: Lanes>(a: &[L; 3]) -> L {
    a[0].magnitude().maximum(a[1].magnitude()).maximum(a[2].magnitude())
}

#[cfg(test)]
mod tests {
    use std::cmp::Ordering;

    use super::*;
    use crate::intersect::{Fraction, is_inside_exactly};
    use crate::simd::{InstructionSet, Kernel, dispatch_to, instruction_sets};

    /// One ray and eight triangles.
    struct Case {
        ray: Ray,
        triangles: [Corners; 8],
        /// Whether these are doubles.
        is_double: bool,
        limit: f32,
    }

    /// What is known of a case: possible and sure lanes, low and high; nothing where the bounds do not hold.
    type Answer = Option<(u8, u8, [f32; 8], [f32; 8])>;

    struct Knowing<'a> {
        case: &'a Case,
        filter: Option<Filter>,
    }

    impl Kernel for Knowing<'_> {
        type Output = Answer;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Answer {
            let (filter, Case { ray, triangles, is_double, limit }) = (self.filter?, self.case);
            let direction = splat(&filter.direction);
            let meeting = if *is_double {
                let [to_vertex, e1, e2] = differences::<L>(triangles.iter().copied(), &ray.origin);
                Meeting::of(&to_vertex, e1, e2, &direction)
            } else {
                let mut vertices = [[L::splat(0.0); 3]; 3];
                for (corner, rows) in vertices.iter_mut().enumerate() {
                    for (axis, row) in rows.iter_mut().enumerate() {
                        *row = L::load(&triangles.map(|corners| corners[corner][axis] as f32));
                    }
                }
                Meeting::new(&splat(&filter.origin), &direction, &vertices)
            };
            let known = filter.known_of::<L>(meeting, *limit, u8::MAX);
            Some(known.map_or((0, 0, [0.0; 8], [0.0; 8]), |known| {
                (known.possible, known.sure, known.low.store(), known.high.store())
            }))
        }
    }

    impl Case {
        fn bounds(&self) -> Bounds {
            self.triangles.iter().fold(Bounds::EMPTY, |bounds, corners| bounds.union(&Bounds::of_triangle(corners)))
        }

        fn filter(&self) -> Option<Filter> {
            Filter::new(&self.ray, &self.bounds(), self.is_double)
        }

        fn filter_around(&self, spread: Vector) -> Option<Filter> {
            Filter::around(&Aim { ray: self.ray, spread }, &self.bounds(), self.is_double)
        }

        fn known(&self, filter: Option<Filter>, set: InstructionSet) -> Answer {
            dispatch_to(set, Knowing { case: self, filter })
        }

        /// How much of what is known is not true.
        fn errors(&self, (possible, sure, low, high): (u8, u8, [f32; 8], [f32; 8])) -> usize {
            let Ray { origin, direction, t_min, t_max } = &self.ray;
            assert_eq!(*t_max, f64::INFINITY);
            let wrong = |lane: usize| {
                let corners = &self.triangles[lane];
                let is = |lanes: u8| lanes >> lane & 1 != 0;
                if !is_inside_exactly(corners, origin, direction, [None; 3]).0 {
                    return is(sure);
                }
                let t = Fraction::distance(corners, origin, direction);
                // A bound that says nothing is infinite.
                let against = |x: f32| if x.is_finite() { t.compare_with(f64::from(x)) } else { 0f32.total_cmp(&x) };
                if t.compare_with(*t_min) == Ordering::Less {
                    return is(sure);
                }
                let is_low = against(low[lane]) == Ordering::Less;
                is(sure) && (is_low || against(high[lane]) == Ordering::Greater)
                    || is(possible) && is_low
                    || !is(possible) && against(self.limit) != Ordering::Greater
            };
            (0..8).filter(|&lane| wrong(lane)).count()
        }
    }

    /// The same bounds, all of them so much smaller.
    fn scaled(filter: &Filter, by: f32) -> Filter {
        Filter {
            edge_error: filter.edge_error * by,
            square_error: filter.square_error * by,
            above_error: filter.above_error * by,
            below_error: filter.below_error * by,
            least_above: filter.least_above * by,
            ..*filter
        }
    }

    /// Numbers from -1 to 1 (Marsaglia 2003, "Xorshift RNGs").
    struct Numbers(u64);

    impl Numbers {
        fn word(&mut self) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            self.0 >> 11
        }

        fn next(&mut self) -> f64 {
            self.word() as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn point(&mut self) -> [f64; 3] {
            [self.next(), self.next(), self.next()]
        }

        fn below(&mut self, count: u64) -> u64 {
            self.word() % count
        }
    }

    /// Triangles of some size around a point at some distance, and a ray that is aimed at a vertex, at an edge, along a
    /// plane or anywhere, now and then within single precision or along an axis; the limit is about where it hits.
    fn case(numbers: &mut Numbers, is_double: bool) -> Case {
        let scale = [1e-6, 1.0, 1e6][numbers.below(3) as usize];
        let size = scale * [1e-3, 0.03, 1.0][numbers.below(3) as usize];
        let offset = numbers.point().map(|x| x * scale * [0.0, 1.0, 1e3][numbers.below(3) as usize]);
        let single = |p: [f64; 3]| if is_double { p } else { p.map(|x| f64::from(x as f32)) };
        let at = |offset: [f64; 3], p: [f64; 3]| single(std::array::from_fn(|i| offset[i] + size * p[i]));
        let mut vertex = |flat: bool| {
            let mut p = numbers.point();
            p[2] *= if flat { 1e-6 } else { 1.0 };
            at(offset, p)
        };
        let flat = [false, true];
        let mut triangles: [Corners; 8] = std::array::from_fn(|lane| std::array::from_fn(|_| vertex(flat[lane % 2])));
        // Two share an edge.
        triangles[1][0] = triangles[0][1];
        triangles[1][1] = triangles[0][0];
        let aimed = triangles[numbers.below(8) as usize];
        let (a, b) = (aimed[0], aimed[1]);
        let weight = [0.0, 0.5, numbers.next()][numbers.below(3) as usize];
        let target: [f64; 3] = std::array::from_fn(|i| a[i] + weight * (b[i] - a[i]));
        let mut origin = at(offset, numbers.point().map(|x| x * [2.0, 100.0][numbers.below(2) as usize]));
        let length = [1.0, 1e-3, 30.0][numbers.below(3) as usize];
        let mut direction: [f64; 3] = std::array::from_fn(|i| length * (target[i] - origin[i]) / scale);
        match numbers.below(8) {
            0 => {
                let axis = numbers.below(3) as usize;
                origin = target;
                origin[axis] -= size;
                direction = [0.0; 3];
                direction[axis] = 1.0;
            }
            1 => direction = std::array::from_fn(|i| (aimed[1][i] - aimed[2][i] + 1e-5 * numbers.next()) / scale),
            2 => direction = numbers.point(),
            3 => (origin, direction) = (single(origin), single(direction)),
            _ => {}
        }
        let distance = (0..3).map(|i| target[i] - origin[i]).map(|x| x * x).sum::<f64>().sqrt();
        let t = distance / direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        let near = [0.0, t, t * (1.0 + 1e-7 * numbers.next())];
        let t_min = near[numbers.below(3) as usize];
        let limit = [f32::INFINITY, t as f32, (2.0 * t) as f32][numbers.below(3) as usize];
        Case { ray: Ray { origin, direction, t_min, t_max: f64::INFINITY }, triangles, is_double, limit }
    }

    /// And not if the bounds were a fraction of what they are.
    #[test]
    fn what_is_known_is_true() {
        let count = if cfg!(miri) { 20 } else { 3_000 };
        let mut numbers = Numbers(1);
        let (mut sure, mut left_out, mut errors_if_smaller, mut tested) = (0, 0, 0, 0);
        for round in 0..count {
            let case = case(&mut numbers, round % 2 == 0);
            let filter = case.filter();
            let Some(known) = case.known(filter, instruction_sets()[0]) else { continue };
            assert_eq!(case.errors(known), 0, "{:?} {:?} {:?}", case.ray, case.triangles, case.limit);
            for set in &instruction_sets()[1..] {
                let same = case.known(filter, *set).expect("the bounds hold everywhere");
                assert_eq!((same.0, same.1), (known.0, known.1), "{set:?}");
            }
            tested += 8;
            sure += known.1.count_ones();
            left_out += known.0.count_zeros();
            let smaller = filter.map(|filter| scaled(&filter, 1.0 / 32.0));
            errors_if_smaller += case.known(smaller, instruction_sets()[0]).map_or(0, |known| case.errors(known));
        }
        assert!(
            cfg!(miri) || tested > 7 * count && sure > tested / 100 && left_out > tested / 3,
            "{tested} {sure} {left_out}"
        );
        assert!(cfg!(miri) || errors_if_smaller > 0, "{errors_if_smaller}");
    }

    /// What the ray hits is possible for one that starts elsewhere within the spread; not so if that were not said.
    #[test]
    fn what_is_hit_from_nearby_is_possible() {
        let mut numbers = Numbers(2);
        let (mut tested, mut left_out, mut errors_without) = (0, 0, 0);
        for round in 0..if cfg!(miri) { 20 } else { 3_000 } {
            let case = case(&mut numbers, round % 2 == 0);
            let size = case.triangles[0].as_flattened().iter().fold(0.0f64, |size, x| size.max(x.abs()));
            let spread: Vector = std::array::from_fn(|_| size * [1e-12, 1e-6, 1e-3][numbers.below(3) as usize]);
            let origin = std::array::from_fn(|i| case.ray.origin[i] + 0.99 * spread[i] * numbers.next());
            let near = Case { ray: Ray { origin, ..case.ray }, triangles: case.triangles, ..case };
            let mut errors = |filter| -> Option<usize> {
                let (possible, _, low, high) = near.known(filter, instruction_sets()[0])?;
                left_out += possible.count_zeros();
                Some(case.errors((possible, 0, low, high)))
            };
            let Some(errors_within) = errors(near.filter_around(spread)) else { continue };
            assert_eq!(errors_within, 0, "{:?} {spread:?} {:?}", case.ray, near.triangles);
            tested += 1;
            errors_without += errors(near.filter()).unwrap_or(0);
        }
        let counts = (tested, left_out, errors_without);
        assert!(cfg!(miri) || tested > 2_000 && left_out > 5_000 && errors_without > 0, "{counts:?}");
    }
}
