//! Telling the processor what is read soon.

#![cfg_attr(
    all(any(target_arch = "x86_64", target_arch = "aarch64"), not(miri)),
    expect(unsafe_code, reason = "prefetching takes an address")
)]

/// Bring `LINES` cache lines from the item at `index` near, where the processor can; changes nothing else. Nothing need
/// be there.
#[inline(always)]
pub fn prefetch<const LINES: usize, T>(items: &[T], index: usize) {
    prefetch_at::<LINES>(items.as_ptr().wrapping_add(index).cast());
}

/// The same from an address.
#[inline(always)]
pub fn prefetch_at<const LINES: usize>(start: *const u8) {
    const LINE: usize = 64;
    for line in 0..LINES {
        let address = start.wrapping_add(line * LINE).cast::<i8>();
        // SAFETY: a prefetch reads nothing that the program sees and never faults, whatever the address; SSE is part of
        // every x86-64.
        #[cfg(all(target_arch = "x86_64", not(miri)))]
        unsafe {
            std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(address);
        }
        // SAFETY: as above; every 64-bit ARM processor has the instruction.
        #[cfg(all(target_arch = "aarch64", not(miri)))]
        unsafe {
            std::arch::asm!("prfm pldl1keep, [{}]", in(reg) address, options(nostack, preserves_flags, readonly));
        }
        #[cfg(any(not(any(target_arch = "x86_64", target_arch = "aarch64")), miri))]
        let _ = address;
    }
}
