//! The grid of the global heuristic: halve the longest side of the cell, wherever the objects are.
//!
//! Wächter and Keller 2006, section 3.2; the slides' "divide longest side in the middle". All cells of a level have one
//! shape, so which axis a level halves is one sequence for all of them, and a cell is a code of one bit a level.

use super::source::{least, most};

/// Bits of a code along one axis at most.
const AXIS_BITS: usize = 31;

/// The axes that the bits of a key stand for, two bits each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Axes(u128);

impl Axes {
    fn set(&mut self, bit: u32, axis: usize) {
        self.0 |= (axis as u128) << (2 * bit);
    }

    /// The axis that a bit of the key halves.
    #[inline(always)]
    pub fn of(self, bit: u32) -> usize {
        (self.0 >> (2 * bit)) as usize & 3
    }
}

/// A grid over a box of doubled centres. Keys hold a cell's code in their upper bits, the first halving uppermost, and
/// leave the lowest to the row.
#[derive(Debug)]
pub struct Grid {
    lower: [f64; 3],
    /// Cells a unit of length, a little more than there are.
    scale: [f64; 3],
    /// Length of a cell.
    step: [f64; 3],
    largest: [f64; 3],
    pub axes: Axes,
    /// What it is made of.
    pub sides: [[f64; 3]; 2],
    /// Where the bits of a code along an axis stand in the key, byte by byte.
    tables: [[[u64; 256]; 4]; 3],
    /// Whether two bytes are all.
    is_narrow: bool,
}

impl Grid {
    /// The last `row_bits` bits of the key are not the grid's.
    pub fn new(lower: [f64; 3], upper: [f64; 3], row_bits: u32) -> Self {
        let sides: [f64; 3] = std::array::from_fn(|axis| upper[axis] - lower[axis]);
        let mut cell = sides;
        let mut axes = Axes::default();
        // The places of each axis' bits, its first halving first.
        let mut places = [[0u32; AXIS_BITS]; 3];
        let mut counts = [0usize; 3];
        for bit in (row_bits..u64::BITS).rev() {
            let longest = (1..3).fold(0, |longest, axis| if cell[axis] > cell[longest] { axis } else { longest });
            let count = &mut counts[longest];
            if cell[longest] <= 0.0 || *count == AXIS_BITS {
                break;
            }
            places[longest][*count] = bit;
            *count += 1;
            axes.set(bit, longest);
            cell[longest] *= 0.5;
        }
        let mut tables = [[[0; 256]; 4]; 3];
        for axis in 0..3 {
            for (bit, place) in places[axis][..counts[axis]].iter().rev().enumerate() {
                for (byte, word) in tables[axis][bit / 8].iter_mut().enumerate() {
                    *word |= (byte as u64 >> (bit % 8) & 1) << place;
                }
            }
        }
        let cells = counts.map(|count| (1u64 << count) as f64);
        Self {
            lower,
            // The quotient and the product are off by three roundings of 2^-53 at most, and more than that is added.
            scale: std::array::from_fn(|axis| {
                if counts[axis] == 0 { 0.0 } else { cells[axis] / sides[axis] * (1.0 + 4.0 * f64::EPSILON) }
            }),
            step: std::array::from_fn(|axis| sides[axis] / cells[axis]),
            largest: cells.map(|cells| cells - 1.0),
            axes,
            sides: [lower, upper],
            tables,
            is_narrow: counts.iter().all(|&count| count <= 16),
        }
    }

    /// The code of a doubled centre, where it stands in the key. It grows with each coordinate, so that partitions by its
    /// bits and sorting by its value make one tree.
    #[inline(always)]
    pub fn code(&self, centre: [f64; 3]) -> u64 {
        /// From this number up there are whole ones alone, and the last bits are theirs: no conversion, which costs more.
        const WHOLE: f64 = (1u64 << 52) as f64;
        let codes: [u32; 3] = std::array::from_fn(|axis| {
            let cell = (centre[axis] - self.lower[axis]) * self.scale[axis];
            // The sum is rounded to the nearest cell.
            let rounded = least(most(cell, 0.0), self.largest[axis]) + WHOLE;
            // Too high by one, if at all; a centre on a plane is above it. Whatever the roundings, it still grows with the centre.
            let plane = self.lower[axis] + (rounded - WHOLE) * self.step[axis];
            (rounded.to_bits() as i32 - i32::from(centre[axis] < plane)).max(0) as u32
        });
        let mut key = 0;
        for (tables, code) in self.tables.iter().zip(codes) {
            let byte = |place: usize| tables[place][(code >> (8 * place)) as usize & 0xff];
            key |= byte(0) | byte(1);
            if !self.is_narrow {
                key |= byte(2) | byte(3);
            }
        }
        key
    }
}
