//! Arrays that builders fill part by part while rays read other parts.

#![expect(unsafe_code, reason = "the on-demand hand-over: parts of one array are read and written at the same time")]

use std::marker::PhantomData;
use std::ops::Range;
use std::ptr::NonNull;
use std::sync::Arc;

use bytemuck::Pod;

use super::hand_over::Claim;
use super::wide::WIDTH;
use crate::geometry::Corners;
use crate::pages;
use crate::saved::Bytes;

/// An array whose parts are handed over: at any moment a part is either written by the one who holds the claim on the
/// piece that it belongs to, or read by whoever knows that the piece is built, or of no piece and never written.
///
/// Who knows it has acquired the root of the piece, which the builder released behind its last write (`Roots`). Indices
/// come from there, and from the records and nodes that hang below: nothing else names a place of a piece.
pub struct Shared<T> {
    /// Of `len` items, all of them initialised. Parts are borrowed from the pointer, never from a box.
    start: NonNull<T>,
    len: usize,
    storage: Storage,
    items: PhantomData<T>,
}

/// What is given back to the allocator.
enum Storage {
    /// The items, all of which were there from the start. They may have been the last.
    Items { are_last: bool },
    /// The lines among which they are.
    Growing(NonNull<[Line]>),
    /// Nothing: they are part of a file, which is held as long. Nobody writes them, as no piece has any of them.
    Saved { _file: Arc<Bytes> },
}

/// As far as an allocator aligns by itself: then it has zeroed memory at hand, and need not write it.
type Line = u128;

// SAFETY: the items belong to the array, like those of a box, or to a file that is only read; `Bytes`, behind an `Arc`, may
// be held and dropped by any thread.
unsafe impl<T: Send> Send for Shared<T> {}

// SAFETY: a place is read by many threads, which T: Sync allows, or written by one, which T: Send allows, never both at
// once: see above.
unsafe impl<T: Send + Sync> Sync for Shared<T> {}

impl<T> Drop for Shared<T> {
    fn drop(&mut self) {
        match self.storage {
            // SAFETY: the pointer is that of the box that `of` took apart, and nobody borrows the array any more.
            Storage::Items { .. } => {
                drop(unsafe { Box::from_raw(NonNull::slice_from_raw_parts(self.start, self.len).as_ptr()) })
            }
            // SAFETY: the same of `growing`; items are plain numbers, which are not dropped.
            Storage::Growing(lines) => drop(unsafe { Box::from_raw(lines.as_ptr()) }),
            Storage::Saved { .. } => {}
        }
    }
}

impl<T: Pod> Shared<T> {
    /// An array that is never written again.
    pub(crate) fn whole(values: Vec<T>) -> Self {
        Self::of(values, true)
    }

    /// An array with items that are still to be written again.
    pub(crate) fn partly(values: Vec<T>) -> Self {
        Self::of(values, false)
    }

    fn of(values: Vec<T>, are_last: bool) -> Self {
        let values = NonNull::from(Box::leak(values.into_boxed_slice()));
        Self { start: values.cast(), len: values.len(), storage: Storage::Items { are_last }, items: PhantomData }
    }

    /// Items that stand in a file; none where the range is not of whole items that are there.
    pub(crate) fn saved(file: &Arc<Bytes>, range: Range<usize>) -> Option<Self> {
        let items: &[T] = bytemuck::try_cast_slice(file.get(range)?).ok()?;
        let storage = Storage::Saved { _file: file.clone() };
        Some(Self { start: NonNull::from(items).cast(), len: items.len(), storage, items: PhantomData })
    }

    /// An array of these items and of zeroed ones that are still to be written. They take no memory until they are.
    pub(crate) fn growing(values: &[T], len: usize) -> Self {
        const { assert!(size_of::<T>() > 0) };
        let bytes = size_of::<T>() * len.max(values.len()) + align_of::<T>();
        let lines = bytemuck::zeroed_slice_box::<Line>(bytes.div_ceil(size_of::<Line>()));
        // They are written from the first to the last, so there is at most one large page more than is needed.
        pages::advise_large(&lines);
        let lines = NonNull::from(Box::leak(lines));
        let first = lines.cast::<T>();
        let offset = first.as_ptr().cast::<u8>().align_offset(align_of::<T>());
        // SAFETY: the lines have room for all items and for as many bytes as the first is moved by to be aligned, less
        // than `align_of`. All of them are zeroed, as T: Pod may be. Nobody else knows of them yet.
        let start = unsafe {
            let start = first.byte_add(offset);
            start.copy_from_nonoverlapping(NonNull::from(values).cast(), values.len());
            start
        };
        Self { start, len: len.max(values.len()), storage: Storage::Growing(lines), items: PhantomData }
    }

    /// How many items there is room for.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is room for none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// An item of a part that is built.
    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> &T {
        assert!(index < self.len);
        // SAFETY: it is within the array; who names the index knows that its part is built, so that nobody writes it.
        unsafe { self.start.add(index).as_ref() }
    }

    /// The same; none beyond the end.
    #[inline(always)]
    pub(crate) fn try_get(&self, index: usize) -> Option<&T> {
        (index < self.len).then(|| self.get(index))
    }

    /// Items of a part that is built.
    #[inline(always)]
    pub(crate) fn slice(&self, range: Range<usize>) -> &[T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: they are within the array; who names the range knows that its part is built, so that nobody writes it.
        unsafe { NonNull::slice_from_raw_parts(self.start.add(range.start), range.len()).as_ref() }
    }

    /// A part of the piece that the claim is on, and of no other.
    pub(crate) fn write<'a>(&'a self, _claim: &'a mut Claim, range: Range<usize>) -> &'a mut [T] {
        assert!(range.start <= range.end && range.end <= self.len);
        // SAFETY: it is within the array. There is one claim on a piece at a time, and while there is one nobody else reads
        // the piece; the claim is borrowed as long as the part is, so that no part is given out twice.
        unsafe { NonNull::slice_from_raw_parts(self.start.add(range.start), range.len()).as_mut() }
    }

    /// Where the items are, for who asks for memory ahead and reads nothing.
    #[inline(always)]
    pub(crate) fn start(&self) -> *const T {
        self.start.as_ptr()
    }

    /// All items; none where some are still to be written.
    pub fn all(&self) -> Option<&[T]> {
        matches!(self.storage, Storage::Items { are_last: true } | Storage::Saved { .. })
            .then(|| self.slice(0..self.len))
    }
}

impl Shared<f32> {
    /// The rows of a leaf of a part that is built: where they start, and how many triangles there are.
    #[inline(always)]
    pub(crate) fn leaf(&self, start: usize, count: usize) -> LeafRows<'_> {
        assert!(count <= WIDTH && start + WIDTH * (count + 1) <= self.len);
        // SAFETY: it is within the array, with as many numbers behind it as `LeafRows` reads; who names the part knows that it
        // is built, so that nobody writes it.
        LeafRows { start: unsafe { self.start.add(start) }, count, rows: PhantomData }
    }
}

/// Nine rows of a number for each of up to `WIDTH` triangles, each read as a whole vector: `WIDTH` numbers from its start.
#[derive(Clone, Copy)]
pub(crate) struct LeafRows<'a> {
    /// `WIDTH * (count + 1)` numbers that nobody writes, as long as they are borrowed.
    start: NonNull<f32>,
    count: usize,
    rows: PhantomData<&'a f32>,
}

impl<'a> LeafRows<'a> {
    /// Of rows that are elsewhere.
    #[inline(always)]
    pub(crate) fn new(rows: &'a [f32; 9 * WIDTH], count: usize) -> Self {
        assert!(count <= WIDTH);
        Self { start: NonNull::from(rows).cast(), count, rows: PhantomData }
    }

    /// A row, and what follows it.
    #[inline(always)]
    pub(crate) fn get(self, row: usize) -> &'a [f32; WIDTH] {
        assert!(row < 9);
        // SAFETY: a row starts after eight others at most, and it is read as one vector: `WIDTH` numbers that end within the
        // `WIDTH * (count + 1)` of the start, which nobody writes as long as they are borrowed.
        unsafe { self.start.add(row * self.count).cast().as_ref() }
    }

    /// All rows, and what follows the last.
    #[inline(always)]
    pub(crate) fn all(self) -> &'a [f32] {
        // SAFETY: these are all the numbers of the start, which nobody writes as long as they are borrowed.
        unsafe { NonNull::slice_from_raw_parts(self.start, WIDTH * (self.count + 1)).as_ref() }
    }

    /// The corners of the triangle in a lane.
    #[inline(always)]
    pub(crate) fn corners(self, lane: usize) -> Corners {
        let at = |row: usize| f64::from(self.get(row)[lane]);
        [[at(0), at(1), at(2)], [at(3), at(4), at(5)], [at(6), at(7), at(8)]]
    }
}

impl<T> std::fmt::Debug for Shared<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{} items", self.len)
    }
}

/// Arrays that are still written are equal to none.
impl<T: Pod + PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        self.all().zip(other.all()).is_some_and(|(mine, others)| mine == others)
    }
}
