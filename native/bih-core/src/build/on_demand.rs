//! Construction on demand: pieces that are built when a ray comes to one.
//!
//! The slides' "on demand" with the flag at the root of a piece: the upper nodes are there from the start, sorted ranges
//! of rows below them, and whoever comes to an unbuilt piece builds all of it, because it fits the cache.

use std::ops;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::classic::ClassicNodes;
use super::frame::Emission;
use super::leaves::Places;
use super::options::BuildOptions;
use super::pieces::Ranges;
use super::reference::Reference;
use super::wide::WideRecords;
use crate::control::{Cancelled, Control};
use crate::geometry::Triangles;
use crate::simd::FloatEnvironment;
use crate::tree::{
    Claim, CompactRecord, Copies, Found, Node, Record, Records, Roots, Stats, Target, Tree, WIDTH, Wide,
};

/// What of a tree is built when rays come to it, and what that has cost so far.
#[derive(Debug)]
pub struct OnDemand {
    ranges: Ranges,
    roots: Roots,
    leaf_size: usize,
    /// Records or nodes that were there from the start.
    top: usize,
    /// Those that there are now.
    used: AtomicUsize,
    /// Of the deepest leaf.
    depth: AtomicUsize,
    leaves: AtomicUsize,
    /// Pieces, and their triangles.
    built: AtomicUsize,
    triangles: AtomicUsize,
    nanoseconds: AtomicU64,
    /// Builders that are to fail, before one does not.
    #[cfg(test)]
    pub failures: std::sync::atomic::AtomicIsize,
}

impl OnDemand {
    /// Bytes that the pieces take beside what is built of them, never exceeded.
    pub fn bound_bytes(options: &BuildOptions, triangles: &Triangles, pieces: usize) -> usize {
        let copies = if options.has_rows(triangles) { Copies::BOUND - 9 * size_of::<f32>() } else { 0 };
        Ranges::bound_bytes(pieces) + pieces * (size_of::<u32>() + Node::BYTES) + triangles.len() * copies
    }

    /// Bytes that builders may hold at once, on all threads of the pool that the caller runs in: for each triangle its row,
    /// its key or its box, and its part of the records.
    pub fn working_bytes(&self) -> usize {
        let each = size_of::<u32>() + size_of::<Reference>() + Record::BYTES;
        let unbuilt = self.pieces() - self.built.load(Ordering::Relaxed);
        let largest = || self.ranges.places.iter().map(|place| place.count as usize).max().unwrap_or(0);
        unbuilt.min(rayon::current_num_threads()) * if unbuilt == 0 { 0 } else { each * largest() }
    }

    /// Over pieces that are all unbuilt.
    pub fn new(ranges: Ranges, leaf_size: usize) -> Self {
        Self {
            roots: Roots::new(ranges.places.len()),
            ranges,
            leaf_size,
            top: 0,
            used: AtomicUsize::new(0),
            depth: AtomicUsize::new(0),
            leaves: AtomicUsize::new(0),
            built: AtomicUsize::new(0),
            triangles: AtomicUsize::new(0),
            nanoseconds: AtomicU64::new(0),
            #[cfg(test)]
            failures: std::sync::atomic::AtomicIsize::new(0),
        }
    }

    /// The nodes of the top are laid down.
    pub fn start_nodes(&mut self, nodes: usize) {
        self.top = nodes;
        self.used = AtomicUsize::new(nodes);
        self.depth = AtomicUsize::new(self.ranges.places.iter().map(|place| place.level).max().unwrap_or(0).into());
    }

    /// The records of the top are laid down.
    pub fn start_records(&mut self, records: &[Record]) {
        // Children stand behind their parents.
        let mut levels = vec![1; records.len()];
        for (index, record) in records.iter().enumerate() {
            for lane in 0..WIDTH {
                match record.child(lane).target() {
                    Target::Record(0) | Target::Leaf { .. } => {}
                    Target::Record(child) => levels[child] = levels[index] + 1,
                    Target::Piece(piece) => self.ranges.places[piece].level = levels[index],
                }
            }
        }
        self.start_nodes(records.len());
    }

    /// How many nodes there were from the start.
    pub fn top(&self) -> usize {
        self.top
    }

    /// How many nodes or records there are.
    pub fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }

    /// Depth of the deepest leaf, in records or nodes.
    #[inline(always)]
    pub fn depth(&self) -> usize {
        self.depth.load(Ordering::Relaxed)
    }

    /// The root of a piece; none while another thread builds it. Built here if nobody does.
    #[inline(always)]
    pub fn enter(&self, tree: &Tree, piece: usize, triangles: &Triangles) -> Option<u32> {
        match self.roots.built(piece) {
            None => self.build_unless_busy(tree, piece, triangles),
            root => root,
        }
    }

    /// A function of its own, so it uses the lanes of no instruction set.
    #[cold]
    #[inline(never)]
    fn build_unless_busy(&self, tree: &Tree, piece: usize, triangles: &Triangles) -> Option<u32> {
        match self.roots.find(piece) {
            Found::Built(root) => Some(root),
            Found::Busy => None,
            Found::Claimed(claim) => Some(self.build(tree, piece, triangles, claim)),
        }
    }

    /// Build all that is not built yet.
    pub fn build_all(&self, tree: &Tree, triangles: &Triangles, control: &Control) -> Result<(), Cancelled> {
        control.start(self.roots.len());
        (0..self.roots.len()).into_par_iter().try_for_each(|piece| {
            control.advance(1)?;
            while self.enter(tree, piece, triangles).is_none() {
                std::thread::yield_now();
            }
            Ok(())
        })
    }

    /// Look at a piece and at its root, if it is built, while nobody writes it.
    pub fn look<R>(&self, piece: usize, look: impl FnOnce(ops::Range<usize>, Option<u32>) -> R) -> R {
        loop {
            let place = self.ranges.places[piece].references();
            match self.roots.find(piece) {
                Found::Built(root) => return look(place, Some(root)),
                Found::Busy => std::thread::yield_now(),
                Found::Claimed(_claim) => return look(place, None),
            }
        }
    }

    /// Whether a piece has no root yet.
    #[inline(always)]
    pub fn is_unbuilt(&self, piece: usize) -> bool {
        self.roots.built(piece).is_none()
    }

    /// How many pieces there are.
    pub fn pieces(&self) -> usize {
        self.roots.len()
    }

    /// The ranges of unbuilt pieces: their first references and their numbers.
    pub fn unbuilt(&self) -> Vec<(usize, usize)> {
        let place = |piece: usize| {
            let place = self.ranges.places[piece].references();
            (place.start, place.len())
        };
        (0..self.pieces()).filter(|&piece| self.roots.built(piece).is_none()).map(place).collect()
    }

    /// Rows in the order of the leaves, those of unbuilt pieces in that of their sorting; then the rejected ones.
    pub fn order(&self, tree: &Tree) -> Vec<u32> {
        let end = tree.order.len();
        let mut order = Vec::with_capacity(end);
        for piece in 0..self.pieces() {
            self.look(piece, |place, _| order.extend_from_slice(tree.order.slice(place)));
        }
        order.extend_from_slice(tree.order.slice(end - tree.stats.rejected..end));
        order
    }

    /// What the tree is and what it cost so far.
    pub fn stats(&self, tree: &Tree) -> Stats {
        let mut stats = tree.stats.clone();
        let used = self.used.load(Ordering::Relaxed);
        let built = self.built.load(Ordering::Relaxed);
        let rows = self.triangles.load(Ordering::Relaxed);
        stats.leaves = self.leaves.load(Ordering::Relaxed);
        stats.unbuilt = self.pieces() - built;
        stats.depth = self.depth();
        let (each, copies) = match &tree.wide {
            Some(Wide { records, copies, .. }) => {
                stats.nodes = used + stats.leaves;
                (records.stride(), copies.as_ref().map_or(0, |copies| copies.bytes(rows)))
            }
            None => {
                // The root of a piece stands beside the node that was flagged.
                stats.nodes = used - self.pieces();
                (Node::BYTES, 0)
            }
        };
        let kept = self.ranges.bytes() + self.pieces() * size_of::<u32>();
        stats.tree_bytes = each * used + copies + tree.order.len() * size_of::<u32>() + kept;
        stats.peak_build_bytes = stats.peak_build_bytes.max(stats.tree_bytes);
        stats.build_seconds += self.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9;
        stats
    }

    /// Build a piece. No other thread's work is done meanwhile: it might wait for this very piece.
    fn build(&self, tree: &Tree, piece: usize, triangles: &Triangles, mut claim: Claim) -> u32 {
        let start = Instant::now();
        let _standard = FloatEnvironment::standard();
        let place = self.ranges.places[piece].references();
        let mut order = tree.order.slice(place.clone()).to_vec();
        let level = usize::from(self.ranges.places[piece].level);
        let (root, depth, leaves) = match &tree.wide {
            None => {
                let built = self.finish(ClassicNodes, piece, triangles, Places { order: &mut order, rows: &mut [] });
                let first = self.used.fetch_add(built.nodes.len(), Ordering::Relaxed);
                let nodes = tree.nodes.write(&mut claim, first..first + built.nodes.len());
                for (place, node) in nodes.iter_mut().zip(&built.nodes) {
                    *place = node.moved(first);
                }
                (first as u32, level + built.depth, built.leaves)
            }
            Some(Wide { records, .. }) => {
                let built = self.finish(WideRecords, piece, triangles, Places { order: &mut order, rows: &mut [] });
                let root = match built.leaf {
                    Some(leaf) => leaf.word(),
                    None => self.write_records(records, &built.records, &mut claim),
                };
                (root, level + built.depth, built.leaves)
            }
        };
        tree.order.write(&mut claim, place).copy_from_slice(&order);
        self.depth.fetch_max(depth, Ordering::Relaxed);
        self.leaves.fetch_add(leaves, Ordering::Relaxed);
        self.triangles.fetch_add(order.len(), Ordering::Relaxed);
        self.built.fetch_add(1, Ordering::Relaxed);
        self.nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        claim.publish(root);
        root
    }

    /// Write the records of a piece behind those that there are; answers the word of the first.
    fn write_records(&self, records: &Records, built: &[Record], claim: &mut Claim) -> u32 {
        let first = self.used.fetch_add(built.len(), Ordering::Relaxed);
        let range = first..first + built.len();
        let moved = built.iter().map(|record| record.moved(first));
        match records {
            Records::Full(records) => {
                for (place, record) in records.write(claim, range).iter_mut().zip(moved) {
                    *place = record;
                }
            }
            Records::Compact(records) => {
                for (place, record) in records.write(claim, range).iter_mut().zip(moved) {
                    *place = CompactRecord::new(&record);
                }
            }
        }
        first as u32
    }

    fn finish<E: Emission>(&self, emission: E, piece: usize, triangles: &Triangles, places: Places) -> E::Piece {
        let built = self.ranges.finish(emission, piece, triangles, self.leaf_size, places);
        #[cfg(test)]
        self.fail();
        built
    }

    #[cfg(test)]
    fn fail(&self) {
        assert!(self.failures.fetch_sub(1, Ordering::Relaxed) <= 0, "a builder that was to fail");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{Build, Heuristic, Layout, build};
    use crate::geometry::{Ray, Vertices};
    use crate::traverse::{Stack, Tracer, Way, naive_closest};
    use crate::tree::validate;

    /// Triangles in a row, and a ray through each of them.
    fn row_of(count: usize) -> (Vec<[f32; 3]>, Vec<Ray>) {
        let at = |i: usize| i as f32 * 1.5;
        let soup = (0..count).flat_map(|i| [[at(i), 0.1, 0.0], [at(i) + 1.0, 0.2, 0.1], [at(i) + 0.3, 1.1, 0.2]]);
        let rays = (0..count).map(|i| Ray::new([f64::from(at(i)) + 0.4, 0.4, -3.0], [0.01, 0.02, 1.0]));
        (soup.collect(), rays.collect())
    }

    /// Also the test of what Miri sees of the shared arrays: some threads at once; it has the time for two layouts.
    #[test]
    fn builders_that_fail_leave_a_tree_that_is_usable() {
        let (soup, mut rays) = row_of(if cfg!(miri) { 20 } else { 400 });
        if cfg!(miri) {
            rays = rays.into_iter().step_by(7).collect();
        }
        let triangles = Triangles::new(Vertices::F32(&soup), None).unwrap();
        for (layout, heuristic) in [
            (Layout::Classic, Heuristic::Global),
            (Layout::Wide, Heuristic::Global),
            (Layout::Wide, Heuristic::Sah),
            (Layout::Compact, Heuristic::Local),
        ]
        .into_iter()
        .take(if cfg!(miri) { 2 } else { 4 })
        {
            let options = BuildOptions {
                layout,
                heuristic,
                build: Build::OnDemand,
                piece: Some(if cfg!(miri) { 9 } else { 16 }),
                ..Default::default()
            };
            let tree = build(&triangles, &options, &Control::default()).unwrap();
            let on_demand = tree.on_demand.as_ref().unwrap();
            on_demand.failures.store(3, Ordering::Relaxed);
            let trace = |way| {
                let mut hits = vec![None; rays.len()];
                Tracer::new(&tree, &triangles).closest(&rays, way, &mut Stack::default(), &mut hits);
                hits
            };
            // Each way on a thread of its own, which may meet a builder that fails.
            let failed: usize = std::thread::scope(|scope| {
                let ways =
                    [Way::Alone, Way::InFlight, Way::Packets, Way::InFlight].map(|way| scope.spawn(move || trace(way)));
                ways.into_iter().map(|way| usize::from(way.join().is_err())).sum()
            });
            assert!((1..=3).contains(&failed), "{layout:?}: {failed} failed");
            on_demand.failures.store(0, Ordering::Relaxed);
            validate(&tree, &triangles).unwrap();
            let expected: Vec<_> = rays.iter().map(|ray| naive_closest(&tree, &triangles, ray)).collect();
            assert!(expected.iter().all(Option::is_some));
            for way in [Way::Alone, Way::InFlight, Way::Packets] {
                assert_eq!(trace(way), expected, "{layout:?} {way:?}");
            }
            on_demand.build_all(&tree, &triangles, &Control::default()).unwrap();
            assert_eq!(on_demand.built.load(Ordering::Relaxed), on_demand.pieces());
            validate(&tree, &triangles).unwrap();
        }
    }
}
