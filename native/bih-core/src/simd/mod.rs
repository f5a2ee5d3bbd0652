//! What depends on the instruction set: a kernel is written once, in lanes, and an instruction set supplies the lanes.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dispatch;
mod float_environment;
mod instruction_set;
mod lanes;
#[cfg(all(target_arch = "aarch64", target_endian = "little"))]
mod neon;
mod prefetch;
#[cfg(target_arch = "x86_64")]
mod register_256;
#[cfg(all(test, target_arch = "x86_64", not(miri)))]
mod subnormals;

pub use dispatch::{Kernel, dispatch, dispatch_common, dispatch_common_to, dispatch_to};
pub use float_environment::FloatEnvironment;
pub use instruction_set::{InstructionSet, NotThere, check_instruction_set, instruction_sets};
pub use lanes::{Lanes, Mask, Scalar};
pub use prefetch::{prefetch, prefetch_at};
