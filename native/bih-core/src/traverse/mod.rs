//! Queries: the nearest hit, any hit, and the naive intersector that they are tested against.

mod batch;
mod closest;
mod counters;
mod fast;
mod filter;
mod flight;
mod interval;
mod naive;
mod occlusion;
pub mod packet;
mod postponed;
mod scene;
mod search;
mod single;
mod slab;
mod stack;
mod watertight;
mod wide;

pub use batch::{Float, Hits, Limits, RayBatch, Vectors};
pub use closest::{Hit, closest};
pub use counters::{Counter, Counts, Uncounted};
pub use flight::{Rays, closest_in_flight, occluded_in_flight};
pub use naive::{naive_closest, naive_occluded};
pub use occlusion::occluded;
pub use stack::Stack;
