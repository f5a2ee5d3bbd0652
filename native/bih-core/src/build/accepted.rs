//! The rows of a mesh that go into the tree, piece by piece.

use std::ops::Range;

use crate::geometry::Triangles;

/// Rows that one piece of work reads.
pub const CHUNK: usize = 1 << 15;

/// All rows but the rejected ones.
#[derive(Clone, Copy)]
pub struct Accepted<'a> {
    pub triangles: &'a Triangles<'a>,
    /// Ascending.
    pub rejected: &'a [u32],
}

impl<'a> Accepted<'a> {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.triangles.len() - self.rejected.len()
    }

    /// Chunks of so many rows, each with its part of `items`, one for each accepted row.
    pub fn chunks<'b, T>(&self, size: usize, mut items: &'b mut [T]) -> Vec<(Range<usize>, &'b mut [T])> {
        let rows = self.triangles.len();
        let mut chunks = Vec::with_capacity(rows.div_ceil(size));
        for start in (0..rows).step_by(size) {
            let chunk = start..rows.min(start + size);
            let (mine, rest) = items.split_at_mut(chunk.len() - self.rejected_of(&chunk).len());
            chunks.push((chunk, mine));
            items = rest;
        }
        chunks
    }

    /// The runs of rows between the rejected ones.
    pub fn runs(&self, rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let rejected = self.rejected_of(&rows);
        let starts = std::iter::once(rows.start).chain(rejected.iter().map(|&row| row as usize + 1));
        let ends = rejected.iter().map(|&row| row as usize).chain(std::iter::once(rows.end));
        starts.zip(ends).map(|(start, end)| start..end)
    }

    fn rejected_of(&self, rows: &Range<usize>) -> &'a [u32] {
        let place = |row: usize| self.rejected.partition_point(|&rejected| (rejected as usize) < row);
        &self.rejected[place(rows.start)..place(rows.end)]
    }
}
