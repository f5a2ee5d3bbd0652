//! Queries: the nearest hit, any hit, and the naive intersector that they are tested against.

mod batch;
mod closest;
mod counters;
mod fast;
mod filter;
mod flight;
mod interval;
mod naive;
mod node_search;
mod occlusion;
mod packet;
mod postponed;
mod rounding;
mod scene;
mod search;
mod single;
mod slab;
mod stack;
mod trace;
mod watertight;
mod wide;

pub use batch::{Float, Hits, Limits, RayBatch, Vectors};
pub use closest::Hit;
pub use counters::{Counter, Counts, Uncounted};
pub use naive::{naive_closest, naive_occluded};
pub use packet::PACKET;
pub use stack::Stack;
pub use trace::{Tracer, Way};
