//! The children of wide records that rays have put off.

use std::hint::select_unpredictable;

use crate::tree::{Child, WIDTH};

/// Stands at the bottom of each stack, before any limit: a word that is no child.
pub(super) const DONE: u32 = Child::NONE;

/// The place of such a one.
const BOTTOM: u32 = 0;

/// Stacks of some rays, one behind another: where a child is entered, and its word. The end of a ray's stack is kept with
/// the ray.
#[derive(Debug, Clone, Default)]
pub(super) struct Postponed {
    nears: Vec<f32>,
    words: Vec<u32>,
    /// Room of each.
    stride: usize,
}

impl Postponed {
    /// Room for this many rays that walk over records of this depth.
    pub(super) fn new(rays: usize, depth: usize) -> Self {
        // A step down takes one entry and adds `WIDTH` at most.
        let stride = (WIDTH - 1) * depth + 2;
        let mut stacks = Self { nears: vec![0.0; rays * stride], words: vec![0; rays * stride], stride };
        for bottom in (0..rays).map(|ray| ray * stride) {
            stacks.nears[bottom] = f32::NEG_INFINITY;
            stacks.words[bottom] = DONE;
        }
        stacks
    }

    /// The depth of records that there is room for.
    #[inline(always)]
    pub(super) fn depth(&self) -> usize {
        self.stride.saturating_sub(2) / (WIDTH - 1)
    }

    /// Give each ray room for records of this depth, if there is less; answers by how much each stack begins further on
    /// than the one before it, if it did.
    pub(super) fn deepen(&mut self, depth: usize) -> Option<u32> {
        let Self { nears, words, stride } = self;
        let mut deeper = Self::new(nears.len() / *stride, depth);
        if deeper.stride <= *stride {
            return None;
        }
        for (from, to) in nears.chunks(*stride).zip(deeper.nears.chunks_mut(deeper.stride)) {
            to[..from.len()].copy_from_slice(from);
        }
        for (from, to) in words.chunks(*stride).zip(deeper.words.chunks_mut(deeper.stride)) {
            to[..from.len()].copy_from_slice(from);
        }
        let further = deeper.stride - *stride;
        *self = deeper;
        Some(further as u32)
    }

    /// The entry that was taken last and left this end waits for another thread: put it behind the next one, if there is
    /// one. Answers the end before it was taken.
    pub(super) fn put_off(&mut self, word: u32, end: u32) -> u32 {
        let place = end as usize;
        self.words[place] = word;
        if self.words[place - 1] != DONE {
            self.words.swap(place - 1, place);
            self.nears.swap(place - 1, place);
        }
        end + 1
    }

    /// Room for one ray that walks over records of this depth.
    #[inline(always)]
    pub(super) fn reserve(&mut self, depth: usize) {
        if self.stride < (WIDTH - 1) * depth + 2 {
            *self = Self::new(1, depth);
        }
    }

    /// The end of the empty stack of a ray.
    #[inline(always)]
    pub(super) fn start(&self, ray: usize) -> u32 {
        start(ray, self.stride)
    }

    /// The entries, as long as no stack gets more room.
    #[inline(always)]
    pub(super) fn entries(&mut self) -> Entries<'_> {
        // Cut to one length, so that one check is enough for both.
        let length = self.nears.len().min(self.words.len());
        Entries { nears: &mut self.nears[..length], words: &mut self.words[..length], stride: self.stride }
    }
}

/// The entries of all stacks.
pub(super) struct Entries<'a> {
    nears: &'a mut [f32],
    words: &'a mut [u32],
    stride: usize,
}

/// The end of an empty stack: behind the entry at its bottom.
#[inline(always)]
fn start(ray: usize, stride: usize) -> u32 {
    (ray * stride) as u32 + 1
}

impl Entries<'_> {
    /// The end of the empty stack of a ray.
    #[inline(always)]
    pub(super) fn start(&self, ray: usize) -> u32 {
        start(ray, self.stride)
    }

    /// Where the children of a record go.
    #[inline(always)]
    pub(super) fn room(&mut self, end: u32) -> (&mut [f32; WIDTH], &mut [u32; WIDTH]) {
        let range = end as usize..end as usize + WIDTH;
        let nears = self.nears.get_mut(range.clone()).and_then(<[f32]>::first_chunk_mut);
        let words = self.words.get_mut(range).and_then(<[u32]>::first_chunk_mut);
        nears.zip(words).expect("a stack has room for a step at any depth of its tree")
    }

    /// The nearest of the children that were put there just now, else the last entry before them; and the new end.
    ///
    /// The former need not be read back nor compared, and there is no branch on which of both it is: it could not be
    /// predicted.
    #[inline(always)]
    pub(super) fn next(&self, end: u32, places: u8, nearest: u32, limit: f32) -> (u32, u32) {
        let is_any = places != 0;
        let mut last = end + places.count_ones() - 1;
        let mut compared = select_unpredictable(is_any, BOTTOM, last);
        // The lowest entry is before any limit.
        while self.nears[compared as usize] > limit {
            compared -= 1;
            last = compared;
        }
        (select_unpredictable(is_any, nearest, self.words[compared as usize]), last)
    }

    /// The last entry that begins before the limit, and the new end; what was behind it is dropped.
    #[inline(always)]
    pub(super) fn pop(&self, mut end: u32, limit: f32) -> (u32, u32) {
        loop {
            end -= 1;
            if self.nears[end as usize] <= limit {
                return (self.words[end as usize], end);
            }
        }
    }

    /// A child is gone on with that was never put there: where it is entered, as if it had been taken and left this end.
    #[inline(always)]
    pub(super) fn put_near(&mut self, end: u32, near: f32) {
        self.nears[end as usize] = near;
    }

    /// Where the entry was entered that was taken last and left this end.
    #[inline(always)]
    pub(super) fn near(&self, end: u32) -> f32 {
        self.nears[end as usize]
    }
}
