//! What the surface area heuristic expects of the whole tree.

use super::split::half_area;
use super::{Costs, KdTree};
use crate::geometry::Bounds;
use crate::tree::Kind;

/// Expected work of a ray through the bounds that nothing stops (Wald and Havran 2006).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExpectedCost {
    /// Inner nodes.
    pub traversals: f64,
    /// Leaves, empty ones too.
    pub leaves: f64,
    /// Triangles tested.
    pub intersections: f64,
}

impl ExpectedCost {
    /// In the unit of `costs`.
    pub fn total(&self, costs: &Costs) -> f64 {
        costs.traversal * self.traversals + costs.intersection * self.intersections
    }
}

impl KdTree {
    /// Each node counts by its cell's surface as a share of the root's.
    pub fn expected_cost(&self) -> ExpectedCost {
        let mut cost = ExpectedCost::default();
        let scale = 1.0 / half_area(&self.bounds);
        self.visit_cells(|cell, kind| {
            let share = half_area(cell) * scale;
            match kind {
                Kind::Inner { .. } => cost.traversals += share,
                Kind::Leaf { count, .. } => {
                    cost.leaves += share;
                    cost.intersections += share * count as f64;
                }
            }
        });
        cost
    }

    /// Every node with its cell, depth first.
    pub(super) fn visit_cells(&self, mut visit: impl FnMut(&Bounds, Kind)) {
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push((0, self.bounds));
        }
        while let Some((node, cell)) = waiting.pop() {
            let kind = self.nodes.get(node).kind();
            visit(&cell, kind);
            if let Kind::Inner { axis, left, clip } = kind {
                let [mut below, mut above] = [cell; 2];
                below.upper[axis] = clip[0];
                above.lower[axis] = clip[1];
                waiting.extend([(left + 1, above), (left, below)]);
            }
        }
    }
}
