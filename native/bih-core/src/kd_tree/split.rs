//! Where to split: the surface area heuristic (MacDonald and Booth 1990; Wald and Havran 2006).

use super::event::Event;
use crate::geometry::Bounds;

/// What the heuristic assumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// One step down the tree.
    pub traversal: f64,
    /// One test of a triangle.
    pub intersection: f64,
    /// Factor on the cost of a split that cuts off empty space.
    pub empty: f64,
}

impl Default for Costs {
    /// Those of Wald and Havran 2006.
    fn default() -> Self {
        Self { traversal: 15.0, intersection: 20.0, empty: 0.8 }
    }
}

/// A plane that splits a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    pub axis: usize,
    pub plane: f32,
    /// Whether triangles that lie in the plane go to the left.
    pub planar_left: bool,
    /// Triangles on the left and on the right, by their bounds.
    pub counts: [usize; 2],
    /// What the heuristic expects a ray through the cell to cost.
    pub cost: f64,
}

impl Split {
    /// Whether a triangle goes to the left child, and whether to the right one.
    #[inline(always)]
    pub fn sides(&self, bounds: &Bounds) -> [bool; 2] {
        let (lower, upper) = (bounds.lower[self.axis], bounds.upper[self.axis]);
        if lower == self.plane && upper == self.plane {
            [self.planar_left, !self.planar_left]
        } else {
            [lower < self.plane, upper > self.plane]
        }
    }

    /// The two parts of the cell.
    pub fn halves(&self, cell: &Bounds) -> [Bounds; 2] {
        let [mut left, mut right] = [*cell; 2];
        left.upper[self.axis] = self.plane;
        right.lower[self.axis] = self.plane;
        [left, right]
    }
}

/// Extent of a cell along an axis. Bounds rounded outward from doubles may be infinite; what is measured may not.
fn side(lower: f32, upper: f32) -> f64 {
    f64::from(upper.min(f32::MAX)) - f64::from(lower.max(f32::MIN))
}

/// Half the surface of a cell: only ratios count.
pub fn half_area(cell: &Bounds) -> f64 {
    let [x, y, z] = std::array::from_fn(|axis| side(cell.lower[axis], cell.upper[axis]));
    x * y + y * z + z * x
}

/// The cheapest plane across one axis; the first of equal ones. `events` of `count` triangles are in order.
pub fn cheapest_on_axis(events: &[Event], count: usize, cell: &Bounds, axis: usize, costs: &Costs) -> Option<Split> {
    let (lower, upper) = (cell.lower[axis], cell.upper[axis]);
    let [j, k] = [(axis + 1) % 3, (axis + 2) % 3].map(|axis| side(cell.lower[axis], cell.upper[axis]));
    let (cap, rim) = (j * k, j + k);
    let scale = 1.0 / (cap + rim * side(lower, upper));
    if !scale.is_finite() {
        return None;
    }
    let mut best: Option<Split> = None;
    let (mut left, mut right) = (0, count);
    let mut next = 0;
    while let Some(first) = events.get(next) {
        let mut happened = [0; 3];
        while let Some(event) = events.get(next).filter(|event| event.key() == first.key()) {
            happened[event.happening() as usize] += 1;
            next += 1;
        }
        let [end, planar, start] = happened;
        right -= end + planar;
        let plane = first.position();
        if lower < plane && plane < upper.min(f32::MAX) {
            let shares = [(lower, plane), (plane, upper)].map(|(a, b)| (cap + rim * side(a, b)) * scale);
            for planar_left in [true, false] {
                let counts = if planar_left { [left + planar, right] } else { [left, right + planar] };
                let cost = cost(counts, shares, costs);
                if best.is_none_or(|best| cost < best.cost) {
                    best = Some(Split { axis, plane, planar_left, counts, cost });
                }
                if planar == 0 {
                    break;
                }
            }
        }
        left += start + planar;
    }
    best
}

/// What a ray through a cell costs if both halves become leaves.
#[inline(always)]
fn cost(counts: [usize; 2], shares: [f64; 2], costs: &Costs) -> f64 {
    let tests = shares[0] * counts[0] as f64 + shares[1] * counts[1] as f64;
    let factor = if counts[0] == 0 || counts[1] == 0 { costs.empty } else { 1.0 };
    factor * (costs.traversal + costs.intersection * tests)
}

/// The cheapest of the planes of three axes, if it is cheaper than a leaf of `count` triangles.
pub fn cheapest(of_axes: [Option<Split>; 3], count: usize, costs: &Costs) -> Option<Split> {
    let cheaper = |best: Option<Split>, split: Split| match best {
        Some(best) if best.cost <= split.cost => Some(best),
        _ => Some(split),
    };
    of_axes.into_iter().flatten().fold(None, cheaper).filter(|split| split.cost < costs.intersection * count as f64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The cheapest cost by counting anew for each plane.
    fn naive(all: &[Bounds], cell: &Bounds, axis: usize, costs: &Costs) -> Option<f64> {
        let mut best: Option<f64> = None;
        for plane in all.iter().flat_map(|bounds| [bounds.lower[axis], bounds.upper[axis]]) {
            if cell.lower[axis] < plane && plane < cell.upper[axis] {
                for planar_left in [true, false] {
                    let split = Split { axis, plane, planar_left, counts: [0; 2], cost: 0.0 };
                    let counts = [0, 1].map(|side| all.iter().filter(|b| split.sides(b)[side]).count());
                    let shares = split.halves(cell).map(|half| half_area(&half) / half_area(cell));
                    let cost = cost(counts, shares, costs);
                    best = Some(best.map_or(cost, |best: f64| best.min(cost)));
                }
            }
        }
        best
    }

    proptest! {
        #[test]
        fn the_sweep_finds_the_cheapest_plane(
            corners in proptest::collection::vec((proptest::collection::vec(-4i32..=4, 3), proptest::collection::vec(0i32..3, 3)), 1..40),
        ) {
            let all: Vec<Bounds> = corners.iter().map(|(lower, size)| Bounds {
                lower: std::array::from_fn(|i| lower[i] as f32),
                upper: std::array::from_fn(|i| (lower[i] + size[i]) as f32),
            }).collect();
            let cell = all.iter().fold(Bounds::EMPTY, |cell, bounds| cell.union(bounds));
            let costs = Costs::default();
            for axis in 0..3 {
                let mut events = Vec::new();
                all.iter().enumerate().for_each(|(number, bounds)| Event::push(&mut events, bounds, axis, number));
                events.sort_unstable();
                let found = cheapest_on_axis(&events, all.len(), &cell, axis, &costs);
                if half_area(&cell) == 0.0 {
                    prop_assert_eq!(found, None);
                    continue;
                }
                let truth = naive(&all, &cell, axis, &costs);
                prop_assert_eq!(found.is_some(), truth.is_some());
                if let (Some(found), Some(truth)) = (found, truth) {
                    prop_assert!((found.cost - truth).abs() <= 1e-12 * truth, "{found:?} {truth}");
                    let counts = [0, 1].map(|side| all.iter().filter(|b| found.sides(b)[side]).count());
                    prop_assert_eq!(found.counts, counts);
                }
            }
        }
    }
}
