// SPDX-License-Identifier: LGPL-3.0-or-later
//! A value of some words that readers copy without a write; a copy that meets a write fails
//! (mauve_rt/base/sequence_cell.hpp).

use loom::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use loom::sync::atomic::{AtomicUsize, Ordering};

/// The one thing that a twin lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    None,
    /// store(): the store of the odd version is relaxed.
    OrderOfOddStore,
    /// store(): the stores of the words are relaxed.
    OrderOfWordStores,
    /// store(): the store of the even version is relaxed.
    OrderOfEvenStore,
    /// load(): the first load of the version is relaxed.
    OrderOfFirstLoad,
    /// load(): the loads of the words are relaxed.
    OrderOfWordLoads,
    /// load(): the last load of the version is relaxed.
    OrderOfLastLoad,
    /// store(): no odd version before the words.
    NoOddVersion,
    /// load(): copies although the version is odd.
    NoCheckOfOdd,
    /// load(): does not compare the version after the copy.
    NoLastCheck,
}

pub struct SequenceCell {
    weak: Weak,
    version: AtomicUsize,
    words: Vec<AtomicUsize>,
}

impl SequenceCell {
    pub fn new(weak: Weak, words: usize) -> Self {
        Self {
            weak,
            version: AtomicUsize::new(0),
            words: (0..words).map(|_| AtomicUsize::new(0)).collect(),
        }
    }
    fn order(&self, weak: Weak, order: Ordering) -> Ordering {
        if self.weak == weak {
            Relaxed
        } else {
            order
        }
    }

    /// Writes the value whose words are all `sequence`. One thread at a time.
    pub fn store(&self, sequence: usize) {
        if self.weak != Weak::NoOddVersion {
            let order = self.order(Weak::OrderOfOddStore, Release);
            self.version.store(2 * sequence - 1, order);
        }
        for word in &self.words {
            word.store(sequence, self.order(Weak::OrderOfWordStores, Release));
        }
        let order = self.order(Weak::OrderOfEvenStore, Release);
        self.version.store(2 * sequence, order);
    }
    /// The value's sequence; None: a write came in between.
    pub fn load(&self) -> Option<usize> {
        let before = self
            .version
            .load(self.order(Weak::OrderOfFirstLoad, Acquire));
        if before % 2 == 1 && self.weak != Weak::NoCheckOfOdd {
            return None;
        }
        let order = self.order(Weak::OrderOfWordLoads, Acquire);
        let words: Vec<_> = self.words.iter().map(|word| word.load(order)).collect();
        let last = self.order(Weak::OrderOfLastLoad, Acquire);
        if self.weak != Weak::NoLastCheck && self.version.load(last) != before {
            return None;
        }
        let whole = words.iter().all(|&word| word == before / 2);
        assert!(whole, "a torn value");
        Some(before / 2)
    }
}
