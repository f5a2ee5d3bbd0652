//! Ray queries on triangle meshes by a Bounding Interval Hierarchy.
//!
//! Wächter and Keller, "Instant Ray Tracing: The Bounding Interval Hierarchy", EGSR 2006.
//! The crate knows neither Python nor any file but saved trees: views of triangles in, hits and pictures out.

#![deny(unsafe_code)]
#![deny(missing_docs)]

pub mod build;
pub mod control;
pub mod error;
pub mod geometry;
pub mod instances;
pub mod intersect;
pub mod kd_tree;
pub mod memory;
mod pages;
pub mod render;
pub mod saved;
pub mod simd;

pub mod traverse;
pub mod tree;

pub use build::{BuildOptions, build};
pub use control::{Cancelled, Control};
pub use error::Error;
pub use geometry::{Bounds, Ray, Triangles, Vertices};
pub use instances::Scene;
pub use traverse::Hit;
pub use tree::Tree;
