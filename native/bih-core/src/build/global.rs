//! The global heuristic on keys: one bit of the code says on which side of the plane a triangle lies.

use std::sync::{Mutex, PoisonError};

use super::frame::{Cut, Range, Split};
use super::grid::{Axes, Grid};
use super::keys::{recode, row_mask};
use super::pieces::Ranges;
use crate::geometry::Triangles;
use crate::simd::Lanes;
use crate::tree::MAX_SPATIAL_DEPTH;

/// Splits ranges of keys.
pub struct Global<'a> {
    pub triangles: &'a Triangles<'a>,
    pub row_bits: u32,
    /// The scene's grid, and the boxes of the others that ranges were coded on, where these are wanted later.
    pub grids: Option<Grids>,
}

/// What keys were made with.
pub struct Grids {
    pub scene: Grid,
    pub others: Mutex<Vec<[[f64; 3]; 2]>>,
}

/// What the keys of a range mean.
#[derive(Debug, Clone, Copy)]
pub struct Coding {
    axes: Axes,
    /// Which of the grids they were coded on: 0 the scene's, then the others.
    pub grid: u32,
    /// The bits by which they are in order.
    sorted: u64,
    /// The bits from this one up are the same in all of them.
    common: u32,
    /// Whether all centres are one point.
    is_point: bool,
}

impl Coding {
    /// Of keys in the order of these bits.
    pub fn new(axes: Axes, sorted: u64) -> Self {
        Self { axes, grid: 0, sorted, common: u64::BITS, is_point: false }
    }

    /// A cut at the highest bit that is not the same in all.
    #[inline(always)]
    fn cut(&mut self, bit: u32, count: usize) -> Cut {
        let skipped = self.common - 1 - bit;
        self.common = bit;
        Cut { skipped, ..Cut::along(self.axes.of(bit), count) }
    }
}

impl Global<'_> {
    /// The number of a grid that ranges are coded on from here.
    fn keep(&self, grid: &Grid) -> u32 {
        let Some(Grids { others, .. }) = &self.grids else { return 0 };
        let mut others = others.lock().unwrap_or_else(PoisonError::into_inner);
        others.push(grid.sides);
        others.len() as u32
    }
}

impl Split for Global<'_> {
    type Item = u64;
    type State = Coding;

    #[inline(always)]
    fn row(&self, key: &u64) -> u32 {
        (key & row_mask(self.row_bits)) as u32
    }

    fn kept(self, ranges: Vec<Range<Coding>>) -> Ranges {
        Ranges::of_keys(&ranges, self.grids.expect("kept from the start"), self.row_bits)
    }

    /// A bucket sort by the next halvings, in the cache.
    #[inline(always)]
    fn prepare(&self, keys: &mut [u64], coding: &mut Coding, scratch: &mut Vec<u64>) {
        /// The digit that they are sorted by, and the counts that are worth it.
        const BITS: u32 = 10;
        const WORTHWHILE: usize = 64;
        let different = differing_bits(keys) >> self.row_bits;
        if keys.len() < WORTHWHILE || different == 0 {
            return;
        }
        let top = different.ilog2() + self.row_bits + 1;
        let shift = top.saturating_sub(BITS).max(self.row_bits);
        let digit = |key: u64| (key >> shift) as usize & ((1 << BITS) - 1);
        let mut places = [0u32; 1 << BITS];
        for &key in &*keys {
            places[digit(key)] += 1;
        }
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        scratch.clear();
        scratch.extend_from_slice(keys);
        for &key in &*scratch {
            let place = &mut places[digit(key)];
            keys[*place as usize] = key;
            *place += 1;
        }
        // The bits above are the same in all.
        coding.sorted = !0 << shift;
    }

    #[inline(always)]
    fn split<L: Lanes>(&self, keys: &mut [u64], coding: &mut Coding, depth: u32) -> Cut {
        if depth >= MAX_SPATIAL_DEPTH || coding.is_point {
            return by_median(keys);
        }
        // In order by some bits, the first and the last key differ in the highest of these that any two differ in.
        let ends = (keys[0] ^ keys[keys.len() - 1]) & coding.sorted;
        if ends != 0 {
            let bit = ends.ilog2();
            return coding.cut(bit, keys.partition_point(|key| key >> bit & 1 == 0));
        }
        let mut different = differing_bits(keys) >> self.row_bits;
        if different == 0 {
            match recode(self.triangles, keys, self.row_bits) {
                Some(grid) => *coding = Coding { grid: self.keep(&grid), ..Coding::new(grid.axes, 0) },
                None => coding.is_point = true,
            }
            different = differing_bits(keys) >> self.row_bits;
            if different == 0 {
                return by_median(keys);
            }
        }
        let bit = different.ilog2() + self.row_bits;
        coding.cut(bit, partition(keys, bit))
    }
}

#[inline(always)]
fn differing_bits(keys: &[u64]) -> u64 {
    keys.iter().fold(0, |bits, key| bits | key ^ keys[0])
}

/// Move the keys whose bit is clear to the front; answers how many. Without a branch that depends on a key.
#[inline(always)]
fn partition(keys: &mut [u64], bit: u32) -> usize {
    let mut count = 0;
    for i in 0..keys.len() {
        let is_lower = !keys[i] >> bit & 1;
        keys.swap(i, count);
        count += is_lower as usize;
    }
    count
}

/// For triangles that no plane separates: the lower half of the rows, where the codes are the same.
#[cold]
fn by_median(keys: &mut [u64]) -> Cut {
    let count = keys.len() / 2;
    keys.select_nth_unstable(count);
    Cut::by_row(count)
}
