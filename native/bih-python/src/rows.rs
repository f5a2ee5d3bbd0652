//! Structured arrays from Python, field by field.

use numpy::{PyArray2, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{as_array, converted, kind};
use crate::errors::GeometryError;

/// A structured array of one dimension, and how its argument is called.
pub struct Rows<'py> {
    name: &'static str,
    array: Bound<'py, PyUntypedArray>,
    pub len: usize,
}

impl<'py> Rows<'py> {
    pub fn new(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let array = as_array(name, value)?;
        let len = array.len();
        if array.shape().len() != 1 {
            let shape = array.getattr("shape")?;
            return Err(GeometryError::new_err(format!("{name}: expected a structured array (N,), got shape {shape}")));
        }
        Ok(Self { name, array, len })
    }

    /// The numbers of a field row by row, all finite.
    pub fn field<const N: usize>(&self, field: &str) -> PyResult<Vec<[f64; N]>> {
        self.read(field)?.ok_or_else(|| self.refuse(field))
    }

    /// The same; where there is no such field, one value for all rows.
    pub fn field_or<const N: usize>(&self, field: &str, value: [f64; N]) -> PyResult<Vec<[f64; N]>> {
        Ok(self.read(field)?.unwrap_or_else(|| vec![value; self.len]))
    }

    /// Whole numbers that T holds; where there is no such field, one value for all rows.
    pub fn whole_or<T: TryFrom<i64> + Copy>(&self, field: &str, value: T) -> PyResult<Vec<T>> {
        let Some(numbers) = self.read::<1>(field)? else { return Ok(vec![value; self.len]) };
        let whole = |(row, [x]): (usize, &[f64; 1])| -> PyResult<T> {
            let number = *x as i64;
            let whole = if number as f64 == *x { T::try_from(number).ok() } else { None };
            whole.ok_or_else(|| GeometryError::new_err(format!("{}: {field} of row {row} is {x}", self.name)))
        };
        numbers.iter().enumerate().map(whole).collect()
    }

    fn read<const N: usize>(&self, field: &str) -> PyResult<Option<Vec<[f64; N]>>> {
        let names = self.array.dtype().getattr("names")?;
        if names.is_none() {
            return Err(self.refuse(field));
        }
        if !names.contains(field)? {
            return Ok(None);
        }
        let values = as_array(self.name, &self.array.get_item(field)?)?;
        let expected: &[usize] = if N == 1 { &[self.len] } else { &[self.len, N] };
        if values.shape() != expected || !matches!(kind(&values), 'f' | 'i' | 'u' | 'b') {
            return Err(self.refuse(field));
        }
        let values = converted(&values, "float64")?.call_method1("reshape", (self.len, N))?;
        let values = values.cast_into::<PyArray2<f64>>()?;
        let values = values.try_readonly()?;
        let rows: Vec<[f64; N]> = values.as_slice()?.as_chunks().0.to_vec();
        for (row, numbers) in rows.iter().enumerate() {
            if let Some(x) = numbers.iter().find(|x| !x.is_finite()) {
                return Err(GeometryError::new_err(format!("{}: row {row} holds {x} in {field}", self.name)));
            }
        }
        Ok(Some(rows))
    }

    fn refuse(&self, field: &str) -> PyErr {
        GeometryError::new_err(format!("{}: expected a structured array (N,) with the field {field}", self.name))
    }
}
