//! Lights from a structured array.

use bih_core::render::{Light, Shape};
use pyo3::prelude::*;

use crate::errors::GeometryError;
use crate::rows::Rows;

/// Rows of kind, position, direction and colour; and where there are such fields size, axis, spot and shadowless.
pub fn read_lights(value: &Bound<'_, PyAny>) -> PyResult<Vec<Light>> {
    let rows = Rows::new("lights", value)?;
    let kinds = rows.field::<1>("kind")?;
    let (positions, directions, colours) =
        (rows.field::<3>("position")?, rows.field::<3>("direction")?, rows.field::<3>("colour")?);
    let sizes = rows.field_or("size", [0.0; 2])?;
    let axes = rows.field_or("axis", [1.0, 0.0, 0.0])?;
    let spots = rows.field_or("spot", [std::f64::consts::PI, 0.0])?;
    let shadowless = rows.field_or("shadowless", [0.0])?;
    (0..rows.len)
        .map(|row| {
            let (position, direction) = (positions[row], directions[row]);
            let ([size, height], [angle, blend]) = (sizes[row], spots[row]);
            if size < 0.0 || height < 0.0 {
                return Err(GeometryError::new_err(format!("lights: row {row} has the size {size}, {height}")));
            }
            let shape = match kinds[row][0] {
                0.0 => Shape::Sun { direction, angle: size },
                1.0 => Shape::Point { position, radius: size },
                2.0 => Shape::Spot { position, radius: size, direction, angle, blend },
                kind @ (3.0 | 4.0) => {
                    let axes = area(axes[row], direction, [size, height])
                        .ok_or_else(|| GeometryError::new_err(format!("lights: row {row} has its axis along it")))?;
                    Shape::Area { position, direction, axes, is_round: kind == 4.0 }
                }
                5.0 => Shape::Headlight,
                kind => {
                    return Err(GeometryError::new_err(format!(
                        "lights: row {row} is of kind {kind}; 0 sun, 1 point, 2 spot, 3 rectangle, 4 ellipse or 5 headlight"
                    )));
                }
            };
            Ok(Light { shape, colour: colours[row], casts_shadows: shadowless[row][0] == 0.0 })
        })
        .collect()
}

/// The sides of an area: its width along `axis`, its height across that and the direction.
fn area(axis: [f64; 3], direction: [f64; 3], [width, height]: [f64; 2]) -> Option<[[f64; 3]; 2]> {
    let unit = |a: [f64; 3]| {
        let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length > 0.0).then(|| a.map(|x| x / length))
    };
    let (across, along) = (unit(axis)?, unit(direction)?);
    let other = unit(std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        along[j] * across[k] - along[k] * across[j]
    }))?;
    Some([across.map(|x| width * x), other.map(|x| height * x)])
}
