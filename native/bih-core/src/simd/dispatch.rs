//! A kernel run in an instruction set.

use super::instruction_set::{InstructionSet, instruction_sets};
use super::lanes::{Lanes, Scalar};

/// Work written once for lanes of any instruction set.
///
/// `run` and all that it calls with lanes must be inlined, and no lanes may stand in a closure: a function of its own,
/// as a closure is, does not have the instruction set of the kernel, and each of its operations becomes a call.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Do it.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Run the kernel in the best of `instruction_sets`.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_to(instruction_sets()[0], kernel)
}

/// The same, but in AVX2 where AVX-512 is the best: see `dispatch_common_to`.
#[inline]
pub fn dispatch_common<K: Kernel>(kernel: K) -> K::Output {
    dispatch_common_to(instruction_sets()[0], kernel)
}

/// Run the kernel in this one, which must be one of `instruction_sets`.
#[cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "intrinsics may run only where the processor has them")
)]
pub fn dispatch_to<K: Kernel>(set: InstructionSet, kernel: K) -> K::Output {
    match set {
        // SAFETY: the set is one of those that were found on this processor.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 if instruction_sets().contains(&set) => unsafe { super::avx512::run(kernel) },
        _ => dispatch_common_to(set, kernel),
    }
}

/// The same, but in AVX2 where AVX-512 is asked for: in our lanes that has one instruction more, by which children are
/// compressed. Kernels other than rays in flight and in packets are not compiled once more for it.
#[cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "intrinsics may run only where the processor has them")
)]
pub fn dispatch_common_to<K: Kernel>(set: InstructionSet, kernel: K) -> K::Output {
    assert!(instruction_sets().contains(&set), "{} is not there", set.name());
    match set {
        // SAFETY: the processor has it.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx512 | InstructionSet::Avx2 if super::avx2::is_available() => unsafe {
            super::avx2::run(kernel)
        },
        #[cfg(all(target_arch = "aarch64", target_endian = "little"))]
        InstructionSet::Neon => kernel.run::<super::neon::Neon>(),
        _ => kernel.run::<Scalar>(),
    }
}
