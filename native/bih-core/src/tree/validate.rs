//! Every rule that a tree keeps, checked one by one.

use super::{Kind, MAX_DEPTH, Record, Target, Tree, WIDTH, Wide};
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
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
    if tree.order.len() != triangles.len() {
        return broken(0, format!("{} references for {} triangles", tree.order.len(), triangles.len()));
    }
    for &row in &tree.order {
        match seen.get_mut(row as usize) {
            None => return broken(0, format!("reference to triangle {row} of {}", triangles.len())),
            Some(true) => return broken(0, format!("triangle {row} is referred to twice")),
            Some(seen) => *seen = true,
        }
    }
    let references = tree.references();
    if let Some(wide) = &tree.wide {
        return validate_records(wide, references, triangles);
    }
    if tree.nodes.is_empty() {
        let lost = references.len();
        return if lost == 0 { Ok(()) } else { broken(0, format!("{lost} references and no node")) };
    }

    let mut reached = 0;
    let mut covered = 0;
    let mut stack = vec![(0, 0, tree.bounds)];
    while let Some((node, depth, bounds)) = stack.pop() {
        reached += 1;
        if depth > MAX_DEPTH {
            return broken(node, format!("deeper than {MAX_DEPTH}"));
        }
        match tree.nodes[node].kind() {
            Kind::Inner { axis, left, clip } => {
                // Children stand behind their parent, so that a walk downwards ends.
                if left <= node || left + 1 >= tree.nodes.len() {
                    return broken(node, format!("children {left} and {}", left + 1));
                }
                let [mut lower_part, mut upper_part] = [bounds; 2];
                lower_part.upper[axis] = clip[0];
                upper_part.lower[axis] = clip[1];
                stack.push((left + 1, depth + 1, upper_part));
                stack.push((left, depth + 1, lower_part));
            }
            Kind::Leaf { first, count } => {
                // Depth first meets the leaves in the order of their references.
                if first != covered || count == 0 || count > references.len() - first {
                    return broken(node, format!("references {first} to {} after {covered}", first + count));
                }
                covered += count;
                for &row in &references[first..covered] {
                    let triangle = Bounds::of_triangle(&triangles.corners(row));
                    if !bounds.contains(&triangle) {
                        return broken(node, format!("triangle {row} reaches out of its clip planes"));
                    }
                }
            }
        }
    }
    if reached != tree.nodes.len() {
        return broken(0, format!("{reached} of {} nodes can be reached", tree.nodes.len()));
    }
    if covered != references.len() {
        return broken(0, format!("{covered} of {} references stand in a leaf", references.len()));
    }
    Ok(())
}

/// The same of records: each leaf's triangles lie within the box of its lane and of every lane above it, and the rows
/// hold their vertices.
fn validate_records(wide: &Wide, references: &[u32], triangles: &Triangles) -> Result<(), Error> {
    let broken = |node: usize, problem: String| Err(Error::Broken { node, problem });
    let mut seen = vec![false; references.len()];
    let mut reached = 0;
    let everything = Bounds { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
    let mut space = Record::EMPTY;
    let mut stack = Vec::new();
    if !references.is_empty() {
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
            match record.child(lane).target() {
                Target::Record(child) if child <= index => return broken(index, format!("child {child}")),
                Target::Record(child) => stack.push((child, bounds)),
                Target::Leaf { first, count } => {
                    for (place, &reference) in references.iter().enumerate().skip(first).take(count) {
                        match seen.get_mut(place) {
                            None | Some(true) => return broken(index, format!("reference {place} in lane {lane}")),
                            Some(seen) => *seen = true,
                        }
                        let corners = triangles.corners(reference);
                        if !bounds.contains(&Bounds::of_triangle(&corners)) {
                            return broken(index, format!("triangle {reference} reaches out of its box"));
                        }
                        let row = |row: usize| wide.rows[9 * first + row * count + place - first];
                        if !wide.rows.is_empty()
                            && !corners.as_flattened().iter().enumerate().all(|(i, &x)| row(i) == x as f32)
                        {
                            return broken(index, format!("vertices of triangle {reference} differ"));
                        }
                    }
                }
            }
        }
    }
    if reached != wide.records.len() || seen.contains(&false) {
        return broken(0, format!("{reached} of {} records can be reached", wide.records.len()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{BuildOptions, build};
    use crate::control::Control;
    use crate::geometry::Vertices;
    use crate::tree::Node;

    fn strip() -> Vec<[f32; 3]> {
        (0..8).flat_map(|i| [[i as f32, 0.0, 0.0], [i as f32 + 1.0, 0.0, 0.0], [i as f32, 1.0, 0.0]]).collect()
    }

    #[test]
    fn each_kind_of_damage_is_found() {
        let vertices = strip();
        let triangles = Triangles::new(Vertices::F32(&vertices), None).unwrap();
        let good =
            build(&triangles, &BuildOptions { leaf_size: Some(1), ..Default::default() }, &Control::default()).unwrap();
        assert_eq!(validate(&good, &triangles), Ok(()));

        let damage: [fn(&mut Tree); 7] = [
            |tree| tree.order[1] = tree.order[0],
            |tree| tree.order[0] = 99,
            |tree| _ = tree.order.pop(),
            |tree| tree.nodes[0] = Node::inner(0, 0, [4.0, 4.0]),
            |tree| tree.nodes[0] = Node::inner(0, 1 << 20, [4.0, 4.0]),
            |tree| tree.nodes[0] = Node::inner(0, 1, [3.0, 4.0]),
            |tree| tree.nodes[0] = Node::leaf(0, 8),
        ];
        for (case, spoil) in damage.iter().enumerate() {
            let mut tree = good.clone();
            spoil(&mut tree);
            assert!(validate(&tree, &triangles).is_err(), "damage {case} was not found");
        }
    }
}
