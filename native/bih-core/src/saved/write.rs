//! Writing: all of a file or nothing.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use bytemuck::cast_slice;

use super::file_error;
use super::format::{BYTE_ORDER, Coded, Header, MAGIC, SECTIONS, Section, VERSION, aligned, checksum};
use crate::build::{Build, BuildOptions, Layout, build_in_frame};
use crate::control::Control;
use crate::error::Error;
use crate::geometry::{Triangles, Vertices};
use crate::tree::{Records, Tree};

/// Save a tree with its triangles. The file is written beside its place and put there when all of it is on the disk; what
/// was there before stays until then.
///
/// Of a tree that is built on demand the file holds the one that is built at once, with the same options and the same
/// answers: it is built for the file, and the tree itself stays as it is.
pub fn save(tree: &Tree, triangles: &Triangles, path: &Path, control: &Control) -> Result<(), Error> {
    let failed = |error: io::Error| file_error(path, &error);
    check_place(path).map_err(failed)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut beside = new_file(folder).map_err(failed)?;
    with_finished(tree, triangles, control, |tree| write(tree, triangles, &mut beside).map_err(failed))?;
    beside.as_file().sync_all().map_err(failed)?;
    beside.persist(path).map_err(|error| failed(error.error))?;
    // The name, too.
    #[cfg(unix)]
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed)?;
    Ok(())
}

/// Only a file may be replaced: no folder, and no device.
fn check_place(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(there) if !there.is_file() => Err(io::Error::other("not a file")),
        _ => Ok(()),
    }
}

fn new_file(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".saving-").suffix(".bihtree");
    // As of any new file; what the process masks is taken away.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Do it with the tree, or with the one that is built at once in the place of one that is not.
fn with_finished<R>(
    tree: &Tree,
    triangles: &Triangles,
    control: &Control,
    work: impl FnOnce(&Tree) -> Result<R, Error>,
) -> Result<R, Error> {
    if tree.on_demand.is_none() {
        return work(tree);
    }
    let options = BuildOptions {
        structure: tree.structure,
        layout: layout(tree),
        build: Build::Eager,
        heuristic: tree.heuristic,
        precision: tree.precision,
        leaf_size: Some(tree.leaf_size),
        ..Default::default()
    };
    work(&build_in_frame(triangles, &options, control)?)
}

fn layout(tree: &Tree) -> Layout {
    match &tree.wide {
        None => Layout::Classic,
        Some(wide) if wide.records.are_ordered() => Layout::Wide,
        Some(_) => Layout::Compact,
    }
}

/// The bytes of a file, section after section.
pub fn write(tree: &Tree, triangles: &Triangles, file: &mut impl Write) -> io::Result<()> {
    if cfg!(target_endian = "big") {
        return Err(io::Error::new(io::ErrorKind::Unsupported, "saved trees are of little-endian machines"));
    }
    let reasons: String = tree.stats.left_out.iter().map(|(part, reason)| format!("{part}: {reason}\n")).collect();
    let sections = sections(tree, triangles, &reasons);
    let mut header = header(tree, triangles);
    let too_long = || io::Error::from(io::ErrorKind::FileTooLarge);
    let mut end = size_of::<Header>() as u64;
    for (entry, (bytes, item_bytes)) in header.table.iter_mut().zip(sections) {
        let start = aligned(end).ok_or_else(too_long)?;
        let length = bytes.len() as u64;
        *entry = Section { start, bytes: length, item_bytes: item_bytes as u32, checksum: checksum(bytes) };
        end = start.checked_add(length).ok_or_else(too_long)?;
    }
    header.file_bytes = end;
    header.checksum = header.sum();
    file.write_all(bytemuck::bytes_of(&header))?;
    let mut end = size_of::<Header>() as u64;
    for (entry, (bytes, _)) in header.table.iter().zip(sections) {
        file.write_all(&[0; super::bytes::ALIGNMENT][..(entry.start - end) as usize])?;
        file.write_all(bytes)?;
        end = entry.start + entry.bytes;
    }
    file.flush()
}

fn header(tree: &Tree, triangles: &Triangles) -> Header {
    Header {
        magic: MAGIC,
        version: VERSION,
        byte_order: BYTE_ORDER,
        sections: SECTIONS.len() as u32,
        structure: tree.structure.code(),
        layout: layout(tree).code(),
        heuristic: tree.heuristic.code(),
        precision: tree.precision.code(),
        coordinate: if triangles.is_double() { 8 } else { 4 },
        is_indexed: triangles.rows().is_some().into(),
        is_presorted: tree.stats.presorted.into(),
        leaf_size: tree.leaf_size.try_into().unwrap_or(u32::MAX),
        depth: tree.stats.depth as u32,
        rejected: tree.stats.rejected as u64,
        leaves: tree.stats.leaves as u64,
        peak_build_bytes: tree.stats.peak_build_bytes as u64,
        build_seconds: tree.stats.build_seconds,
        bounds: [tree.bounds.lower, tree.bounds.upper],
        ..bytemuck::Zeroable::zeroed()
    }
}

/// The bytes of each section, and those of one of its items.
fn sections<'a>(tree: &'a Tree, triangles: &Triangles<'a>, reasons: &'a str) -> [(&'a [u8], usize); SECTIONS.len()] {
    let vertices = match triangles.vertices() {
        Vertices::F32(vertices) => (cast_slice(vertices), size_of::<[f32; 3]>()),
        Vertices::F64(vertices) => (cast_slice(vertices), size_of::<[f64; 3]>()),
    };
    let rows = (triangles.rows().map_or(&[][..], cast_slice), size_of::<[u32; 3]>());
    let all = |values: &'a crate::tree::Shared<u32>| -> &'a [u8] { cast_slice(values.slice(0..values.len())) };
    let order = tree.kd_tree.as_ref().map_or_else(|| all(&tree.order), |kd_tree| cast_slice(kd_tree.order()));
    let nodes: (&[u8], usize) = match (&tree.wide, &tree.kd_tree) {
        (Some(wide), _) => {
            let records = match &wide.records {
                Records::Full(records) => cast_slice(records.slice(0..records.len())),
                Records::Compact(records) => cast_slice(records.slice(0..records.len())),
            };
            (records, wide.records.stride())
        }
        (None, Some(kd_tree)) => (cast_slice(kd_tree.nodes()), crate::kd_tree::KdNode::BYTES),
        (None, None) => (cast_slice(tree.nodes()), crate::tree::Node::BYTES),
    };
    let leaf_rows = tree.wide.as_ref().map_or(&[][..], |wide| cast_slice(wide.rows.slice(0..wide.rows.len())));
    let leaf_rows = (leaf_rows, size_of::<f32>());
    [vertices, rows, (order, size_of::<u32>()), nodes, leaf_rows, (reasons.as_bytes(), 1)]
}
