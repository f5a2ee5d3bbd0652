//! Advice to the system about large arrays.

#![expect(unsafe_code, reason = "the system is told of addresses")]

/// Ask for large pages behind an array that is about to be filled: there are fewer of them to hand out, and later fewer
/// to look up. A hint: nothing depends on it.
pub fn advise_large<T>(values: &[T]) {
    /// The large pages of x86-64 and of AArch64 with pages of 4 KiB.
    const PAGE: usize = 1 << 21;
    let start = values.as_ptr().addr();
    let end = (start + size_of_val(values)) / PAGE * PAGE;
    let start = start.next_multiple_of(PAGE);
    if start >= end {
        return;
    }
    #[cfg(target_os = "linux")]
    // SAFETY: the range is part of the array, which is borrowed meanwhile; the advice changes how the system provides the
    // memory, not what is in it.
    unsafe {
        let address = values.as_ptr().with_addr(start).cast_mut().cast();
        libc::madvise(address, end - start, libc::MADV_HUGEPAGE);
    }
}

/// A zeroed array, its pages untouched where the system hands out zeroed ones.
pub fn zeroed<T: bytemuck::Zeroable + Clone>(count: usize) -> Vec<T> {
    let values = vec![T::zeroed(); count];
    advise_large(&values);
    values
}
