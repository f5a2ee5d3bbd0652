//! What is split: the triangles of a node, and their events in order on each axis.

use rayon::prelude::*;

use super::clip::clip;
use super::event::Event;
use super::split::Split;
use crate::geometry::{Bounds, Triangles};

/// A triangle in a cell: its row, and bounds of the part of it that lies in the cell.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    pub bounds: Bounds,
    pub row: u32,
}

/// Triangles of one node or, one behind the other, of several. Events number the triangles from the first of their node.
#[derive(Debug, Default)]
pub struct Lists {
    pub references: Vec<Reference>,
    pub events: [Vec<Event>; 3],
}

/// Where the lists of a node begin.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mark {
    references: usize,
    events: [usize; 3],
}

/// Not among a child's triangles.
const NONE: u32 = u32::MAX;

/// Numbers of a node's triangles in its children, and what is new in them.
#[derive(Debug, Default)]
pub struct Sorting {
    /// For each triangle whose events stay as they are its number in the child that it goes to.
    numbers: Vec<[u32; 2]>,
    /// For each axis and child the events of triangles that the split has cut.
    cut: [[Vec<Event>; 2]; 3],
}

impl Lists {
    /// Lists of all triangles, their events put in order on all threads.
    pub fn new(references: Vec<Reference>) -> Self {
        let events = [0, 1, 2].map(|axis| {
            let mut events = Vec::with_capacity(2 * references.len());
            references.iter().enumerate().for_each(|(n, r)| Event::push(&mut events, &r.bounds, axis, n));
            events.par_sort_unstable();
            events
        });
        Self { references, events }
    }

    /// Where the next node's lists will begin.
    pub fn end(&self) -> Mark {
        Mark { references: self.references.len(), events: [0, 1, 2].map(|axis| self.events[axis].len()) }
    }

    /// Forget the nodes from here on.
    pub fn truncate(&mut self, mark: Mark) {
        self.references.truncate(mark.references);
        (0..3).for_each(|axis| self.events[axis].truncate(mark.events[axis]));
    }

    /// Append the one node of `other`.
    pub fn append(&mut self, other: &Self) {
        self.references.extend_from_slice(&other.references);
        (0..3).for_each(|axis| self.events[axis].extend_from_slice(&other.events[axis]));
    }

    /// Triangles of the last node.
    pub fn references_from(&self, mark: Mark) -> &[Reference] {
        &self.references[mark.references..]
    }

    /// Events of the last node.
    pub fn events_from(&self, mark: Mark, axis: usize) -> &[Event] {
        &self.events[axis][mark.events[axis]..]
    }

    pub fn bytes(&self) -> usize {
        self.references.capacity() * size_of::<Reference>()
            + self.events.iter().map(|events| events.capacity() * size_of::<Event>()).sum::<usize>()
    }

    /// Sort the triangles of the last node into its two `children`, which are empty. Triangles on both sides are
    /// clipped to them; order and events of the others stay, so this takes linear time.
    pub fn split(
        &self,
        mark: Mark,
        split: &Split,
        cells: &[Bounds; 2],
        triangles: &Triangles,
        sorting: &mut Sorting,
        children: &mut [Self; 2],
    ) {
        sorting.sort(self.references_from(mark), split, cells, triangles, children);
        for (axis, cut) in sorting.cut.iter_mut().enumerate() {
            cut.iter_mut().for_each(|cut| cut.sort_unstable());
            let [left, right] = &mut *children;
            distribute(
                self.events_from(mark, axis),
                &sorting.numbers,
                cut,
                [&mut left.events[axis], &mut right.events[axis]],
            );
        }
    }
}

impl Sorting {
    fn sort(
        &mut self,
        references: &[Reference],
        split: &Split,
        cells: &[Bounds; 2],
        triangles: &Triangles,
        children: &mut [Lists; 2],
    ) {
        self.cut.as_flattened_mut().iter_mut().for_each(Vec::clear);
        self.numbers.clear();
        for reference in references {
            match split.sides(&reference.bounds) {
                [true, true] => {
                    self.numbers.push([NONE; 2]);
                    self.cut(reference, cells, triangles, children);
                }
                sides => {
                    let side = usize::from(sides[1]);
                    let mut numbers = [NONE; 2];
                    numbers[side] = children[side].references.len() as u32;
                    self.numbers.push(numbers);
                    children[side].references.push(*reference);
                }
            }
        }
    }

    fn cut(&mut self, reference: &Reference, cells: &[Bounds; 2], triangles: &Triangles, children: &mut [Lists; 2]) {
        let corners = triangles.corners(reference.row);
        for side in 0..2 {
            if let Some(bounds) = clip(&corners, &reference.bounds, &cells[side]) {
                let number = children[side].references.len();
                children[side].references.push(Reference { bounds, row: reference.row });
                for (axis, events) in self.cut.iter_mut().enumerate() {
                    Event::push(&mut events[side], &bounds, axis, number);
                }
            }
        }
    }
}

/// Append to each child those of `events` whose triangle has a number there, renumbered, and what was `cut`, in order.
fn distribute(events: &[Event], numbers: &[[u32; 2]], cut: &[Vec<Event>; 2], mut children: [&mut Vec<Event>; 2]) {
    let mut cut = [0, 1].map(|side: usize| cut[side].iter().copied().peekable());
    for event in events {
        let numbers = numbers[event.number()];
        let side = usize::from(numbers[0] == NONE);
        if numbers[side] != NONE {
            // Numbers of a child rise with those of its parent, so the order stays.
            let event = event.renumbered(numbers[side]);
            while let Some(earlier) = cut[side].next_if(|cut| *cut < event) {
                children[side].push(earlier);
            }
            children[side].push(event);
        }
    }
    for (child, cut) in children.iter_mut().zip(cut) {
        child.extend(cut);
    }
}

#[cfg(test)]
mod tests {
    use std::array::from_fn;

    use proptest::prelude::*;

    use super::super::split::{Costs, cheapest_on_axis};
    use super::*;
    use crate::geometry::Vertices;

    proptest! {
        /// What a split makes of sorted events is what sorting the child's triangles anew would make.
        #[test]
        fn events_stay_complete_and_in_order(
            points in proptest::collection::vec(proptest::collection::vec(-4i32..=4, 3), 3..120),
            axis in 0usize..3,
        ) {
            let points: Vec<[f32; 3]> = points[..points.len() / 3 * 3].iter().map(|p| from_fn(|i| p[i] as f32)).collect();
            let triangles = Triangles::new(Vertices::F32(&points), None).unwrap();
            let references: Vec<Reference> = (0..triangles.len() as u32)
                .map(|row| Reference { bounds: Bounds::of_triangle(&triangles.corners(row)), row })
                .collect();
            let cell = references.iter().fold(Bounds::EMPTY, |cell, reference| cell.union(&reference.bounds));
            let lists = Lists::new(references);
            let mark = Mark::default();
            let found = cheapest_on_axis(lists.events_from(mark, axis), lists.references.len(), &cell, axis, &Costs::default());
            let Some(split) = found else { return Ok(()) };
            let mut children = [Lists::default(), Lists::default()];
            let halves = split.halves(&cell);
            lists.split(mark, &split, &halves, &triangles, &mut Sorting::default(), &mut children);
            for (child, half) in children.into_iter().zip(halves) {
                prop_assert!(child.references.iter().all(|reference| half.contains(&reference.bounds)));
                prop_assert!(child.references.is_sorted_by(|a, b| a.row < b.row));
                let Lists { references, events } = child;
                prop_assert_eq!(events, Lists::new(references).events);
            }
        }
    }
}
