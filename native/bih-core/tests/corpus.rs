//! The fuzz targets over the corpus that is kept: what `make fuzz` runs for longer, and everything it ever found.

use std::fs;
use std::path::Path;

#[path = "../../fuzz/src/lib.rs"]
mod targets;

fn replay(name: &str, target: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(name);
    let mut paths: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{}: no corpus", folder.display());
    for path in paths {
        // Said where it panics.
        println!("{}", path.display());
        target(&fs::read(&path).unwrap());
    }
}

/// Bytes that look random, the same each time.
fn made_up(number: u32) -> Vec<u8> {
    let byte =
        |i: u32| (i.wrapping_mul(0x9e37_79b9) ^ number.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 24;
    (0..number % 200).map(|i| byte(i) as u8).collect()
}

/// How many inputs are made up beside the corpus.
const MADE_UP: u32 = if cfg!(debug_assertions) { 20 } else { 200 };

#[test]
fn queries() {
    let all_trees = |data: &[u8]| targets::queries(data, 1);
    replay("queries", all_trees);
    (0..MADE_UP).for_each(|number| all_trees(&made_up(number)));
}

#[test]
fn saved() {
    replay("saved", targets::saved);
    (0..10 * MADE_UP).for_each(|number| targets::saved(&[&[1], &made_up(number)[..]].concat()));
}
