//! Records of eight children with boxes in eight bits a coordinate: for meshes that fill the memory.

use bytemuck::{Pod, Zeroable};

use super::wide::{Child, Record, WIDTH};
use crate::geometry::Bounds;
use crate::simd::Lanes;

/// Steps that a coordinate can be away from the corner of its record.
const STEPS: f32 = 255.0;

/// Boxes farther apart than this have no grid: 255 steps of a wider one would overflow.
const LONGEST: f64 = (1u128 << 126) as f64;

/// In the place of a step's width: the boxes have no grid, and each stands for all of space.
const NO_GRID: u8 = u8::MAX;

/// 96 bytes, aligned so that no record lies in three cache lines.
///
/// | bytes | what |
/// | --- | --- |
/// | 0 – 11 | the lower corner of all boxes |
/// | 12 – 14 | the width of a step along x, y and z, a power of two: the exponent of a float32 |
/// | 15 | one bit for each lane with a child |
/// | 16 – 63 | lower x, y, z, then upper x, y, z of the eight boxes, in steps from the corner |
/// | 64 – 95 | the words of the eight children, as in `Record` |
///
/// A box holds that of the `Record` it was made from: every coordinate is rounded outward. That of a lane without a child
/// means nothing. Boxes that lie further apart than single precision can tell, or are infinite, are all of space.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct CompactRecord {
    corner: [f32; 3],
    exponents: [u8; 3],
    lanes: u8,
    lower: [[u8; WIDTH]; 3],
    upper: [[u8; WIDTH]; 3],
    children: [Child; WIDTH],
}

impl CompactRecord {
    /// Bytes of one record.
    pub const BYTES: usize = size_of::<Self>();

    /// The boxes of a record, rounded outward.
    pub fn new(record: &Record) -> Self {
        let mut compact = Self {
            corner: [0.0; 3],
            exponents: [0; 3],
            lanes: 0,
            lower: [[0; WIDTH]; 3],
            upper: [[0; WIDTH]; 3],
            children: record.children,
        };
        let lanes =
            || (0..WIDTH).map(|lane| (lane, record.bounds(lane))).filter(|(_, bounds)| *bounds != Bounds::EMPTY);
        let all = lanes().fold(Bounds::EMPTY, |all, (_, bounds)| all.union(&bounds));
        compact.lanes = lanes().fold(0, |mask, (lane, _)| mask | 1 << lane);
        let grids: [Option<Grid>; 3] = std::array::from_fn(|axis| Grid::new(all.lower[axis], all.upper[axis]));
        let [Some(x), Some(y), Some(z)] = grids else {
            compact.exponents = [NO_GRID; 3];
            return compact;
        };
        for (axis, grid) in [x, y, z].into_iter().enumerate() {
            compact.corner[axis] = grid.corner;
            compact.exponents[axis] = grid.exponent;
            for (lane, bounds) in lanes() {
                compact.lower[axis][lane] = grid.below(bounds.lower[axis]);
                compact.upper[axis][lane] = grid.above(bounds.upper[axis]);
            }
        }
        compact
    }

    /// Whether the boxes are on a grid; if not, each is all of space.
    #[inline(always)]
    pub fn has_grid(&self) -> bool {
        self.exponents[0] != NO_GRID
    }

    /// The corner of all boxes and the width of a step along an axis: a coordinate is corner + steps · width, rounded to
    /// nearest once, as the product is exact.
    #[inline(always)]
    pub fn grid(&self, axis: usize) -> (f32, f32) {
        (self.corner[axis], width(self.exponents[axis]))
    }

    /// The lower coordinates of the boxes along an axis, in steps.
    #[inline(always)]
    pub fn lower(&self, axis: usize) -> &[u8; WIDTH] {
        &self.lower[axis]
    }

    /// The upper coordinates of the boxes along an axis, in steps.
    #[inline(always)]
    pub fn upper(&self, axis: usize) -> &[u8; WIDTH] {
        &self.upper[axis]
    }

    /// One bit for each lane with a child.
    #[inline(always)]
    pub fn lanes(&self) -> u8 {
        self.lanes
    }

    /// The words of all lanes.
    #[inline(always)]
    pub fn words(&self) -> &[u32; WIDTH] {
        bytemuck::cast_ref(&self.children)
    }

    /// What stands in a lane.
    #[inline(always)]
    pub fn child(&self, lane: usize) -> Child {
        self.children[lane]
    }

    /// The box of a lane; empty where there is no child.
    pub fn bounds(&self, lane: usize) -> Bounds {
        if self.lanes >> lane & 1 == 0 {
            return Bounds::EMPTY;
        }
        if !self.has_grid() {
            return EVERYTHING;
        }
        let at = |steps: &[[u8; WIDTH]; 3], axis: usize| {
            let (corner, width) = self.grid(axis);
            corner + f32::from(steps[axis][lane]) * width
        };
        Bounds {
            lower: std::array::from_fn(|axis| at(&self.lower, axis)),
            upper: std::array::from_fn(|axis| at(&self.upper, axis)),
        }
    }
}

impl CompactRecord {
    /// The record itself, without orders, in `space`.
    #[inline(always)]
    pub fn unpacked<'a, L: Lanes>(&self, space: &'a mut Record) -> &'a Record {
        let nothing = L::mask(!self.lanes);
        space.children = self.children;
        if !self.has_grid() {
            space.lower = [L::splat(f32::INFINITY).select(nothing, L::splat(f32::NEG_INFINITY)).store(); 3];
            space.upper = [L::splat(f32::NEG_INFINITY).select(nothing, L::splat(f32::INFINITY)).store(); 3];
            return space;
        }
        for axis in 0..3 {
            let (corner, width) = self.grid(axis);
            let (corner, width) = (L::splat(corner), L::splat(width));
            // The product is exact: it does not matter that the sum is rounded once.
            let lower = L::from_bytes(&self.lower[axis]).fused(width, corner);
            let upper = L::from_bytes(&self.upper[axis]).fused(width, corner);
            space.lower[axis] = L::splat(f32::INFINITY).select(nothing, lower).store();
            space.upper[axis] = L::splat(f32::NEG_INFINITY).select(nothing, upper).store();
        }
        space
    }
}

const EVERYTHING: Bounds = Bounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };

/// The steps along one axis.
struct Grid {
    corner: f32,
    exponent: u8,
}

/// 2^(exponent − 127); twice the smallest normal number at least, so that no step is lost to underflow.
#[inline(always)]
fn width(exponent: u8) -> f32 {
    f32::from_bits(u32::from(exponent) << 23)
}

impl Grid {
    /// The finest that reaches from `lower` to `upper`; none where no step is wide enough. Where there is no box, any.
    fn new(lower: f32, upper: f32) -> Option<Self> {
        // In double precision the difference does not overflow.
        let length = f64::from(upper) - f64::from(lower);
        if length == f64::NEG_INFINITY {
            return Some(Self { corner: 0.0, exponent: 1 });
        }
        if length > LONGEST {
            return None;
        }
        let exponent = ((length / f64::from(STEPS)) as f32).to_bits() >> 23;
        let mut grid = Self { corner: lower, exponent: exponent.max(1) as u8 };
        while grid.at(u8::MAX) < upper {
            grid.exponent += 1;
        }
        Some(grid)
    }

    fn at(&self, steps: u8) -> f32 {
        self.corner + f32::from(steps) * width(self.exponent)
    }

    fn steps(&self, x: f32) -> f64 {
        (f64::from(x) - f64::from(self.corner)) / f64::from(width(self.exponent))
    }

    /// The most steps that do not pass `x`.
    fn below(&self, x: f32) -> u8 {
        let mut steps = self.steps(x).floor() as u8;
        while steps > 0 && self.at(steps) > x {
            steps -= 1;
        }
        steps
    }

    /// The fewest steps that reach `x`.
    fn above(&self, x: f32) -> u8 {
        let mut steps = self.steps(x).ceil() as u8;
        while steps < u8::MAX && self.at(steps) < x {
            steps += 1;
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Scalar;

    fn record(boxes: &[Bounds]) -> Record {
        let mut record = Record::EMPTY;
        for (lane, bounds) in boxes.iter().enumerate() {
            record.set(lane, bounds, Child::leaf(8 * lane, 8));
        }
        record
    }

    fn holds(boxes: &[Bounds]) {
        let compact = CompactRecord::new(&record(boxes));
        let mut space = Record::EMPTY;
        compact.unpacked::<Scalar>(&mut space);
        for lane in 0..WIDTH {
            assert_eq!(space.bounds(lane), compact.bounds(lane), "lane {lane}");
        }
        for (lane, bounds) in boxes.iter().enumerate() {
            assert!(compact.bounds(lane).contains(bounds), "{bounds:?} in {:?}", compact.bounds(lane));
            assert_eq!(compact.child(lane), Child::leaf(8 * lane, 8));
        }
        for lane in boxes.len()..WIDTH {
            assert_eq!(compact.bounds(lane), Bounds::EMPTY);
        }
    }

    #[test]
    fn a_record_is_three_times_a_half_cache_line() {
        assert_eq!(CompactRecord::BYTES, 96);
    }

    #[test]
    fn every_box_holds_the_one_it_was_made_from() {
        let point = |x: f32| Bounds { lower: [x; 3], upper: [x; 3] };
        let span = |x: f32, y: f32| Bounds { lower: [x; 3], upper: [y; 3] };
        holds(&[]);
        holds(&[point(0.0)]);
        holds(&[point(0.1), point(0.2), span(0.1, 0.15)]);
        holds(&[span(-1.0, 1.0), span(0.3, 0.7), point(-0.999_999_94), point(1.0)]);
        holds(&[span(f32::MIN, f32::MAX), point(0.0), span(1.0, 2.0)]);
        holds(&[span(-4e37, 4e37), point(0.0), span(1.0, 2.0)]);
        holds(&[span(f32::NEG_INFINITY, f32::INFINITY), point(0.0), span(1e30, f32::INFINITY)]);
        holds(&[span(1e-45, 3e-45), point(0.0)]);
        holds(&[span(16_777_216.0, 16_777_218.0), point(16_777_216.0)]);
        holds(&[span(-1e-30, 1.0), span(-1e-38, 1e-38), point(1e-45)]);
        for i in 0..2000u32 {
            let x = |k: u32| {
                let bits = (i * 8 + k).wrapping_mul(0x9e37_79b9).rotate_left(13).wrapping_mul(0x85eb_ca6b);
                f32::from_bits(bits & 0x8fff_ffff | 0x3000_0000)
            };
            let boxes: Vec<_> = (0..4).map(|k| span(x(2 * k).min(x(2 * k + 1)), x(2 * k).max(x(2 * k + 1)))).collect();
            holds(&boxes);
        }
    }

    #[test]
    fn boxes_are_at_most_two_steps_too_wide() {
        let bounds = Bounds { lower: [0.0; 3], upper: [1.0, 10.0, 100.0] };
        let inner = Bounds { lower: [0.25, 2.5, 25.0], upper: [0.75, 7.5, 75.0] };
        let compact = CompactRecord::new(&record(&[bounds, inner]));
        for axis in 0..3 {
            let (_, step) = compact.grid(axis);
            assert!(step <= 2.0 * (bounds.upper[axis] - bounds.lower[axis]) / STEPS);
            assert!(inner.lower[axis] - compact.bounds(1).lower[axis] < step);
            assert!(compact.bounds(1).upper[axis] - inner.upper[axis] < step);
        }
    }
}
