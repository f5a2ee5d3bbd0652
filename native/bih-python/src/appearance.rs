//! Surfaces, objects, material slots and corner normals, checked: how what is hit looks.

use std::collections::HashSet;

use bih_core::render::{Appearance, MeshLook, Object, Surface};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{as_array, converted, kind, wrong};
use crate::errors::GeometryError;
use crate::rows::Rows;

const HIDDEN: u8 = 1;
const NO_SHADOW: u8 = 2;
const HOLDOUT: u8 = 4;

/// What the caller gives for the triangles of one tree, borrowed.
pub struct MeshArrays<'py> {
    materials: Option<PyReadonlyArray1<'py, i32>>,
    corner_normals: Option<PyReadonlyArray3<'py, f32>>,
}

impl<'py> MeshArrays<'py> {
    /// Both have one row for each of the tree's triangles.
    pub fn new(
        materials: Option<&Bound<'py, PyAny>>,
        corner_normals: Option<&Bound<'py, PyAny>>,
        triangles: usize,
    ) -> PyResult<Self> {
        Ok(Self {
            materials: materials.map(|slots| read_materials(slots, triangles)).transpose()?,
            corner_normals: corner_normals.map(|normals| read_normals(normals, triangles)).transpose()?,
        })
    }

    pub fn look(&self) -> PyResult<MeshLook<'_>> {
        Ok(MeshLook {
            materials: self.materials.as_ref().map(|slots| slots.as_slice()).transpose()?,
            corner_normals: match &self.corner_normals {
                Some(normals) => Some(bytemuck::cast_slice(normals.as_slice()?)),
                None => None,
            },
        })
    }
}

fn read_materials<'py>(value: &Bound<'py, PyAny>, triangles: usize) -> PyResult<PyReadonlyArray1<'py, i32>> {
    let array = as_array("materials", value)?;
    if array.shape() != [triangles] || kind(&array) != 'i' || array.dtype().getattr("itemsize")?.extract::<usize>()? > 4
    {
        return wrong("materials", &format!("({triangles},) int32"), &array);
    }
    Ok(converted(&array, "int32")?.cast_into::<PyArray1<i32>>()?.try_readonly()?)
}

fn read_normals<'py>(value: &Bound<'py, PyAny>, triangles: usize) -> PyResult<PyReadonlyArray3<'py, f32>> {
    let array = as_array("corner_normals", value)?;
    if array.shape() != [triangles, 3, 3] || kind(&array) != 'f' {
        return wrong("corner_normals", &format!("({triangles}, 3, 3) floats"), &array);
    }
    Ok(converted(&array, "float32")?.cast_into::<PyArray3<f32>>()?.try_readonly()?)
}

/// The looks of a tree's objects, which are ranges of its triangles.
pub fn of_tree<'a>(
    surfaces: Option<&Bound<'_, PyAny>>,
    objects: Option<&Bound<'_, PyAny>>,
    mesh: &'a MeshArrays<'_>,
    triangles: usize,
) -> PyResult<Appearance<'a>> {
    let (objects, first_triangles) = match objects {
        Some(value) => {
            let rows = Rows::new("objects", value)?;
            let first = rows.whole_or::<u32>("first_triangle", 0)?;
            check_ranges(&first, triangles)?;
            (read_objects(&rows)?, Some(first))
        }
        None => (Vec::new(), None),
    };
    let surfaces = surfaces.map_or(Ok(Vec::new()), read_surfaces)?;
    let appearance = Appearance { surfaces, objects, first_triangles, meshes: vec![mesh.look()?] };
    appearance.check([(0, 0)].into_iter(), triangles).map_err(|error| GeometryError::new_err(error.to_string()))?;
    Ok(appearance)
}

/// What is given for the triangles of each of some trees: nothing, or a sequence of arrays, some of them None.
pub fn meshes_of_trees<'py>(
    materials: Option<&Bound<'py, PyAny>>,
    corner_normals: Option<&Bound<'py, PyAny>>,
    triangles: &[usize],
) -> PyResult<Vec<MeshArrays<'py>>> {
    let (materials, normals) = (
        one_a_tree("materials", materials, triangles.len())?,
        one_a_tree("corner_normals", corner_normals, triangles.len())?,
    );
    triangles
        .iter()
        .zip(materials.iter().zip(&normals))
        .map(|(&triangles, (materials, normals))| MeshArrays::new(materials.as_ref(), normals.as_ref(), triangles))
        .collect()
}

fn one_a_tree<'py>(
    name: &str,
    values: Option<&Bound<'py, PyAny>>,
    trees: usize,
) -> PyResult<Vec<Option<Bound<'py, PyAny>>>> {
    let Some(values) = values else { return Ok(vec![None; trees]) };
    let refuse =
        |what: String| GeometryError::new_err(format!("{name}: {what}; a scene of {trees} trees has one for each"));
    let items = values.try_iter().map_err(|_| refuse("not a sequence".to_owned()))?.collect::<PyResult<Vec<_>>>()?;
    if items.len() != trees {
        return Err(refuse(format!("{} items", items.len())));
    }
    Ok(items.into_iter().map(|item| Some(item).filter(|item| !item.is_none())).collect())
}

/// The looks of a scene's objects, which are its instances: `shown` has the tree of each.
pub fn of_scene<'a>(
    surfaces: Option<&Bound<'_, PyAny>>,
    objects: Option<&Bound<'_, PyAny>>,
    meshes: &'a [MeshArrays<'_>],
    shown: &[u32],
) -> PyResult<Appearance<'a>> {
    let objects = match objects {
        Some(value) => {
            let rows = Rows::new("objects", value)?;
            if rows.len != shown.len() {
                let (rows, instances) = (rows.len, shown.len());
                return Err(GeometryError::new_err(format!(
                    "objects: {rows} rows, but there are {instances} instances"
                )));
            }
            read_objects(&rows)?
        }
        None => Vec::new(),
    };
    let surfaces = surfaces.map_or(Ok(Vec::new()), read_surfaces)?;
    let meshes = meshes.iter().map(MeshArrays::look).collect::<PyResult<Vec<_>>>()?;
    let appearance = Appearance { surfaces, objects, first_triangles: None, meshes };
    if appearance.surfaces.is_empty() {
        return Ok(appearance);
    }
    // Instances of one tree with the same first surface have the same ones.
    let mut seen = HashSet::new();
    let first = |object: usize| appearance.objects.get(object).map_or(0, |object| object.first_surface);
    let pairs = shown.iter().enumerate().filter(|&(object, &tree)| seen.insert((tree, first(object))));
    let pairs: Vec<_> = pairs.map(|(object, &tree)| (tree as usize, object)).collect();
    appearance.check(pairs.into_iter(), 0).map_err(|error| GeometryError::new_err(error.to_string()))?;
    Ok(appearance)
}

fn check_ranges(first: &[u32], triangles: usize) -> PyResult<()> {
    let refuse = |row: usize, why: &str| {
        let start = first.get(row).map_or(String::new(), |start| format!(" at triangle {start}"));
        Err(GeometryError::new_err(format!("objects: row {row} begins{start}; {why}")))
    };
    match first {
        [] => return Err(GeometryError::new_err("objects: there are none; a tree has at least one")),
        [0, ..] => {}
        _ => return refuse(0, "the first begins at 0"),
    }
    if let Some(row) = first.windows(2).position(|pair| pair[0] > pair[1]) {
        return refuse(row + 1, "each begins where the one before it ends");
    }
    match first.iter().position(|&start| start as usize > triangles) {
        Some(row) => refuse(row, &format!("there are {triangles}")),
        None => Ok(()),
    }
}

fn read_objects(rows: &Rows<'_>) -> PyResult<Vec<Object>> {
    let first_surfaces = rows.whole_or::<u32>("first_surface", 0)?;
    let indices = rows.whole_or::<i32>("index", 0)?;
    let flags = rows.whole_or::<u8>("flags", 0)?;
    Ok((0..rows.len)
        .map(|row| Object {
            first_surface: first_surfaces[row],
            index: indices[row],
            is_hidden: flags[row] & HIDDEN != 0,
            casts_no_shadow: flags[row] & NO_SHADOW != 0,
            is_holdout: flags[row] & HOLDOUT != 0,
        })
        .collect())
}

fn read_surfaces(value: &Bound<'_, PyAny>) -> PyResult<Vec<Surface>> {
    let rows = Rows::new("surfaces", value)?;
    let bases = rows.field::<3>("base")?;
    let emissions = rows.field_or("emission", [0.0; 3])?;
    let indices = rows.whole_or::<i32>("index", 0)?;
    Ok((0..rows.len).map(|row| Surface { base: bases[row], emission: emissions[row], index: indices[row] }).collect())
}
