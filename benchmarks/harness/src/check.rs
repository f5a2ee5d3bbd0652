//! Whether answers are right: against a reference, ray by ray.

use serde_json::{Map, Value, json};

use crate::side::Answers;

/// Distances that differ by less, relatively, are the same hit: single precision's rounding of a distance that cancels.
const TOLERANCE: f32 = 1e-3;

/// How answers compare with those of the reference.
pub fn compare(answers: &Answers, reference: &Answers) -> Map<String, Value> {
    let mut counts = Map::new();
    counts.insert("digest".to_owned(), json!(format!("{:016x}", digest(answers))));
    let mut insert = |name: &str, count: usize| counts.insert(name.to_owned(), json!(count));
    match (answers, reference) {
        (Answers::Nearest(answers), Answers::Nearest(reference)) => {
            assert_eq!(answers.len(), reference.len());
            let pairs = || answers.iter().zip(reference);
            insert("hits", answers.iter().filter(|(t, _)| t.is_finite()).count());
            insert("missed", pairs().filter(|(a, b)| a.0.is_infinite() && b.0.is_finite()).count());
            insert("invented", pairs().filter(|(a, b)| a.0.is_finite() && b.0.is_infinite()).count());
            insert("nearer", pairs().filter(|(a, b)| a.0 < b.0 * (1.0 - TOLERANCE) && b.0.is_finite()).count());
            insert("farther", pairs().filter(|(a, b)| a.0 > b.0 * (1.0 + TOLERANCE) && a.0.is_finite()).count());
            insert("other_triangle", pairs().filter(|(a, b)| a.1 != b.1).count());
        }
        (Answers::Hidden(answers), Answers::Hidden(reference)) => {
            assert_eq!(answers.len(), reference.len());
            let pairs = || answers.iter().zip(reference);
            insert("hits", answers.iter().filter(|hidden| **hidden).count());
            insert("missed", pairs().filter(|(a, b)| !**a && **b).count());
            insert("invented", pairs().filter(|(a, b)| **a && !**b).count());
        }
        _ => unreachable!("both answer the same question"),
    }
    counts
}

/// FNV-1a over every bit of the answers: equal where they are the same.
fn digest(answers: &Answers) -> u64 {
    let mix = |hash: u64, word: u32| (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
    let start = 0xcbf2_9ce4_8422_2325;
    match answers {
        Answers::Nearest(found) => found.iter().fold(start, |hash, (t, row)| mix(mix(hash, t.to_bits()), *row)),
        Answers::Hidden(hidden) => hidden.iter().fold(start, |hash, hidden| mix(hash, u32::from(*hidden))),
    }
}
