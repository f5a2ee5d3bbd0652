//! Emission of 12-byte nodes.

use super::frame::{Emission, Weight};
use super::treelet::{Branch, Treelet};
use crate::tree::Node;

/// Turns treelets into nodes.
pub struct ClassicNodes;

/// The nodes of one treelet, their children counted from its own.
pub struct Piece {
    pub nodes: Vec<Node>,
    pub depth: usize,
    pub leaves: usize,
}

/// All nodes.
#[derive(Default)]
pub struct Nodes {
    pub nodes: Vec<Node>,
    pub depth: usize,
    pub leaves: usize,
}

impl Weight for Piece {
    fn bytes(&self) -> usize {
        self.nodes.capacity() * Node::BYTES
    }
}

impl Weight for Nodes {
    fn bytes(&self) -> usize {
        self.nodes.capacity() * Node::BYTES
    }
}

impl Emission for ClassicNodes {
    type Piece = Piece;
    type Output = Nodes;

    fn piece(&self, treelet: &Treelet) -> Piece {
        let leaf = |leaf: &Branch| Node::leaf(treelet.first + leaf.first as usize, leaf.count as usize);
        let nodes = emit(&treelet.branches, leaf);
        let leaves = treelet.branches.iter().filter(|branch| branch.is_leaf()).count();
        Piece { nodes, depth: depths(&treelet.branches).max().unwrap_or(0), leaves }
    }

    fn unbuilt(&self, number: usize) -> Piece {
        Piece { nodes: vec![Node::piece(number)], depth: 0, leaves: 0 }
    }

    fn join(&self, top: &Treelet, pieces: Vec<Piece>) -> Nodes {
        // The root of a piece takes its place in the top; the rest of it follows.
        let mut starts = Vec::with_capacity(pieces.len());
        let mut end = top.branches.len();
        for piece in &pieces {
            starts.push(end);
            end += piece.nodes.len() - 1;
        }
        let mut nodes = Vec::with_capacity(end);
        let moved = |node: &Node, number: usize| node.moved(starts[number] - 1);
        nodes.extend(emit(&top.branches, |leaf| moved(&pieces[leaf.first as usize].nodes[0], leaf.first as usize)));
        for (number, piece) in pieces.iter().enumerate() {
            nodes.extend(piece.nodes[1..].iter().map(|node| moved(node, number)));
        }
        let depth = top.branches.iter().zip(depths(&top.branches)).filter(|(branch, _)| branch.is_leaf());
        let depth = depth.map(|(leaf, depth)| depth + pieces[leaf.first as usize].depth).max().unwrap_or(0);
        let leaves = pieces.iter().map(|piece| piece.leaves).sum();
        Nodes { nodes, depth, leaves }
    }
}

/// One node for each branch, at the same index.
fn emit(branches: &[Branch], leaf: impl Fn(&Branch) -> Node) -> Vec<Node> {
    let node = |branch: &Branch| {
        if branch.is_leaf() {
            return leaf(branch);
        }
        let (axis, left) = (branch.axis(), branch.left as usize);
        let clip = [branches[left].bounds.upper[axis], branches[left + 1].bounds.lower[axis]];
        Node::inner(axis, left, clip)
    };
    branches.iter().map(node).collect()
}

/// How far each branch is below the first.
fn depths(branches: &[Branch]) -> impl Iterator<Item = usize> {
    let mut depths = vec![0; branches.len()];
    for (index, branch) in branches.iter().enumerate() {
        if !branch.is_leaf() {
            let left = branch.left as usize;
            depths[left] = depths[index] + 1;
            depths[left + 1] = depths[index] + 1;
        }
    }
    depths.into_iter()
}
