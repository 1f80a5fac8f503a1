// SPDX-License-Identifier: LGPL-3.0-or-later
//! Models of the kernel's lock-free protocols, and the means to explore them. README.md has the table of twins.

pub mod biased_mutex;
pub mod latest_register;
pub mod sequence_cell;
pub mod spsc_queue;

use std::cell::Cell;
use std::panic::{catch_unwind, set_hook, take_hook, AssertUnwindSafe};
use std::sync::Once;

/// The kind of failure that a weakened twin must show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Two accesses to the same plain data without an order between them.
    Race,
    /// Every thread sleeps: a wake-up was lost.
    Deadlock,
    /// An assertion of the model whose message contains this text.
    Assertion(&'static str),
}

/// Explores all interleavings; `preemptions` limits how often a running thread is interrupted, None: no limit.
pub fn explore<F>(preemptions: Option<usize>, scenario: F)
where
    F: Fn() + Sync + Send + 'static,
{
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = preemptions;
    builder.check(scenario);
}

thread_local! {
    static SILENT: Cell<bool> = const { Cell::new(false) };
}

/// Explores a weakened twin and asserts that the exploration finds this fault.
pub fn must_fail<F>(fault: Fault, preemptions: Option<usize>, scenario: F)
where
    F: Fn() + Sync + Send + 'static,
{
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let shown = take_hook();
        set_hook(Box::new(move |info| {
            if !SILENT.get() {
                shown(info);
            }
        }));
    });
    SILENT.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(|| explore(preemptions, scenario)));
    SILENT.set(false);
    let Err(payload) = outcome else {
        panic!("the weakened twin passes: expected {fault:?}");
    };
    let message = payload
        .downcast_ref::<String>()
        .cloned()
        .or_else(|| payload.downcast_ref::<&str>().map(|text| text.to_string()))
        .unwrap_or_default();
    let sign = match fault {
        Fault::Race => "Causality violation",
        Fault::Deadlock => "deadlock",
        Fault::Assertion(text) => text,
    };
    assert!(
        message.contains(sign),
        "the twin fails in another way: expected {fault:?}, found: {message}"
    );
}
