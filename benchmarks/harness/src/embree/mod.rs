//! The peer Embree, through the shared library that the wheel of embreex carries.

mod device;
mod flush;
mod library;
mod packets;
mod trace;

pub use device::{Device, EmbreeSide};
pub use flush::Flushed;
pub use library::Arguments;
pub use packets::Packet;
pub use trace::EmbreeScene;
