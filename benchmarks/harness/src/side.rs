//! One structure over one mesh, as each side supplies it.

use std::time::Instant;

use bih_core::build::Structure::{Bih, Bvh, KdTree};
use rayon::ThreadPool;

use crate::bih::BihSide;
use crate::embree::{self, Device, EmbreeSide, Packet};
use crate::mesh::Mesh;
use crate::obvhs::ObvhsSide;
use crate::rays::{Found, Kind, Ray};
use crate::slides::SlidesSide;

/// The rays in every form that a side takes them in, made beforehand.
pub struct RaySet {
    pub kind: Kind,
    pub rays: Vec<Ray>,
    pub arrays: Arrays,
    pub packets_8: Vec<Packet<8>>,
    pub packets_16: Vec<Packet<16>>,
}

/// The rays as the arrays of bih-core, in the precision that all sides are given them in.
pub struct Arrays {
    pub origins: Vec<[f32; 3]>,
    pub directions: Vec<[f32; 3]>,
    pub t_max: Vec<f64>,
}

impl RaySet {
    pub fn new(kind: Kind, rays: Vec<Ray>) -> Self {
        let arrays = Arrays {
            origins: rays.iter().map(|ray| ray.origin).collect(),
            directions: rays.iter().map(|ray| ray.direction).collect(),
            t_max: rays.iter().map(|ray| f64::from(ray.t_max)).collect(),
        };
        let (packets_8, packets_16) = (Packet::all(&rays), Packet::all(&rays));
        Self { kind, rays, arrays, packets_8, packets_16 }
    }
}

/// How a side is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    /// All rays in one call, the side's own way.
    Batch,
    /// One ray at a time.
    Single,
    /// All rays of ours in flight, coherent or not.
    Flight,
    /// 2 x 2 rays of ours together.
    TwoByTwo,
    /// Packets of so many rays.
    Packet(usize),
    /// Packets that the side is told to be coherent.
    Coherent(usize),
}

impl Call {
    pub fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "batch" => Self::Batch,
            "1" => Self::Single,
            "flight" => Self::Flight,
            "2x2" => Self::TwoByTwo,
            "8" => Self::Packet(8),
            "16" => Self::Packet(16),
            "8c" => Self::Coherent(8),
            "16c" => Self::Coherent(16),
            _ => return None,
        })
    }
}

/// What came of a set of rays.
#[derive(Debug, Clone, PartialEq)]
pub enum Answers {
    Nearest(Vec<Found>),
    Hidden(Vec<bool>),
}

/// A built structure. Runs in the pool that it is called from.
pub trait Structure: Sync {
    /// Seconds, and the answers.
    fn trace(&self, rays: &RaySet, call: Call) -> (f64, Answers);

    /// Nodes and triangles a ray, the statistics of the tree: what the side tells of itself.
    fn facts(&self, _rays: Option<&RaySet>) -> serde_json::Map<String, serde_json::Value> {
        serde_json::Map::new()
    }
}

/// A way to build.
pub enum Side<'a> {
    Bih(BihSide),
    Embree(EmbreeSide<'a>),
    Obvhs(ObvhsSide),
    Slides(SlidesSide),
}

/// Whether there is a side of that name.
pub fn is_known(name: &str) -> bool {
    match name.split_once('/') {
        // Its qualities and flags are known without its library.
        Some(("embree", words)) => embree::settings(&words.split('/').collect::<Vec<_>>()).is_ok(),
        _ => Side::parse(name, None).is_ok(),
    }
}

impl<'a> Side<'a> {
    /// By its name, such as bih/wide, bvh, kd_tree, embree/medium/robust or obvhs/bvh2/fastest.
    pub fn parse(name: &str, device: Option<&'a Device>) -> Result<Self, String> {
        let mut parts = name.split('/');
        let peer = parts.next().unwrap_or_default();
        let options: Vec<_> = parts.collect();
        match (peer, device) {
            ("bih", _) => BihSide::parse(Bih, &options).map(Self::Bih),
            ("bvh", _) => BihSide::parse(Bvh, &options).map(Self::Bih),
            ("kd_tree", _) => BihSide::parse(KdTree, &options).map(Self::Bih),
            ("embree", Some(device)) => EmbreeSide::parse(&options, device).map(Self::Embree),
            ("embree", None) => Err("no --embree-libs".to_owned()),
            ("obvhs", _) => ObvhsSide::parse(&options).map(Self::Obvhs),
            ("slides", _) => SlidesSide::parse(&options).map(Self::Slides),
            _ => Err("neither bih, bvh, kd_tree, embree, obvhs nor slides".to_owned()),
        }
        .map_err(|reason| format!("{name}: {reason}"))
    }

    /// Seconds from the mesh's arrays to what can be traced, and that. Rust's sides build in the pool, Embree on the
    /// threads of its device.
    pub fn build<'m>(&'m self, mesh: &'m Mesh, pool: &ThreadPool) -> (f64, Box<dyn Structure + 'm>) {
        let start = Instant::now();
        let built: Box<dyn Structure + 'm> = match self {
            Self::Bih(side) => Box::new(pool.install(|| side.build(mesh))),
            Self::Embree(side) => Box::new(side.build(mesh)),
            Self::Obvhs(side) => Box::new(pool.install(|| side.build(mesh))),
            Self::Slides(side) => Box::new(side.build(mesh)),
        };
        (start.elapsed().as_secs_f64(), built)
    }
}
