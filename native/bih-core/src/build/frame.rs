//! The frame of every construction: ranges of items are split until they are leaves.
//!
//! Long ranges are split first, their halves at the same time; each short one is then a piece of work of its own. Which
//! ranges are short depends on the mesh alone, so the tree is the same for any number of threads.

use rayon::prelude::*;

use super::leaves::write_leaves;
use super::treelet::{Branch, Treelet};
use crate::control::{Cancelled, Control};
use crate::geometry::Triangles;
use crate::simd::FloatEnvironment;

/// Ranges of at most this many items are one piece of work.
pub const PIECE: usize = 4096;

/// A heuristic: how a range of items is divided.
pub trait Split: Sync {
    /// What is sorted, one for each triangle.
    type Item: Copy + Send;
    /// What is known of a range.
    type State: Copy + Send;

    fn row(&self, item: Self::Item) -> u32;

    /// Divide two items or more, in place, so that neither part is empty. What is left in `state` holds for both parts.
    fn split(&self, items: &mut [Self::Item], state: &mut Self::State, depth: u32) -> Cut;
}

/// How a range was divided: the first `count` items lie below the others along the axis. No axis: on the longest one of
/// the node's bounds, because no plane separates them.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    pub count: usize,
    pub axis: Option<usize>,
}

/// What pieces are turned into.
pub trait Emission: Sync {
    type Piece: Send;
    type Output;
    /// Make something of a finished treelet.
    fn piece(&self, treelet: &Treelet) -> Self::Piece;
    /// Put all together; the leaves of `top` are the numbers of pieces.
    fn join(&self, top: &Treelet, pieces: Vec<Self::Piece>) -> Self::Output;
}

/// Where leaves are written to.
pub struct Places<'a> {
    /// Rows of triangles in leaf order.
    pub order: &'a mut [u32],
    /// Nine numbers a triangle, or none.
    pub rows: &'a mut [f32],
}

/// Everything that is the same for all ranges.
pub struct Frame<'a, S: Split, E> {
    pub split: S,
    pub emission: E,
    pub triangles: &'a Triangles<'a>,
    pub leaf_size: usize,
    pub control: &'a Control,
}

/// A range that is one piece of work.
struct Range<T> {
    first: usize,
    count: usize,
    depth: u32,
    state: T,
}

enum Top<T> {
    Piece(Range<T>),
    Inner { axis: Option<usize>, halves: Box<[Top<T>; 2]> },
}

impl<S: Split, E: Emission> Frame<'_, S, E> {
    pub fn construct(&self, items: &mut [S::Item], state: S::State, places: Places) -> Result<E::Output, Cancelled> {
        let count = items.len();
        let top = self.divide(items, Range { first: 0, count, depth: 0, state })?;
        let mut treelet = Treelet::default();
        let mut ranges = Vec::new();
        flatten(top, &mut treelet, &mut ranges);

        let (mut items, mut order, mut rows) = (items, places.order, places.rows);
        let mut work = Vec::with_capacity(ranges.len());
        for range in ranges {
            let numbers = if rows.is_empty() { 0 } else { 9 * range.count };
            let mine;
            let places;
            (mine, items) = items.split_at_mut(range.count);
            (places, order, rows) = {
                let (order, other_order) = order.split_at_mut(range.count);
                let (rows, other_rows) = rows.split_at_mut(numbers);
                (Places { order, rows }, other_order, other_rows)
            };
            work.push((range, mine, places));
        }
        let pieces = work
            .into_par_iter()
            .map_init(Treelet::default, |treelet, (range, items, places)| {
                let _standard = FloatEnvironment::standard();
                self.control.advance(items.len())?;
                treelet.plan(&self.split, items, range.state, range.depth, self.leaf_size);
                for (place, item) in places.order.iter_mut().zip(&*items) {
                    *place = self.split.row(*item);
                }
                write_leaves(self.triangles, treelet, places);
                treelet.unite();
                treelet.first = range.first;
                Ok((treelet.branches[0].bounds, self.emission.piece(treelet)))
            })
            .collect::<Result<Vec<_>, Cancelled>>()?;

        let (bounds, pieces): (Vec<_>, Vec<_>) = pieces.into_iter().unzip();
        for leaf in treelet.branches.iter_mut().filter(|branch| branch.is_leaf()) {
            leaf.bounds = bounds[leaf.first as usize];
        }
        treelet.unite();
        Ok(self.emission.join(&treelet, pieces))
    }

    /// Split down to pieces, both halves at the same time.
    fn divide(&self, items: &mut [S::Item], mut range: Range<S::State>) -> Result<Top<S::State>, Cancelled> {
        if items.len() <= PIECE.max(self.leaf_size) {
            return Ok(Top::Piece(range));
        }
        let _standard = FloatEnvironment::standard();
        self.control.check()?;
        let Cut { count, axis } = self.split.split(items, &mut range.state, range.depth);
        let Range { first, depth, state, .. } = range;
        let (lower, upper) = items.split_at_mut(count);
        let halves = [
            Range { first, count, depth: depth + 1, state },
            Range { first: first + count, count: upper.len(), depth: depth + 1, state },
        ];
        let [left, right] = halves;
        let (left, right) = rayon::join(|| self.divide(lower, left), || self.divide(upper, right));
        Ok(Top::Inner { axis, halves: Box::new([left?, right?]) })
    }
}

/// The top as a treelet whose leaves are the numbers of the pieces, and the pieces in order.
fn flatten<T>(top: Top<T>, treelet: &mut Treelet, ranges: &mut Vec<Range<T>>) {
    treelet.branches.push(Branch::leaf(0, 1));
    let mut waiting = vec![(0, top)];
    while let Some((index, top)) = waiting.pop() {
        match top {
            Top::Piece(range) => {
                treelet.branches[index] = Branch::leaf(ranges.len(), 1);
                ranges.push(range);
            }
            Top::Inner { axis, halves } => {
                let left = treelet.branches.len();
                treelet.branches[index].open(left, axis);
                treelet.branches.extend([Branch::leaf(0, 0); 2]);
                let [lower, upper] = *halves;
                waiting.push((left + 1, upper));
                waiting.push((left, lower));
            }
        }
    }
}
