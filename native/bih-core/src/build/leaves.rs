//! Writing leaves: their references in the order of the rows, their triangles, their boxes.

use super::source::{Coordinate, Reading, Source, box_of, each_row, least, most, read};
use super::treelet::{Branch, Treelet};
use crate::geometry::{Bounds, Triangles};

/// Where leaves are written to.
pub struct Places<'a> {
    /// Rows of triangles in leaf order.
    pub order: &'a mut [u32],
    /// Nine numbers a triangle, or none.
    pub rows: &'a mut [f32],
}

/// Fill the places of all leaves of the treelet. `order` already holds the references of each, in any order.
pub fn write_leaves(triangles: &Triangles, treelet: &mut Treelet, places: Places) {
    let Places { order, rows } = places;
    let Treelet { branches, leaves, .. } = treelet;
    read(triangles, Leaves { branches, leaves, order, rows });
}

/// The box that holds these rows of triangles.
pub fn box_of_rows(triangles: &Triangles, rows: &[u32]) -> Bounds {
    read(triangles, BoxOf { rows })
}

struct BoxOf<'a> {
    rows: &'a [u32],
}

impl Reading for BoxOf<'_> {
    type Output = Bounds;

    #[inline(always)]
    fn run<S: Source>(self, source: S) -> Bounds {
        let mut all = empty::<S::Scalar>();
        for corners in each_row(source, self.rows) {
            all = union(all, box_of(&corners));
        }
        bounds(all)
    }
}

struct Leaves<'a> {
    branches: &'a mut [Branch],
    leaves: &'a [u32],
    order: &'a mut [u32],
    rows: &'a mut [f32],
}

impl Reading for Leaves<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Source>(self, source: S) {
        // The triangles lie anywhere: ask for all of them before the first one is waited for.
        for &reference in &*self.order {
            source.prefetch_row(reference as usize);
        }
        for &reference in &*self.order {
            source.prefetch_corners(reference as usize);
        }
        for &leaf in self.leaves {
            let leaf = &mut self.branches[leaf as usize];
            let (first, count) = (leaf.first as usize, leaf.count as usize);
            let references = &mut self.order[first..first + count];
            let rows = if self.rows.is_empty() { &mut [] } else { &mut self.rows[9 * first..9 * (first + count)] };
            leaf.bounds = match count {
                1 => write::<S, 1>(source, references, rows),
                2 => write::<S, 2>(source, references, rows),
                3 => write::<S, 3>(source, references, rows),
                4 => write::<S, 4>(source, references, rows),
                5 => write::<S, 5>(source, references, rows),
                6 => write::<S, 6>(source, references, rows),
                7 => write::<S, 7>(source, references, rows),
                8 => write::<S, 8>(source, references, rows),
                _ => {
                    references.sort_unstable();
                    let corners = references.iter().map(|&reference| source.corners(reference as usize));
                    bounds(corners.fold(empty::<S::Scalar>(), |all, corners| union(all, box_of(&corners))))
                }
            }
        }
    }
}

/// Compiled for each count, so that all offsets are known.
#[inline(always)]
fn write<S: Source, const COUNT: usize>(source: S, references: &mut [u32], rows: &mut [f32]) -> Bounds {
    let Some(references) = references.first_chunk_mut::<COUNT>() else { return Bounds::EMPTY };
    sort(references);
    let mut all = empty::<S::Scalar>();
    let rows = rows.as_chunks_mut::<COUNT>().0.first_chunk_mut::<9>();
    match rows {
        Some(rows) => {
            for lane in 0..COUNT {
                let corners = source.corners(references[lane] as usize);
                all = union(all, box_of(&corners));
                for (row, value) in rows.iter_mut().zip(corners.as_flattened()) {
                    row[lane] = value.single();
                }
            }
        }
        None => {
            for reference in references {
                all = union(all, box_of(&source.corners(*reference as usize)));
            }
        }
    }
    bounds(all)
}

/// Each goes to the place of its rank: no branch depends on the numbers, all different.
#[inline(always)]
fn sort<const COUNT: usize>(references: &mut [u32; COUNT]) {
    let unsorted = *references;
    let mut ranks = [0u32; COUNT];
    for other in unsorted {
        for (rank, reference) in ranks.iter_mut().zip(&unsorted) {
            *rank += u32::from(other < *reference);
        }
    }
    for (rank, reference) in ranks.into_iter().zip(unsorted) {
        references[rank as usize] = reference;
    }
}

#[inline(always)]
fn empty<T: Coordinate>() -> [[T; 3]; 2] {
    [[T::INFINITY; 3], [T::NEG_INFINITY; 3]]
}

#[inline(always)]
fn union<T: Coordinate>(all: [[T; 3]; 2], other: [[T; 3]; 2]) -> [[T; 3]; 2] {
    [
        std::array::from_fn(|axis| least(other[0][axis], all[0][axis])),
        std::array::from_fn(|axis| most(other[1][axis], all[1][axis])),
    ]
}

#[inline(always)]
fn bounds<T: Coordinate>([lower, upper]: [[T; 3]; 2]) -> Bounds {
    // Adding +0 makes -0 a +0: which of the two is the smaller one is left open, and the bits of a tree are not.
    Bounds { lower: lower.map(|x| x.below() + 0.0), upper: upper.map(|x| x.above() + 0.0) }
}
