//! Emission of wide records.

use rayon::prelude::*;

use super::collapse::Collapse;
use super::frame::{Emission, Weight};
use super::treelet::{Branch, Treelet};
use crate::tree::{Child, Record};

/// Turns treelets into records.
pub struct WideRecords;

/// The records of one treelet, their children counted from its own; none where it is a single leaf.
pub struct Piece {
    pub records: Vec<Record>,
    /// Of the deepest leaf, in records.
    pub depth: usize,
    pub leaves: usize,
    pub leaf: Option<Child>,
}

/// All records.
#[derive(Default)]
pub struct Records {
    pub records: Vec<Record>,
    pub depth: usize,
    pub leaves: usize,
}

impl Weight for Piece {
    fn bytes(&self) -> usize {
        self.records.capacity() * Record::BYTES
    }
}

impl Weight for Records {
    fn bytes(&self) -> usize {
        self.records.capacity() * Record::BYTES
    }
}

impl Emission for WideRecords {
    type Piece = Piece;
    type Output = Records;

    fn piece(&self, treelet: &Treelet) -> Piece {
        let child = |leaf: &Branch| Child::leaf(treelet.first + leaf.first as usize, leaf.count as usize);
        let root = &treelet.branches[0];
        if root.is_leaf() {
            return Piece { records: Vec::new(), depth: 0, leaves: 1, leaf: Some(child(root)) };
        }
        let (mut depth, mut leaves) = (0, 0);
        let records = Collapse::default().emit(treelet, |leaf, level| {
            depth = depth.max(level);
            leaves += 1;
            child(leaf)
        });
        Piece { records, depth, leaves, leaf: None }
    }

    fn unbuilt(&self, number: usize) -> Piece {
        Piece { records: Vec::new(), depth: 0, leaves: 0, leaf: Some(Child::piece(number)) }
    }

    fn join(&self, top: &Treelet, mut pieces: Vec<Piece>) -> Records {
        let leaves = pieces.iter().map(|piece| piece.leaves).sum();
        if let [Piece { records, leaf: None, depth, .. }] = &mut pieces[..] {
            let records = std::mem::take(records);
            return Records { records, depth: *depth, leaves };
        }
        // The records of the top come first, then those of each piece. How many the first are is known when they are there.
        let mut collapse = Collapse::default();
        let top_records = collapse.emit(top, |_, _| Child::record(0)).len();
        let mut starts = Vec::with_capacity(pieces.len() + 1);
        let mut end = top_records;
        for piece in &pieces {
            starts.push(end);
            end += piece.records.len();
        }
        let mut depth = 0;
        let top = collapse.emit(top, |leaf, level| {
            let number = leaf.first as usize;
            depth = depth.max(level + pieces[number].depth);
            pieces[number].leaf.unwrap_or(Child::record(starts[number]))
        });
        let record = |index: usize| {
            if index < top_records {
                return top[index];
            }
            let number = starts.partition_point(|&start| start <= index) - 1;
            pieces[number].records[index - starts[number]].moved(starts[number])
        };
        let mut records = Vec::new();
        (0..end).into_par_iter().with_min_len(1024).map(record).collect_into_vec(&mut records);
        Records { records, depth, leaves }
    }
}
