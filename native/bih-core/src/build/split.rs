//! The split rule of the global heuristic: halve the longest side of the cell, wherever the objects are.
//!
//! Wächter and Keller 2006, section 3.2; the slides' "divide longest side in the middle".

use super::reference::Reference;
use crate::geometry::Bounds;

/// The part of space that halving has reached. It starts as the bounds of the scene and knows nothing of the objects.
#[derive(Debug, Clone, Copy)]
pub struct Cell {
    lower: [f64; 3],
    upper: [f64; 3],
}

/// Where a cell is cut: `axis`, and twice the coordinate of the candidate plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    pub axis: usize,
    pub doubled_plane: f64,
}

impl Cut {
    /// Whether the centre of an object lies below the plane; on it counts as above.
    #[inline(always)]
    pub fn is_left(&self, reference: &Reference) -> bool {
        reference.doubled_centre(self.axis) < self.doubled_plane
    }
}

impl Cell {
    pub fn new(bounds: &Bounds) -> Self {
        // Bounds rounded outward from doubles may be infinite; a cell that is halved may not.
        let finite = |x: f32| f64::from(x.clamp(f32::MIN, f32::MAX));
        Self { lower: bounds.lower.map(finite), upper: bounds.upper.map(finite) }
    }

    /// The next cut: the middle of the longest side, the lower axis where sides are equal. None where no side can be
    /// halved in double precision any more.
    pub fn cut(&self) -> Option<Cut> {
        let mut best: Option<(f64, Cut)> = None;
        for axis in 0..3 {
            let side = self.upper[axis] - self.lower[axis];
            let doubled_plane = self.lower[axis] + self.upper[axis];
            let plane = 0.5 * doubled_plane;
            let halves = self.lower[axis] < plane && plane < self.upper[axis];
            if halves && best.is_none_or(|(longest, _)| side > longest) {
                best = Some((side, Cut { axis, doubled_plane }));
            }
        }
        best.map(|(_, cut)| cut)
    }

    /// The two halves.
    pub fn halves(&self, cut: &Cut) -> [Self; 2] {
        let plane = 0.5 * cut.doubled_plane;
        let [mut left, mut right] = [*self; 2];
        left.upper[cut.axis] = plane;
        right.lower[cut.axis] = plane;
        [left, right]
    }

    /// The first cut that has objects on both sides, and the cell it cuts: halves without objects cost arithmetic
    /// only, no pass over the objects. The count says how many such halvings there were. None where no cut separates
    /// the objects: all centres coincide.
    pub fn first_separating_cut(&self, references: &[Reference]) -> Option<(Self, Cut, usize)> {
        let mut least = [f64::INFINITY; 3];
        let mut most = [f64::NEG_INFINITY; 3];
        for reference in references {
            for axis in 0..3 {
                let centre = reference.doubled_centre(axis);
                least[axis] = least[axis].min(centre);
                most[axis] = most[axis].max(centre);
            }
        }
        if (0..3).all(|axis| least[axis] >= most[axis]) {
            return None;
        }
        let mut cell = *self;
        let mut empty = 0;
        while let Some(cut) = cell.cut() {
            let [left, right] = cell.halves(&cut);
            if most[cut.axis] < cut.doubled_plane {
                cell = left;
            } else if cut.doubled_plane <= least[cut.axis] {
                cell = right;
            } else {
                return Some((cell, cut, empty));
            }
            empty += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slides_box_is_cut_at_nine_then_five_then_five() {
        let mut cell = Cell::new(&Bounds { lower: [0.0; 3], upper: [18.0, 10.0, 10.0] });
        let mut cuts = Vec::new();
        for _ in 0..4 {
            let cut = cell.cut().unwrap();
            cuts.push((cut.axis, 0.5 * cut.doubled_plane));
            cell = cell.halves(&cut)[0];
        }
        assert_eq!(cuts, [(0, 9.0), (1, 5.0), (2, 5.0), (0, 4.5)]);
    }

    #[test]
    fn a_cell_without_extent_has_no_cut() {
        assert_eq!(Cell::new(&Bounds { lower: [1.0; 3], upper: [1.0; 3] }).cut(), None);
    }

    #[test]
    fn halving_ends_in_any_cell_of_float32() {
        let bounds = Bounds { lower: [f32::MIN; 3], upper: [f32::MAX; 3] };
        let mut cell = Cell::new(&bounds);
        let mut steps = 0;
        while let Some(cut) = cell.cut() {
            // Towards zero the grid of doubles is finest.
            cell = cell.halves(&cut)[if steps < 3 { 1 } else { 0 }];
            steps += 1;
        }
        assert!(steps < 3 * 2200, "{steps}");
    }
}
