//! Every rule that a tree keeps, checked one by one.

use super::{Child, Kind, MAX_DEPTH, Record, Target, Tree, WIDTH, Wide};
use crate::error::Error;
use crate::geometry::{Bounds, Corners, Triangles};
use crate::simd::Scalar;

/// Check the whole tree against the triangles it was built over; the error names the first broken node.
///
/// Every node is reached once, every reference belongs to one leaf, the order is a permutation of the rows, and each
/// leaf's triangles lie within the clip planes on the way to it.
pub fn validate(tree: &Tree, triangles: &Triangles) -> Result<(), Error> {
    if let Some(kd_tree) = &tree.kd_tree {
        return kd_tree.validate(triangles);
    }
    let broken = |node: usize, problem: String| Err(Error::Broken { node, problem });
    let mut seen = vec![false; triangles.len()];
    let order = tree.order();
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
    if tree.used() == before && reached != before {
        return broken(0, format!("{reached} of {before} nodes can be reached"));
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

/// Answers how many nodes were reached.
fn validate_nodes(tree: &Tree, triangles: &Triangles) -> Result<usize, Error> {
    let broken = |node: usize, problem: String| Err(Error::Broken { node, problem });
    let references = tree.order.len() - tree.stats.rejected;
    if tree.nodes.is_empty() {
        return if references == 0 { Ok(0) } else { broken(0, format!("{references} references and no node")) };
    }
    let mut reached = 0;
    let mut covered = 0;
    let mut stack = vec![(0, 0, tree.bounds)];
    while let Some((index, depth, bounds)) = stack.pop() {
        reached += 1;
        if depth > MAX_DEPTH {
            return broken(index, format!("deeper than {MAX_DEPTH}"));
        }
        let node = tree.nodes.get(index);
        let (first, rows) = match node.piece_number().map(|piece| look(tree, piece, index)).transpose()? {
            Some(Place::Root(root)) if root as usize <= index => return broken(index, format!("root {root}")),
            Some(Place::Root(root)) => {
                stack.push((root as usize, depth, bounds));
                continue;
            }
            Some(Place::Unbuilt(first, rows)) => (first, rows),
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
                Kind::Leaf { first, count } if first.checked_add(count).is_some_and(|end| end <= references) => {
                    (first, tree.order.slice(first..first + count).to_vec())
                }
                Kind::Leaf { first, count } => return broken(index, format!("{count} references from {first}")),
            },
        };
        // Depth first meets the leaves in the order of their references.
        if first != covered || rows.is_empty() {
            return broken(index, format!("references {first} to {} after {covered}", first + rows.len()));
        }
        covered += rows.len();
        for row in rows {
            if !bounds.contains(&Bounds::of_triangle(&triangles.corners(row))) {
                return broken(index, format!("triangle {row} reaches out of its clip planes"));
            }
        }
    }
    if covered != references {
        return broken(0, format!("{covered} of {references} references stand in a leaf"));
    }
    Ok(reached)
}

/// The same of records: each leaf's triangles lie within the box of its lane and of every lane above it, and the rows
/// hold their vertices.
fn validate_records(tree: &Tree, wide: &Wide, triangles: &Triangles) -> Result<usize, Error> {
    let broken = |node: usize, problem: String| Err(Error::Broken { node, problem });
    let mut seen = vec![false; tree.order.len() - tree.stats.rejected];
    let mut reached = 0;
    let everything = Bounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
    let mut space = Record::EMPTY;
    let mut stack = Vec::new();
    if !seen.is_empty() {
        stack.push((0, everything));
    }
    while let Some((index, outer)) = stack.pop() {
        reached += 1;
        if index >= wide.records.len() {
            return broken(index, format!("{} records", wide.records.len()));
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
            let (first, rows) = match (target, unbuilt) {
                (Target::Record(child), _) if child <= index => return broken(index, format!("child {child}")),
                (Target::Record(child), _) => {
                    stack.push((child, bounds));
                    continue;
                }
                (Target::Leaf { first, count }, _) => {
                    if first + count > seen.len() {
                        return broken(index, format!("{count} references from {first} in lane {lane}"));
                    }
                    let rows = tree.order.slice(first..first + count).to_vec();
                    for (place, &row) in rows.iter().enumerate() {
                        if !holds_vertices(wide, Leaf { first, count }, place, &triangles.corners(row)) {
                            return broken(index, format!("vertices of triangle {row} differ"));
                        }
                    }
                    (first, rows)
                }
                (Target::Piece(_), Some(rows)) => rows,
                (Target::Piece(piece), None) => return broken(index, format!("piece {piece} within a piece")),
            };
            for (place, row) in (first..).zip(rows) {
                match seen.get_mut(place) {
                    None | Some(true) => return broken(index, format!("reference {place} in lane {lane}")),
                    Some(seen) => *seen = true,
                }
                if !bounds.contains(&Bounds::of_triangle(&triangles.corners(row))) {
                    return broken(index, format!("triangle {row} reaches out of its box"));
                }
            }
        }
    }
    let covered = seen.iter().filter(|&&seen| seen).count();
    let references = triangles.len() - tree.stats.rejected;
    if covered != references {
        return broken(0, format!("{covered} of {references} references stand in a leaf"));
    }
    Ok(reached)
}

/// A range of references.
struct Leaf {
    first: usize,
    count: usize,
}

fn holds_vertices(wide: &Wide, leaf: Leaf, place: usize, corners: &Corners) -> bool {
    let Leaf { first, count } = leaf;
    let row = |row: usize| *wide.rows.get(9 * first + row * count + place);
    wide.rows.is_empty() || corners.as_flattened().iter().enumerate().all(|(i, &x)| row(i) == x as f32)
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
