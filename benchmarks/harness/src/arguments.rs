//! What the command line says.

use std::path::PathBuf;

use crate::rays::Kind;

pub const USAGE: &str = "bih-harness --mesh FILE [--embree-libs FOLDER] [--threads 2] [--rounds 5] [--seconds 20]
    [--build SIDE,…] [--trace SIDE[@CALL],…] [--rays primary,bounce,random,shadow,ambient,vertices,axis] [--image SIDE,…]
    [--samples 1,4,16] [--first SIDE,…] [--size 1024x768] [--json FILE]
bih-harness --knows SIDE,… prints those that there are.
SIDE: bih/wide, bih/classic/leaf4, bvh, bvh/compact/fast, kd_tree, embree/low, embree/medium/robust, embree/high/compact,
    obvhs/bvh2/fastest, slides/plain, slides/buckets, …
CALL: batch, 1, flight (ours), 2x2 (ours over binary nodes), 8, 16, 8c, 16c (packets; c: told to be coherent)
Each part times its sides in turn, round by round, and checks their answers.";

#[derive(Debug)]
pub struct Arguments {
    pub mesh: PathBuf,
    /// Pixels of the picture, multiples of 8.
    pub size: [usize; 2],
    pub embree_libs: Option<PathBuf>,
    pub threads: usize,
    pub rounds: usize,
    /// After so many seconds of one table no further round starts.
    pub seconds: f64,
    pub build: Vec<String>,
    pub trace: Vec<String>,
    pub rays: Vec<Kind>,
    pub image: Vec<String>,
    pub samples: Vec<u32>,
    /// Whose first picture is timed part by part.
    pub first: Vec<String>,
    pub json: Option<PathBuf>,
}

impl Arguments {
    pub fn parse(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self {
            mesh: PathBuf::new(),
            size: [1024, 768],
            embree_libs: None,
            threads: 2,
            rounds: 5,
            seconds: 20.0,
            build: Vec::new(),
            trace: Vec::new(),
            rays: vec![Kind::Primary, Kind::Bounce, Kind::Random, Kind::Shadow, Kind::Ambient],
            image: Vec::new(),
            samples: vec![1],
            first: Vec::new(),
            json: None,
        };
        let mut words = words;
        while let Some(name) = words.next() {
            let value = words.next().ok_or_else(|| format!("{name}: no value"))?;
            let list = || value.split(',').map(str::to_owned).collect();
            match name.as_str() {
                "--mesh" => arguments.mesh = value.into(),
                "--embree-libs" => arguments.embree_libs = Some(value.into()),
                "--threads" => arguments.threads = number(&name, &value)?,
                "--rounds" => arguments.rounds = number(&name, &value)?,
                "--seconds" => arguments.seconds = number(&name, &value)?,
                "--build" => arguments.build = list(),
                "--trace" => arguments.trace = list(),
                "--rays" => arguments.rays = value.split(',').map(kind).collect::<Result<_, _>>()?,
                "--image" => arguments.image = list(),
                "--samples" => {
                    arguments.samples = value.split(',').map(|count| number(&name, count)).collect::<Result<_, _>>()?;
                }
                "--first" => arguments.first = list(),
                "--size" => arguments.size = size(&value)?,
                "--json" => arguments.json = Some(value.into()),
                _ => return Err(format!("no option {name}")),
            }
        }
        if arguments.mesh.as_os_str().is_empty() { Err("no --mesh".to_owned()) } else { Ok(arguments) }
    }
}

fn number<T: std::str::FromStr>(name: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("{name}: {value:?} is no number"))
}

fn kind(name: &str) -> Result<Kind, String> {
    Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| format!("no rays {name:?}"))
}

fn size(value: &str) -> Result<[usize; 2], String> {
    let sides = value.split_once('x').and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    sides
        .filter(|sides: &[usize; 2]| sides.iter().all(|side| *side > 0 && side.is_multiple_of(8)))
        .ok_or_else(|| format!("--size: {value:?} is not WIDTHxHEIGHT in multiples of 8"))
}
