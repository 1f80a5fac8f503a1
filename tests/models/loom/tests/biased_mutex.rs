// SPDX-License-Identifier: LGPL-3.0-or-later
//! The biased mutex, and each of its weakened twins.

use loom::thread;
use mauve_loom_models::biased_mutex::{
    Barriers, BiasedMutex, Config, Counter, Held, Waiting, Weak,
};
use mauve_loom_models::{explore, must_fail, Fault};
use std::sync::Arc; // not loom's: loom cannot drop its own while it reports a deadlock

const OUTSIDER: u32 = 11; // its thread id

type Shared = Arc<(BiasedMutex, Counter)>;

fn shared(config: Config) -> Shared {
    Arc::new((BiasedMutex::new(config), Counter::default()))
}
fn as_owner(seat: usize, sections: u32, shared: &Shared) {
    for _ in 0..sections {
        let held = shared.0.owner_lock(seat);
        shared.1.add();
        shared.0.owner_unlock(seat, held);
    }
    shared.0.end(seat);
}
fn owner(sections: u32, shared: &Shared) -> thread::JoinHandle<()> {
    let shared = shared.clone();
    thread::spawn(move || as_owner(0, sections, &shared))
}
fn as_outsider(tid: u32, shared: &Shared, change: fn(&mut Held)) {
    let mut held = shared.0.outsider_lock(tid);
    shared.1.add();
    change(&mut held);
    shared.0.outsider_unlock(held);
}
fn nothing(_held: &mut Held) {}

/// The owner enters twice, an outsider once.
fn one_outsider(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(2, &shared);
        as_outsider(OUTSIDER, &shared, nothing);
        owner.join().unwrap();
        assert_eq!(shared.1.get(), 3, "an addition is lost");
    }
}
/// The owner and two outsiders enter once.
fn two_outsiders(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(1, &shared);
        let other = {
            let shared = shared.clone();
            thread::spawn(move || as_outsider(OUTSIDER + 1, &shared, nothing))
        };
        as_outsider(OUTSIDER, &shared, nothing);
        owner.join().unwrap();
        other.join().unwrap();
        assert_eq!(shared.1.get(), 3, "an addition is lost");
    }
}
/// The outsider enters twice, and sees what it left itself.
fn outsider_twice(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(2, &shared);
        as_outsider(OUTSIDER, &shared, nothing);
        as_outsider(OUTSIDER, &shared, nothing);
        owner.join().unwrap();
        assert_eq!(shared.1.get(), 4, "an addition is lost");
    }
}
/// The bias ends while the first owner may be inside; then both owners enter.
fn second_seat(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(2, &shared);
        as_outsider(OUTSIDER, &shared, BiasedMutex::end_bias);
        as_owner(1, 1, &shared);
        owner.join().unwrap();
        assert_eq!(shared.1.get(), 4, "an addition is lost");
    }
}
/// The bias moves to the second seat while the first owner may be inside or about to enter.
fn moved_bias(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(1, &shared);
        as_outsider(OUTSIDER, &shared, |held| BiasedMutex::move_bias(held, 1));
        as_owner(1, 1, &shared);
        owner.join().unwrap();
        assert_eq!(shared.1.get(), 3, "an addition is lost");
    }
}

/// The bias ends and comes back.
fn returned_bias(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let owner = owner(2, &shared);
        as_outsider(OUTSIDER, &shared, BiasedMutex::end_bias);
        as_outsider(OUTSIDER, &shared, |held| BiasedMutex::move_bias(held, 0));
        owner.join().unwrap();
        assert_eq!(shared.1.get(), 4, "an addition is lost");
    }
}

const fn with(weak: Weak, barriers: Barriers, waiting: Waiting) -> Config {
    Config {
        weak,
        barriers,
        waiting,
    }
}

macro_rules! holds {
    ($($name:ident: $scenario:ident, $barriers:ident, $waiting:ident, $preemptions:expr;)*) => {$(
        #[test]
        fn $name() {
            explore($preemptions, $scenario(with(Weak::None, Barriers::$barriers, Waiting::$waiting)));
        }
    )*};
}
macro_rules! twins {
    ($($name:ident: $weak:ident, $scenario:ident, $barriers:ident, $waiting:ident => $fault:expr;)*) => {$(
        #[test]
        fn $name() {
            must_fail($fault, Some(3), $scenario(with(Weak::$weak, Barriers::$barriers, Waiting::$waiting)));
        }
    )*};
}

holds! {
    one_outsider_with_fences: one_outsider, Fences, Poll, None;
    one_outsider_with_interrupts: one_outsider, Interrupts, Poll, None;
    one_outsider_with_futex: one_outsider, Fences, Futex, None;
    one_outsider_with_futex_and_interrupts: one_outsider, Interrupts, Futex, Some(4);
    two_outsiders_with_fences: two_outsiders, Fences, Poll, Some(3);
    two_outsiders_with_futex: two_outsiders, Fences, Futex, Some(3);
    outsider_twice_with_fences: outsider_twice, Fences, Poll, Some(4);
    outsider_twice_with_futex: outsider_twice, Fences, Futex, Some(4);
    second_seat_with_fences: second_seat, Fences, Poll, None;
    moved_bias_with_fences: moved_bias, Fences, Poll, Some(5);
    returned_bias_with_fences: returned_bias, Fences, Poll, Some(4);
}

twins! {
    no_light_barrier_in_lock: NoLightBarrierInLock, one_outsider, Fences, Poll => Fault::Race;
    no_heavy_barrier: NoHeavyBarrier, one_outsider, Fences, Poll => Fault::Race;
    no_heavy_barrier_with_interrupts: NoHeavyBarrier, one_outsider, Interrupts, Poll => Fault::Race;
    order_of_leave: OrderOfLeave, one_outsider, Fences, Poll => Fault::Race;
    order_of_leave_with_interrupts: OrderOfLeave, one_outsider, Interrupts, Poll => Fault::Race;
    order_of_await: OrderOfAwait, one_outsider, Fences, Poll => Fault::Race;
    order_of_await_with_interrupts: OrderOfAwait, one_outsider, Interrupts, Poll => Fault::Race;
    order_of_second_check: OrderOfSecondCheck, one_outsider, Fences, Poll => Fault::Race;
    order_of_second_check_with_interrupts: OrderOfSecondCheck, one_outsider, Interrupts, Poll => Fault::Race;
    order_of_grant: OrderOfGrant, one_outsider, Fences, Poll => Fault::Race;
    order_of_grant_with_interrupts: OrderOfGrant, one_outsider, Interrupts, Poll => Fault::Race;
    no_await: NoAwait, one_outsider, Fences, Poll => Fault::Race;
    no_revocation: NoRevocation, one_outsider, Fences, Poll => Fault::Race;
    no_second_check: NoSecondCheck, one_outsider, Fences, Poll => Fault::Race;
    no_revocation_by_former_owner: NoRevocationByFormerOwner, moved_bias, Fences, Poll => Fault::Race;
    no_leave_after_failed_check: NoLeaveAfterFailedCheck, one_outsider, Fences, Futex => Fault::Deadlock;
    no_light_barrier_in_leave: NoLightBarrierInLeave, one_outsider, Fences, Futex => Fault::Deadlock;
    no_fence_in_slow_leave_with_interrupts: NoFenceInSlowLeave, one_outsider, Interrupts, Futex => Fault::Deadlock;
    no_fence_in_await: NoFenceInAwait, one_outsider, Fences, Futex => Fault::Deadlock;
    no_recheck: NoRecheck, one_outsider, Fences, Futex => Fault::Deadlock;
    no_undo: NoUndo, one_outsider, Fences, Futex => Fault::Assertion("handover is still locked");
    no_unlock_for_waiters: NoUnlockForWaiters, one_outsider, Fences, Futex => Fault::Deadlock;
    no_check_of_handover: NoCheckOfHandover, one_outsider, Fences, Futex => Fault::Assertion("EPERM");
}
