//! The bucket sort before the construction: counters, prefix sums, and each key to its bucket.
//!
//! A bucket is a cell of the first twelve halvings. Each chunk of rows is sorted by itself, in the cache; then the
//! pieces of a bucket are put together, many buckets at a time.

use rayon::prelude::*;

use super::keys::Keys;
use crate::control::{Cancelled, Control};
use crate::simd::FloatEnvironment;

/// Halvings that the buckets stand for.
const BITS: u32 = 12;
const BUCKETS: usize = 1 << BITS;

/// The bits of a key by which it sorts.
pub const SORTED: u64 = !0 << (u64::BITS - BITS);

/// Meshes of at most this many triangles go without.
pub const WORTHWHILE: usize = 8192;

/// Rows that are sorted by themselves.
const CHUNK: usize = 1 << 16;

/// Where each bucket of a chunk starts, and its end.
type Starts = Vec<u32>;

/// All keys, in the order of their buckets. `scratch` has room for one number a row.
pub fn bucket_sort(keys: &Keys, scratch: &mut [u64], control: &Control) -> Result<Vec<u64>, Cancelled> {
    let rows = keys.triangles.len();
    let starts: Vec<Starts> = scratch[..rows]
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map_init(Vec::new, |unsorted, (chunk, sorted)| {
            let _standard = FloatEnvironment::standard();
            control.check()?;
            let first = chunk * CHUNK;
            unsorted.resize(sorted.len(), 0);
            let count = keys.fill(first..first + sorted.len(), unsorted);
            Ok(scatter(&unsorted[..count], sorted))
        })
        .collect::<Result<_, Cancelled>>()?;

    let mut sorted = vec![0; keys.len()];
    let scratch = &scratch[..rows];
    groups(&starts, &mut sorted).into_par_iter().for_each(|group| gather(&starts, scratch, group));
    Ok(sorted)
}

#[inline(always)]
fn bucket(key: u64) -> usize {
    (key >> (u64::BITS - BITS)) as usize
}

fn scatter(unsorted: &[u64], sorted: &mut [u64]) -> Starts {
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

fn groups<'a>(starts: &[Starts], mut keys: &'a mut [u64]) -> Vec<Group<'a>> {
    const LEAST: usize = 1 << 15;
    let mut groups = Vec::new();
    let (mut first, mut size) = (0, 0);
    for end in 1..=BUCKETS {
        size += starts.iter().map(|starts| (starts[end] - starts[end - 1]) as usize).sum::<usize>();
        if size >= LEAST || end == BUCKETS {
            let (mine, rest) = keys.split_at_mut(size);
            groups.push(Group { first, end, keys: mine });
            keys = rest;
            (first, size) = (end, 0);
        }
    }
    groups
}

fn gather(starts: &[Starts], scratch: &[u64], group: Group) {
    let mut place = 0;
    for bucket in group.first..group.end {
        for (chunk, starts) in scratch.chunks(CHUNK).zip(starts) {
            let piece = &chunk[starts[bucket] as usize..starts[bucket + 1] as usize];
            group.keys[place..place + piece.len()].copy_from_slice(piece);
            place += piece.len();
        }
    }
}
