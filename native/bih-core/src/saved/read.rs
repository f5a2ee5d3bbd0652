//! Reading: every byte is checked before anything is used.

use std::fs::{self, File};
use std::io;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::format::{BYTE_ORDER, Coded, Header, MAGIC, SECTIONS, Section, VERSION, aligned, checksum};
use super::{Bytes, SavedMesh, file_error};
use crate::build::{Build, BuildOptions, Heuristic, Layout, Precision, Structure};
use crate::error::Error;
use crate::geometry::{Bounds, Triangles};
use crate::kd_tree::{self, KdNode, KdStats, KdTree};
use crate::simd::FloatEnvironment;
use crate::tree::{CompactRecord, Kind, Node, Record, Records, Shared, Stats, Tree, Wide, validate};

/// How a file is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Mapped: its pages come from the disk when they are used, and processes share them.
    Map,
    /// Into memory.
    Read,
}

/// A tree and the mesh that every query of it wants.
#[derive(Debug)]
pub struct Saved {
    /// The tree.
    pub tree: Tree,
    /// What it was built over.
    pub mesh: SavedMesh,
}

/// The names of parts that were left out, and why: there are a handful.
const LONGEST_TEXT: usize = 1 << 16;

/// Load a saved tree. Nothing in the file is trusted: a tree that is answered keeps every rule that `validate` knows.
pub fn load(path: &Path, access: Access) -> Result<Saved, Error> {
    let failed = |error: io::Error| file_error(path, &error);
    let wrong = |problem: String| Error::Format { path: path.display().to_string(), problem };
    // Opening anything else might wait for ever.
    let there = fs::metadata(path).map_err(failed)?;
    if there.is_dir() {
        return Err(failed(io::ErrorKind::IsADirectory.into()));
    }
    if !there.is_file() {
        return Err(wrong("not a file".to_owned()));
    }
    let mut file = File::open(path).map_err(failed)?;
    let len = usize::try_from(file.metadata().map_err(failed)?.len()).unwrap_or(usize::MAX);
    let bytes = match access {
        _ if len == 0 => return Err(wrong("empty".to_owned())),
        Access::Map => Bytes::map(&file, len),
        Access::Read => Bytes::read(&mut file, len),
    };
    parse(bytes.map_err(failed)?, &path.display().to_string())
}

/// The tree in the bytes of a file, or what is wrong with them; errors call the file by this name.
pub fn parse(bytes: Bytes, name: &str) -> Result<Saved, Error> {
    let _standard = FloatEnvironment::standard();
    let wrong = |problem: String| Error::Format { path: name.to_owned(), problem };
    let saved = assembled(bytes).map_err(wrong)?;
    match validate(&saved.tree, &saved.mesh.triangles()) {
        Ok(()) => Ok(saved),
        Err(error @ Error::Broken { .. }) => Err(wrong(error.to_string())),
        Err(error) => Err(error),
    }
}

/// The tree as it stands in the file, its rules still to be checked.
fn assembled(bytes: Bytes) -> Result<Saved, String> {
    let file = Arc::new(bytes);
    let header = header(&file)?;
    let options = options(&header)?;
    let places = places(&header, item_bytes(&header, &options), &file)?;
    let [vertices, rows, order, nodes, leaf_rows, left_out] = places;

    let is_indexed = flag("indexed", header.is_indexed)?;
    if !is_indexed && !rows.is_empty() {
        return Err("section triangles: not empty in a soup".to_owned());
    }
    let is_double = header.coordinate == 8;
    let mesh = SavedMesh::new(&file, is_double, vertices, is_indexed.then_some(rows)).ok_or("section vertices")?;
    let triangles = Triangles::new(mesh.vertices(), mesh.rows()).map_err(|error| error.to_string())?;
    let parts = Parts { file: &file, header: &header, options: &options, triangles: &triangles };
    let tree = parts.tree(order, nodes, leaf_rows, reasons(&file[left_out])?)?;
    Ok(Saved { tree, mesh })
}

/// The header, if it is one and fits the file.
fn header(file: &[u8]) -> Result<Header, String> {
    if !file.starts_with(&MAGIC) {
        return Err("not a saved tree".to_owned());
    }
    let word = |start: usize| file.get(start..start + 4).map(bytemuck::pod_read_unaligned::<u32>);
    // What stands in any version.
    let (Some(version), Some(byte_order)) = (word(8), word(12)) else {
        return Err(format!("cut short: {} bytes", file.len()));
    };
    if byte_order != BYTE_ORDER {
        return Err(format!("byte order {byte_order:#010x}; that of this machine is {BYTE_ORDER:#010x}"));
    }
    if version != VERSION {
        return Err(format!("version {version} of the format; this is version {VERSION}"));
    }
    let Some(header) = file.get(..size_of::<Header>()).map(bytemuck::pod_read_unaligned::<Header>) else {
        return Err(format!("cut short: {} bytes", file.len()));
    };
    if header.checksum != header.sum() {
        return Err("damaged: the checksum of the header differs".to_owned());
    }
    match header.file_bytes {
        bytes if bytes > file.len() as u64 => Err(format!("cut short: {} bytes of {bytes}", file.len())),
        bytes if bytes < file.len() as u64 => Err(format!("{} bytes, but the header says {bytes}", file.len())),
        _ if header.sections as usize != SECTIONS.len() => Err(format!("{} sections", header.sections)),
        _ if header.zero != 0 || header.zeros != [0; 3] => Err("header: a number that is not zero".to_owned()),
        _ => Ok(header),
    }
}

/// The options, if they go together.
fn options(header: &Header) -> Result<BuildOptions, String> {
    if !matches!(header.coordinate, 4 | 8) {
        return Err(format!("header: coordinates of {} bytes", header.coordinate));
    }
    let structure = Structure::of(header.structure)?;
    let leaf_size = header.leaf_size as usize;
    if !(1..=Triangles::LIMIT).contains(&leaf_size) {
        return Err(format!("header: leaves of {leaf_size}"));
    }
    let options = BuildOptions {
        structure,
        layout: Layout::of(header.layout)?,
        build: Build::Eager,
        heuristic: Heuristic::of(header.heuristic)?,
        precision: Precision::of(header.precision)?,
        // What is chosen for a kd-tree ends nowhere.
        leaf_size: (structure != Structure::KdTree).then_some(leaf_size),
        ..Default::default()
    };
    options.check().map_err(|error| format!("header: {error}"))?;
    Ok(options)
}

/// Bytes of an item of each section.
fn item_bytes(header: &Header, options: &BuildOptions) -> [usize; SECTIONS.len()] {
    let node = match (options.structure, options.layout) {
        (Structure::KdTree, _) => KdNode::BYTES,
        (_, Layout::Classic) => Node::BYTES,
        (_, Layout::Wide) => Record::BYTES,
        (_, Layout::Compact) => CompactRecord::BYTES,
    };
    [3 * usize::from(header.coordinate), size_of::<[u32; 3]>(), size_of::<u32>(), node, size_of::<f32>(), 1]
}

fn flag(name: &str, value: u8) -> Result<bool, String> {
    match value {
        0 | 1 => Ok(value == 1),
        _ => Err(format!("header: {name} {value}")),
    }
}

/// Where the sections are, each with the right checksum and nothing but zeros before it.
fn places(
    header: &Header,
    item_bytes: [usize; SECTIONS.len()],
    file: &[u8],
) -> Result<[Range<usize>; SECTIONS.len()], String> {
    let mut places = [const { 0..0 }; SECTIONS.len()];
    let mut end = size_of::<Header>() as u64;
    let entries = header.table.iter().zip(item_bytes).zip(SECTIONS);
    for (place, ((entry, item), name)) in places.iter_mut().zip(entries) {
        let Section { start, bytes, item_bytes, checksum: sum } = *entry;
        if aligned(end) != Some(start) {
            return Err(format!("section {name}: at {start}, behind {end}"));
        }
        let next = start.checked_add(bytes).filter(|&next| next <= header.file_bytes);
        let Some(next) = next else {
            return Err(format!("section {name}: {bytes} bytes at {start} of {}", header.file_bytes));
        };
        if item_bytes as usize != item || bytes % item as u64 != 0 {
            return Err(format!("section {name}: {bytes} bytes, items of {item_bytes}; {item} belong to an item"));
        }
        if file[end as usize..start as usize].iter().any(|&byte| byte != 0) {
            return Err(format!("damaged: the bytes before section {name} are not zero"));
        }
        *place = start as usize..next as usize;
        if checksum(&file[place.clone()]) != sum {
            return Err(format!("damaged: the checksum of section {name} differs"));
        }
        end = next;
    }
    if end != header.file_bytes {
        return Err(format!("{} bytes behind the last section", header.file_bytes - end));
    }
    Ok(places)
}

/// Parts that were left out, and why.
fn reasons(text: &[u8]) -> Result<Vec<(String, String)>, String> {
    let wrong = || "section left_out: no lines of a part and a reason".to_owned();
    let text = std::str::from_utf8(text).ok().filter(|text| text.len() <= LONGEST_TEXT).ok_or_else(wrong)?;
    let reason = |line: &str| line.split_once(": ").map(|(part, reason)| (part.to_owned(), reason.to_owned()));
    text.split_inclusive('\n').map(|line| line.strip_suffix('\n').and_then(reason).ok_or_else(wrong)).collect()
}

/// What a tree is put together from.
struct Parts<'a> {
    file: &'a Arc<Bytes>,
    header: &'a Header,
    options: &'a BuildOptions,
    triangles: &'a Triangles<'a>,
}

impl Parts<'_> {
    /// The tree, whose rules are still to be checked.
    fn tree(
        &self,
        order: Range<usize>,
        nodes: Range<usize>,
        leaf_rows: Range<usize>,
        left_out: Vec<(String, String)>,
    ) -> Result<Tree, String> {
        let Self { header, options, triangles, .. } = *self;
        let tree_bytes = order.len() + nodes.len() + leaf_rows.len();
        let order: Shared<u32> = self.items("order", order)?;
        let rejected = usize::try_from(header.rejected).ok().filter(|&rejected| rejected <= order.len());
        let rejected = rejected.ok_or_else(|| format!("header: {} rejected of {}", header.rejected, order.len()))?;
        let references = order.len() - rejected;
        let stats = Stats {
            triangles: triangles.len(),
            references,
            leaves: header.leaves as usize,
            depth: header.depth as usize,
            tree_bytes,
            bound_bytes: options.bound_bytes(triangles),
            peak_build_bytes: header.peak_build_bytes as usize,
            build_seconds: header.build_seconds,
            presorted: flag("presorted", header.is_presorted)?,
            rejected,
            left_out,
            ..Default::default()
        };
        let [lower, upper] = header.bounds;
        let mut tree = Tree {
            nodes: Shared::whole(Vec::new()),
            wide: None,
            kd_tree: None,
            order: Shared::whole(Vec::new()),
            bounds: Bounds { lower, upper },
            structure: options.structure,
            precision: options.precision,
            heuristic: options.heuristic,
            leaf_size: header.leaf_size as usize,
            build: Build::Eager,
            stats,
            on_demand: None,
        };
        let expected = options.numbers(triangles, references);
        let numbers: Shared<f32> = self.items("rows", leaf_rows)?;
        if numbers.len() != expected {
            return Err(format!("section rows: {} numbers, but {expected} are needed", numbers.len()));
        }
        if options.structure == Structure::KdTree {
            let nodes: Shared<KdNode> = self.items("nodes", nodes)?;
            tree.stats.nodes = nodes.len();
            tree.stats.bound_bytes = 0;
            let stats = kd_stats(&tree.stats, &nodes);
            tree.kd_tree = Some(KdTree::new(nodes, order, tree.bounds, stats));
            return Ok(tree);
        }
        tree.order = order;
        if options.layout == Layout::Classic {
            tree.nodes = self.items::<Node>("nodes", nodes)?;
            tree.stats.nodes = tree.nodes.len();
            return Ok(tree);
        }
        let records = if options.layout == Layout::Wide {
            Records::Full(self.items::<Record>("nodes", nodes)?)
        } else {
            Records::Compact(self.items::<CompactRecord>("nodes", nodes)?)
        };
        tree.stats.nodes = records.len().saturating_add(tree.stats.leaves);
        tree.wide = Some(Wide { records, rows: numbers, copies: None, depth: tree.stats.depth });
        Ok(tree)
    }

    /// Items of a section.
    fn items<T: bytemuck::Pod>(&self, name: &str, place: Range<usize>) -> Result<Shared<T>, String> {
        Shared::saved(self.file, place).ok_or_else(|| format!("section {name}: no whole items"))
    }
}

fn kd_stats(stats: &Stats, nodes: &Shared<KdNode>) -> KdStats {
    let nodes = nodes.slice(0..nodes.len());
    KdStats {
        triangles: stats.triangles,
        rejected: stats.rejected,
        nodes: stats.nodes,
        leaves: stats.leaves,
        empty_leaves: nodes.iter().filter(|node| matches!(node.kind(), Kind::Leaf { count: 0, .. })).count(),
        references: stats.references,
        depth: stats.depth,
        tree_bytes: stats.tree_bytes,
        bound_bytes: kd_tree::bound_bytes(stats.triangles),
        peak_build_bytes: stats.peak_build_bytes,
        build_seconds: stats.build_seconds,
    }
}
