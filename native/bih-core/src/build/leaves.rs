//! Writing leaves: their references in the order of the rows, their triangles, their boxes.

use super::frame::Places;
use super::source::{Coordinate, Reading, Source, box_of, least, most, read};
use super::treelet::{Branch, Treelet};
use crate::geometry::{Bounds, Triangles};

/// Fill the places of all leaves of the treelet. `order` already holds the references of each, in any order.
pub fn write_leaves(triangles: &Triangles, treelet: &mut Treelet, places: Places) {
    let Places { order, rows } = places;
    read(triangles, Leaves { branches: &mut treelet.branches, order, rows });
}

struct Leaves<'a> {
    branches: &'a mut [Branch],
    order: &'a mut [u32],
    rows: &'a mut [f32],
}

impl Reading for Leaves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        for leaf in self.branches.iter_mut().filter(|branch| branch.is_leaf()) {
            let (first, count) = (leaf.first as usize, leaf.count as usize);
            let references = &mut self.order[first..first + count];
            sort(references);
            let rows = if self.rows.is_empty() { &mut [] } else { &mut self.rows[9 * first..9 * (first + count)] };
            leaf.bounds = write_leaf(source, references, rows);
        }
    }
}

/// By insertion: there are few.
#[inline(always)]
fn sort(references: &mut [u32]) {
    if references.len() > 32 {
        references.sort_unstable();
        return;
    }
    for end in 1..references.len() {
        let reference = references[end];
        let mut place = end;
        while place > 0 && references[place - 1] > reference {
            references[place] = references[place - 1];
            place -= 1;
        }
        references[place] = reference;
    }
}

#[inline(always)]
fn write_leaf<S: Source>(source: S, references: &[u32], rows: &mut [f32]) -> Bounds {
    let count = references.len();
    let mut lower = [S::Scalar::INFINITY; 3];
    let mut upper = [S::Scalar::NEG_INFINITY; 3];
    for (lane, &reference) in references.iter().enumerate() {
        let corners = source.corners(reference as usize);
        let [low, high] = box_of(&corners);
        for axis in 0..3 {
            lower[axis] = least(low[axis], lower[axis]);
            upper[axis] = most(high[axis], upper[axis]);
        }
        if !rows.is_empty() {
            for (row, value) in corners.as_flattened().iter().enumerate() {
                rows[row * count + lane] = value.single();
            }
        }
    }
    // Adding +0 makes -0 a +0: which of the two is the smaller one is left open, and the bits of a tree are not.
    Bounds { lower: lower.map(|x| x.below() + 0.0), upper: upper.map(|x| x.above() + 0.0) }
}
