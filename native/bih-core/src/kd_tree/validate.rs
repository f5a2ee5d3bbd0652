//! Every rule that a kd-tree keeps, checked one by one.

use super::{KdTree, MAX_DEPTH};
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::tree::Kind;

impl KdTree {
    /// Check the whole tree against the triangles it was built over; the error names the first broken node.
    ///
    /// Every node is reached once and splits its cell inside, every reference belongs to one leaf and its triangle's
    /// bounds meet the leaf's cell, every row is referred to or rejected, and no bound is exceeded.
    pub fn validate(&self, triangles: &Triangles) -> Result<(), Error> {
        let broken = |node: usize, problem: String| Err(Error::Broken { node, problem });
        let mut seen = vec![false; triangles.len()];
        for &row in self.order() {
            match seen.get_mut(row as usize) {
                None => return broken(0, format!("reference to triangle {row} of {}", triangles.len())),
                Some(seen) => *seen = true,
            }
        }
        for &row in self.rejected() {
            seen[row as usize] = false;
        }
        if let Some(row) = self.references().iter().find(|&&row| !seen[row as usize]) {
            return broken(0, format!("triangle {row} is referred to and rejected"));
        }
        for &row in self.rejected() {
            seen[row as usize] = true;
        }
        if let Some(row) = seen.iter().position(|seen| !seen) {
            return broken(0, format!("triangle {row} is not referred to"));
        }
        if self.stats.tree_bytes > self.stats.bound_bytes {
            return broken(0, format!("{} bytes exceed {}", self.stats.tree_bytes, self.stats.bound_bytes));
        }
        let references = self.references();
        let (mut reached, mut covered, mut leaves, mut deepest) = (0, 0, 0, 0);
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push((0, 0, self.bounds));
        }
        while let Some((node, depth, cell)) = waiting.pop() {
            reached += 1;
            if reached > self.nodes.len() {
                return broken(node, format!("{} nodes", self.nodes.len()));
            }
            if depth > MAX_DEPTH {
                return broken(node, format!("deeper than {MAX_DEPTH}"));
            }
            match self.nodes.get(node).kind() {
                Kind::Inner { axis, left, clip: [plane, _] } => {
                    // Children stand behind their parent, so that a walk downwards ends.
                    if left <= node || left + 1 >= self.nodes.len() {
                        return broken(node, format!("children {left} and {}", left + 1));
                    }
                    if !(cell.lower[axis] < plane && plane < cell.upper[axis]) {
                        return broken(node, format!("plane {plane} is not inside the cell"));
                    }
                    let [mut below, mut above] = [cell; 2];
                    below.upper[axis] = plane;
                    above.lower[axis] = plane;
                    waiting.extend([(left + 1, depth + 1, above), (left, depth + 1, below)]);
                }
                Kind::Leaf { first, count } => {
                    if first != covered || count > references.len() - first {
                        return broken(node, format!("references {first} to {} after {covered}", first + count));
                    }
                    covered += count;
                    leaves += 1;
                    deepest = deepest.max(depth);
                    let rows = &references[first..covered];
                    if !rows.is_sorted_by(|a, b| a < b) {
                        return broken(node, "rows out of order".to_owned());
                    }
                    for &row in rows {
                        let bounds = Bounds::of_triangle(&triangles.corners(row));
                        let meets = |axis: usize| {
                            bounds.lower[axis] <= cell.upper[axis] && cell.lower[axis] <= bounds.upper[axis]
                        };
                        if !(0..3).all(meets) {
                            return broken(node, format!("triangle {row} lies beside its cell"));
                        }
                    }
                }
            }
        }
        if reached != self.nodes.len() || covered != references.len() {
            return broken(0, format!("{reached} of {} nodes, {covered} references", self.nodes.len()));
        }
        if (leaves, deepest as usize) != (self.stats.leaves, self.stats.depth) {
            return broken(0, format!("{} leaves and depth {}", self.stats.leaves, self.stats.depth));
        }
        Ok(())
    }
}
