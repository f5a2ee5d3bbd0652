//! Rays through a scene: one by one, or in packets.

use std::ffi::c_int;
use std::ptr::null_mut;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use super::flush::Flushed;
use super::library::{Arguments, Functions, Handle};
use super::packets::{Lanes, Packet};
use crate::rays::{Found, Ray};
use crate::side::{Answers, Call, RaySet, Structure};

const CHUNK: usize = 1024;
const INVALID: u32 = u32::MAX;

pub struct EmbreeScene<'m> {
    pub(super) functions: &'m Functions,
    pub(super) handle: Handle,
    pub(super) bytes: usize,
    pub(super) peak_bytes: usize,
}

// SAFETY: a committed scene may be traced from any number of threads.
unsafe impl Sync for EmbreeScene<'_> {}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: it is released once.
        unsafe { (self.functions.release_scene)(self.handle) };
    }
}

/// RTCRayHit. Its last words are the instances of a scene in a scene.
#[repr(C, align(16))]
struct RayHit {
    origin: [f32; 3],
    t_min: f32,
    direction: [f32; 3],
    time: f32,
    t_max: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    triangle: u32,
    geometry: u32,
    instance: [u32; 2],
}

impl RayHit {
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin,
            t_min: ray.t_min,
            direction: ray.direction,
            time: 0.0,
            t_max: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            u: 0.0,
            v: 0.0,
            triangle: INVALID,
            geometry: INVALID,
            instance: [INVALID; 2],
        }
    }
}

/// RTCRayHit8 and RTCRayHit16.
#[repr(C, align(64))]
pub struct PacketHit<const N: usize> {
    origin: [Lanes<f32, N>; 3],
    t_min: Lanes<f32, N>,
    direction: [Lanes<f32, N>; 3],
    time: Lanes<f32, N>,
    pub t: Lanes<f32, N>,
    mask: Lanes<u32, N>,
    id: Lanes<u32, N>,
    flags: Lanes<u32, N>,
    pub normal: [Lanes<f32, N>; 3],
    uv: [Lanes<f32, N>; 2],
    pub triangle: Lanes<u32, N>,
    geometry: Lanes<u32, N>,
    instance: [Lanes<u32, N>; 2],
}

impl<const N: usize> PacketHit<N> {
    fn new(packet: &Packet<N>) -> Self {
        Self {
            origin: packet.origin,
            t_min: packet.t_min,
            direction: packet.direction,
            time: [0.0; N],
            t: packet.t_max,
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
            normal: [[0.0; N]; 3],
            uv: [[0.0; N]; 2],
            triangle: [INVALID; N],
            geometry: [INVALID; N],
            instance: [[INVALID; N]; 2],
        }
    }
}

impl EmbreeScene<'_> {
    fn nearest(&self, ray: &Ray) -> Found {
        let mut query = RayHit::new(ray);
        // SAFETY: the scene is committed, the query is an RTCRayHit; without arguments the defaults hold.
        unsafe { (self.functions.intersect_1)(self.handle, (&raw mut query).cast(), null_mut()) };
        if query.triangle == INVALID { (f32::INFINITY, INVALID) } else { (query.t_max, query.triangle) }
    }

    fn is_hidden(&self, ray: &Ray) -> bool {
        let mut query = RayHit::new(ray);
        // SAFETY: the scene is committed, the query starts with an RTCRay.
        unsafe { (self.functions.occluded_1)(self.handle, (&raw mut query).cast(), null_mut()) };
        query.t_max < 0.0
    }

    /// The nearest hits of a packet; `triangle` is `u32::MAX` for a miss.
    pub fn nearest_of<const N: usize>(&self, packet: &Packet<N>, arguments: &mut Arguments) -> PacketHit<N> {
        let mut query = PacketHit::new(packet);
        self.call::<N>(&packet.valid, &mut query, arguments, false);
        query
    }

    /// A negative `t` where anything is hit.
    pub fn hidden_of<const N: usize>(&self, packet: &Packet<N>, arguments: &mut Arguments) -> Lanes<f32, N> {
        let mut query = PacketHit::new(packet);
        self.call::<N>(&packet.valid, &mut query, arguments, true);
        query.t
    }

    fn call<const N: usize>(
        &self,
        valid: &Lanes<i32, N>,
        query: &mut PacketHit<N>,
        arguments: &mut Arguments,
        is_any: bool,
    ) {
        let functions = self.functions;
        let function = match (N, is_any) {
            (8, false) => functions.intersect_8,
            (8, true) => functions.occluded_8,
            (16, false) => functions.intersect_16,
            (16, true) => functions.occluded_16,
            _ => unreachable!("Embree has packets of 8 and 16 here"),
        };
        let valid: *const c_int = valid.as_ptr();
        // SAFETY: the scene is committed; mask and query have N lanes, aligned to 64 bytes by `Packet` and `PacketHit`.
        unsafe { function(valid, self.handle, (&raw mut *query).cast(), arguments) };
    }

    fn trace_packets<const N: usize>(&self, rays: &RaySet, packets: &[Packet<N>], is_coherent: bool) -> (f64, Answers) {
        let count = rays.rays.len();
        if rays.kind.is_any() {
            let mut hidden = vec![false; count];
            let start = Instant::now();
            hidden.par_chunks_mut(CHUNK).zip(packets.par_chunks(CHUNK / N)).for_each(|(hidden, packets)| {
                let _flushed = Flushed::new();
                let mut arguments = Arguments::new(is_coherent);
                for (packet, hidden) in packets.iter().zip(hidden.chunks_mut(N)) {
                    let t = self.hidden_of(packet, &mut arguments);
                    for (slot, t) in hidden.iter_mut().zip(t) {
                        *slot = t < 0.0;
                    }
                }
            });
            (start.elapsed().as_secs_f64(), Answers::Hidden(hidden))
        } else {
            let mut found = vec![(f32::INFINITY, INVALID); count];
            let start = Instant::now();
            found.par_chunks_mut(CHUNK).zip(packets.par_chunks(CHUNK / N)).for_each(|(found, packets)| {
                let _flushed = Flushed::new();
                let mut arguments = Arguments::new(is_coherent);
                for (packet, found) in packets.iter().zip(found.chunks_mut(N)) {
                    let query = self.nearest_of(packet, &mut arguments);
                    for (lane, slot) in found.iter_mut().enumerate() {
                        let triangle = query.triangle[lane];
                        *slot = (if triangle == INVALID { f32::INFINITY } else { query.t[lane] }, triangle);
                    }
                }
            });
            (start.elapsed().as_secs_f64(), Answers::Nearest(found))
        }
    }

    fn trace_singles(&self, rays: &RaySet) -> (f64, Answers) {
        fn each<A: Send>(rays: &[Ray], answers: &mut [A], answer: impl Fn(&Ray) -> A + Sync) {
            answers.par_chunks_mut(CHUNK).zip(rays.par_chunks(CHUNK)).for_each(|(answers, rays)| {
                let _flushed = Flushed::new();
                for (slot, ray) in answers.iter_mut().zip(rays) {
                    *slot = answer(ray);
                }
            });
        }
        if rays.kind.is_any() {
            let mut hidden = vec![false; rays.rays.len()];
            let start = Instant::now();
            each(&rays.rays, &mut hidden, |ray| self.is_hidden(ray));
            (start.elapsed().as_secs_f64(), Answers::Hidden(hidden))
        } else {
            let mut found = vec![(f32::INFINITY, INVALID); rays.rays.len()];
            let start = Instant::now();
            each(&rays.rays, &mut found, |ray| self.nearest(ray));
            (start.elapsed().as_secs_f64(), Answers::Nearest(found))
        }
    }
}

impl Structure for EmbreeScene<'_> {
    fn trace(&self, rays: &RaySet, call: Call) -> (f64, Answers) {
        match call {
            Call::Packet(8) => self.trace_packets(rays, &rays.packets_8, false),
            Call::Coherent(8) => self.trace_packets(rays, &rays.packets_8, true),
            Call::Packet(_) => self.trace_packets(rays, &rays.packets_16, false),
            Call::Coherent(_) => self.trace_packets(rays, &rays.packets_16, true),
            Call::Single | Call::Flight | Call::TwoByTwo | Call::Batch => self.trace_singles(rays),
        }
    }

    fn facts(&self, rays: Option<&RaySet>) -> Map<String, Value> {
        let mut facts = Map::new();
        if rays.is_none() {
            facts.insert("tree_bytes".to_owned(), json!(self.bytes));
            facts.insert("peak_bytes".to_owned(), json!(self.peak_bytes));
        }
        facts
    }
}
