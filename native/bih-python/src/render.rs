//! Pictures.

use std::collections::HashMap;

use bih_core::instances::SceneTracer;
use bih_core::render::{Lighting, Passes, RenderOptions, Tile, Wanted, render as core_render};
use bih_core::simd::FloatEnvironment;
use bih_core::traverse::Tracer;
use numpy::{Element, PyArray, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::appearance::{MeshArrays, meshes_of_trees, of_scene, of_tree};
use crate::camera::Camera;
use crate::errors::GeometryError;
use crate::lights::read_lights;
use crate::scene::{Scene, with_models};
use crate::supervise::supervise;
use crate::tree::{State, Tree, count};

const PASSES: [&str; 9] =
    ["combined", "depth", "normal", "position", "triangle", "instance", "object_index", "material_index", "cost"];

/// Trace one picture in one call.
#[pyfunction]
#[pyo3(signature = (scene, camera, *, passes=vec!["combined".to_owned()], samples=1, first_sample=0, seed=0,
    shadows=true, ambient_occlusion=false, ambient_occlusion_distance=f64::INFINITY, lights=None, ambient=None, background=None,
    surfaces=None, objects=None, materials=None, corner_normals=None, tile=None, progress=None),
    text_signature = "(scene, camera, *, passes=['combined'], samples=1, first_sample=0, seed=0, shadows=True, \
ambient_occlusion=False, ambient_occlusion_distance=1e999, lights=None, ambient=None, background=None, surfaces=None, objects=None, \
materials=None, corner_normals=None, tile=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn render<'py>(
    py: Python<'py>,
    scene: &Bound<'py, PyAny>,
    camera: &Camera,
    passes: Vec<String>,
    samples: i64,
    first_sample: i64,
    seed: i64,
    shadows: bool,
    ambient_occlusion: bool,
    ambient_occlusion_distance: f64,
    lights: Option<&Bound<'py, PyAny>>,
    ambient: Option<[f64; 3]>,
    background: Option<[f64; 4]>,
    surfaces: Option<&Bound<'py, PyAny>>,
    objects: Option<&Bound<'py, PyAny>>,
    materials: Option<&Bound<'py, PyAny>>,
    corner_normals: Option<&Bound<'py, PyAny>>,
    tile: Option<[i64; 4]>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let _standard = FloatEnvironment::standard();
    if let Some(unknown) = passes.iter().find(|pass| !PASSES.contains(&pass.as_str())) {
        return Err(PyValueError::new_err(format!("passes: {unknown:?} is not one of {}", PASSES.join(", "))));
    }
    let [first_sample, samples] = sample_range(first_sample, samples)?;
    let background = background.unwrap_or_default();
    check_finite("ambient", &ambient.unwrap_or_default())?;
    check_finite("background", &background)?;
    if ambient_occlusion_distance.is_nan() || ambient_occlusion_distance <= 0.0 {
        let text = format!("ambient_occlusion_distance: {ambient_occlusion_distance} is not above 0");
        return Err(GeometryError::new_err(text));
    }
    let options = RenderOptions {
        tile: part(tile, camera)?,
        samples,
        first_sample,
        seed: count("seed", seed, 0)? as u64,
        lighting: Lighting {
            lights: lights.map_or(Ok(Vec::new()), read_lights)?,
            shadows,
            ambient,
            occlusion: ambient_occlusion.then_some(ambient_occlusion_distance),
        },
        background,
        wanted: wanted(&passes),
    };
    let look = Look { surfaces, objects, materials, corner_normals };
    let picture = if let Ok(scene) = scene.cast::<Scene>() {
        picture_of_scene(py, scene.get(), camera, &options, &look, progress)?
    } else if let Ok(tree) = scene.cast::<Tree>() {
        picture_of_tree(py, tree.get(), camera, &options, &look, progress)?
    } else {
        let name = scene.get_type().name()?;
        return Err(PyTypeError::new_err(format!("scene: {name} is neither a bihtree.Tree nor a bihtree.Scene")));
    };
    let result = PyDict::new(py);
    let shape = [picture.height, picture.width];
    let mut arrays = HashMap::from([
        ("combined", channels(py, picture.combined, shape)?),
        ("depth", flat(py, picture.depth, shape, 1)?),
        ("normal", channels(py, picture.normal, shape)?),
        ("position", channels(py, picture.position, shape)?),
        ("triangle", flat(py, picture.triangle, shape, 1)?),
        ("instance", flat(py, picture.instance, shape, 1)?),
        ("object_index", flat(py, picture.object_index, shape, 1)?),
        ("material_index", flat(py, picture.material_index, shape, 1)?),
        ("cost", channels(py, picture.cost, shape)?),
    ]);
    for pass in &passes {
        if let Some(array) = arrays.remove(pass.as_str()) {
            result.set_item(pass, array)?;
        }
    }
    Ok(result)
}

/// How what is hit looks, as the caller gives it.
struct Look<'a, 'py> {
    surfaces: Option<&'a Bound<'py, PyAny>>,
    objects: Option<&'a Bound<'py, PyAny>>,
    materials: Option<&'a Bound<'py, PyAny>>,
    corner_normals: Option<&'a Bound<'py, PyAny>>,
}

fn picture_of_tree(
    py: Python<'_>,
    tree: &Tree,
    camera: &Camera,
    options: &RenderOptions,
    look: &Look<'_, '_>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Passes> {
    let State { core, mesh: triangles } = &*tree.state();
    let rows = triangles.with_triangles(py, |triangles| triangles.len())?;
    let mesh = MeshArrays::new(look.materials, look.corner_normals, rows)?;
    let appearance = of_tree(look.surfaces, look.objects, &mesh, rows)?;
    triangles.with_triangles(py, |triangles| {
        let traced = Tracer::new(core, &triangles);
        supervise(py, tree.pool.as_ref(), progress, |control| {
            core_render(&traced, &appearance, &camera.inner, options, control)
        })
    })?
}

fn picture_of_scene(
    py: Python<'_>,
    scene: &Scene,
    camera: &Camera,
    options: &RenderOptions,
    look: &Look<'_, '_>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Passes> {
    let placed = scene.placed();
    with_models(py, &placed.trees, |models| {
        let counts: Vec<_> = models.iter().map(|model| model.triangles.len()).collect();
        let meshes = meshes_of_trees(look.materials, look.corner_normals, &counts)?;
        let appearance = of_scene(look.surfaces, look.objects, &meshes, scene.rows())?;
        let traced = SceneTracer { scene: &placed.core, models };
        supervise(py, scene.pool(), progress, |control| {
            core_render(&traced, &appearance, &camera.inner, options, control)
        })
    })
}

fn wanted(passes: &[String]) -> Wanted {
    let is_wanted = |name: &str| passes.iter().any(|pass| pass == name);
    Wanted {
        combined: is_wanted("combined"),
        depth: is_wanted("depth"),
        normal: is_wanted("normal"),
        position: is_wanted("position"),
        triangle: is_wanted("triangle"),
        instance: is_wanted("instance"),
        object_index: is_wanted("object_index"),
        material_index: is_wanted("material_index"),
        cost: is_wanted("cost"),
    }
}

/// The first sample and how many there are: their numbers are of 32 bits.
fn sample_range(first: i64, samples: i64) -> PyResult<[u32; 2]> {
    let (start, number) = (count("first_sample", first, 0)?, count("samples", samples, 1)?);
    match [start, number, start.saturating_add(number)].map(u32::try_from) {
        [Ok(start), Ok(number), Ok(_)] => Ok([start, number]),
        _ => Err(PyValueError::new_err(format!("samples: {number} are too many from first_sample {start} on"))),
    }
}

fn check_finite(name: &str, numbers: &[f64]) -> PyResult<()> {
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(GeometryError::new_err(format!("{name}: holds {x}"))),
        None => Ok(()),
    }
}

/// One pass as (height, width, channels), the same memory; without rows where it is empty.
fn channels<T: Element, const N: usize>(
    py: Python<'_>,
    values: Vec<[T; N]>,
    shape: [usize; 2],
) -> PyResult<Bound<'_, PyAny>> {
    flat(py, values.into_flattened(), shape, N)
}

fn flat<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    [height, width]: [usize; 2],
    channels: usize,
) -> PyResult<Bound<'_, PyAny>> {
    let height = if values.is_empty() { 0 } else { height };
    Ok(PyArray::from_vec(py, values).reshape([height, width, channels])?.into_any())
}

/// The part of the picture to render, within it.
fn part(tile: Option<[i64; 4]>, camera: &Camera) -> PyResult<Tile> {
    let (columns, rows) = (camera.inner.width(), camera.inner.height());
    let Some([x, y, width, height]) = tile else {
        return Ok(Tile { x: 0, y: 0, width: columns, height: rows });
    };
    let fits = |start: i64, size: i64, whole: u32| start >= 0 && size >= 1 && size <= i64::from(whole) - start;
    if !fits(x, width, columns) || !fits(y, height, rows) {
        let tile = (x, y, width, height);
        return Err(GeometryError::new_err(format!("tile: {tile:?} does not lie within {columns} x {rows} pixels")));
    }
    Ok(Tile { x: x as u32, y: y as u32, width: width as u32, height: height as u32 })
}
