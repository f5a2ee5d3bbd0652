//! What depends on the instruction set: a kernel is written once, in lanes, and an instruction set supplies the lanes.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod dispatch;
mod float_environment;
mod lanes;
mod prefetch;

pub use dispatch::{InstructionSet, Kernel, dispatch, dispatch_to, instruction_sets};
pub use float_environment::FloatEnvironment;
pub use lanes::{Lanes, Mask, Scalar};
pub use prefetch::prefetch;
