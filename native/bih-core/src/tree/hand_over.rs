//! The hand-over of a piece from the thread that builds it to those that trace it.
//!
//! The root of a piece goes from unbuilt to busy by compare-and-exchange, so that one thread builds it, and from busy to
//! its word by a store that releases all that was written before. Nobody waits in here: who finds a piece busy does
//! something else first. A builder that fails gives its claim back.

#[cfg(not(loom))]
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(loom)]
use loom::sync::atomic::{AtomicU32, Ordering};

/// No words of a root: indices of nodes and records stay below 2^30, and words of leaves have bit 31 set.
const UNBUILT: u32 = 0x7000_0000;
const BUSY: u32 = UNBUILT + 1;

/// One word a piece: where its root is, or that there is none yet.
#[derive(Debug)]
pub struct Roots(Box<[AtomicU32]>);

/// How a piece was found.
pub enum Found<'a> {
    /// Its root.
    Built(u32),
    /// Another thread is at it.
    Busy,
    /// Unbuilt, and now ours to build.
    Claimed(Claim<'a>),
}

impl Roots {
    /// All pieces unbuilt.
    pub fn new(pieces: usize) -> Self {
        Self((0..pieces).map(|_| AtomicU32::new(UNBUILT)).collect())
    }

    /// How many pieces there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The root of a piece that is built; all that was written before it can be read.
    #[inline(always)]
    pub fn built(&self, piece: usize) -> Option<u32> {
        let word = self.0[piece].load(Ordering::Acquire);
        (word != UNBUILT && word != BUSY).then_some(word)
    }

    /// Take the piece if it is unbuilt.
    pub fn find(&self, piece: usize) -> Found<'_> {
        let root = &self.0[piece];
        match root.compare_exchange(UNBUILT, BUSY, Ordering::Acquire, Ordering::Acquire) {
            Ok(_) => Found::Claimed(Claim { root, word: UNBUILT }),
            Err(BUSY) => Found::Busy,
            Err(word) => Found::Built(word),
        }
    }
}

/// The right to write a piece, of which nobody else reads anything meanwhile. Given back when it is dropped.
#[derive(Debug)]
pub struct Claim<'a> {
    root: &'a AtomicU32,
    /// What becomes of the root.
    word: u32,
}

impl Claim<'_> {
    /// The piece is written: let it be read.
    pub fn publish(mut self, word: u32) {
        debug_assert!(word != UNBUILT && word != BUSY);
        self.word = word;
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        self.root.store(self.word, Ordering::Release);
    }
}
