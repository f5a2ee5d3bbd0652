//! Whether answers are right: against a reference, ray by ray.

use serde_json::{Map, Value, json};

use crate::side::Answers;

/// Distances that differ by less, relatively, are the same hit: single precision's rounding of a distance that cancels.
const TOLERANCE: f32 = 1e-3;

/// How answers compare with those of the reference.
pub fn compare(answers: &Answers, reference: &Answers) -> Map<String, Value> {
    let mut counts = Map::new();
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
