//! Every rule that a tree keeps, checked one by one, in time in proportion to its size.

use rayon::prelude::*;

use super::{Child, Kind, MAX_DEPTH, Record, Records, Target, Tree, WIDTH, Wide};
use crate::build::Extent;
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Bounds, Corners, Triangles};
use crate::memory;
use crate::simd::Scalar;

/// Check the whole tree against the triangles it was built over; the error names the first broken node.
///
/// Every node is reached once, every reference belongs to one leaf, the order is a permutation of the rows, those that no
/// ray can hit the last, and each leaf's triangles lie within the clip planes on the way to it. A tree that passes can be
/// asked anything, wherever it comes from: no walk leaves its arrays, goes round in circles or deeper than is said.
pub fn validate(tree: &Tree, triangles: &Triangles) -> Result<(), Error> {
    memory::room("the checks", triangles.len() * (2 * size_of::<u32>() + size_of::<bool>()))?;
    let order = tree.order();
    check_rejected(tree, triangles, &order)?;
    if let Some(kd_tree) = &tree.kd_tree {
        return kd_tree.validate(triangles);
    }
    let mut seen = vec![false; triangles.len()];
    if order.len() != triangles.len() {
        return broken(0, format!("{} references for {} triangles", order.len(), triangles.len()));
    }
    for row in order {
        match seen.get_mut(row as usize) {
            None => return broken(0, format!("reference to triangle {row} of {}", triangles.len())),
            Some(true) => return broken(0, format!("triangle {row} is referred to twice")),
            Some(seen) => *seen = true,
        }
    }
    // Pieces may be built meanwhile: then there is nothing that the number of nodes could be compared with.
    let before = tree.used();
    let reached = if let Some(wide) = &tree.wide {
        validate_records(tree, wide, triangles)?
    } else {
        validate_nodes(tree, triangles)?
    };
    if tree.used() == before && reached.nodes != before {
        return broken(0, format!("{} of {before} nodes can be reached", reached.nodes));
    }
    let stats = &tree.stats;
    if tree.on_demand.is_none() && (reached.leaves, reached.depth) != (stats.leaves, stats.depth) {
        let Reached { leaves, depth, .. } = reached;
        return broken(0, format!("{} leaves and depth {}, but {leaves} and {depth}", stats.leaves, stats.depth));
    }
    Ok(())
}

fn broken<T>(node: usize, problem: String) -> Result<T, Error> {
    Err(Error::Broken { node, problem })
}

/// The rows that no ray can hit, and the bounds of the others, as the mesh has them.
fn check_rejected(tree: &Tree, triangles: &Triangles, order: &[u32]) -> Result<(), Error> {
    let extent = Extent::of(triangles, &Control::default())?;
    let start = order.len().checked_sub(tree.stats.rejected);
    if start.is_none_or(|start| order[start..] != extent.rejected) {
        return broken(0, "the rejected rows are not those that no ray can hit".to_owned());
    }
    if tree.bounds != extent.bounds() {
        return broken(0, format!("bounds {:?} of triangles within {:?}", tree.bounds, extent.bounds()));
    }
    Ok(())
}

/// What stands in the place of a piece.
enum Place {
    Root(u32),
    /// No root yet: first reference, and the rows.
    Unbuilt(usize, Vec<u32>),
}

fn look(tree: &Tree, piece: usize, node: usize) -> Result<Place, Error> {
    let broken = || Error::Broken { node, problem: format!("piece {piece}") };
    let on_demand = tree.on_demand.as_ref().filter(|on_demand| piece < on_demand.pieces()).ok_or_else(broken)?;
    Ok(on_demand.look(piece, |place, root| match root {
        Some(root) => Place::Root(root),
        None => Place::Unbuilt(place.start, tree.order.slice(place).to_vec()),
    }))
}

/// What was found on the way through a tree.
#[derive(Default)]
struct Reached {
    nodes: usize,
    leaves: usize,
    /// Of the deepest leaf.
    depth: usize,
}

impl Reached {
    fn leaf(&mut self, depth: usize) {
        self.leaves += 1;
        self.depth = self.depth.max(depth);
    }
}

/// A range of references, and where their triangles lie.
struct Leaf {
    node: usize,
    first: usize,
    count: usize,
    bounds: Bounds,
}

/// Leaves whose triangles are still to be looked at, which all threads do together.
struct Leaves<'a> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    waiting: Vec<Leaf>,
}

impl<'a> Leaves<'a> {
    fn new(tree: &'a Tree, triangles: &'a Triangles<'a>) -> Self {
        Self { tree, triangles, waiting: Vec::new() }
    }

    fn add(&mut self, leaf: Leaf) -> Result<(), Error> {
        const TOGETHER: usize = 1 << 14;
        self.waiting.push(leaf);
        if self.waiting.len() < TOGETHER { Ok(()) } else { self.check() }
    }

    fn check(&mut self) -> Result<(), Error> {
        let problem = |leaf: &Leaf| self.problem(leaf).map(|problem| Error::Broken { node: leaf.node, problem });
        match self.waiting.par_iter().with_min_len(256).find_map_first(problem) {
            Some(error) => Err(error),
            None => {
                self.waiting.clear();
                Ok(())
            }
        }
    }

    fn problem(&self, leaf: &Leaf) -> Option<String> {
        let &Leaf { first, count, ref bounds, .. } = leaf;
        self.tree.order.slice(first..first + count).iter().enumerate().find_map(|(place, &row)| {
            let corners = self.triangles.corners(row);
            let holds = self.tree.wide.as_ref().is_none_or(|wide| holds_vertices(wide, leaf, place, &corners));
            if !holds {
                return Some(format!("vertices of triangle {row} differ"));
            }
            reaches_out(bounds, row, &corners)
        })
    }
}

fn reaches_out(bounds: &Bounds, row: u32, corners: &Corners) -> Option<String> {
    (!bounds.contains(&Bounds::of_triangle(corners))).then(|| format!("triangle {row} reaches out of its bounds"))
}

fn holds_vertices(wide: &Wide, leaf: &Leaf, place: usize, corners: &Corners) -> bool {
    let &Leaf { first, count, .. } = leaf;
    wide.leaf_rows(first, count).is_none_or(|rows| {
        rows.corners(place).as_flattened().iter().zip(corners.as_flattened()).all(|(&row, &x)| row as f32 == x as f32)
    })
}

/// Of nodes with two children.
fn validate_nodes(tree: &Tree, triangles: &Triangles) -> Result<Reached, Error> {
    let references = tree.order.len() - tree.stats.rejected;
    let mut reached = Reached::default();
    if tree.nodes.is_empty() {
        return if references == 0 { Ok(reached) } else { broken(0, format!("{references} references and no node")) };
    }
    let mut leaves = Leaves::new(tree, triangles);
    let mut covered = 0;
    let mut stack = vec![(0, 0, tree.bounds)];
    while let Some((index, depth, bounds)) = stack.pop() {
        reached.nodes += 1;
        if depth > MAX_DEPTH {
            return broken(index, format!("deeper than {MAX_DEPTH}"));
        }
        let node = tree.nodes.get(index);
        let (first, count, unbuilt) = match node.piece_number().map(|piece| look(tree, piece, index)).transpose()? {
            Some(Place::Root(root)) if root as usize <= index => return broken(index, format!("root {root}")),
            Some(Place::Root(root)) => {
                stack.push((root as usize, depth, bounds));
                continue;
            }
            Some(Place::Unbuilt(first, rows)) => (first, rows.len(), Some(rows)),
            None => match node.kind() {
                Kind::Inner { axis, left, clip } => {
                    // Children stand behind their parent, so that a walk downwards ends.
                    if left <= index || left + 1 >= tree.nodes.len() {
                        return broken(index, format!("children {left} and {}", left + 1));
                    }
                    let [mut lower_part, mut upper_part] = [bounds; 2];
                    lower_part.upper[axis] = clip[0];
                    upper_part.lower[axis] = clip[1];
                    stack.push((left + 1, depth + 1, upper_part));
                    stack.push((left, depth + 1, lower_part));
                    continue;
                }
                Kind::Leaf { first, count } => (first, count, None),
            },
        };
        // Depth first meets the leaves in the order of their references, each of which has one at least.
        if first != covered || count == 0 || count > references - covered {
            return broken(index, format!("{count} references from {first} after {covered} of {references}"));
        }
        covered += count;
        match unbuilt {
            None => {
                reached.leaf(depth as usize);
                leaves.add(Leaf { node: index, first, count, bounds })?;
            }
            Some(rows) => check_unbuilt(index, &bounds, &rows, triangles)?,
        }
    }
    leaves.check()?;
    if covered != references {
        return broken(0, format!("{covered} of {references} references stand in a leaf"));
    }
    Ok(reached)
}

fn check_unbuilt(node: usize, bounds: &Bounds, rows: &[u32], triangles: &Triangles) -> Result<(), Error> {
    let problem = |&row: &u32| reaches_out(bounds, row, &triangles.corners(row));
    rows.iter().find_map(problem).map_or(Ok(()), |problem| broken(node, problem))
}

/// The same of records: each leaf's triangles lie within the box of its lane and of every lane above it, and the rows
/// hold their vertices.
fn validate_records(tree: &Tree, wide: &Wide, triangles: &Triangles) -> Result<Reached, Error> {
    let mut seen = vec![false; tree.order.len() - tree.stats.rejected];
    let mut reached = Reached::default();
    let mut leaves = Leaves::new(tree, triangles);
    let everything = Bounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
    let mut space = Record::EMPTY;
    let mut stack = Vec::new();
    if !seen.is_empty() {
        stack.push((0, 1, everything));
    }
    while let Some((index, depth, outer)) = stack.pop() {
        reached.nodes += 1;
        if index >= wide.records.len() || reached.nodes > wide.records.len() {
            return broken(index, format!("{} records", wide.records.len()));
        }
        if depth > MAX_DEPTH as usize + 1 {
            return broken(index, format!("deeper than {MAX_DEPTH}"));
        }
        if let Records::Full(records) = &wide.records
            && !records.get(index).orders_are_whole()
        {
            return broken(index, "a lane is not met once in an order".to_owned());
        }
        let record = wide.records.get::<Scalar>(index, &mut space);
        for lane in (0..WIDTH).filter(|&lane| record.bounds(lane) != Bounds::EMPTY) {
            let bounds = record.bounds(lane);
            // Of quantised boxes each is rounded outward by itself.
            if wide.records.are_ordered() && !outer.contains(&bounds) {
                return broken(index, format!("lane {lane} reaches out of its record"));
            }
            let bounds = bounds.intersection(&outer);
            let mut target = record.child(lane).target();
            let mut unbuilt = None;
            if let Target::Piece(piece) = target {
                match look(tree, piece, index)? {
                    Place::Root(root) => target = Child::from_word(root).target(),
                    Place::Unbuilt(first, rows) => unbuilt = Some((first, rows)),
                }
            }
            let (first, count) = match (target, &unbuilt) {
                // Children stand behind their parent, so that a walk downwards ends.
                (Target::Record(child), _) if child <= index => return broken(index, format!("child {child}")),
                (Target::Record(child), _) => {
                    stack.push((child, depth + 1, bounds));
                    continue;
                }
                (Target::Leaf { first, count }, _) => (first, count),
                (Target::Piece(_), Some((first, rows))) => (*first, rows.len()),
                (Target::Piece(piece), None) => return broken(index, format!("piece {piece} within a piece")),
            };
            if first > seen.len() || count > seen.len() - first {
                return broken(index, format!("{count} references from {first} in lane {lane}"));
            }
            if let Some(place) = seen[first..first + count].iter().position(|&seen| seen) {
                return broken(index, format!("reference {} in lane {lane} is in another leaf", first + place));
            }
            seen[first..first + count].fill(true);
            match unbuilt {
                None => {
                    reached.leaf(depth);
                    leaves.add(Leaf { node: index, first, count, bounds })?;
                }
                Some((_, rows)) => check_unbuilt(index, &bounds, &rows, triangles)?,
            }
        }
    }
    leaves.check()?;
    let covered = seen.iter().filter(|&&seen| seen).count();
    let references = triangles.len() - tree.stats.rejected;
    if covered != references {
        return broken(0, format!("{covered} of {references} references stand in a leaf"));
    }
    Ok(reached)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{BuildOptions, build};
    use crate::control::Control;
    use crate::geometry::Vertices;
    use crate::tree::{Node, Shared};

    fn strip() -> Vec<[f32; 3]> {
        (0..8).flat_map(|i| [[i as f32, 0.0, 0.0], [i as f32 + 1.0, 0.0, 0.0], [i as f32, 1.0, 0.0]]).collect()
    }

    #[test]
    fn each_kind_of_damage_is_found() {
        let vertices = strip();
        let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
        let good = || {
            build(&triangles, &BuildOptions { leaf_size: Some(1), ..Default::default() }, &Control::default()).unwrap()
        };
        assert_eq!(validate(&good(), &triangles), Ok(()));
        fn spoil<T: bytemuck::Pod>(values: &mut Shared<T>, spoil: impl FnOnce(&mut Vec<T>)) {
            let mut spoilt = values.all().unwrap().to_vec();
            spoil(&mut spoilt);
            *values = Shared::whole(spoilt);
        }

        let damage: [fn(&mut Tree); 7] = [
            |tree| spoil(&mut tree.order, |order| order[1] = order[0]),
            |tree| spoil(&mut tree.order, |order| order[0] = 99),
            |tree| spoil(&mut tree.order, |order| _ = order.pop()),
            |tree| spoil(&mut tree.nodes, |nodes| nodes[0] = Node::inner(0, 0, [4.0, 4.0])),
            |tree| spoil(&mut tree.nodes, |nodes| nodes[0] = Node::inner(0, 1 << 20, [4.0, 4.0])),
            |tree| spoil(&mut tree.nodes, |nodes| nodes[0] = Node::inner(0, 1, [3.0, 4.0])),
            |tree| spoil(&mut tree.nodes, |nodes| nodes[0] = Node::leaf(0, 8)),
        ];
        for (case, damage) in damage.iter().enumerate() {
            let mut tree = good();
            damage(&mut tree);
            assert!(validate(&tree, &triangles).is_err(), "damage {case} was not found");
        }
    }
}
