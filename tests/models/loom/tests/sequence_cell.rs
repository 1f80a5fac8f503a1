// SPDX-License-Identifier: LGPL-3.0-or-later
//! The sequence cell, and each of its weakened twins.

use loom::thread;
use mauve_loom_models::sequence_cell::{SequenceCell, Weak};
use mauve_loom_models::{explore, must_fail, Fault};
use std::sync::Arc;

/// The writer stores twice; a reader copies twice.
fn copies(weak: Weak) -> impl Fn() + Sync + Send + 'static {
    move || {
        let cell = Arc::new(SequenceCell::new(weak, 2));
        let reader = {
            let cell = cell.clone();
            thread::spawn(move || {
                let first = cell.load().unwrap_or(0);
                let second = cell.load().unwrap_or(first);
                assert!(first <= second, "a copy goes back");
            })
        };
        cell.store(1);
        cell.store(2);
        reader.join().unwrap();
        assert_eq!(cell.load(), Some(2), "the last value is lost");
    }
}

#[test]
fn two_copies() {
    explore(Some(3), copies(Weak::None));
}

macro_rules! twins {
    ($($name:ident: $weak:ident;)*) => {$(
        #[test]
        fn $name() {
            must_fail(Fault::Assertion("a torn value"), Some(3), copies(Weak::$weak));
        }
    )*};
}
twins! {
    order_of_word_stores: OrderOfWordStores;
    order_of_even_store: OrderOfEvenStore;
    order_of_first_load: OrderOfFirstLoad;
    order_of_word_loads: OrderOfWordLoads;
    no_odd_version: NoOddVersion;
    no_check_of_odd: NoCheckOfOdd;
    no_last_check: NoLastCheck;
}
