//! Arrays that builders fill part by part while rays read other parts.

#![expect(unsafe_code, reason = "the on-demand hand-over: parts of one array are read and written at the same time")]

use std::cell::UnsafeCell;
use std::ops::Range;

use super::hand_over::Claim;

/// An array whose parts are handed over: at any moment a part is either written by the one who holds the claim on the
/// piece that it belongs to, or read by whoever knows that the piece is built, or of no piece and never written.
///
/// Who knows it has acquired the root of the piece, which the builder released behind its last write (`Roots`). Indices
/// come from there, and from the records and nodes that hang below: nothing else names a place of a piece.
pub struct Shared<T> {
    cells: Box<[UnsafeCell<T>]>,
    /// Whether all of it was there from the start.
    is_whole: bool,
}

// SAFETY: a place is read by many threads, which T: Sync allows, or written by one, which T: Send allows, never both at
// once: see above.
unsafe impl<T: Send + Sync> Sync for Shared<T> {}

impl<T: Copy> Shared<T> {
    /// An array that is never written again.
    pub(crate) fn whole(values: Vec<T>) -> Self {
        Self { is_whole: true, ..Self::growing(values) }
    }

    /// An array with parts that are still to be written.
    pub(crate) fn growing(values: Vec<T>) -> Self {
        let values = Box::into_raw(values.into_boxed_slice());
        // SAFETY: the box was ours alone, and a cell is laid out as what is in it.
        let cells = unsafe { Box::from_raw(values as *mut [UnsafeCell<T>]) };
        Self { cells, is_whole: false }
    }

    /// How many items there is room for.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is room for none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// An item of a part that is built.
    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> &T {
        // SAFETY: who names the index knows that its part is built, so that nobody writes it.
        unsafe { &*self.cells[index].get() }
    }

    /// The same; none beyond the end.
    #[inline(always)]
    pub(crate) fn try_get(&self, index: usize) -> Option<&T> {
        // SAFETY: as above.
        self.cells.get(index).map(|cell| unsafe { &*cell.get() })
    }

    /// Items of a part that is built.
    #[inline(always)]
    pub(crate) fn slice(&self, range: Range<usize>) -> &[T] {
        let cells = &self.cells[range];
        // SAFETY: a cell is laid out as what is in it; who names the range knows that its part is built, so that nobody
        // writes it.
        unsafe { std::slice::from_raw_parts(cells.as_ptr().cast(), cells.len()) }
    }

    /// A part of the piece that the claim is on, and of no other.
    #[expect(clippy::mut_from_ref, reason = "the claim is what is borrowed mutably")]
    pub(crate) fn write<'a>(&'a self, _claim: &'a mut Claim, range: Range<usize>) -> &'a mut [T] {
        let cells = &self.cells[range];
        // SAFETY: there is one claim on a piece at a time, and while there is one nobody reads the piece; the claim is
        // borrowed as long as the part is, so that no part is given out twice. The pointer is that of cells.
        unsafe { std::slice::from_raw_parts_mut(UnsafeCell::raw_get(cells.as_ptr()), cells.len()) }
    }

    /// Where the items are, for who asks for memory ahead and reads nothing.
    #[inline(always)]
    pub(crate) fn start(&self) -> *const T {
        self.cells.as_ptr().cast()
    }

    /// All items; none where some are still to be written.
    pub fn all(&self) -> Option<&[T]> {
        self.is_whole.then(|| self.slice(0..self.len()))
    }
}

impl<T> std::fmt::Debug for Shared<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} items", self.cells.len())
    }
}

/// Arrays that are still written are equal to none.
impl<T: Copy + PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        self.all().zip(other.all()).is_some_and(|(mine, others)| mine == others)
    }
}
