//! Which instruction set a kernel runs in, chosen once a process.

#[cfg(target_arch = "x86_64")]
use std::arch::is_x86_feature_detected;
use std::sync::LazyLock;

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

/// The instruction sets that kernels can run in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// 256-bit registers.
    Avx2,
    /// No vector instructions.
    Scalar,
}

impl InstructionSet {
    /// Its name, as in `BIHTREE_ISA`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx2 => "avx2",
            Self::Scalar => "scalar",
        }
    }
}

static AVAILABLE: LazyLock<Vec<InstructionSet>> = LazyLock::new(|| {
    let mut sets = vec![InstructionSet::Scalar];
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
    {
        sets.insert(0, InstructionSet::Avx2);
    }
    match std::env::var("BIHTREE_ISA") {
        Ok(name) => sets.into_iter().filter(|set| set.name() == name || *set == InstructionSet::Scalar).collect(),
        Err(_) => sets,
    }
});

/// What this process can run in, best first. The environment variable BIHTREE_ISA leaves only the one it names, and
/// the scalar one.
pub fn instruction_sets() -> &'static [InstructionSet] {
    &AVAILABLE
}

/// Run the kernel in the best of them.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_to(instruction_sets()[0], kernel)
}

/// Run the kernel in this one, which must be one of `instruction_sets`.
#[expect(unsafe_code, reason = "intrinsics may run only where the processor has them")]
pub fn dispatch_to<K: Kernel>(set: InstructionSet, kernel: K) -> K::Output {
    assert!(instruction_sets().contains(&set), "{} is not there", set.name());
    match set {
        // SAFETY: the set is one of those that were found on this processor.
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 => unsafe { super::avx2::run(kernel) },
        _ => kernel.run::<Scalar>(),
    }
}
