//! The bucket sort before the construction: counters, prefix sums, and each key to its bucket.
//!
//! A bucket is a cell of the first twelve halvings. Each chunk of rows is sorted by itself, in the cache; then the
//! pieces of a bucket are put together, many buckets at a time.

use rayon::prelude::*;

use super::keys::Keys;
use crate::control::{Cancelled, Control};
use crate::pages;
use crate::simd::FloatEnvironment;

/// Halvings that the buckets stand for.
const BITS: u32 = 12;
const BUCKETS: usize = 1 << BITS;

/// The bits of a key by which it sorts.
pub const SORTED: u64 = !0 << (u64::BITS - BITS);

/// Meshes of at most this many triangles go without: docs/decisions/needs.md.
pub const WORTHWHILE: usize = 65_536;

/// Rows that are sorted by themselves.
const CHUNK: usize = 1 << 16;

/// The keys of a chunk, in the order of their buckets, and where each bucket starts and ends.
struct Chunk<'a> {
    keys: &'a [u64],
    starts: Vec<u32>,
}

/// All keys, in the order of their buckets. `scratch` has room for as many.
pub fn bucket_sort(keys: &Keys, scratch: &mut [u64], control: &Control) -> Result<Vec<u64>, Cancelled> {
    let chunks: Vec<Chunk> = keys
        .accepted
        .chunks(CHUNK, scratch)
        .into_par_iter()
        .map_init(Vec::new, |unsorted, (rows, sorted)| {
            let _standard = FloatEnvironment::standard();
            control.check()?;
            unsorted.resize(sorted.len(), 0);
            keys.fill(rows, unsorted);
            let starts = scatter(unsorted, sorted);
            Ok(Chunk { keys: sorted, starts })
        })
        .collect::<Result<_, Cancelled>>()?;

    let mut sorted = pages::zeroed(keys.accepted.len());
    groups(&chunks, &mut sorted).into_par_iter().for_each(|group| gather(&chunks, group));
    Ok(sorted)
}

#[inline(always)]
fn bucket(key: u64) -> usize {
    (key >> (u64::BITS - BITS)) as usize
}

fn scatter(unsorted: &[u64], sorted: &mut [u64]) -> Vec<u32> {
    let mut starts = vec![0u32; BUCKETS + 1];
    for &key in unsorted {
        starts[bucket(key)] += 1;
    }
    let mut sum = 0;
    for start in &mut starts {
        sum += std::mem::replace(start, sum);
    }
    let mut next = starts.clone();
    for &key in unsorted {
        let place = &mut next[bucket(key)];
        sorted[*place as usize] = key;
        *place += 1;
    }
    starts
}

/// Buckets that one piece of work puts together, and where they go.
struct Group<'a> {
    first: usize,
    end: usize,
    keys: &'a mut [u64],
}

fn groups<'a>(chunks: &[Chunk], mut keys: &'a mut [u64]) -> Vec<Group<'a>> {
    const LEAST: usize = 1 << 15;
    let mut groups = Vec::new();
    let (mut first, mut size) = (0, 0);
    for end in 1..=BUCKETS {
        size += chunks.iter().map(|chunk| (chunk.starts[end] - chunk.starts[end - 1]) as usize).sum::<usize>();
        if size >= LEAST || end == BUCKETS {
            let (mine, rest) = keys.split_at_mut(size);
            groups.push(Group { first, end, keys: mine });
            keys = rest;
            (first, size) = (end, 0);
        }
    }
    groups
}

fn gather(chunks: &[Chunk], group: Group) {
    let mut place = 0;
    for bucket in group.first..group.end {
        for Chunk { keys, starts } in chunks {
            let part = &keys[starts[bucket] as usize..starts[bucket + 1] as usize];
            group.keys[place..place + part.len()].copy_from_slice(part);
            place += part.len();
        }
    }
}
