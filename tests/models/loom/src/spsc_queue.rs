// SPDX-License-Identifier: LGPL-3.0-or-later
//! A bounded queue of one producer and one consumer. Each side caches the other side's index.
//!
//! A third thread, the peeker, may read the newest element. A mutex keeps the peeker and the producer apart; the
//! consumer pops at the same time.

use loom::cell::UnsafeCell;
use loom::sync::atomic::AtomicUsize;
use loom::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use loom::sync::Mutex;

/// The one thing that a twin lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    None,
    /// push(): the store of tail_ is relaxed.
    OrderOfTailStore,
    /// pop(): the load of tail_ is relaxed.
    OrderOfTailLoad,
    /// pop(): the store of head_ is relaxed.
    OrderOfHeadStore,
    /// push(): the load of head_ is relaxed.
    OrderOfHeadLoad,
    /// push(): no check that a place is free.
    NoCheckOfFull,
    /// pop(): no check that an element is there.
    NoCheckOfEmpty,
    /// push(): publishes the element before it writes the place.
    TailBeforePlace,
    /// pop(): frees the place before it reads the element.
    HeadBeforePlace,
    /// The peeker does not take the mutex.
    NoMutexOfPeeker,
}

pub struct SpscQueue {
    weak: Weak,
    tail: AtomicUsize,
    head: AtomicUsize,
    cached_tail: UnsafeCell<usize>,
    producer: Mutex<Producer>,
    places: Vec<UnsafeCell<u32>>,
}

#[derive(Default)]
struct Producer {
    cached_head: usize,
    lost: u32,
}

impl SpscQueue {
    pub fn new(weak: Weak, capacity: usize) -> Self {
        Self {
            weak,
            tail: AtomicUsize::new(0),
            head: AtomicUsize::new(0),
            cached_tail: UnsafeCell::new(0),
            producer: Mutex::new(Producer::default()),
            places: (0..capacity).map(|_| UnsafeCell::new(0)).collect(),
        }
    }
    fn weak(&self, weak: Weak) -> bool {
        self.weak == weak
    }
    fn place(&self, index: usize) -> &UnsafeCell<u32> {
        &self.places[index % self.places.len()]
    }

    /// Producer. False: the queue is full, the element is counted as lost.
    pub fn push(&self, value: u32) -> bool {
        let mut producer = self.producer.lock().unwrap();
        let tail = self.tail.load(Relaxed);
        let full = |head: usize| tail - head >= self.places.len();
        if full(producer.cached_head) && !self.weak(Weak::NoCheckOfFull) {
            let weak = self.weak(Weak::OrderOfHeadLoad);
            producer.cached_head = self.head.load(if weak { Relaxed } else { Acquire });
            if full(producer.cached_head) {
                producer.lost += 1;
                return false;
            }
        }
        let weak = self.weak(Weak::OrderOfTailStore);
        let order = if weak { Relaxed } else { Release };
        if self.weak(Weak::TailBeforePlace) {
            self.tail.store(tail + 1, order);
        }
        self.place(tail).with_mut(|place| unsafe { *place = value });
        if !self.weak(Weak::TailBeforePlace) {
            self.tail.store(tail + 1, order);
        }
        true
    }

    /// Consumer.
    pub fn pop(&self) -> Option<u32> {
        let head = self.head.load(Relaxed);
        let cached = self.cached_tail.with(|tail| unsafe { *tail });
        if head == cached && !self.weak(Weak::NoCheckOfEmpty) {
            let weak = self.weak(Weak::OrderOfTailLoad);
            let tail = self.tail.load(if weak { Relaxed } else { Acquire });
            self.cached_tail
                .with_mut(|cached| unsafe { *cached = tail });
            if head == tail {
                return None;
            }
        }
        let weak = self.weak(Weak::OrderOfHeadStore);
        let order = if weak { Relaxed } else { Release };
        if self.weak(Weak::HeadBeforePlace) {
            self.head.store(head + 1, order);
        }
        let value = self.place(head).with(|place| unsafe { *place });
        if !self.weak(Weak::HeadBeforePlace) {
            self.head.store(head + 1, order);
        }
        Some(value)
    }

    /// Peeker: the newest element, popped or not.
    pub fn peek(&self) -> Option<u32> {
        let guard = (!self.weak(Weak::NoMutexOfPeeker)).then(|| self.producer.lock().unwrap());
        let tail = self.tail.load(Relaxed);
        if tail == 0 {
            return None;
        }
        let value = self.place(tail - 1).with(|place| unsafe { *place });
        drop(guard);
        Some(value)
    }

    pub fn lost(&self) -> u32 {
        self.producer.lock().unwrap().lost
    }
}
