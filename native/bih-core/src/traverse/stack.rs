//! What a ray has put off.

use super::packet;
use crate::tree::{MAX_DEPTH, WIDTH};

/// A node to visit later, and the part of the ray that lies in it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Entry {
    pub node: usize,
    pub near: f64,
    pub far: f64,
}

/// Room for one node a level: a step down puts off at most one child, and no node is deeper than `MAX_DEPTH`.
///
/// Made once for many rays.
#[derive(Debug, Clone)]
pub struct Stack {
    entries: [Entry; MAX_DEPTH as usize],
    len: usize,
    pub(super) wide: WideStack,
    /// For packets.
    pub(super) packet: Vec<packet::Entry>,
}

impl Default for Stack {
    fn default() -> Self {
        Self { entries: [Entry::default(); MAX_DEPTH as usize], len: 0, wide: WideStack::default(), packet: Vec::new() }
    }
}

impl Stack {
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(super) fn push(&mut self, entry: Entry) {
        self.entries[self.len] = entry;
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        Some(self.entries[self.len])
    }
}

/// Entries that a walk over records of this depth puts off at most: a step down takes one and adds `WIDTH`.
pub(super) const fn room(depth: usize) -> usize {
    (WIDTH - 1) * depth + 1
}

/// Room for children of wide records: where they are entered, and their words.
#[derive(Debug, Clone, Default)]
pub(super) struct WideStack {
    nears: Vec<f32>,
    words: Vec<u32>,
}

impl WideStack {
    /// For a walk over records of this depth.
    #[inline(always)]
    pub(super) fn emptied(&mut self, depth: usize) -> Postponed<'_> {
        let room = room(depth);
        if self.nears.len() < room {
            self.nears.resize(room, 0.0);
            self.words.resize(room, 0);
        }
        Postponed { nears: &mut self.nears, words: &mut self.words, len: 0 }
    }
}

/// The children that one ray has put off.
pub(super) struct Postponed<'a> {
    nears: &'a mut [f32],
    words: &'a mut [u32],
    len: usize,
}

impl<'a> Postponed<'a> {
    /// Where the children of a record go.
    #[inline(always)]
    pub(super) fn room(&mut self) -> (&mut [f32; WIDTH], &mut [u32; WIDTH]) {
        let nears = self.nears.get_mut(self.len..).and_then(<[f32]>::first_chunk_mut);
        let words = self.words.get_mut(self.len..).and_then(<[u32]>::first_chunk_mut);
        nears.zip(words).expect("a stack has room for a step at any depth of its tree")
    }

    /// This many were put there.
    #[inline(always)]
    pub(super) fn grow(&mut self, count: usize) {
        self.len += count;
    }

    /// The last one that begins before the limit; those behind it are dropped.
    #[inline(always)]
    pub(super) fn pop(&mut self, limit: f32) -> Option<u32> {
        while self.len > 0 {
            self.len -= 1;
            if self.nears[self.len] <= limit {
                return Some(self.words[self.len]);
            }
        }
        None
    }
}
