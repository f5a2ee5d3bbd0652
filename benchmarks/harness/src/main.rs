//! Times bih-core beside its peers on one mesh and checks their answers: `bih-harness --help`.

#![deny(unsafe_code)]

mod arguments;
mod bih;
mod check;
#[expect(unsafe_code, reason = "Embree has a C interface")]
mod embree;
mod first;
mod image;
#[expect(unsafe_code, reason = "an allocator's functions are unsafe to call")]
mod memory;
mod mesh;
mod obvhs;
mod rays;
mod rounds;
mod runs;
mod side;
mod slides;
mod vector;

use std::process::ExitCode;

use rayon::ThreadPoolBuilder;
use serde_json::{Value, json};

use arguments::{Arguments, USAGE};
use embree::Device;
use mesh::Mesh;
use runs::Bench;

#[global_allocator]
static ALLOCATOR: memory::Counting = memory::Counting;

fn main() -> ExitCode {
    let words: Vec<_> = std::env::args().skip(1).collect();
    if words.iter().any(|word| word == "--help") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    if let [option, names] = &words[..]
        && option == "--knows"
    {
        for name in names.split(',').filter(|name| side::is_known(name)) {
            println!("{name}");
        }
        return ExitCode::SUCCESS;
    }
    match Arguments::parse(words.into_iter()).and_then(|arguments| run(&arguments)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("{reason}\n{USAGE}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let mesh = Mesh::read(&arguments.mesh, arguments.size)
        .map_err(|error| format!("{}: {error}", arguments.mesh.display()))?;
    let device = match &arguments.embree_libs {
        Some(folder) => Some(Device::new(folder, arguments.threads)?),
        None => None,
    };
    let pool = ThreadPoolBuilder::new().num_threads(arguments.threads).build().map_err(|error| error.to_string())?;
    let bench = Bench { arguments, mesh: &mesh, device: device.as_ref(), pool: &pool };
    let results = json!({
        "mesh": arguments.mesh.file_stem().map(|name| name.to_string_lossy()),
        "triangles": mesh.triangles.len(),
        "threads": arguments.threads,
        "embree": device.as_ref().map(Device::version),
        "instruction_set": bih_core::simd::instruction_sets()[0].name(),
        "build": bench.build()?,
        "trace": bench.trace()?,
        "image": bench.image()?,
        "first": bench.first()?,
    });
    write(arguments, &results)
}

fn write(arguments: &Arguments, results: &Value) -> Result<(), String> {
    let Some(path) = &arguments.json else { return Ok(()) };
    std::fs::write(path, format!("{results:#}\n")).map_err(|error| format!("{}: {error}", path.display()))
}
