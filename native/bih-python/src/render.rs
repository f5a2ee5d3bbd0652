//! Pictures.

use std::collections::HashMap;

use bih_core::render::{Light, Lighting, RenderOptions, Tile, Wanted, render as core_render};
use bih_core::simd::FloatEnvironment;
use numpy::{Element, PyArray, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{as_array, converted};
use crate::camera::Camera;
use crate::errors::GeometryError;
use crate::supervise::supervise;
use crate::tree::{Tree, count};

const PASSES: [&str; 6] = ["combined", "depth", "normal", "position", "triangle", "cost"];

/// Trace one picture in one call.
#[pyfunction]
#[pyo3(signature = (scene, camera, *, passes=vec!["combined".to_owned()], samples=1, seed=0, shadows=true, lights=None,
    tile=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
pub fn render<'py>(
    py: Python<'py>,
    scene: &Tree,
    camera: &Camera,
    passes: Vec<String>,
    samples: i64,
    seed: i64,
    shadows: bool,
    lights: Option<&Bound<'py, PyAny>>,
    tile: Option<[i64; 4]>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let _standard = FloatEnvironment::standard();
    if let Some(unknown) = passes.iter().find(|pass| !PASSES.contains(&pass.as_str())) {
        return Err(PyValueError::new_err(format!("passes: {unknown:?} is not one of {}", PASSES.join(", "))));
    }
    let samples = count("samples", samples, 1)?;
    let samples =
        u32::try_from(samples).map_err(|_| PyValueError::new_err(format!("samples: {samples} are too many")))?;
    let options = RenderOptions {
        tile: part(tile, camera)?,
        samples,
        seed: count("seed", seed, 0)? as u64,
        lighting: Lighting { lights: lights.map_or(Ok(Vec::new()), read_lights)?, shadows },
        wanted: wanted(&passes),
    };
    let picture = scene.with_triangles(py, |triangles| {
        supervise(py, scene.pool.as_ref(), progress, |control| {
            Ok(core_render(&scene.core, &triangles, &camera.inner, &options, control)?)
        })
    })??;
    let result = PyDict::new(py);
    let shape = [picture.height, picture.width];
    let mut arrays = HashMap::from([
        ("combined", channels(py, picture.combined, shape)?),
        ("depth", flat(py, picture.depth, shape, 1)?),
        ("normal", channels(py, picture.normal, shape)?),
        ("position", channels(py, picture.position, shape)?),
        ("triangle", flat(py, picture.triangle, shape, 1)?),
        ("cost", channels(py, picture.cost, shape)?),
    ]);
    for pass in &passes {
        if let Some(array) = arrays.remove(pass.as_str()) {
            result.set_item(pass, array)?;
        }
    }
    Ok(result)
}

fn wanted(passes: &[String]) -> Wanted {
    let is_wanted = |name: &str| passes.iter().any(|pass| pass == name);
    Wanted {
        combined: is_wanted("combined"),
        depth: is_wanted("depth"),
        normal: is_wanted("normal"),
        position: is_wanted("position"),
        triangle: is_wanted("triangle"),
        cost: is_wanted("cost"),
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

/// Rows of a structured array: kind, position, direction, colour.
fn read_lights(lights: &Bound<'_, PyAny>) -> PyResult<Vec<Light>> {
    let array = as_array("lights", lights)?;
    let rows = array.len();
    let field = |name: &str, columns: usize| -> PyResult<Vec<f64>> {
        let refuse =
            || GeometryError::new_err(format!("lights: expected a structured array (L,) with the field {name}"));
        let values = array.get_item(name).map_err(|_| refuse())?;
        let values = converted(&values, "float64")?.call_method1("reshape", (rows, columns)).map_err(|_| refuse())?;
        Ok(values.cast_into::<PyArray2<f64>>()?.try_readonly()?.as_slice()?.to_vec())
    };
    let (kinds, colours) = (field("kind", 1)?, field("colour", 3)?);
    let (positions, directions) = (field("position", 3)?, field("direction", 3)?);
    (0..rows)
        .map(|row| {
            let vector = |values: &[f64]| -> [f64; 3] { std::array::from_fn(|i| values[3 * row + i]) };
            let (position, direction, colour) = (vector(&positions), vector(&directions), vector(&colours));
            if let Some(x) = position.iter().chain(&direction).chain(&colour).find(|x| !x.is_finite()) {
                return Err(GeometryError::new_err(format!("lights: row {row} holds {x}")));
            }
            match kinds[row] {
                0.0 => Ok(Light::Sun { direction, irradiance: colour }),
                1.0 => Ok(Light::Point { position, power: colour }),
                kind => Err(GeometryError::new_err(format!("lights: row {row} is of kind {kind}; 0 sun or 1 point"))),
            }
        })
        .collect()
}
