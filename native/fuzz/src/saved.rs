//! Files: any bytes at all, and saved trees that are changed here and there and given the right checksums again.

use std::sync::OnceLock;

use bih_core::build::{Build, Heuristic, Layout, Precision, Structure};
use bih_core::saved::{Bytes, SECTIONS, parse, write};
use bih_core::tree::node_table;
use bih_core::{BuildOptions, Control, Ray, Triangles, Vertices, build};

use super::numbers::Numbers;
use super::queries::{agree, naive};

const HEADER: usize = 272;
const FIRST_ENTRY: usize = 128;
const ENTRY: usize = 24;
const ALIGNMENT: usize = 64;

/// The first byte says whether the others are a file or changes of one.
pub fn saved(data: &[u8]) {
    match data.split_first() {
        None => {}
        Some((0, file)) => load(file),
        Some((_, changes)) => load(&changed(&mut Numbers(changes))),
    }
}

/// A file that loads holds a tree that gives the true answers; of a kd-tree, whose leaves may have been robbed of
/// triangles, answers.
fn load(file: &[u8]) {
    let Ok(loaded) = parse(Bytes::read(&mut &file[..], file.len()).expect("as long"), "a file") else { return };
    let (tree, triangles) = (&loaded.tree, &loaded.mesh.triangles());
    let rays = rays(triangles);
    if tree.precision() != Precision::Fast && tree.structure() != Structure::KdTree {
        agree(tree, triangles, &rays, Some(&naive(tree, triangles, &rays)));
    } else if tree.structure() != Structure::KdTree {
        agree(tree, triangles, &rays, None);
    } else {
        let mut hits = vec![None; rays.len()];
        let tracer = bih_core::traverse::Tracer::new(tree, triangles);
        for way in [bih_core::traverse::Way::Alone, bih_core::traverse::Way::Packets] {
            tracer.closest(&rays, way, &mut Default::default(), &mut hits);
        }
    }
    node_table(tree, triangles, u32::MAX, usize::MAX, &Control::default()).expect("a table of any tree");
    let mut again = Vec::new();
    write(tree, triangles, &mut again).expect("memory takes all");
    assert!(again == file, "a file that loads is written as it was");
}

/// From outside and from within, at the corners of some triangles.
fn rays(triangles: &Triangles) -> Vec<Ray> {
    let ray = |i: usize| {
        let origin = [i as f64 * 0.1 - 3.0, if i.is_multiple_of(3) { 0.25 } else { -5.0 }, (i % 7) as f64 * 0.3];
        let target =
            if triangles.is_empty() { [0.0; 3] } else { triangles.corners((i % triangles.len()) as u32)[i % 3] };
        Ray::new(origin, std::array::from_fn(|axis| target[axis] - origin[axis]))
    };
    (0..70).map(ray).collect()
}

/// Small trees of every kind.
fn originals() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| {
        let mut points: Vec<[f64; 3]> = (0..36u32)
            .map(|i| [f64::from(i % 6), f64::from(i / 6), f64::from(i.wrapping_mul(0x9e37_79b9) >> 24) / 256.0])
            .collect();
        points.push([f64::NAN; 3]);
        let mut rows: Vec<[u32; 3]> =
            (0..29).filter(|i| i % 6 != 5).flat_map(|i| [[i, i + 1, i + 6], [i + 1, i + 7, i + 6]]).collect();
        rows.extend([[0, 0, 1], [1, 2, 36]]);
        let single: Vec<[f32; 3]> = points.iter().map(|point| point.map(|x| x as f32)).collect();
        let soup: Vec<[f32; 3]> = rows.iter().flat_map(|row| row.map(|vertex| single[vertex as usize])).collect();
        let meshes = [
            Triangles::new(Vertices::F32(&single), Some(&rows)),
            Triangles::new(Vertices::F64(&points), Some(&rows)),
            Triangles::new(Vertices::F32(&soup), None),
            Triangles::new(Vertices::F32(&single), Some(&rows[..1])),
        ];
        let meshes = meshes.map(|mesh| mesh.expect("rows of vertices that are there"));
        let bih = |layout, heuristic| BuildOptions {
            layout,
            heuristic,
            build: Build::Eager,
            leaf_size: Some(2),
            ..Default::default()
        };
        let options = [
            bih(Layout::Wide, Heuristic::Global),
            BuildOptions { precision: Precision::Exact, ..bih(Layout::Compact, Heuristic::Sah) },
            bih(Layout::Classic, Heuristic::Local),
            BuildOptions::of(Structure::KdTree),
            BuildOptions { precision: Precision::Fast, ..BuildOptions::of(Structure::Bvh) },
        ];
        let file = |(mesh, options)| {
            let mut file = Vec::new();
            let tree = build(mesh, options, &Control::default()).expect("a tree over any mesh");
            write(&tree, mesh, &mut file).expect("memory takes all");
            file
        };
        meshes.iter().flat_map(|mesh| options.iter().map(move |options| (mesh, options))).map(file).collect()
    })
}

/// A file taken apart.
struct Parts {
    header: Vec<u8>,
    sections: Vec<Vec<u8>>,
    items: Vec<u32>,
}

impl Parts {
    fn of(file: &[u8]) -> Self {
        let number =
            |place: usize| u64::from_le_bytes(file[place..place + 8].try_into().expect("eight bytes")) as usize;
        let entries = (0..SECTIONS.len()).map(|section| FIRST_ENTRY + ENTRY * section);
        let section = |entry: usize| file[number(entry)..number(entry) + number(entry + 8)].to_vec();
        Self {
            header: file[..FIRST_ENTRY].to_vec(),
            sections: entries.clone().map(section).collect(),
            items: entries.map(|entry| number(entry + 16) as u32).collect(),
        }
    }

    /// With the right places and checksums.
    fn file(&self) -> Vec<u8> {
        let mut file = self.header.clone();
        file.resize(HEADER, 0);
        for (number, (section, item)) in self.sections.iter().zip(&self.items).enumerate() {
            file.resize(file.len().next_multiple_of(ALIGNMENT), 0);
            let entry = FIRST_ENTRY + ENTRY * number;
            let start = file.len() as u64;
            file[entry..entry + 8].copy_from_slice(&start.to_le_bytes());
            file[entry + 8..entry + 16].copy_from_slice(&(section.len() as u64).to_le_bytes());
            file[entry + 16..entry + 20].copy_from_slice(&item.to_le_bytes());
            file[entry + 20..entry + 24].copy_from_slice(&crc32fast::hash(section).to_le_bytes());
            file.extend_from_slice(section);
        }
        let bytes = file.len() as u64;
        file[16..24].copy_from_slice(&bytes.to_le_bytes());
        seal(&mut file);
        file
    }
}

/// The right checksum of the header.
fn seal(file: &mut [u8]) {
    file[24..28].fill(0);
    let sum = crc32fast::hash(&file[..HEADER]);
    file[24..28].copy_from_slice(&sum.to_le_bytes());
}

/// One of the originals with up to eight changes, and the right checksums over them.
fn changed(numbers: &mut Numbers) -> Vec<u8> {
    let originals = originals();
    let mut parts = Parts::of(&originals[usize::from(numbers.byte()) % originals.len()]);
    let mut entry = None;
    for _ in 0..8 {
        if numbers.is_empty() {
            break;
        }
        let kind = numbers.byte();
        let section = usize::from(numbers.byte()) % SECTIONS.len();
        let bytes = &mut parts.sections[section];
        let words = bytes.len() / 4;
        match kind % 8 {
            0 => {
                let place = numbers.below(FIRST_ENTRY);
                parts.header[place] = numbers.byte();
            }
            1 if words > 0 => {
                let place = 4 * numbers.below(words);
                bytes[place..place + 4].copy_from_slice(&numbers.word().to_le_bytes());
            }
            2 if !bytes.is_empty() => {
                let place = numbers.below(bytes.len());
                bytes[place] ^= 1 << (numbers.byte() & 7);
            }
            3 if words > 0 => {
                let [from, to] = [4 * numbers.below(words), 4 * numbers.below(words)];
                let count = 4 * numbers.below(words - from.max(to) / 4);
                bytes.copy_within(from..from + count, to);
            }
            4 => {
                let item = parts.items[section] as usize;
                let (_, count) = (numbers.byte(), numbers.below(8));
                bytes.truncate(bytes.len().saturating_sub(count * item));
            }
            5 => {
                let count = (parts.items[section] as usize * numbers.below(8)).min(bytes.len());
                let start = bytes.len() - count;
                bytes.extend_from_within(start..);
            }
            6 => {
                *bytes =
                    Parts::of(&originals[usize::from(numbers.byte()) % originals.len()]).sections.swap_remove(section)
            }
            7 => entry = Some((section, numbers.below(ENTRY), numbers.byte())),
            _ => {}
        }
    }
    let mut file = parts.file();
    if let Some((section, place, value)) = entry {
        file[FIRST_ENTRY + ENTRY * section + place] = value;
        seal(&mut file);
    }
    file
}
