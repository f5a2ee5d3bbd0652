//! What a ray has put off.

use super::packet;
use super::postponed::Postponed;
use crate::kd_tree::{self, LANES};
use crate::tree::MAX_DEPTH;

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
    pub(super) wide: Postponed,
    /// For packets.
    pub(super) packet: Vec<packet::Entry>,
    /// For single rays through a kd-tree.
    pub(super) alone: kd_tree::Stack,
    /// For 2 × 2 packets through binary nodes.
    pub(super) two_by_two: kd_tree::Stack<LANES>,
    /// For the tree of an instance.
    inner: Option<Box<Stack>>,
}

impl Default for Stack {
    fn default() -> Self {
        Self {
            entries: [Entry::default(); MAX_DEPTH as usize],
            len: 0,
            wide: Postponed::default(),
            packet: Vec::new(),
            alone: kd_tree::Stack::default(),
            two_by_two: kd_tree::Stack::default(),
            inner: None,
        }
    }
}

impl Stack {
    /// A stack for walks that begin while one on this goes on.
    #[inline(always)]
    pub(crate) fn take_inner(&mut self) -> Box<Self> {
        self.inner.take().unwrap_or_default()
    }

    /// Keep it for the next time.
    #[inline(always)]
    pub(crate) fn give_inner(&mut self, inner: Box<Self>) {
        self.inner = Some(inner);
    }

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
