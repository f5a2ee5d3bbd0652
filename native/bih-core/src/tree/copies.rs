//! Copies of the vertices of those leaves that rays came to twice, in a tree that is built on demand.
//!
//! Most leaves that a picture needs are visited by one packet, once: its rays read the caller's vertices. Who comes again
//! copies them, one copy behind another.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::hand_over::Visits;
use super::shared::{LeafRows, Shared};
use super::wide::WIDTH;
use crate::simd::prefetch_at;

/// Room for the copies, and where they are.
#[derive(Debug)]
pub struct Copies {
    visits: Visits,
    /// A leaf of n triangles takes n + 1 times `WIDTH` numbers: its nine rows are read as whole vectors to the end of
    /// those, and no further.
    rows: Shared<f32>,
    /// How many times `WIDTH` numbers are taken.
    used: AtomicUsize,
}

impl Copies {
    /// Numbers a triangle that there is room for: leaves of four triangles or more find room, all of them. Where there
    /// is none left, rays go on reading the caller's vertices.
    const ROOM: usize = 10;

    /// Bytes a triangle that they never exceed, `WIDTH` numbers in all excepted.
    pub const BOUND: usize = Self::ROOM * size_of::<f32>() + size_of::<u32>();

    /// Of no leaf yet, among so many references.
    pub(crate) fn new(references: usize) -> Self {
        let numbers = (Self::ROOM * references).next_multiple_of(WIDTH);
        Self { visits: Visits::new(references), rows: Shared::growing(&[], numbers), used: AtomicUsize::new(0) }
    }

    /// Bytes of the copies, and of the words of so many references that are in use.
    pub(crate) fn bytes(&self, references: usize) -> usize {
        size_of::<[f32; WIDTH]>() * self.used.load(Ordering::Relaxed) + size_of::<u32>() * references
    }

    /// The rows of the leaf that starts at a reference, if there is a copy.
    #[inline(always)]
    pub(crate) fn get(&self, first: usize, count: usize) -> Option<LeafRows<'_>> {
        let place = self.visits.copied(first)?;
        Some(self.rows.leaf(WIDTH * place as usize, count))
    }

    /// A ray came to a leaf without a copy, and these are its rows.
    pub(crate) fn visit(&self, first: usize, count: usize, rows: &[f32; 9 * WIDTH]) {
        let Some(mut claim) = self.visits.visit(first) else { return };
        // Where there is no room, the claim is given back.
        let Some(place) = self.take(count + 1) else { return };
        let start = WIDTH * place;
        self.rows.write(&mut claim, start..start + 9 * count).copy_from_slice(&rows[..9 * count]);
        Visits::publish(claim, place as u32);
    }

    /// Room for so many times `WIDTH` numbers: where, if there is any left.
    fn take(&self, more: usize) -> Option<usize> {
        let mut used = self.used.load(Ordering::Relaxed);
        while WIDTH * (used + more) <= self.rows.len() {
            match self.used.compare_exchange_weak(used, used + more, Ordering::Relaxed, Ordering::Relaxed) {
                Ok(place) => return Some(place),
                Err(now) => used = now,
            }
        }
        None
    }

    /// Where it says whether there is a copy, a word for each reference, for who asks for memory ahead.
    pub(crate) fn visits_start(&self) -> *const u8 {
        self.visits.start().cast()
    }

    /// Tell the processor that the copy is soon read, if there is one.
    #[inline(always)]
    pub(crate) fn prefetch(&self, first: usize) {
        if let Some(place) = self.visits.copied(first) {
            prefetch_at::<4>(self.rows.start().wrapping_add(WIDTH * place as usize).cast());
        }
    }
}

/// Like arrays that are still written: equal to none.
impl PartialEq for Copies {
    fn eq(&self, _: &Self) -> bool {
        false
    }
}
