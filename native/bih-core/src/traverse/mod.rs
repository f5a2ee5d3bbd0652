//! Queries: the nearest hit, any hit, and the naive intersector that they are tested against.

mod batch;
mod closest;
mod counters;
mod interval;
mod naive;
mod occlusion;
pub mod packet;
mod stack;
mod wide;

pub use batch::{Limits, RayBatch};
pub use closest::{Hit, closest};
pub use counters::{Counter, Counts, Uncounted};
pub use naive::{naive_closest, naive_occluded};
pub use occlusion::occluded;
pub use stack::Stack;
