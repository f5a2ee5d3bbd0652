//! Clocks: sides in turn, round by round, so that a slower minute of the machine is shared by all.

use std::time::Instant;

use serde_json::{Map, Value, json};

/// How often, and for how long.
#[derive(Debug, Clone, Copy)]
pub struct Rounds {
    pub count: usize,
    pub seconds: f64,
}

/// Seconds of each round.
#[derive(Debug, Clone, Default)]
pub struct Clock(Vec<f64>);

impl Rounds {
    /// Let each of `sides` be timed once a round, after a round that warms up and is not counted; every other round
    /// backwards, so that no side always follows the same one.
    pub fn run(self, sides: usize, mut time: impl FnMut(usize) -> f64) -> Vec<Clock> {
        let mut clocks = vec![Clock::default(); sides];
        let start = Instant::now();
        for round in 0..=self.count {
            for turn in 0..sides {
                let side = if round % 2 == 0 { turn } else { sides - 1 - turn };
                let seconds = time(side);
                if round > 0 {
                    clocks[side].0.push(seconds);
                }
            }
            if round > 0 && start.elapsed().as_secs_f64() > self.seconds {
                break;
            }
        }
        clocks
    }
}

impl Clock {
    pub fn add(&mut self, seconds: f64) {
        self.0.push(seconds);
    }

    pub fn median(&self) -> f64 {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        if sorted.len().is_multiple_of(2) { 0.5 * (sorted[middle - 1] + sorted[middle]) } else { sorted[middle] }
    }

    pub fn facts(&self) -> Map<String, Value> {
        let mut facts = Map::new();
        facts.insert("seconds".to_owned(), json!(self.median()));
        facts.insert("least".to_owned(), json!(self.0.iter().copied().fold(f64::INFINITY, f64::min)));
        facts.insert("rounds".to_owned(), json!(self.0));
        facts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_take_turns_and_the_first_round_does_not_count() {
        let mut turns = Vec::new();
        let clocks = Rounds { count: 3, seconds: 60.0 }.run(2, |side| {
            turns.push(side);
            (turns.len() * 10) as f64
        });
        assert_eq!(turns, [0, 1, 1, 0, 0, 1, 1, 0]);
        assert_eq!(clocks[0].0, [40.0, 50.0, 80.0]);
        assert_eq!((clocks[0].median(), clocks[1].median()), (50.0, 60.0));
    }

    #[test]
    fn one_round_is_counted_however_long_it_takes() {
        let clocks = Rounds { count: 3, seconds: 0.0 }.run(1, |_| 1.0);
        assert_eq!(clocks[0].0, [1.0]);
    }

    #[test]
    fn the_median_of_an_even_number_is_between_two() {
        assert_eq!(Clock(vec![4.0, 1.0, 3.0, 2.0]).median(), 2.5);
    }
}
