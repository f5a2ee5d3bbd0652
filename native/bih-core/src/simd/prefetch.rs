//! Telling the processor what is read soon.

#![expect(unsafe_code, reason = "prefetching takes an address")]

/// Bring all cache lines of `value` near, where the processor can; changes nothing else.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    const LINE: usize = 64;
    let start = std::ptr::from_ref(value).cast::<i8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
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
