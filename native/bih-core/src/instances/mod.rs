//! A tree over trees: instances of meshes, each where a matrix takes it.
//!
//! What is hit is the image of a triangle, and the ray is as it is given. The inverse of a matrix only leads through the
//! tree of the mesh, rounded outward; docs/accuracy.md, section 9, derives by how much.

mod affine;
mod batch;
mod boxes;
mod inverse;
mod lists;
mod queries;
mod scene;
mod shape;
mod traced;
mod tracer;
mod walk;

pub use affine::Affine;
pub use batch::{SceneHitLists, SceneHits};
pub use scene::{Model, Scene};
pub use tracer::SceneTracer;
