//! One picture in one call: camera rays in tiles, shaded natively, as passes.

mod camera;
mod passes;
mod shade;
mod tiles;

pub use camera::{Camera, SingularMatrix, sample_offset};
pub use passes::{Passes, Wanted};
pub use shade::{Light, Lighting};
pub use tiles::{RenderOptions, Tile, render};
