//! The frame of every construction: ranges of items are split until they are leaves.
//!
//! Long ranges are split first, their halves at the same time; each short one is then a piece of work of its own. Which
//! ranges are short depends on the mesh alone, so the tree is the same for any number of threads.

use rayon::prelude::*;

use super::leaves::{Places, box_of_rows, write_leaves};
use super::pieces::{Pieces, Ranges};
use super::treelet::Treelet;
use crate::control::{Cancelled, Control};
use crate::geometry::{Bounds, Triangles};
use crate::pages;
use crate::simd::{FloatEnvironment, Kernel, Lanes, dispatch};
use crate::tree::MAX_DEPTH;

/// Ranges of at most this many items are one piece of work: docs/decisions/on-demand.md.
pub const PIECE: usize = 1024;

/// Pieces that there are at most: every other range has more items, and those at one depth are apart.
pub fn most_pieces(items: usize, longest: usize) -> usize {
    items.min(1 + MAX_DEPTH as usize * (items / longest))
}

/// A heuristic: how a range of items is divided.
pub trait Split: Sync {
    /// What is sorted, one for each triangle.
    type Item: Copy + Send + Sync;
    /// What is known of a range.
    type State: Copy + Send + Sync;

    fn row(&self, item: &Self::Item) -> u32;

    /// The pieces of its division, and all else that is needed to split them further when the items are gone.
    fn kept(self, ranges: Vec<Range<Self::State>>) -> Ranges;

    /// The items that stand in the rows of the leaves until these are written; none where they have their own place.
    fn in_rows(_rows: &mut [f32]) -> &mut [Self::Item] {
        &mut []
    }

    /// Make a short range ready for being split all the way down. `scratch` is room that may be used.
    #[inline(always)]
    fn prepare(&self, _items: &mut [Self::Item], _state: &mut Self::State, _scratch: &mut Vec<Self::Item>) {}

    /// Divide two items or more, in place, so that neither part is empty. What is left in `state` holds for both parts.
    fn split<L: Lanes>(&self, items: &mut [Self::Item], state: &mut Self::State, depth: u32) -> Cut;
}

/// How a range was divided: the first `count` items lie below the others along the axis. No axis: on the longest one of
/// the node's bounds, because no plane separates them.
#[derive(Debug, Clone, Copy)]
pub struct Cut {
    pub count: usize,
    pub axis: Option<usize>,
    /// Halvings skipped before it, because all items were on one side.
    pub skipped: u32,
}

impl Cut {
    pub fn along(axis: usize, count: usize) -> Self {
        Self { count, axis: Some(axis), skipped: 0 }
    }

    pub fn by_row(count: usize) -> Self {
        Self { count, axis: None, skipped: 0 }
    }
}

/// What pieces are turned into.
pub trait Emission: Sync {
    type Piece: Send + Weight;
    type Output: Default + Weight;
    /// Make something of a finished treelet.
    fn piece(&self, treelet: &Treelet) -> Self::Piece;
    /// What stands for a piece that is built on demand.
    fn unbuilt(&self, number: usize) -> Self::Piece;
    /// Put all together; the leaves of `top` are the numbers of pieces.
    fn join(&self, top: &Treelet, pieces: Vec<Self::Piece>) -> Self::Output;
}

/// What counts as memory.
pub trait Weight {
    fn bytes(&self) -> usize;
}

/// Everything that is the same for all ranges.
pub struct Frame<'a, S, E> {
    pub split: S,
    pub emission: E,
    pub triangles: &'a Triangles<'a>,
    pub leaf_size: usize,
    /// The most items of a piece.
    pub longest: usize,
    pub control: &'a Control,
}

/// What was constructed.
pub struct Constructed<T> {
    pub output: T,
    /// Halvings that had all objects on one side.
    pub skipped: usize,
    /// The most memory held at once.
    pub peak_bytes: usize,
}

/// A range that is one piece of work.
#[derive(Debug, Clone, Copy)]
pub struct Range<T> {
    pub first: usize,
    pub count: usize,
    pub depth: u32,
    pub state: T,
}

/// What long ranges were split into.
enum Top<T> {
    Piece(Range<T>),
    Inner { cut: Cut, halves: Box<[Top<T>; 2]> },
}

impl<S: Split, E: Emission> Frame<'_, S, E> {
    /// Build over the items, or over those in the rows where there are none; the places are filled.
    pub fn construct(
        &self,
        mut items: Vec<S::Item>,
        state: S::State,
        places: Places,
    ) -> Result<Constructed<E::Output>, Cancelled> {
        let Places { order, rows } = places;
        let count = order.len();
        let all = if items.is_empty() { S::in_rows(&mut rows[..9 * count]) } else { &mut items };
        let top = self.divide(all, Range { first: 0, count, depth: 0, state })?;
        let mut treelet = Treelet::default();
        let mut ranges = Vec::new();
        flatten(top, &mut treelet, &mut ranges);
        let work = share(ranges, &mut items, Places { order, rows });
        let pieces = work
            .into_par_iter()
            .map_init(Default::default, |(treelet, scratch), piece| self.piece(piece, treelet, scratch))
            .collect::<Result<Vec<_>, Cancelled>>()?;
        let items_bytes = size_of_val(&items[..]);
        drop(items);

        let at_once = rayon::current_num_threads().min(pieces.len());
        let scratch_bytes = at_once * pieces.iter().map(|piece| piece.scratch_bytes).max().unwrap_or(0);
        let piece_bytes: usize = pieces.iter().map(|piece| piece.output.bytes()).sum();
        for leaf in treelet.branches.iter_mut().filter(|branch| branch.is_leaf()) {
            leaf.bounds = pieces[leaf.first as usize].bounds;
        }
        treelet.unite();
        let skipped = treelet.skipped + pieces.iter().map(|piece| piece.skipped).sum::<usize>();
        let output = self.emission.join(&treelet, pieces.into_iter().map(|piece| piece.output).collect());
        let peak_bytes = piece_bytes + (items_bytes + scratch_bytes).max(output.bytes());
        Ok(Constructed { output, skipped, peak_bytes })
    }

    /// Divide the items into pieces that are built later, and keep the rows of each in the order of the items.
    pub fn lay_out(
        self,
        mut items: Vec<S::Item>,
        state: S::State,
    ) -> Result<(Constructed<E::Output>, Pieces), Cancelled> {
        let count = items.len();
        let top = self.divide(&mut items, Range { first: 0, count, depth: 0, state })?;
        let mut treelet = Treelet::default();
        let mut ranges = Vec::new();
        flatten(top, &mut treelet, &mut ranges);
        let mut order = pages::zeroed(count);
        let work = share::<S>(ranges, &mut items, Places { order: &mut order, rows: &mut [] });
        let (ranges, boxes): (Vec<_>, Vec<_>) = work
            .into_par_iter()
            .map(|Work { range, items, places }| {
                let _standard = FloatEnvironment::standard();
                self.control.advance(range.count)?;
                for (place, item) in places.order.iter_mut().zip(items) {
                    *place = self.split.row(item);
                }
                Ok((range, box_of_rows(self.triangles, places.order)))
            })
            .collect::<Result<Vec<_>, Cancelled>>()?
            .into_iter()
            .unzip();
        let items_bytes = size_of_val(&items[..]);
        drop(items);
        for leaf in treelet.branches.iter_mut().filter(|branch| branch.is_leaf()) {
            leaf.bounds = boxes[leaf.first as usize];
        }
        treelet.unite();
        let pieces = (0..ranges.len()).map(|number| self.emission.unbuilt(number)).collect();
        let output = self.emission.join(&treelet, pieces);
        let peak_bytes = items_bytes + size_of_val(&order[..]);
        let constructed = Constructed { output, skipped: treelet.skipped, peak_bytes };
        Ok((constructed, Pieces { ranges: self.split.kept(ranges), order }))
    }

    /// Build one piece over its items.
    pub fn finish(&self, range: Range<S::State>, items: &mut [S::Item], places: Places) -> E::Piece {
        self.plan(Work { range, items, places }, &mut Treelet::default(), &mut Vec::new()).output
    }

    /// Split down to pieces, both halves at the same time.
    fn divide(&self, items: &mut [S::Item], range: Range<S::State>) -> Result<Top<S::State>, Cancelled> {
        if items.len() <= self.longest {
            return Ok(Top::Piece(range));
        }
        let _standard = FloatEnvironment::standard();
        self.control.check()?;
        let Range { first, count, depth, mut state } = range;
        let cut = dispatch(SplitOnce { split: &self.split, items: &mut *items, state: &mut state, depth });
        let (lower, upper) = items.split_at_mut(cut.count);
        let left = Range { first, count: cut.count, depth: depth + 1, state };
        let right = Range { first: first + cut.count, count: count - cut.count, depth: depth + 1, state };
        let (left, right) = rayon::join(|| self.divide(lower, left), || self.divide(upper, right));
        Ok(Top::Inner { cut, halves: Box::new([left?, right?]) })
    }

    fn piece(
        &self,
        work: Work<S>,
        treelet: &mut Treelet,
        scratch: &mut Vec<S::Item>,
    ) -> Result<Piece<E::Piece>, Cancelled> {
        let _standard = FloatEnvironment::standard();
        self.control.advance(work.range.count)?;
        Ok(self.plan(work, treelet, scratch))
    }

    fn plan(&self, work: Work<S>, treelet: &mut Treelet, scratch: &mut Vec<S::Item>) -> Piece<E::Piece> {
        let Work { range, items, places } = work;
        let items = if items.is_empty() { S::in_rows(places.rows) } else { items };
        dispatch(Plan { split: &self.split, items, range: &range, leaf_size: self.leaf_size, treelet, scratch });
        for (place, item) in places.order.iter_mut().zip(items) {
            *place = self.split.row(item);
        }
        write_leaves(self.triangles, treelet, places);
        treelet.unite();
        Piece {
            bounds: treelet.branches[0].bounds,
            skipped: treelet.skipped,
            scratch_bytes: treelet.bytes() + size_of_val(&scratch[..]),
            output: self.emission.piece(treelet),
        }
    }
}

/// The top as a treelet whose leaves are the numbers of the pieces, and the pieces in order.
fn flatten<T>(top: Top<T>, treelet: &mut Treelet, ranges: &mut Vec<Range<T>>) {
    treelet.start(1);
    let mut waiting = vec![(0, top)];
    while let Some((index, top)) = waiting.pop() {
        match top {
            Top::Piece(range) => {
                treelet.branches[index].first = ranges.len() as u32;
                ranges.push(range);
            }
            Top::Inner { cut, halves } => {
                let left = treelet.open(index, Cut { count: 1, ..cut });
                let [lower, upper] = *halves;
                waiting.push((left + 1, upper));
                waiting.push((left, lower));
            }
        }
    }
}

/// A range, and what belongs to it.
struct Work<'a, S: Split> {
    range: Range<S::State>,
    /// None where they stand in the rows.
    items: &'a mut [S::Item],
    places: Places<'a>,
}

/// Give each range what belongs to it.
fn share<'a, S: Split>(
    ranges: Vec<Range<S::State>>,
    mut items: &'a mut [S::Item],
    places: Places<'a>,
) -> Vec<Work<'a, S>> {
    let Places { mut order, mut rows } = places;
    let mut work = Vec::with_capacity(ranges.len());
    for range in ranges {
        let (mine, places);
        (mine, items) = items.split_at_mut(range.count.min(items.len()));
        (places, order, rows) = {
            let (order, other_order) = order.split_at_mut(range.count);
            let (rows, other_rows) = rows.split_at_mut((9 * range.count).min(rows.len()));
            (Places { order, rows }, other_order, other_rows)
        };
        work.push(Work { range, items: mine, places });
    }
    work
}

/// A finished piece.
struct Piece<T> {
    bounds: Bounds,
    skipped: usize,
    scratch_bytes: usize,
    output: T,
}

struct SplitOnce<'a, S: Split> {
    split: &'a S,
    items: &'a mut [S::Item],
    state: &'a mut S::State,
    depth: u32,
}

impl<S: Split> Kernel for SplitOnce<'_, S> {
    type Output = Cut;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Cut {
        self.split.split::<L>(self.items, self.state, self.depth)
    }
}

struct Plan<'a, S: Split> {
    split: &'a S,
    items: &'a mut [S::Item],
    range: &'a Range<S::State>,
    leaf_size: usize,
    treelet: &'a mut Treelet,
    scratch: &'a mut Vec<S::Item>,
}

impl<S: Split> Kernel for Plan<'_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Range { first, depth, mut state, .. } = *self.range;
        self.split.prepare(self.items, &mut state, self.scratch);
        self.treelet.plan::<S, L>(self.split, self.items, state, depth, self.leaf_size);
        self.treelet.first = first;
    }
}
