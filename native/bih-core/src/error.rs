//! What can go wrong in the core.

use std::io;

use crate::control::Cancelled;

/// An error of construction or validation; its text names the argument, the row and the value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A triangle refers to a vertex that is not there.
    #[error("triangles: row {row} refers to vertex {vertex}, but there are {vertices} vertices")]
    VertexOutOfRange {
        /// Row of the triangle.
        row: usize,
        /// The vertex it names.
        vertex: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A soup needs three vertices a triangle.
    #[error("vertices: {vertices} rows without triangles; each three rows are one triangle")]
    RaggedSoup {
        /// How many vertices were given.
        vertices: usize,
    },
    /// More triangles than a child index of 30 bits can address.
    #[error("triangles: {triangles} rows; one tree holds at most {limit}")]
    TooManyTriangles {
        /// How many were given.
        triangles: usize,
        /// The most one tree can hold.
        limit: usize,
    },
    /// More instances than the tree over them can hold.
    #[error("instances: {instances} rows; one scene holds at most {limit}")]
    TooManyInstances {
        /// How many were given.
        instances: usize,
        /// The most one scene can hold.
        limit: usize,
    },
    /// Options that do not go with each other.
    #[error("structure: {structure:?} does not go with {argument} {value}; {advice}")]
    Incompatible {
        /// The name of the structure.
        structure: &'static str,
        /// The other argument.
        argument: &'static str,
        /// Its value, as it is written.
        value: String,
        /// What to do.
        advice: &'static str,
    },
    /// A tree that breaks one of its own rules.
    #[error("node {node}: {problem}")]
    Broken {
        /// The first broken node.
        node: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// A file that is no saved tree, or a damaged one.
    #[error("{path}: {problem}")]
    Format {
        /// The file.
        path: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A file that cannot be read or written.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: String,
        /// What kind of trouble it is.
        kind: io::ErrorKind,
        /// The system's number of it.
        code: Option<i32>,
        /// What the system says.
        reason: String,
    },
    /// There is not enough memory.
    #[error("memory: {bytes} bytes for {what} cannot be had")]
    Memory {
        /// What it was needed for.
        what: &'static str,
        /// How many were asked for.
        bytes: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
