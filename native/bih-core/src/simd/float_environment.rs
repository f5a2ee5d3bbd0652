//! The standard floating-point environment, whatever the calling thread has set.
//!
//! A host may run its threads with flush-to-zero or another rounding mode, and threads inherit it. The bounds of the
//! filters hold for rounding to nearest with subnormals only. (Miri runs no assembly, and has no other environment.)

#![cfg_attr(
    not(miri),
    expect(unsafe_code, reason = "the control register of the vector unit can only be reached by assembly")
)]

/// While it lives, this thread rounds to nearest and keeps subnormals; dropped, it restores what was there.
#[derive(Debug)]
pub struct FloatEnvironment {
    #[cfg(all(target_arch = "x86_64", not(miri)))]
    saved: u32,
    #[cfg(all(target_arch = "aarch64", not(miri)))]
    saved: u64,
}

#[cfg(all(target_arch = "x86_64", not(miri)))]
pub(super) mod register {
    /// Round to nearest, no flush-to-zero, all exceptions masked: the state in which a process starts.
    pub const STANDARD: u32 = 0x1f80;
    /// The bits that change results: rounding mode, flush-to-zero, denormals-are-zero.
    pub const MODES: u32 = 0xe040;

    pub fn read() -> u32 {
        let mut value = 0u32;
        // SAFETY: stmxcsr writes the four bytes it is pointed at and nothing else; SSE is part of every x86-64.
        unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
        value
    }

    pub fn write(value: u32) {
        // SAFETY: the value is the standard state or one that was read before, so no reserved bit is set; ldmxcsr reads
        // four bytes. No floating-point operation of Rust is moved across: the compiler takes the block for one that
        // reads and writes memory.
        unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags)) };
    }
}

#[cfg(all(target_arch = "aarch64", not(miri)))]
mod register {
    /// Round to nearest, no flush-to-zero: the state in which a process starts.
    pub const STANDARD: u64 = 0;
    /// The bits that change results: flush-to-zero, rounding mode, default NaN, half-precision flush.
    pub const MODES: u64 = 0x07c8_0000;

    pub fn read() -> u64 {
        let value: u64;
        // SAFETY: reading the control register has no effect.
        unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) value, options(nomem, nostack, preserves_flags)) };
        value
    }

    pub fn write(value: u64) {
        // SAFETY: the value is the standard state or one that was read before.
        unsafe { std::arch::asm!("msr fpcr, {}", in(reg) value, options(nostack, preserves_flags)) };
    }
}

impl FloatEnvironment {
    /// Enter the standard environment.
    #[must_use = "the environment lasts as long as this value"]
    pub fn standard() -> Self {
        #[cfg(all(any(target_arch = "x86_64", target_arch = "aarch64"), not(miri)))]
        {
            let saved = register::read();
            if saved & register::MODES != 0 {
                register::write(register::STANDARD);
            }
            Self { saved }
        }
        #[cfg(not(all(any(target_arch = "x86_64", target_arch = "aarch64"), not(miri))))]
        Self {}
    }
}

#[cfg(all(any(target_arch = "x86_64", target_arch = "aarch64"), not(miri)))]
impl Drop for FloatEnvironment {
    fn drop(&mut self) {
        if self.saved & register::MODES != 0 {
            register::write(self.saved);
        }
    }
}

#[cfg(all(test, target_arch = "x86_64", not(miri)))]
mod tests {
    use super::*;
    use std::hint::black_box;

    #[test]
    fn subnormals_are_kept_inside_and_flushed_again_outside() {
        let half = || black_box(f64::MIN_POSITIVE) * black_box(0.5);
        let before = register::read();
        register::write(register::STANDARD | 0x8040);
        let flushed = half();
        let inside = {
            let _standard = FloatEnvironment::standard();
            half()
        };
        let after = half();
        register::write(before);
        assert_eq!((flushed, inside, after), (0.0, f64::MIN_POSITIVE / 2.0, 0.0));
    }
}
