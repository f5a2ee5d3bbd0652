//! The hand-over of a piece from the thread that builds it to those that trace it.
//!
//! The root of a piece goes from unbuilt to busy by compare-and-exchange, so that one thread builds it, and from busy to
//! its word by a store that releases all that was written before. Nobody waits in here: who finds a piece busy does
//! something else first. A builder that fails gives its claim back.

#[cfg(not(all(test, loom)))]
use std::sync::atomic::{AtomicU32, Ordering};

#[cfg(all(test, loom))]
use loom::sync::atomic::{AtomicU32, Ordering};

/// No words of a root: indices of nodes and records stay below 2^30, and words of leaves have bit 31 set.
const UNBUILT: u32 = 0x7000_0000;
const BUSY: u32 = UNBUILT + 1;

/// One word a piece: where its root is, or that there is none yet.
#[derive(Debug)]
pub struct Roots(Box<[AtomicU32]>);

/// How a piece was found.
pub enum Found<'a> {
    /// Its root.
    Built(u32),
    /// Another thread is at it.
    Busy,
    /// Unbuilt, and now ours to build.
    Claimed(Claim<'a>),
}

impl Roots {
    /// All pieces unbuilt.
    pub fn new(pieces: usize) -> Self {
        Self((0..pieces).map(|_| AtomicU32::new(UNBUILT)).collect())
    }

    /// How many pieces there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The root of a piece that is built; all that was written before it can be read.
    #[inline(always)]
    pub fn built(&self, piece: usize) -> Option<u32> {
        let word = self.0[piece].load(Ordering::Acquire);
        (word != UNBUILT && word != BUSY).then_some(word)
    }

    /// Take the piece if it is unbuilt.
    pub fn find(&self, piece: usize) -> Found<'_> {
        let root = &self.0[piece];
        match root.compare_exchange(UNBUILT, BUSY, Ordering::Acquire, Ordering::Acquire) {
            Ok(_) => Found::Claimed(Claim { root, word: UNBUILT }),
            Err(BUSY) => Found::Busy,
            Err(word) => Found::Built(word),
        }
    }
}

/// The right to write a piece or the copy of a leaf, of which nobody else reads anything meanwhile. Given back when it is
/// dropped.
#[derive(Debug)]
pub struct Claim<'a> {
    root: &'a AtomicU32,
    /// What becomes of the root.
    word: u32,
}

/// One word a reference: how often rays have come to the leaf that starts there, or where the copy of it is.
#[derive(Debug)]
pub struct Visits(Box<[AtomicU32]>);

/// Words of a leaf without a copy: no ray has come to it, or one has, or the second one copies it.
const NEVER: u32 = 0;
const ONCE: u32 = 1;
const COPYING: u32 = 2;
/// The copy at place 0.
const COPIED: u32 = 3;

impl Visits {
    /// No ray has come to any.
    pub fn new(references: usize) -> Self {
        // Zeros of the system, which take no memory before a ray comes.
        #[cfg(not(all(test, loom)))]
        return Self(bytemuck::zeroed_slice_box(references));
        #[cfg(all(test, loom))]
        return Self((0..references).map(|_| AtomicU32::new(NEVER)).collect());
    }

    /// Where the copy of a leaf is, which then can be read.
    #[inline(always)]
    pub fn copied(&self, first: usize) -> Option<u32> {
        self.0[first].load(Ordering::Acquire).checked_sub(COPIED)
    }

    /// A ray has come to a leaf without a copy; the second one is to copy it. Nobody waits for that.
    pub fn visit(&self, first: usize) -> Option<Claim<'_>> {
        let root = &self.0[first];
        if root.compare_exchange(NEVER, ONCE, Ordering::Relaxed, Ordering::Relaxed).is_ok() {
            return None;
        }
        root.compare_exchange(ONCE, COPYING, Ordering::Acquire, Ordering::Relaxed)
            .ok()
            .map(|_| Claim { root, word: ONCE })
    }

    /// The copy is written: let it be read.
    pub fn publish(claim: Claim, place: u32) {
        claim.publish(COPIED + place);
    }

    /// Where the words are, for who asks for memory ahead and reads nothing.
    #[inline(always)]
    pub fn start(&self) -> *const AtomicU32 {
        self.0.as_ptr()
    }
}

impl Claim<'_> {
    /// It is written: let it be read.
    pub fn publish(mut self, word: u32) {
        debug_assert!(word != UNBUILT && word != BUSY);
        self.word = word;
    }
}

impl Drop for Claim<'_> {
    fn drop(&mut self) {
        self.root.store(self.word, Ordering::Release);
    }
}

/// Every order in which threads can meet: `make test-loom`.
#[cfg(all(test, loom))]
mod tests {
    use loom::cell::UnsafeCell;
    use loom::sync::Arc;
    use loom::thread;

    use super::*;

    /// Pieces of one number each, which loom watches: it fails where one is read and written at once, or read unwritten.
    struct Model {
        roots: Roots,
        numbers: [UnsafeCell<u32>; 2],
        builds: AtomicU32,
    }

    impl Model {
        fn new() -> Arc<Self> {
            Arc::new(Self {
                roots: Roots::new(2),
                numbers: [UnsafeCell::new(0), UnsafeCell::new(0)],
                builds: AtomicU32::new(0),
            })
        }

        /// As a ray does: the root of a piece, which is built if nobody has; none while another thread is at it.
        fn enter(&self, piece: usize) -> Option<u32> {
            if let Some(root) = self.roots.built(piece) {
                return Some(root);
            }
            match self.roots.find(piece) {
                Found::Built(root) => Some(root),
                Found::Busy => None,
                Found::Claimed(claim) => {
                    self.write(piece);
                    self.builds.fetch_add(1, Ordering::Relaxed);
                    claim.publish(7);
                    Some(7)
                }
            }
        }

        #[expect(unsafe_code, reason = "loom checks what it stands for")]
        fn write(&self, piece: usize) {
            // SAFETY: loom fails if anybody else has it meanwhile.
            self.numbers[piece].with_mut(|number| unsafe { *number = 42 });
        }

        #[expect(unsafe_code, reason = "loom checks what it stands for")]
        fn read(&self, piece: usize) -> u32 {
            // SAFETY: loom fails if anybody writes it meanwhile.
            self.numbers[piece].with(|number| unsafe { *number })
        }

        /// Enter and read, unless the piece is busy.
        fn visit(&self, piece: usize) -> bool {
            let root = self.enter(piece);
            assert!(root.is_none() || self.read(piece) == 42);
            root.is_some()
        }

        /// The same, waiting.
        fn trace(&self, piece: usize) {
            while !self.visit(piece) {
                thread::yield_now();
            }
        }
    }

    #[test]
    fn one_thread_builds_a_piece_and_all_read_it() {
        loom::model(|| {
            let model = Model::new();
            let threads: Vec<_> = (0..2)
                .map(|_| {
                    let model = model.clone();
                    thread::spawn(move || model.visit(0))
                })
                .collect();
            model.visit(0);
            for thread in threads {
                thread.join().unwrap();
            }
            assert!(model.visit(0));
            assert_eq!(model.builds.load(Ordering::Relaxed), 1);
        });
    }

    #[test]
    fn pieces_are_independent() {
        loom::model(|| {
            let model = Model::new();
            let other = model.clone();
            let thread = thread::spawn(move || {
                other.trace(1);
                other.trace(0);
            });
            model.trace(0);
            model.trace(1);
            thread.join().unwrap();
            assert_eq!(model.builds.load(Ordering::Relaxed), 2);
        });
    }

    #[test]
    fn a_builder_that_fails_leaves_the_piece_to_the_next() {
        loom::model(|| {
            let model = Model::new();
            let other = model.clone();
            let thread = thread::spawn(move || {
                if let Found::Claimed(claim) = other.roots.find(0) {
                    other.write(0);
                    // As a panic does.
                    drop(claim);
                }
            });
            model.trace(0);
            thread.join().unwrap();
            assert!(model.builds.load(Ordering::Relaxed) == 1 && model.roots.built(0) == Some(7));
        });
    }

    #[test]
    fn the_second_visit_copies_a_leaf_once_and_all_read_it() {
        loom::model(|| {
            let model = Model::new();
            let visits = Arc::new(Visits::new(1));
            let visit = |model: &Model, visits: &Visits| match visits.copied(0) {
                Some(place) => assert!(place == 7 && model.read(0) == 42),
                None => {
                    if let Some(claim) = visits.visit(0) {
                        model.write(0);
                        model.builds.fetch_add(1, Ordering::Relaxed);
                        Visits::publish(claim, 7);
                    }
                }
            };
            let others = (model.clone(), visits.clone());
            let thread = thread::spawn(move || {
                visit(&others.0, &others.1);
                visit(&others.0, &others.1);
            });
            visit(&model, &visits);
            visit(&model, &visits);
            thread.join().unwrap();
            assert!(visits.copied(0) == Some(7) && model.builds.load(Ordering::Relaxed) == 1);
        });
    }

    #[test]
    fn who_cannot_copy_a_leaf_leaves_it_to_the_next() {
        loom::model(|| {
            let visits = Arc::new(Visits::new(1));
            assert!(visits.visit(0).is_none());
            let other = visits.clone();
            let thread = thread::spawn(move || drop(other.visit(0)));
            let mine = visits.visit(0).is_some();
            thread.join().unwrap();
            assert!(visits.copied(0).is_none() && (mine || visits.visit(0).is_some()));
        });
    }
}
