//! One picture in one call: camera rays in tiles, shaded natively, as passes.

mod appearance;
mod camera;
mod light;
mod passes;
mod sampling;
mod shade;
mod surface;
mod tiles;
mod traced;
mod vectors;
mod visible;

pub use appearance::{Appearance, GREY, MeshLook, NoSurface, Object, Surface};
pub use camera::{Camera, SingularMatrix};
pub use light::{Light, Shape};
pub use passes::{Passes, Wanted};
pub use sampling::sample_offset;
pub use shade::Lighting;
pub use tiles::{RenderOptions, Tile, render};
pub use traced::{Seen, Traced};
