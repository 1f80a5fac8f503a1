// SPDX-License-Identifier: LGPL-3.0-or-later
//! The register of one writer and a fixed number of readers that neither block nor retry
//! (mauve_rt/data/latest_register.hpp), and its growth by new tables of slots.
//!
//! The exchange and the additions of word_ acquire and release: the writer that sees a take must also see that the
//! reader gave back its slot before.
//!
//! A value is its sequence. The table of slots is plain data behind an index `table`, which stands for a pointer: a
//! thread that reads a table without an order after its creation is a race.

use crate::sequence_cell::{self, SequenceCell};
use loom::cell::UnsafeCell;
use loom::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use loom::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc; // not loom's: the tables share the slots, and the protocol never frees a slot

/// The one thing that a twin lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    None,
    /// Readers + 1 slots.
    OneSlotLess,
    /// write(): the exchange of word_ does not release.
    NoReleaseOfExchange,
    /// A reader's addition to word_ does not acquire.
    NoAcquireOfTake,
    /// A reader's addition to released is relaxed.
    OrderOfLetGo,
    /// write(): the load of released is relaxed.
    OrderOfReleasedLoad,
    /// write(): fills a slot without a comparison of released and taken.
    NoComparison,
    /// write(): released is not set to 0 again.
    NoReset,
    /// A reader does not give back the slot that it kept.
    NoLetGo,
    /// A reader gives the slot back before the copy.
    LetGoBeforeCopy,
    /// write(): exchanges word_ before it fills front_.
    FrontAfterExchange,
    /// reserve(): the store of table_ is relaxed.
    OrderOfTableStore,
    /// write(): the load of table_ is relaxed.
    OrderOfWritersTable,
    /// A reader's load of table_ is relaxed.
    OrderOfReadersTable,
    /// A reader loads table_ before it takes an index.
    TableBeforeTake,
    /// reserve(): the old table is freed at once.
    NoOldTable,
    /// write(): the exchange of word_ does not acquire.
    NoAcquireOfExchange,
    /// A reader's addition to word_ does not release.
    NoReleaseOfTake,
}

#[derive(Clone, Copy, Debug)]
pub struct Config {
    pub weak: Weak,
    pub readers: usize,
    /// Values lie in front_ too; the cell may be weakened.
    pub front: Option<sequence_cell::Weak>,
}

#[derive(Default)]
struct Slot {
    released: AtomicUsize,
    taken: UnsafeCell<usize>,
    entry: UnsafeCell<usize>,
}

type Table = Vec<Arc<Slot>>;

pub struct LatestRegister {
    config: Config,
    front: Option<SequenceCell>,
    word: AtomicUsize,
    sequence: UnsafeCell<usize>, // of the writer
    table: AtomicUsize,
    tables: [UnsafeCell<Table>; 2],
}

const COUNT_BITS: u32 = 16;
const COUNT_MASK: usize = (1 << COUNT_BITS) - 1;

impl LatestRegister {
    pub fn new(config: Config) -> Self {
        let less = usize::from(config.weak == Weak::OneSlotLess);
        let slots = config.readers + 2 - less;
        Self {
            config,
            front: config.front.map(|weak| SequenceCell::new(weak, 1)),
            word: AtomicUsize::new(0),
            sequence: UnsafeCell::new(0),
            table: AtomicUsize::new(0),
            tables: [
                UnsafeCell::new((0..slots).map(|_| Arc::default()).collect()),
                UnsafeCell::new(Vec::new()),
            ],
        }
    }
    fn weak(&self, weak: Weak) -> bool {
        self.config.weak == weak
    }
    fn order(&self, weak: Weak, order: Ordering) -> Ordering {
        if self.weak(weak) {
            Relaxed
        } else {
            order
        }
    }
    /// The order of an access to word_: without one half, or whole.
    fn word_order(&self, no_acquire: Weak, no_release: Weak) -> Ordering {
        if self.weak(no_acquire) {
            Release
        } else if self.weak(no_release) {
            Acquire
        } else {
            AcqRel
        }
    }

    /// Room for `readers` readers. One thread at a time.
    pub fn reserve(&self, readers: usize) {
        let mut slots = self.tables[0].with(|table| unsafe { &*table }.clone());
        slots.resize_with(readers + 2, Arc::default);
        self.tables[1].with_mut(|table| unsafe { *table = slots });
        let order = self.order(Weak::OrderOfTableStore, Release);
        self.table.store(1, order);
        if self.weak(Weak::NoOldTable) {
            self.tables[0].with_mut(|_| ());
        }
    }
    fn slot_of(&self, table: usize, index: usize) -> Arc<Slot> {
        self.tables[table]
            .with(|table| unsafe { &*table }.get(index).cloned())
            .expect("an index is not in the table")
    }
    fn readers_table(&self) -> usize {
        let order = self.order(Weak::OrderOfReadersTable, Acquire);
        self.table.load(order)
    }

    /// One thread at a time. False: no slot is free.
    pub fn write(&self) -> bool {
        let order = self.order(Weak::OrderOfWritersTable, Acquire);
        let table = self.table.load(order);
        let size = self.tables[table].with(|table| unsafe { &*table }.len());
        let newest = self.word.load(Relaxed) >> COUNT_BITS;
        for index in (newest + 1..size).chain(0..newest) {
            let slot = self.slot_of(table, index);
            let order = self.order(Weak::OrderOfReleasedLoad, Acquire);
            let released = slot.released.load(order);
            let taken = slot.taken.with(|taken| unsafe { *taken });
            if released != taken && !self.weak(Weak::NoComparison) {
                continue;
            }
            if !self.weak(Weak::NoReset) {
                slot.released.store(0, Relaxed);
            }
            let sequence = self.sequence.with_mut(|sequence| unsafe {
                *sequence += 1;
                *sequence
            });
            slot.entry.with_mut(|entry| unsafe { *entry = sequence });
            let late = self.weak(Weak::FrontAfterExchange);
            if let (Some(front), false) = (&self.front, late) {
                front.store(sequence);
            }
            let order = self.word_order(Weak::NoAcquireOfExchange, Weak::NoReleaseOfExchange);
            let before = self.word.swap(index << COUNT_BITS, order);
            if let (Some(front), true) = (&self.front, late) {
                front.store(sequence);
            }
            self.slot_of(table, newest)
                .taken
                .with_mut(|taken| unsafe { *taken = before & COUNT_MASK });
            return true;
        }
        false
    }

    /// Returns the sequence of the value; 0: none.
    pub fn read(&self, held: &mut Option<usize>) -> usize {
        let Some(front) = &self.front else {
            return self.read_slot(held);
        };
        if let Some(sequence) = front.load() {
            return sequence;
        }
        // kCopies is 1 here: more tries are the same load again.
        self.read_slot(held)
    }
    /// The value in front_; 0: none, or a write came in between.
    pub fn read_front(&self) -> usize {
        self.front
            .as_ref()
            .and_then(SequenceCell::load)
            .unwrap_or(0)
    }
    /// The newest slot's value, as look() returns it.
    pub fn read_slot(&self, held: &mut Option<usize>) -> usize {
        let early = self
            .weak(Weak::TableBeforeTake)
            .then(|| self.readers_table());
        let newest = self.word.load(Relaxed) >> COUNT_BITS;
        if *held != Some(newest) {
            self.let_go(held);
            let order = self.word_order(Weak::NoAcquireOfTake, Weak::NoReleaseOfTake);
            *held = Some(self.word.fetch_add(1, order) >> COUNT_BITS);
        }
        let index = held.expect("a slot is held");
        let table = early.unwrap_or_else(|| self.readers_table());
        let slot = self.slot_of(table, index);
        if self.weak(Weak::LetGoBeforeCopy) {
            self.let_go(held);
        }
        slot.entry.with(|entry| unsafe { *entry })
    }
    pub fn let_go(&self, held: &mut Option<usize>) {
        let Some(index) = held.take() else { return };
        if self.weak(Weak::NoLetGo) {
            return;
        }
        let slot = self.slot_of(self.readers_table(), index);
        let order = self.order(Weak::OrderOfLetGo, Release);
        slot.released.fetch_add(1, order);
    }
}
