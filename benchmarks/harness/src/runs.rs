//! The tables: building, and tracing each set of rays.

use std::time::Instant;

use rayon::ThreadPool;
use serde_json::{Map, Value, json};

use crate::arguments::Arguments;
use crate::check::compare;
use crate::embree::Device;
use crate::image::{Picture, by_bih, by_embree, differing};
use crate::memory::counted;
use crate::mesh::Mesh;
use crate::rays::{self, Found, Kind, Ray};
use crate::rounds::Rounds;
use crate::side::{Answers, Call, RaySet, Side, Structure};

/// Its answers are held to be the truth; tests prove them so, and Embree's robust ones are compared with them here.
const REFERENCE: &str = "bih/wide/watertight";

pub struct Bench<'a> {
    pub arguments: &'a Arguments,
    pub mesh: &'a Mesh,
    pub device: Option<&'a Device>,
    pub pool: &'a ThreadPool,
}

impl Bench<'_> {
    pub fn rounds(&self) -> Rounds {
        Rounds { count: self.arguments.rounds, seconds: self.arguments.seconds }
    }

    pub fn side(&self, name: &str) -> Result<Side<'_>, String> {
        Side::parse(name, self.device)
    }

    /// Seconds and bytes of each side's build.
    pub fn build(&self) -> Result<Value, String> {
        let names = &self.arguments.build;
        let sides = names.iter().map(|name| self.side(name)).collect::<Result<Vec<_>, _>>()?;
        let mut facts: Vec<Map<String, Value>> = vec![Map::new(); sides.len()];
        let clocks = self.rounds().run(sides.len(), |side| {
            let ((seconds, built), used) = counted(|| sides[side].build(self.mesh, self.pool));
            let facts = &mut facts[side];
            facts.insert("held_bytes".to_owned(), json!(used.held));
            facts.insert("peak_bytes".to_owned(), json!(used.peak));
            facts.extend(built.facts(None));
            seconds
        });
        let count = self.mesh.triangles.len() as f64;
        let mut table = Map::new();
        for ((name, clock), mut facts) in names.iter().zip(&clocks).zip(facts) {
            let bytes = |name: &str| facts.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN) / count;
            eprintln!(
                "build    {name:<28} {:9.2} ms  {:6.1} bytes a triangle, {:6.1} at the peak",
                1e3 * clock.median(),
                bytes("tree_bytes"),
                bytes("peak_bytes"),
            );
            facts.extend(clock.facts());
            table.insert(name.clone(), Value::Object(facts));
        }
        Ok(Value::Object(table))
    }

    /// Seconds of each set of rays through each side, and how many answers differ from the reference.
    pub fn trace(&self) -> Result<Value, String> {
        if self.arguments.trace.is_empty() {
            return Ok(json!({}));
        }
        let calls = self.arguments.trace.iter().map(|name| parse_call(name)).collect::<Result<Vec<_>, _>>()?;
        let mut names: Vec<&str> = vec![REFERENCE];
        for (name, _) in &calls {
            if !names.contains(name) {
                names.push(name);
            }
        }
        let sides = names.iter().map(|name| self.side(name)).collect::<Result<Vec<_>, _>>()?;
        let built: Vec<_> = sides.iter().map(|side| side.build(self.mesh, self.pool).1).collect();
        let structure = |name: &str| &built[names.iter().position(|other| *other == name).expect("it was built")];

        let primary = RaySet::new(Kind::Primary, rays::primary(&self.mesh.view));
        let found = match self.traced(&**structure(REFERENCE), &primary, Call::Batch).1 {
            Answers::Nearest(found) => found,
            Answers::Hidden(_) => unreachable!("primary rays have nearest hits"),
        };
        let mut table = Map::new();
        for &kind in &self.arguments.rays {
            let rays = RaySet::new(kind, self.rays(kind, &primary.rays, &found));
            let (_, reference) = self.traced(&**structure(REFERENCE), &rays, Call::Batch);
            let mut checks = vec![Map::new(); calls.len()];
            let clocks = self.rounds().run(calls.len(), |row| {
                let (name, call) = calls[row];
                let (seconds, answers) = self.traced(&**structure(name), &rays, call);
                if checks[row].is_empty() {
                    checks[row] = compare(&answers, &reference);
                }
                seconds
            });
            let mut rows = Map::new();
            for ((name, clock), mut facts) in self.arguments.trace.iter().zip(&clocks).zip(checks) {
                let rate = rays.rays.len() as f64 / clock.median();
                eprintln!("{:<8} {name:<28} {:9.2} Mrays/s  {}", kind.name(), 1e-6 * rate, shown(&facts));
                facts.extend(clock.facts());
                facts.insert("rays".to_owned(), json!(rays.rays.len()));
                facts.insert("rays_a_second".to_owned(), json!(rate));
                rows.insert(name.clone(), Value::Object(facts));
            }
            for name in &names {
                let costs = self.pool.install(|| structure(name).facts(Some(&rays)));
                if !costs.is_empty() {
                    rows.insert(format!("{name}@cost"), Value::Object(costs));
                }
            }
            table.insert(kind.name().to_owned(), Value::Object(rows));
        }
        Ok(Value::Object(table))
    }

    /// Seconds from the mesh to a picture, the build counted, and how many pixels differ from the first side's.
    pub fn image(&self) -> Result<Value, String> {
        let names = &self.arguments.image;
        let sides = names.iter().map(|name| self.side(name)).collect::<Result<Vec<_>, _>>()?;
        let mut table = Map::new();
        for &samples in &self.arguments.samples {
            let mut pictures = vec![Picture::new(); sides.len()];
            let mut failed = None;
            let clocks = self.rounds().run(sides.len(), |row| {
                let start = Instant::now();
                match self.picture(&sides[row], samples) {
                    Ok(picture) => pictures[row] = picture,
                    Err(reason) => failed = Some(format!("{}: {reason}", names[row])),
                }
                start.elapsed().as_secs_f64()
            });
            if let Some(reason) = failed {
                return Err(reason);
            }
            let mut rows = Map::new();
            for ((name, clock), picture) in names.iter().zip(&clocks).zip(&pictures) {
                let pixels = differing(picture, &pictures[0]);
                eprintln!("image {samples:>2} {name:<28} {:9.2} ms  {pixels} pixels differ", 1e3 * clock.median());
                let mut facts = clock.facts();
                facts.insert("differing_pixels".to_owned(), json!(pixels));
                rows.insert(name.clone(), Value::Object(facts));
            }
            table.insert(samples.to_string(), Value::Object(rows));
        }
        Ok(Value::Object(table))
    }

    fn picture(&self, side: &Side, samples: u32) -> Result<Picture, String> {
        match side {
            Side::Bih(side) => Ok(self.pool.install(|| by_bih(&side.build(self.mesh), &self.mesh.view, samples, true))),
            Side::Embree(side) => {
                let scene = side.build(self.mesh);
                Ok(self.pool.install(|| by_embree(&scene, self.mesh, samples)))
            }
            Side::Obvhs(_) | Side::Slides(_) => Err("takes no picture".to_owned()),
        }
    }

    fn rays(&self, kind: Kind, primary: &[Ray], found: &[Found]) -> Vec<Ray> {
        match kind {
            Kind::Primary => primary.to_vec(),
            Kind::Bounce => rays::bounce(self.mesh, primary, found),
            Kind::Random => rays::random(self.mesh),
            Kind::Shadow => rays::shadow(self.mesh, primary, found),
            Kind::Ambient => rays::ambient(self.mesh, primary, found),
            Kind::Vertices => rays::at_vertices(self.mesh),
            Kind::Axis => rays::along_axes(self.mesh),
        }
    }

    fn traced(&self, structure: &dyn Structure, rays: &RaySet, call: Call) -> (f64, Answers) {
        self.pool.install(|| structure.trace(rays, call))
    }
}

/// A side's name and how it is called.
fn parse_call(name: &str) -> Result<(&str, Call), String> {
    let (side, call) = name.split_once('@').unwrap_or((name, "batch"));
    Call::parse(call).map(|call| (side, call)).ok_or_else(|| format!("{name}: no call {call:?}"))
}

fn shown(facts: &Map<String, Value>) -> String {
    facts.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}
