// SPDX-License-Identifier: LGPL-3.0-or-later
//! The queue of one producer and one consumer, and each of its weakened twins.

use loom::thread;
use mauve_loom_models::spsc_queue::{SpscQueue, Weak};
use mauve_loom_models::{explore, must_fail, Fault};
use std::sync::Arc;

/// The producer pushes 1, 2, ...; the consumer tries as often, and drains the queue at the end.
fn transfer(weak: Weak, capacity: usize, elements: u32) -> impl Fn() + Sync + Send + 'static {
    move || {
        let queue = Arc::new(SpscQueue::new(weak, capacity));
        let consumer = {
            let queue = queue.clone();
            thread::spawn(move || (0..elements).filter_map(|_| queue.pop()).collect())
        };
        let accepted: Vec<u32> = (1..=elements).filter(|&value| queue.push(value)).collect();
        let mut received: Vec<u32> = consumer.join().unwrap();
        received.extend(std::iter::from_fn(|| queue.pop()));
        assert_eq!(
            received, accepted,
            "elements are lost, doubled or out of order"
        );
        assert_eq!(elements, accepted.len() as u32 + queue.lost());
    }
}
/// A third thread peeks twice while the others push and pop.
fn peeker(weak: Weak, capacity: usize, elements: u32) -> impl Fn() + Sync + Send + 'static {
    move || {
        let queue = Arc::new(SpscQueue::new(weak, capacity));
        let consumer = {
            let queue = queue.clone();
            thread::spawn(move || (0..elements).filter_map(|_| queue.pop()).count())
        };
        let peeker = {
            let queue = queue.clone();
            thread::spawn(move || {
                let first = queue.peek().unwrap_or(0);
                let second = queue.peek().unwrap_or(0);
                assert!(first <= second, "a peek goes back");
            })
        };
        for value in 1..=elements {
            queue.push(value);
        }
        consumer.join().unwrap();
        peeker.join().unwrap();
    }
}

#[test]
fn one_place_three_elements() {
    explore(None, transfer(Weak::None, 1, 3));
}
#[test]
fn two_places_four_elements() {
    explore(None, transfer(Weak::None, 2, 4));
}
#[test]
fn peeker_with_one_place() {
    explore(Some(3), peeker(Weak::None, 1, 2));
}
#[test]
fn peeker_with_two_places() {
    explore(Some(3), peeker(Weak::None, 2, 3));
}

macro_rules! twins {
    ($($name:ident: $weak:ident, $scenario:ident => $fault:expr;)*) => {$(
        #[test]
        fn $name() {
            must_fail($fault, Some(3), $scenario(Weak::$weak, 1, 3));
        }
    )*};
}
twins! {
    order_of_tail_store: OrderOfTailStore, transfer => Fault::Race;
    order_of_tail_load: OrderOfTailLoad, transfer => Fault::Race;
    order_of_head_store: OrderOfHeadStore, transfer => Fault::Race;
    order_of_head_load: OrderOfHeadLoad, transfer => Fault::Race;
    no_check_of_full: NoCheckOfFull, transfer => Fault::Assertion("lost, doubled or out of order");
    no_check_of_empty: NoCheckOfEmpty, transfer => Fault::Race;
    tail_before_place: TailBeforePlace, transfer => Fault::Race;
    head_before_place: HeadBeforePlace, transfer => Fault::Race;
    no_mutex_of_peeker: NoMutexOfPeeker, peeker => Fault::Race;
}
