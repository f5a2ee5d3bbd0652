//! What depends on the instruction set.

mod float_environment;

pub use float_environment::FloatEnvironment;
