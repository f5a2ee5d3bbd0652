//! Cameras.

use bih_core::geometry::Ray;
use bih_core::memory::room;
use bih_core::render::{Camera as CoreCamera, sample_offset};
use bih_core::simd::FloatEnvironment;
use numpy::{PyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::arrays::matrix;
use crate::errors::{GeometryError, to_exception};

/// A camera and the size of its picture.
#[pyclass(frozen, module = "bihtree")]
pub struct Camera {
    pub inner: CoreCamera,
}

type VectorArray<'py> = Bound<'py, PyArray2<f64>>;

#[pymethods]
impl Camera {
    #[new]
    fn new(clip_to_world: &Bound<'_, PyAny>, width: i64, height: i64) -> PyResult<Self> {
        let _standard = FloatEnvironment::standard();
        let clip_to_world = matrix("clip_to_world", clip_to_world)?;
        let [width, height] = [pixels("width", width)?, pixels("height", height)?];
        let inner = CoreCamera::new(clip_to_world, width, height)
            .map_err(|error| GeometryError::new_err(format!("{error}: {clip_to_world:?}")))?;
        Ok(Self { inner })
    }

    /// The rays of one sample through every pixel, row by row from the lower left.
    #[pyo3(signature = (*, sample = 0))]
    fn rays<'py>(&self, py: Python<'py>, sample: u32) -> PyResult<(VectorArray<'py>, VectorArray<'py>)> {
        let _standard = FloatEnvironment::standard();
        let offset = sample_offset(sample, 0);
        let (width, height) = (self.inner.width(), self.inner.height());
        // Both arrays, each twice, as vectors and as numbers; the rays and their pixels.
        let bytes = 4 * size_of::<[f64; 3]>() + size_of::<Ray>() + size_of::<[u32; 2]>();
        room("the rays", bytes * width as usize * height as usize).map_err(to_exception)?;
        let pixels: Vec<_> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
        let mut rays = vec![Ray::new([0.0; 3], [0.0; 3]); pixels.len()];
        self.inner.rays(&pixels, offset, &mut rays);
        let (origins, directions) = rays.iter().map(|ray| (ray.origin, ray.direction)).unzip();
        let array = |vectors: Vec<[f64; 3]>| {
            let shape = [vectors.len(), 3];
            PyArray::from_vec(py, bytemuck::cast_slice(&vectors).to_vec()).reshape(shape)
        };
        Ok((array(origins)?, array(directions)?))
    }

    #[getter]
    fn width(&self) -> u32 {
        self.inner.width()
    }

    #[getter]
    fn height(&self) -> u32 {
        self.inner.height()
    }
}

fn pixels(name: &str, value: i64) -> PyResult<u32> {
    const MOST: i64 = 1 << 16;
    match value {
        1..=MOST => Ok(value as u32),
        _ => Err(GeometryError::new_err(format!("{name}: {value} pixels; a picture has 1 to {MOST}"))),
    }
}
