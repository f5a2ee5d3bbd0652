//! Denormals flushed, as Embree's manual advises (section "Performance Recommendations").

/// While it lives, this thread flushes denormals to zero and takes them for zero.
pub struct Flushed {
    #[cfg(target_arch = "x86_64")]
    saved: u32,
}

impl Flushed {
    #[cfg(target_arch = "x86_64")]
    pub fn new() -> Self {
        let saved = read();
        // Bit 15 flushes results, bit 6 operands.
        write(saved | 0x8040);
        Self { saved }
    }

    #[cfg(not(target_arch = "x86_64"))]
    pub fn new() -> Self {
        Self {}
    }
}

#[cfg(target_arch = "x86_64")]
impl Drop for Flushed {
    fn drop(&mut self) {
        write(self.saved);
    }
}

#[cfg(target_arch = "x86_64")]
fn read() -> u32 {
    let mut value = 0u32;
    // SAFETY: stmxcsr writes the four bytes it is pointed at and nothing else.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack, preserves_flags)) };
    value
}

#[cfg(target_arch = "x86_64")]
fn write(value: u32) {
    // SAFETY: the value was read before, but for two bits that every x86-64 has.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack, preserves_flags)) };
}
