//! Which instruction sets there are, which of them this processor has, and which of those this process uses.

use std::sync::LazyLock;

/// The instruction sets that kernels can run in, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// x86-64: registers of 256 bits, masks and compression.
    Avx512,
    /// x86-64: registers of 256 bits.
    Avx2,
    /// 64-bit ARM: registers of 128 bits.
    Neon,
    /// No vector instructions.
    Scalar,
}

impl InstructionSet {
    const ALL: [Self; 4] = [Self::Avx512, Self::Avx2, Self::Neon, Self::Scalar];

    /// Its name, as in `BIHTREE_ISA`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx512 => "avx512",
            Self::Avx2 => "avx2",
            Self::Neon => "neon",
            Self::Scalar => "scalar",
        }
    }

    /// Whether this processor has it.
    fn is_available(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => super::avx512::is_available(),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => super::avx2::is_available(),
            Self::Neon => cfg!(all(target_arch = "aarch64", target_endian = "little")),
            Self::Scalar => true,
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }
}

/// BIHTREE_ISA names what this processor does not have, or nobody.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("BIHTREE_ISA: {name:?} is no instruction set of this processor, which has {}", names(.available))]
pub struct NotThere {
    name: String,
    available: Vec<InstructionSet>,
}

fn names(sets: &[InstructionSet]) -> String {
    sets.iter().map(|set| set.name()).collect::<Vec<_>>().join(", ")
}

static USED: LazyLock<Result<Vec<InstructionSet>, NotThere>> = LazyLock::new(|| {
    let available = InstructionSet::ALL.into_iter().filter(|set| set.is_available()).collect();
    let forced = std::env::var_os("BIHTREE_ISA").unwrap_or_default();
    choose(available, &forced.to_string_lossy())
});

fn choose(available: Vec<InstructionSet>, forced: &str) -> Result<Vec<InstructionSet>, NotThere> {
    if forced.is_empty() {
        return Ok(available);
    }
    match available.iter().find(|set| set.name() == forced) {
        Some(InstructionSet::Scalar) => Ok(vec![InstructionSet::Scalar]),
        Some(&set) => Ok(vec![set, InstructionSet::Scalar]),
        None => Err(NotThere { name: forced.to_string(), available }),
    }
}

/// What kernels of this process run in, best first: all that the processor has, or what the environment variable
/// BIHTREE_ISA names, and the scalar one.
///
/// # Panics
/// Where `check_instruction_set` gives an error.
pub fn instruction_sets() -> &'static [InstructionSet] {
    match &*USED {
        Ok(sets) => sets,
        Err(error) => panic!("{error}"),
    }
}

/// Whether BIHTREE_ISA can be followed: for a host to call first, and say the error in its own way.
pub fn check_instruction_set() -> Result<(), NotThere> {
    USED.as_ref().map(|_| ()).map_err(Clone::clone)
}

#[cfg(test)]
mod tests {
    use super::*;
    use InstructionSet::{Avx2, Avx512, Scalar};

    #[test]
    fn a_name_forces_its_instruction_set_and_another_is_an_error() {
        let available = vec![Avx512, Avx2, Scalar];
        let forced = |name| choose(available.clone(), name);
        assert_eq!(forced(""), Ok(available.clone()));
        assert_eq!(forced("avx2"), Ok(vec![Avx2, Scalar]));
        assert_eq!(forced("scalar"), Ok(vec![Scalar]));
        for name in ["neon", "AVX2", "abacus"] {
            let text = forced(name).unwrap_err().to_string();
            let expected = "is no instruction set of this processor, which has avx512, avx2, scalar";
            assert_eq!(text, format!("BIHTREE_ISA: {name:?} {expected}"));
        }
    }

    #[test]
    fn every_processor_has_scalar_last() {
        assert_eq!(instruction_sets().last(), Some(&Scalar));
    }
}
