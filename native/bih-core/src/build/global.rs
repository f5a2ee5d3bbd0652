//! The global heuristic on keys: one bit of the code says on which side of the plane a triangle lies.

use super::frame::{Cut, Split};
use super::grid::Axes;
use super::keys::{mask, recode};
use crate::geometry::Triangles;
use crate::tree::MAX_SPATIAL_DEPTH;

/// Splits ranges of keys.
pub struct Global<'a> {
    pub triangles: &'a Triangles<'a>,
    pub row_bits: u32,
}

/// What the keys of a range mean.
#[derive(Debug, Clone, Copy)]
pub struct Coding {
    pub axes: Axes,
    /// The bits by which they are in order.
    pub sorted: u64,
    /// Whether all centres are one point.
    pub is_point: bool,
}

impl Split for Global<'_> {
    type Item = u64;
    type State = Coding;

    #[inline(always)]
    fn row(&self, key: u64) -> u32 {
        (key & mask(self.row_bits)) as u32
    }

    #[inline(always)]
    fn split(&self, keys: &mut [u64], coding: &mut Coding, depth: u32) -> Cut {
        let ends = (keys[0] ^ keys[keys.len() - 1]) & coding.sorted;
        if ends != 0 {
            let bit = ends.ilog2();
            let count = keys.partition_point(|key| key >> bit & 1 == 0);
            return Cut { count, axis: Some(coding.axes.of(bit)) };
        }
        if depth >= MAX_SPATIAL_DEPTH || coding.is_point {
            return by_median(keys);
        }
        let mut different = differing_bits(keys) >> self.row_bits;
        if different == 0 {
            match recode(self.triangles, keys, self.row_bits) {
                None => {
                    coding.is_point = true;
                    return by_median(keys);
                }
                Some(grid) => *coding = Coding { axes: grid.axes, sorted: 0, is_point: false },
            }
            different = differing_bits(keys) >> self.row_bits;
        }
        // Halvings that have all triangles on one side are skipped.
        let bit = different.ilog2() + self.row_bits;
        Cut { count: partition(keys, bit), axis: Some(coding.axes.of(bit)) }
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

/// For triangles that no plane separates: the lower half of the rows.
#[cold]
fn by_median(keys: &mut [u64]) -> Cut {
    let count = keys.len() / 2;
    keys.select_nth_unstable(count);
    Cut { count, axis: None }
}
