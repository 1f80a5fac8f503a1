// SPDX-License-Identifier: LGPL-3.0-or-later
//! A mutex that one owner enters without an atomic read-modify-write; all others revoke the owner first.
//!
//! The two barriers stand for membarrier(PRIVATE_EXPEDITED): each thread of the process executes a full barrier at
//! some point between the call and the return. Two models of that:
//! - `Barriers::Fences`: a full fence on both sides. The owner's code is store, compiler barrier, load. If the
//!   kernel's barrier comes before the load, then the load sees all that preceded the call. If it comes after the
//!   store, then the caller sees the store after the return. A pair of full fences gives the same two cases.
//! - `Barriers::Interrupts`: the owner has no fence. The kernel's barrier interrupts the owner between any two
//!   accesses, or finds the owner off its CPU. This model is closer to the machine: a full fence in the owner would
//!   also strengthen the relaxed loads before it.
//!
//! In the second model a barrier of the compiler has no counterpart, and a mutex is a full fence for the owner.
//!
//! The model does not hold priorities, and thus not the reason for the PI futex, only that no wake-up is lost.

use loom::cell::UnsafeCell;
use loom::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release, SeqCst};
use loom::sync::atomic::{fence, AtomicU32, AtomicUsize, Ordering};
use loom::sync::{Mutex, MutexGuard};
use loom::thread::{current, park, yield_now, Thread};
use std::mem::ManuallyDrop;
use std::ops::{Deref, DerefMut};

/// The one thing that a twin lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    None,
    /// Owner, lock(): no barrier between the store of inside and the second check.
    NoLightBarrierInLock,
    /// Owner, unlock(): no barrier between the store of inside and the check of owner_.
    NoLightBarrierInLeave,
    /// Outsider, lock(): no membarrier.
    NoHeavyBarrier,
    /// Owner, unlock(): inside.store(0) is relaxed.
    OrderOfLeave,
    /// Outsider, lock(): the load of inside that ends the wait is relaxed.
    OrderOfAwait,
    /// Owner, lock(): the second check is relaxed.
    OrderOfSecondCheck,
    /// Outsider, unlock(): the store of owner_ is relaxed.
    OrderOfGrant,
    /// Outsider, lock(): no wait for inside.
    NoAwait,
    /// Outsider, lock(): owner_ stays set.
    NoRevocation,
    /// Owner, lock(): enters after the first check.
    NoSecondCheck,
    /// Owner, lock(): inside stays set when the second check fails.
    NoLeaveAfterFailedCheck,
    /// Owner, lock(): takes mutex_ without a look at whom the bias belongs to now.
    NoRevocationByFormerOwner,
    /// Owner, unlock(): no fence between the store of inside and the exchange of handover.
    NoFenceInSlowLeave,
    /// Outsider, wait: no fence between the exchange of handover and the next load of inside.
    NoFenceInAwait,
    /// Outsider, wait: sleeps without another load of inside.
    NoRecheck,
    /// Outsider, wait: handover keeps the owner's id although the owner left.
    NoUndo,
    /// Owner, unlock(): gives handover back only if no thread sleeps there.
    NoUnlockForWaiters,
    /// Owner, unlock(): asks the kernel although handover is not locked on the owner's behalf.
    NoCheckOfHandover,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Barriers {
    Fences,
    Interrupts,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waiting {
    /// The outsider polls inside: fewer states, enough for mutual exclusion.
    Poll,
    /// The outsider sleeps on the PI futex handover.
    Futex,
}

#[derive(Clone, Copy, Debug)]
pub struct Config {
    pub weak: Weak,
    pub barriers: Barriers,
    pub waiting: Waiting,
}

const NO_SEAT: usize = usize::MAX;
const WAITERS: u32 = 1 << 31;

#[derive(Default)]
struct Seat {
    inside: AtomicU32,
    handover: AtomicU32,
}

/// A guard that does not unlock while loom reports a failure: loom cannot unlock then, and would abort the test.
pub struct Guard<'a, T>(ManuallyDrop<MutexGuard<'a, T>>);

impl<'a, T> Guard<'a, T> {
    fn lock(mutex: &'a Mutex<T>) -> Self {
        Self(ManuallyDrop::new(mutex.lock().unwrap()))
    }
}
impl<T> Drop for Guard<'_, T> {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            unsafe { ManuallyDrop::drop(&mut self.0) };
        }
    }
}
impl<T> Deref for Guard<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}
impl<T> DerefMut for Guard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// The kernel's PI futexes of one word (man 2 futex: FUTEX_LOCK_PI, FUTEX_UNLOCK_PI).
struct Kernel {
    queue: Mutex<Queue>,
}
struct Queue {
    sleeping: Vec<(u32, Thread)>,
    given: Option<u32>,
}

impl Kernel {
    fn lock_pi(&self, word: &AtomicU32, tid: u32) {
        let mut queue = Guard::lock(&self.queue);
        loop {
            match word.compare_exchange(0, tid, AcqRel, Acquire) {
                Ok(_) => return,
                Err(found) => {
                    let marked = found | WAITERS;
                    if word
                        .compare_exchange(found, marked, AcqRel, Acquire)
                        .is_ok()
                    {
                        break;
                    }
                }
            }
        }
        queue.sleeping.push((tid, current()));
        while queue.given != Some(tid) {
            drop(queue);
            park();
            queue = Guard::lock(&self.queue);
        }
        queue.given = None;
    }

    fn unlock_pi(&self, word: &AtomicU32, tid: u32) {
        let mut queue = Guard::lock(&self.queue);
        let next = if queue.sleeping.is_empty() {
            None
        } else {
            Some(queue.sleeping.remove(0))
        };
        let more = if queue.sleeping.is_empty() {
            0
        } else {
            WAITERS
        };
        let value = next.as_ref().map_or(0, |(tid, _)| tid | more);
        let before = word.swap(value, AcqRel);
        assert_eq!(before & !WAITERS, tid, "EPERM: not the holder of the futex");
        if let Some((tid, thread)) = next {
            queue.given = Some(tid);
            thread.unpark();
        }
    }
}

/// The owner's CPU as membarrier sees it.
mod cpu {
    pub const RUNS: usize = 0;
    pub const INTERRUPTED: usize = 1;
    pub const OFF: usize = 2;
}

pub struct BiasedMutex {
    config: Config,
    owner: AtomicUsize,
    granted: Mutex<usize>, // mutex_, and granted_ that it protects
    seats: [Seat; 2],
    kernel: Kernel,
    fences: AtomicUsize,
    cpu: AtomicUsize,
}

/// How a thread holds the mutex.
pub enum Held<'a> {
    Fast,
    Slow {
        granted: Guard<'a, usize>,
        revoked: bool,
    },
}

pub const fn tid_of(seat: usize) -> u32 {
    seat as u32 + 1
}

impl BiasedMutex {
    /// The bias belongs to seat 0.
    pub fn new(config: Config) -> Self {
        Self {
            config,
            owner: AtomicUsize::new(0),
            granted: Mutex::new(0),
            seats: Default::default(),
            kernel: Kernel {
                queue: Mutex::new(Queue {
                    sleeping: Vec::new(),
                    given: None,
                }),
            },
            fences: AtomicUsize::new(0),
            cpu: AtomicUsize::new(cpu::RUNS),
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
    /// loom switches threads at accesses, not at fences: the relaxed addition is such a point. It synchronizes nothing.
    fn full_fence(&self) {
        self.fences.fetch_add(1, Relaxed);
        fence(SeqCst);
    }

    fn light_barrier(&self, weak: Weak) {
        if self.config.barriers == Barriers::Fences && !self.weak(weak) {
            self.full_fence();
        }
    }
    fn heavy_barrier(&self) {
        if self.weak(Weak::NoHeavyBarrier) {
            return;
        }
        fence(SeqCst);
        if self.config.barriers == Barriers::Fences {
            self.fences.fetch_add(1, Relaxed);
        } else {
            let request = self
                .cpu
                .compare_exchange(cpu::RUNS, cpu::INTERRUPTED, AcqRel, Acquire);
            while request.is_ok() && self.cpu.load(Acquire) == cpu::INTERRUPTED {
                yield_now();
            }
        }
        fence(SeqCst);
    }
    /// A point of the owner's code at which the interrupt of a membarrier may arrive.
    fn interruptible(&self, seat: usize) {
        if self.config.barriers == Barriers::Interrupts
            && seat == 0
            && self.cpu.load(Relaxed) == cpu::INTERRUPTED
        {
            fence(SeqCst);
            self.cpu.swap(cpu::RUNS, AcqRel);
        }
    }
    fn switch_cpu(&self, seat: usize, state: usize) {
        if self.config.barriers == Barriers::Interrupts && seat == 0 {
            fence(SeqCst);
            self.cpu.swap(state, AcqRel);
            fence(SeqCst);
        }
    }
    /// The thread of the seat ends.
    pub fn end(&self, seat: usize) {
        self.switch_cpu(seat, cpu::OFF);
    }

    pub fn owner_lock(&self, seat: usize) -> Held<'_> {
        self.interruptible(seat);
        if self.owner.load(Relaxed) == seat {
            self.interruptible(seat);
            self.seats[seat].inside.store(tid_of(seat), Relaxed);
            self.light_barrier(Weak::NoLightBarrierInLock);
            self.interruptible(seat);
            let order = self.order(Weak::OrderOfSecondCheck, Acquire);
            if self.weak(Weak::NoSecondCheck) || self.owner.load(order) == seat {
                self.interruptible(seat);
                return Held::Fast;
            }
            if !self.weak(Weak::NoLeaveAfterFailedCheck) {
                self.leave(seat);
            }
        }
        self.switch_cpu(seat, cpu::OFF); // it may sleep in mutex_
        let granted = Guard::lock(&self.granted);
        self.switch_cpu(seat, cpu::RUNS);
        let revoked =
            *granted != NO_SEAT && *granted != seat && !self.weak(Weak::NoRevocationByFormerOwner);
        if revoked {
            self.revoke(*granted);
        }
        Held::Slow { granted, revoked }
    }

    pub fn owner_unlock(&self, seat: usize, held: Held) {
        match held {
            Held::Fast => self.leave(seat),
            Held::Slow { granted, revoked } => {
                if revoked {
                    self.owner
                        .store(*granted, self.order(Weak::OrderOfGrant, Release));
                }
                self.switch_cpu(seat, cpu::OFF);
                drop(granted);
                self.switch_cpu(seat, cpu::RUNS);
            }
        }
    }

    fn leave(&self, seat: usize) {
        self.interruptible(seat);
        let order = self.order(Weak::OrderOfLeave, Release);
        self.seats[seat].inside.store(0, order);
        if self.config.waiting == Waiting::Poll {
            return;
        }
        self.light_barrier(Weak::NoLightBarrierInLeave);
        self.interruptible(seat);
        if self.owner.load(Relaxed) != seat {
            self.slow_leave(seat);
        }
    }
    fn slow_leave(&self, seat: usize) {
        let tid = tid_of(seat);
        let handover = &self.seats[seat].handover;
        if !self.weak(Weak::NoFenceInSlowLeave) {
            self.full_fence();
        }
        self.interruptible(seat);
        let Err(found) = handover.compare_exchange(tid, 0, Relaxed, Relaxed) else {
            return;
        };
        if self.weak(Weak::NoUnlockForWaiters) {
            return;
        }
        if found & !WAITERS == tid || self.weak(Weak::NoCheckOfHandover) {
            self.switch_cpu(seat, cpu::OFF);
            self.kernel.unlock_pi(handover, tid);
            self.switch_cpu(seat, cpu::RUNS);
        }
    }

    pub fn outsider_lock(&self, tid: u32) -> Held<'_> {
        let granted = Guard::lock(&self.granted);
        if *granted != NO_SEAT {
            self.revoke_as(*granted, tid);
        }
        Held::Slow {
            granted,
            revoked: true,
        }
    }
    pub fn outsider_unlock(&self, held: Held) {
        if let Held::Slow { granted, .. } = held {
            self.owner
                .store(*granted, self.order(Weak::OrderOfGrant, Release));
        }
    }

    fn revoke(&self, seat: usize) {
        self.revoke_as(seat, tid_of(1 - seat));
    }
    fn revoke_as(&self, seat: usize, tid: u32) {
        if !self.weak(Weak::NoRevocation) {
            self.owner.store(NO_SEAT, Relaxed);
        }
        self.heavy_barrier();
        if !self.weak(Weak::NoAwait) {
            self.await_leave(seat, tid);
        }
    }
    fn await_leave(&self, seat: usize, me: u32) {
        let Seat { inside, handover } = &self.seats[seat];
        loop {
            let tid = inside.load(self.order(Weak::OrderOfAwait, Acquire));
            if tid == 0 {
                break;
            }
            if self.config.waiting == Waiting::Poll {
                yield_now();
                continue;
            }
            let _ = handover.compare_exchange(0, tid, Relaxed, Relaxed);
            if !self.weak(Weak::NoFenceInAwait) {
                self.full_fence();
            }
            if !self.weak(Weak::NoRecheck) && inside.load(Relaxed) == 0 {
                if !self.weak(Weak::NoUndo) {
                    let _ = handover.compare_exchange(tid, 0, Relaxed, Relaxed);
                }
                continue;
            }
            self.kernel.lock_pi(handover, me);
            self.kernel.unlock_pi(handover, me);
        }
        if self.config.waiting == Waiting::Futex {
            let left = handover.compare_exchange(0, 0, Relaxed, Relaxed);
            assert!(left.is_ok(), "handover is still locked");
        }
    }

    /// Two seats: no bias. Under outsider_lock().
    pub fn end_bias(held: &mut Held) {
        Self::move_bias(held, NO_SEAT);
    }
    /// One seat is left. Under outsider_lock().
    pub fn move_bias(held: &mut Held, seat: usize) {
        if let Held::Slow { granted, .. } = held {
            **granted = seat;
        }
    }
}

/// Data that the mutex protects: loom reports a race when it does not.
#[derive(Default)]
pub struct Counter(UnsafeCell<u32>);

impl Counter {
    pub fn add(&self) {
        self.0.with_mut(|value| unsafe { *value += 1 });
    }
    pub fn get(&self) -> u32 {
        self.0.with(|value| unsafe { *value })
    }
}
