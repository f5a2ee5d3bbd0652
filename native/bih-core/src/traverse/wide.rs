//! The walk over wide records: eight boxes and eight triangles at a time, in single precision, rounded outward.
//!
//! Single precision only leaves out what cannot be hit; docs/accuracy.md derives by how much. What is left is decided by
//! the same tests in double precision as for every other layout.

use std::ops::ControlFlow;

use super::Counter;
use super::interval::Crossing;
use crate::geometry::{Bounds, Corners, Ray, Triangles, round_down, round_up};
use crate::simd::{Lanes, Mask};
use crate::tree::{Child, Record, Target, Tree, WIDTH, Wide};

/// Half a unit in the last place of 1 in single precision.
const U: f64 = f32::EPSILON as f64 / 2.0;
/// Added where a product may have lost all bits to underflow.
const TINY: f32 = f32::MIN_POSITIVE;
/// Coordinates below this do not overflow in the box test.
const BOX_RANGE: f64 = f32::MAX as f64 / 4.0;
/// Coordinates below this, and directions within `DIRECTIONS`, neither overflow nor underflow unseen in the leaf test.
const LEAF_RANGE: f64 = 1e18;
const DIRECTIONS: std::ops::Range<f64> = 1e-6..1e6;

/// What the rays of a stack have put off.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Postponed {
    child: Child,
    near: f32,
}

/// A ray in lanes.
struct BoxRay<L> {
    near_origin: [L; 3],
    near_reciprocal: [L; 3],
    far_origin: [L; 3],
    far_reciprocal: [L; 3],
    negative: [bool; 3],
    t_min: L,
    tiny: L,
}

impl<L: Lanes> BoxRay<L> {
    /// None where single precision might lose a hit: t may be negative, or coordinates overflow.
    #[inline(always)]
    fn new(ray: &Ray, bounds: &Bounds) -> Option<Self> {
        let largest = |values: &[f32; 3]| values.iter().fold(0.0f64, |most, &x| most.max(f64::from(x).abs()));
        let is_small = ray.origin.iter().all(|x| x.abs() < BOX_RANGE)
            && largest(&bounds.lower) < BOX_RANGE
            && largest(&bounds.upper) < BOX_RANGE;
        if !(ray.t_min >= 0.0 && is_small) {
            return None;
        }
        let negative = ray.direction.map(f64::is_sign_negative);
        let origin = |upwards: bool, axis: usize| {
            if upwards { round_up(ray.origin[axis]) } else { round_down(ray.origin[axis]) }
        };
        let reciprocal = |factor: f64, round: fn(f64) -> f32, axis: usize| {
            let magnitude = (1.0 / ray.direction[axis]).abs();
            // Rounded down an overflow is the largest number; that of a true zero is infinite.
            let rounded = if ray.direction[axis] == 0.0 { f32::INFINITY } else { round(magnitude * factor) };
            rounded.copysign(if negative[axis] { -1.0 } else { 1.0 })
        };
        Some(Self {
            near_origin: splat(AXES.map(|axis| origin(!negative[axis], axis))),
            near_reciprocal: splat(AXES.map(|axis| reciprocal(1.0 - 4.0 * U, finite_down, axis))),
            far_origin: splat(AXES.map(|axis| origin(negative[axis], axis))),
            far_reciprocal: splat(AXES.map(|axis| reciprocal(1.0 + 4.0 * U, round_up, axis))),
            negative,
            t_min: L::splat(round_down(ray.t_min)),
            tiny: L::splat(TINY),
        })
    }

    /// The children whose boxes the ray may meet before `limit`, and where.
    #[inline(always)]
    fn meets(&self, record: &Record, limit: f32) -> (u8, [f32; WIDTH]) {
        let mut near = self.t_min;
        let mut far = L::splat(limit);
        for axis in 0..3 {
            let (entry, exit) = if self.negative[axis] {
                (&record.upper[axis], &record.lower[axis])
            } else {
                (&record.lower[axis], &record.upper[axis])
            };
            // A ray in the plane of a side gives NaN, which the operand order passes over.
            let enters = L::load(entry).minus(self.near_origin[axis]).times(self.near_reciprocal[axis]);
            let leaves = L::load(exit).minus(self.far_origin[axis]).times(self.far_reciprocal[axis]);
            near = enters.maximum(near);
            far = leaves.plus(self.tiny).minimum(far);
        }
        (near.at_most(far).bits(), near.store())
    }
}

const AXES: [usize; 3] = [0, 1, 2];

#[inline(always)]
fn splat<L: Lanes>(values: [f32; 3]) -> [L; 3] {
    [L::splat(values[0]), L::splat(values[1]), L::splat(values[2])]
}

/// Three rows of the triangles of a leaf.
#[inline(always)]
fn load<L: Lanes>(rows: &[f32], first: usize, count: usize) -> [L; 3] {
    [load_row(rows, first * count), load_row(rows, (first + 1) * count), load_row(rows, (first + 2) * count)]
}

#[inline(always)]
fn load_row<L: Lanes>(rows: &[f32], start: usize) -> L {
    match rows[start..].first_chunk() {
        Some(values) => L::load(values),
        None => L::splat(f32::NAN),
    }
}

fn finite_down(x: f64) -> f32 {
    round_down(x).min(f32::MAX)
}

/// What leaves out the triangles of a leaf that a ray cannot hit.
struct LeafRay<L> {
    origin: [L; 3],
    direction: [L; 3],
    /// Factors of the largest edge component and of its square in the error bounds.
    edge_error: L,
    square_error: L,
    above_error: L,
    below_error: L,
    least_error: L,
    least_above: L,
    more: L,
}

impl<L: Lanes> LeafRay<L> {
    /// None where the bounds do not hold.
    #[inline(always)]
    fn new(ray: &Ray, bounds: &Bounds) -> Option<Self> {
        // The distance that a coordinate can have from the origin, and what rounding the origin adds.
        let reach: [f64; 3] = std::array::from_fn(|axis| {
            let to = |x: f32| (f64::from(x) - ray.origin[axis]).abs();
            to(bounds.lower[axis]).max(to(bounds.upper[axis])) + ray.origin[axis].abs()
        });
        let [x, y, z] = reach;
        let [dx, dy, dz] = ray.direction.map(f64::abs);
        let sum = dx + dy + dz;
        if !(ray.t_min >= 0.0 && x + y + z < LEAF_RANGE && DIRECTIONS.contains(&dx.max(dy).max(dz))) {
            return None;
        }
        let moment = x * (dy + dz) + y * (dx + dz) + z * (dx + dy);
        Some(Self {
            origin: splat(ray.origin.map(|x| x as f32)),
            direction: splat(ray.direction.map(|x| x as f32)),
            edge_error: L::splat(round_up(22.0 * U * moment + 1e-36)),
            square_error: L::splat(round_up(38.0 * U * sum)),
            above_error: L::splat(round_up(19.0 * U * (x + y + z))),
            below_error: L::splat(round_up(19.0 * U * sum)),
            least_error: L::splat(1e-36),
            least_above: L::splat(round_up(1e-36 + 1e-42 * (x + y + z))),
            more: L::splat(1.0 + 8.0 * f32::EPSILON),
        })
    }

    /// The triangles of a leaf that may be hit before `limit`.
    #[inline(always)]
    fn candidates(&self, rows: &[f32], count: usize, limit: f32) -> u8 {
        let v0 = load::<L>(rows, 0, count);
        let v1 = load::<L>(rows, 3, count);
        let v2 = load::<L>(rows, 6, count);
        let to_vertex = minus(&v0, &self.origin);
        let (e1, e2) = (minus(&v0, &v1), minus(&v2, &v0));
        let normal = cross(&e2, &e1);
        let moment = cross(&to_vertex, &self.direction);
        let below = dot(&normal, &self.direction);
        let size = below.magnitude();
        let u = dot(&moment, &e2).turned_by(below);
        let v = dot(&moment, &e1).turned_by(below);
        let above = dot(&normal, &to_vertex).turned_by(below);

        let longest = largest(&e1).maximum(largest(&e2));
        let square = longest.times(longest);
        let error = longest.times(self.edge_error).plus(square.times(self.square_error)).plus(self.least_error);
        let zero = L::splat(0.0);
        let outside = u.plus(error).below(zero).or(v.plus(error).below(zero)).or(size.plus(error).below(u.plus(v)));
        // Beyond the limit: above / size, each at its nearest, still exceeds it.
        let nearest = above.minus(square.times(self.above_error)).minus(self.least_above);
        let size = size.plus(square.times(self.below_error)).plus(self.least_error).times(self.more);
        let beyond = size.times(L::splat(limit)).below(nearest);
        !outside.or(beyond).bits() & ((1u16 << count) - 1) as u8
    }
}

#[inline(always)]
fn minus<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0].minus(b[0]), a[1].minus(b[1]), a[2].minus(b[2])]
}

#[inline(always)]
fn cross<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [
        a[1].times(b[2]).minus(a[2].times(b[1])),
        a[2].times(b[0]).minus(a[0].times(b[2])),
        a[0].times(b[1]).minus(a[1].times(b[0])),
    ]
}

#[inline(always)]
fn dot<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].times(b[0]).plus(a[1].times(b[1])).plus(a[2].times(b[2]))
}

#[inline(always)]
fn largest<L: Lanes>(a: &[L; 3]) -> L {
    a[0].magnitude().maximum(a[1].magnitude()).maximum(a[2].magnitude())
}

/// The places of the bits that are set.
#[inline(always)]
fn bits(mut mask: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (lane < 8).then_some(lane)
    })
}

/// Offer the triangles that the ray may hit, front to back. `offer` is given the row and the corners of one and answers
/// how far the ray still matters, or that it is done.
#[inline(always)]
pub(super) fn walk<L: Lanes, C: Counter>(
    wide: &Wide,
    tree: &Tree,
    triangles: &Triangles,
    ray: &Ray,
    stack: &mut Vec<Postponed>,
    counter: &mut C,
    mut offer: impl FnMut(u32, Corners) -> ControlFlow<(), f64>,
) {
    if wide.records.is_empty() {
        return;
    }
    let boxes = BoxRay::<L>::new(ray, &tree.bounds);
    let leaves = if wide.rows.is_empty() { None } else { LeafRay::<L>::new(ray, &tree.bounds) };
    let crossing = Crossing::new(ray);
    // One number more than the limit: t and the limit are rounded to single precision.
    let single = |limit: f64| round_up(limit + f64::from(TINY));
    let mut limit = single(ray.t_max);
    stack.clear();
    let mut target = Target::Record(0);
    loop {
        counter.visit_node();
        match target {
            Target::Record(index) => {
                let record = &wide.records[index];
                let (hits, near) = match &boxes {
                    Some(boxes) => boxes.meets(record, limit),
                    None => meets_slowly(&crossing, ray, record, limit),
                };
                let start = stack.len();
                for lane in bits(hits) {
                    let entry = Postponed { child: record.child(lane), near: near[lane] };
                    // The nearest goes on top.
                    let mut place = stack.len();
                    stack.push(entry);
                    while place > start && stack[place - 1].near < entry.near {
                        stack[place] = stack[place - 1];
                        place -= 1;
                    }
                    stack[place] = entry;
                }
            }
            Target::Leaf { first, count } => {
                counter.test_triangles(count);
                let candidates = match &leaves {
                    Some(leaves) => leaves.candidates(&wide.rows[9 * first..], count, limit),
                    None => ((1u16 << count) - 1) as u8,
                };
                for lane in bits(candidates) {
                    let row = tree.order[first + lane];
                    // In single precision the corners are at hand.
                    let corners = wide.corners(first, count, lane).unwrap_or_else(|| triangles.corners(row));
                    match offer(row, corners) {
                        ControlFlow::Continue(t) => limit = single(t),
                        ControlFlow::Break(()) => return,
                    }
                }
            }
        }
        loop {
            match stack.pop() {
                Some(entry) if entry.near <= limit => {
                    target = entry.child.target();
                    break;
                }
                Some(_) => {}
                None => return,
            }
        }
    }
}

/// The same in double precision, one child after another.
#[cold]
fn meets_slowly(crossing: &Crossing, ray: &Ray, record: &Record, limit: f32) -> (u8, [f32; WIDTH]) {
    let mut near = [0.0; WIDTH];
    let mut hits = 0;
    for (lane, near) in near.iter_mut().enumerate() {
        let bounds = record.bounds(lane);
        let (enters, leaves) = crossing.clip(&bounds, ray.t_min, f64::from(limit).min(ray.t_max));
        *near = round_down(enters);
        hits |= u8::from(enters <= leaves && bounds.lower[0] <= bounds.upper[0]) << lane;
    }
    (hits, near)
}
