//! Queries: the nearest hit, any hit, and the naive intersector that they are tested against.

mod all;
mod batch;
mod closest;
mod contains;
mod count;
mod counters;
mod every;
mod fast;
mod filter;
mod flight;
mod interval;
mod lists;
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
pub use contains::contains;
pub use counters::{Counter, Counts, Uncounted};
pub use lists::HitLists;
pub use naive::{naive_all, naive_closest, naive_contains, naive_count, naive_occluded};
pub use packet::PACKET;
pub use stack::Stack;
pub use trace::{Tracer, Way};
