//! A bounded queue of bytes from one interrupt to one loop.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

/// Bytes that may wait: three of the longest slcan lines. A power of two, so that the counts below may wrap.
pub const CAPACITY: usize = 512;

/// Queue of at most [`CAPACITY`] bytes for one writer and one reader. Bytes that do not fit are dropped and counted.
#[derive(Debug)]
pub struct Ring {
    bytes: [AtomicU8; CAPACITY],
    /// Bytes ever written and ever read; the difference is the number waiting.
    written: AtomicUsize,
    read: AtomicUsize,
    lost: AtomicUsize,
}

impl Default for Ring {
    fn default() -> Self {
        Self::new()
    }
}

impl Ring {
    /// An empty ring.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [const { AtomicU8::new(0) }; CAPACITY],
            written: AtomicUsize::new(0),
            read: AtomicUsize::new(0),
            lost: AtomicUsize::new(0),
        }
    }

    /// Appends a byte, or counts it as lost. For the writer.
    pub fn push(&self, byte: u8) {
        let written = self.written.load(Ordering::Relaxed);
        let waiting = written.wrapping_sub(self.read.load(Ordering::Acquire));
        match self.bytes.get(written % CAPACITY) {
            Some(place) if waiting < CAPACITY => {
                place.store(byte, Ordering::Relaxed);
                // The byte is stored before the reader may see it.
                self.written
                    .store(written.wrapping_add(1), Ordering::Release);
            }
            _ => self.lose(),
        }
    }

    /// Counts a byte that was lost before it got here. For the writer.
    pub fn lose(&self) {
        let lost = self.lost.load(Ordering::Relaxed);
        self.lost.store(lost.saturating_add(1), Ordering::Relaxed);
    }

    /// Takes the oldest byte. For the reader.
    pub fn pop(&self) -> Option<u8> {
        let read = self.read.load(Ordering::Relaxed);
        if read == self.written.load(Ordering::Acquire) {
            return None;
        }
        let byte = self.bytes.get(read % CAPACITY)?.load(Ordering::Relaxed);
        // The slot is free only once the byte has been read.
        self.read.store(read.wrapping_add(1), Ordering::Release);
        Some(byte)
    }

    /// Whether no byte waits.
    pub fn is_empty(&self) -> bool {
        self.read.load(Ordering::Relaxed) == self.written.load(Ordering::Acquire)
    }

    /// Bytes lost so far.
    pub fn lost(&self) -> usize {
        self.lost.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against a queue of the standard library, over bursts longer than the ring.
        #[test]
        fn behaves_as_a_bounded_queue(bursts in proptest::collection::vec((0_usize..700, 0_usize..700), 1..20)) {
            let ring = Ring::new();
            let mut model = VecDeque::new();
            let mut lost = 0;
            let mut next = 0_u8;
            for (pushes, pops) in bursts {
                for _ in 0..pushes {
                    next = next.wrapping_mul(5).wrapping_add(1);
                    ring.push(next);
                    if model.len() < CAPACITY {
                        model.push_back(next);
                    } else {
                        lost += 1;
                    }
                }
                for _ in 0..pops {
                    prop_assert_eq!(ring.pop(), model.pop_front());
                }
                prop_assert_eq!(ring.is_empty(), model.is_empty());
                prop_assert_eq!(ring.lost(), lost);
            }
        }
    }

    #[test]
    fn the_counts_may_wrap() {
        let ring = Ring::new();
        ring.written.store(usize::MAX - 1, Ordering::Relaxed);
        ring.read.store(usize::MAX - 1, Ordering::Relaxed);
        (1..=4).for_each(|byte| ring.push(byte));
        let taken: Vec<u8> = std::iter::from_fn(|| ring.pop()).collect();
        assert_eq!(taken, [1, 2, 3, 4]);
    }

    #[test]
    fn a_writer_in_another_thread_loses_nothing_that_fits() {
        let ring = Ring::new();
        std::thread::scope(|scope| {
            scope.spawn(|| (0..CAPACITY).for_each(|k| ring.push(k as u8)));
            let mut expected = 0;
            while expected < CAPACITY {
                if let Some(byte) = ring.pop() {
                    assert_eq!(byte, expected as u8);
                    expected += 1;
                }
            }
        });
        assert_eq!(ring.lost(), 0);
    }
}
