// SPDX-License-Identifier: LGPL-3.0-or-later
//! The register of one writer and many readers, its growth, and each of its weakened twins.

use loom::sync::atomic::AtomicUsize;
use loom::sync::atomic::Ordering::{Acquire, Release};
use loom::thread;
use mauve_loom_models::latest_register::{Config, LatestRegister, Weak};
use mauve_loom_models::{explore, must_fail, sequence_cell, Fault};
use std::sync::Arc;

struct Shared {
    register: LatestRegister,
    seen: AtomicUsize, // the newest value of a read that one reader finished
}

fn shared(config: Config) -> Arc<Shared> {
    Arc::new(Shared {
        register: LatestRegister::new(config),
        seen: AtomicUsize::new(0),
    })
}
fn write(times: usize, shared: &Shared) {
    for _ in 0..times {
        assert!(shared.register.write(), "no slot is free");
    }
}
fn read_twice(shared: &Shared) {
    let mut held = None;
    let first = shared.register.read(&mut held);
    let second = shared.register.read(&mut held);
    assert!(first <= second, "a read goes back");
    shared.register.let_go(&mut held);
}

/// The writer writes three times; one reader reads twice.
fn one_reader(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let reader = {
            let shared = shared.clone();
            thread::spawn(move || read_twice(&shared))
        };
        write(3, &shared);
        reader.join().unwrap();
    }
}
/// One thread writes and reads in turn, so often that every slot is used again.
fn in_turn(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let mut held = None;
        for sequence in 1..=9 {
            write(1, &shared);
            assert_eq!(shared.register.read(&mut held), sequence);
        }
    }
}
/// Two readers; the second one may not read an older value than the first one told it.
fn two_readers(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let first = {
            let shared = shared.clone();
            thread::spawn(move || {
                let mut held = None;
                let value = shared.register.read(&mut held);
                shared.seen.store(value, Release);
                shared.register.let_go(&mut held);
            })
        };
        let second = {
            let shared = shared.clone();
            thread::spawn(move || {
                let mut held = None;
                shared.register.read(&mut held);
                let least = shared.seen.load(Acquire);
                let value = shared.register.read(&mut held);
                assert!(least <= value, "a read goes back");
                shared.register.let_go(&mut held);
            })
        };
        write(2, &shared);
        first.join().unwrap();
        second.join().unwrap();
    }
}
/// A reader that keeps the first slot meets writes in front_. It may not read an older value than another reader
/// told it.
fn contended(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let mut held = None;
        assert_eq!(shared.register.read_slot(&mut held), 0);
        let writer = {
            let shared = shared.clone();
            thread::spawn(move || write(2, &shared))
        };
        let first = {
            let shared = shared.clone();
            thread::spawn(move || {
                let value = shared.register.read_front();
                shared.seen.store(value, Release);
            })
        };
        let least = shared.seen.load(Acquire);
        let value = shared.register.read(&mut held);
        assert!(least <= value, "a read goes back");
        writer.join().unwrap();
        first.join().unwrap();
    }
}
/// One reader reads front_ or a slot, then the slots only, as look() does.
fn look_after_read(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let reader = {
            let shared = shared.clone();
            thread::spawn(move || {
                let mut held = None;
                let first = shared.register.read(&mut held);
                let second = shared.register.read_slot(&mut held);
                assert!(first <= second, "a look goes back");
            })
        };
        write(2, &shared);
        reader.join().unwrap();
    }
}
/// One reader reads twice; another one is added, and reads twice; the writer writes three times.
fn growth(config: Config) -> impl Fn() + Sync + Send + 'static {
    move || {
        let shared = shared(config);
        let reader = {
            let shared = shared.clone();
            thread::spawn(move || read_twice(&shared))
        };
        let added = {
            let shared = shared.clone();
            thread::spawn(move || {
                shared.register.reserve(2);
                read_twice(&shared);
            })
        };
        write(3, &shared);
        reader.join().unwrap();
        added.join().unwrap();
    }
}

const fn slots(weak: Weak, readers: usize) -> Config {
    Config {
        weak,
        readers,
        front: None,
    }
}
const fn front(weak: Weak, cell: sequence_cell::Weak, readers: usize) -> Config {
    Config {
        weak,
        readers,
        front: Some(cell),
    }
}
const fn growing(weak: Weak) -> Config {
    Config {
        weak,
        readers: 1,
        front: None,
    }
}

#[test]
fn slots_of_one_reader() {
    explore(None, one_reader(slots(Weak::None, 1)));
}
#[test]
fn slots_in_turn() {
    explore(None, in_turn(slots(Weak::None, 1)));
}
#[test]
fn slots_of_two_readers() {
    explore(Some(4), two_readers(slots(Weak::None, 2)));
}
#[test]
fn front_that_is_contended() {
    explore(
        Some(2),
        contended(front(Weak::None, sequence_cell::Weak::None, 2)),
    );
}
#[test]
fn growth_by_one_reader() {
    explore(Some(2), growth(growing(Weak::None)));
}

const NO_SLOT: Fault = Fault::Assertion("no slot is free");
const BACK: Fault = Fault::Assertion("goes back");

macro_rules! twins {
    ($($name:ident: $scenario:ident($config:expr), $preemptions:expr => $fault:expr;)*) => {$(
        #[test]
        fn $name() {
            must_fail($fault, $preemptions, $scenario($config));
        }
    )*};
}
twins! {
    one_slot_less: one_reader(slots(Weak::OneSlotLess, 1)), None => NO_SLOT;
    no_release_of_exchange: one_reader(slots(Weak::NoReleaseOfExchange, 1)), None => Fault::Race;
    no_acquire_of_take: one_reader(slots(Weak::NoAcquireOfTake, 1)), None => Fault::Race;
    order_of_let_go: one_reader(slots(Weak::OrderOfLetGo, 1)), None => Fault::Race;
    order_of_released_load: one_reader(slots(Weak::OrderOfReleasedLoad, 1)), None => Fault::Race;
    no_comparison: one_reader(slots(Weak::NoComparison, 1)), None => Fault::Race;
    no_reset: in_turn(slots(Weak::NoReset, 1)), None => NO_SLOT;
    no_let_go: one_reader(slots(Weak::NoLetGo, 1)), None => NO_SLOT;
    let_go_before_copy: one_reader(slots(Weak::LetGoBeforeCopy, 1)), None => Fault::Race;
    front_after_exchange: two_readers(front(Weak::FrontAfterExchange, sequence_cell::Weak::None, 2)), Some(2) => BACK;
    order_of_odd_store: contended(front(Weak::None, sequence_cell::Weak::OrderOfOddStore, 2)), Some(2) => BACK;
    order_of_last_load: contended(front(Weak::None, sequence_cell::Weak::OrderOfLastLoad, 2)), Some(2) => BACK;
    look_after_read_goes_back: look_after_read(front(Weak::None, sequence_cell::Weak::None, 1)), Some(2) => BACK;
    order_of_table_store: growth(growing(Weak::OrderOfTableStore)), Some(2) => Fault::Race;
    order_of_writers_table: growth(growing(Weak::OrderOfWritersTable)), Some(2) => Fault::Race;
    order_of_readers_table: growth(growing(Weak::OrderOfReadersTable)), Some(2) => Fault::Race;
    table_before_take: growth(growing(Weak::TableBeforeTake)), Some(2) => Fault::Assertion("an index is not in the table");
    no_old_table: growth(growing(Weak::NoOldTable)), Some(2) => Fault::Race;
    no_acquire_of_exchange: one_reader(slots(Weak::NoAcquireOfExchange, 1)), None => NO_SLOT;
    no_release_of_take: one_reader(slots(Weak::NoReleaseOfTake, 1)), None => NO_SLOT;
}
