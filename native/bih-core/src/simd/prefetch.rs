//! Telling the processor what is read soon.

#![expect(unsafe_code, reason = "prefetching takes an address")]

/// Bring `LINES` cache lines from the item at `index` near, where the processor can; changes nothing else. Nothing need be
/// there.
#[inline(always)]
pub fn prefetch<const LINES: usize, T>(items: &[T], index: usize) {
    const LINE: usize = 64;
    let start = items.as_ptr().wrapping_add(index).cast::<i8>();
    for line in 0..LINES {
        let address = start.wrapping_add(line * LINE);
        // SAFETY: a prefetch reads nothing that the program sees and never faults, whatever the address; SSE is part of
        // every x86-64.
        #[cfg(target_arch = "x86_64")]
        unsafe {
            std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(address);
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = address;
    }
}
