//! Memory is asked for before work begins: what cannot be had in the middle of it would end the process.

use std::hint::black_box;
use std::sync::{Mutex, PoisonError};

use crate::error::Error;

/// Less is not asked for: it is there, or nothing works any more.
const LEAST: usize = 1 << 20;

/// An error unless so many bytes can be had at once, for what they are named after.
///
/// They are given back at once. Work on other threads may take them meanwhile: this is a promise to those who work alone.
pub fn room(what: &'static str, bytes: usize) -> Result<(), Error> {
    if bytes < LEAST {
        return Ok(());
    }
    // Threads take addresses for themselves when they first ask for memory: before it is counted what is left.
    rayon::broadcast(|_| black_box(Vec::<u8>::with_capacity(64)));
    if is_there(bytes) { Ok(()) } else { Err(Error::Memory { what, bytes }) }
}

/// By its alignment, which nothing else has, whoever counts memory tells what is only asked for from what is used.
#[repr(align(4096))]
struct Page {
    _first: u8,
}

fn is_there(bytes: usize) -> bool {
    let mut probe = Vec::<Page>::new();
    let is_there = probe.try_reserve_exact(bytes.div_ceil(size_of::<Page>())).is_ok();
    // Else nothing would be asked for.
    black_box(&probe);
    is_there
}

/// Memory for work of which nobody knows before how much it will hold, on several threads: whatever is taken, more than
/// that is left when it is refused, so that what nobody counts still finds its place.
#[derive(Debug)]
pub(crate) struct Headroom {
    what: &'static str,
    /// What may be taken before it is asked again what is there.
    left: Mutex<usize>,
}

impl Headroom {
    /// Never taken.
    const KEPT: usize = 16 << 20;
    /// Asked for at a time.
    const STEP: usize = 4 << 20;

    /// For what it is named after.
    pub fn new(what: &'static str) -> Self {
        Self { what, left: Mutex::new(LEAST) }
    }

    fn take(&self, bytes: usize) -> Result<(), Error> {
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        if *left < bytes {
            if !is_there(bytes.saturating_add(Self::STEP + Self::KEPT)) {
                return Err(Error::Memory { what: self.what, bytes });
            }
            *left = bytes + Self::STEP;
        }
        *left -= bytes;
        Ok(())
    }
}

/// A thread's part of a `Headroom`; of none, all that the system gives.
#[derive(Debug, Clone, Default)]
pub struct Allowance<'a> {
    headroom: Option<&'a Headroom>,
    left: usize,
}

impl<'a> Allowance<'a> {
    /// Taken from the others at a time.
    const STEP: usize = 64 << 10;

    pub(crate) fn of(headroom: &'a Headroom) -> Self {
        Self { headroom: Some(headroom), left: 0 }
    }

    /// An error unless so many bytes may be taken.
    pub(crate) fn take(&mut self, bytes: usize) -> Result<(), Error> {
        if let Some(headroom) = self.headroom
            && self.left < bytes
        {
            headroom.take(bytes.saturating_add(Self::STEP))?;
            self.left = bytes + Self::STEP;
        }
        self.left = self.left.saturating_sub(bytes);
        Ok(())
    }

    /// Make room for more items in a vector that has none left.
    pub(crate) fn grow<T>(&mut self, items: &mut Vec<T>, more: usize) -> Result<(), Error> {
        // The old ones are there until the new ones are.
        let bytes = items.len().max(4).max(more).saturating_mul(2 * size_of::<T>());
        self.take(bytes)?;
        let what = self.headroom.map_or("the answers", |headroom| headroom.what);
        items.try_reserve(more).map_err(|_| Error::Memory { what, bytes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_has_is_an_error_that_says_how_much() {
        assert_eq!(room("this", LEAST), Ok(()));
        let error = room("that", isize::MAX as usize).unwrap_err();
        assert_eq!(error.to_string(), format!("memory: {} bytes for that cannot be had", isize::MAX));
        assert!(room("that", usize::MAX).is_err());
    }

    #[test]
    fn an_allowance_is_what_was_asked_for() {
        let headroom = Headroom::new("these");
        let mut allowance = Allowance::of(&headroom);
        assert!((0..100).all(|_| allowance.take(LEAST).is_ok()));
        for bytes in [isize::MAX as usize, usize::MAX] {
            assert_eq!(
                allowance.take(bytes).unwrap_err().to_string().split_once(" bytes for ").unwrap().1,
                "these cannot be had"
            );
        }
        // Nothing is lost by it.
        let mut items = vec![1, 2, 3];
        assert!(allowance.grow(&mut items, usize::MAX).is_err());
        allowance.grow(&mut items, 1).unwrap();
        assert_eq!((items.len(), items.capacity() > 3), (3, true));
    }
}
