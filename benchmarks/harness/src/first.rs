//! The first picture of a tree, part by part: the build, the picture, and the same picture twice again, since what rays
//! come to a second time is finished then. And what is built after the first.

use std::fs;
use std::time::Instant;

use serde_json::{Map, Value, json};

use crate::bih::BihSide;
use crate::image::{Picture, by_bih, differing};
use crate::rounds::Clock;
use crate::runs::Bench;
use crate::side::Side;

/// What is timed in each round.
const PARTS: [&str; 5] = ["image", "build", "first", "second", "third"];

/// Of one side: the clocks of its parts, the processor's time of all threads in them, the facts of its tree, and its
/// picture.
#[derive(Default)]
struct Row {
    clocks: [Clock; PARTS.len()],
    processor: [Clock; PARTS.len()],
    facts: Map<String, Value>,
    picture: Picture,
}

impl Bench<'_> {
    /// With shadows and with primary rays alone.
    pub fn first(&self) -> Result<Value, String> {
        let names = &self.arguments.first;
        let sides = names.iter().map(|name| self.side(name)).collect::<Result<Vec<_>, _>>()?;
        let mut table = Map::new();
        for (kind, shadows) in [("shadows", true), ("primary", false)] {
            if names.is_empty() {
                break;
            }
            let mut rows: Vec<Row> = names.iter().map(|_| Row::default()).collect();
            self.rounds().run(sides.len(), |side| match &sides[side] {
                Side::Bih(bih) => self.take(bih, shadows, &mut rows[side]),
                _ => f64::NAN,
            });
            let mut shown = Map::new();
            let reference = rows.first().map(|row| row.picture.clone()).unwrap_or_default();
            for (name, mut row) in names.iter().zip(rows) {
                let mut facts = std::mem::take(&mut row.facts);
                let [image, build, first, second, third] = row.clocks.each_ref().map(|clock| 1e3 * clock.median());
                let different = differing(&row.picture, &reference);
                eprintln!(
                    "{kind:<8} {name:<28} {image:9.2} ms: build {build:9.2}, first {first:9.2}, second {second:9.2}, \
                     third {third:9.2}; {different} differ; {}",
                    Value::Object(facts.clone())
                );
                facts.insert("differing_pixels".to_owned(), json!(different));
                for (part, (clock, processor)) in PARTS.into_iter().zip(row.clocks.iter().zip(&row.processor)) {
                    let mut timed = clock.facts();
                    timed.insert("processor".to_owned(), Value::Object(processor.facts()));
                    facts.insert(part.to_owned(), Value::Object(timed));
                }
                shown.insert(name.clone(), Value::Object(facts));
            }
            table.insert(kind.to_owned(), Value::Object(shown));
        }
        Ok(Value::Object(table))
    }

    /// One round of a side; the first one, which warms up, gives the facts.
    fn take(&self, side: &BihSide, shadows: bool, row: &mut Row) -> f64 {
        let view = &self.mesh.view;
        self.pool.install(|| {
            let start = Moment::now();
            let built = side.build(self.mesh);
            let build = start.elapsed();
            let before = built.tree.stats();
            let picture = by_bih(&built, view, 1, shadows);
            let image = start.elapsed();
            let after = built.tree.stats();
            let [second, third] = [(); 2].map(|()| {
                let again = Moment::now();
                let same = by_bih(&built, view, 1, shadows);
                let seconds = again.elapsed();
                assert!(picture == same, "one tree, one picture");
                seconds
            });
            let first = std::array::from_fn(|clock| image[clock] - build[clock]);
            if row.picture.is_empty() {
                row.picture = picture;
                for (name, value) in [
                    ("pieces", before.unbuilt),
                    ("unbuilt", after.unbuilt),
                    ("tree_bytes", after.tree_bytes),
                    ("bound_bytes", after.bound_bytes),
                ] {
                    row.facts.insert(name.to_owned(), json!(value));
                }
                row.facts.insert("build_seconds".to_owned(), json!(after.build_seconds));
            } else {
                for (part, [seconds, processor]) in [image, build, first, second, third].into_iter().enumerate() {
                    row.clocks[part].add(seconds);
                    row.processor[part].add(processor);
                }
            }
            image[0]
        })
    }
}

/// On the clock, and in the processor's time of all threads that there are.
struct Moment(Instant, f64);

impl Moment {
    fn now() -> Self {
        Self(Instant::now(), processor())
    }

    /// Seconds of both.
    fn elapsed(&self) -> [f64; 2] {
        [self.0.elapsed().as_secs_f64(), processor() - self.1]
    }
}

/// Seconds that the threads have run, as Linux counts them; elsewhere 0.
fn processor() -> f64 {
    let nanoseconds = |task: fs::DirEntry| -> Option<f64> {
        let text = fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse().ok()
    };
    let tasks = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    1e-9 * tasks.filter_map(nanoseconds).sum::<f64>()
}
