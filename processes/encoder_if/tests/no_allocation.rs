//! A step of the cards does not allocate: counted by a global allocator of this test binary.

#![allow(unsafe_code)] // a global allocator cannot be written without

mod cards;

use cards::{Bench, MS, scenario};
use messages::registers::encoder;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged; the counter is a constant-initialised Cell, so
// touching it neither allocates nor runs a destructor
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_step_does_not_allocate_once_the_host_s_buffers_have_grown() {
    for delay in ["encoder_if.delay_ms=0", "encoder_if.delay_ms=100"] {
        let mut bench = Bench::new(&scenario(&[delay]), |t| 1e5 * t * t);
        let addresses = [encoder::COUNT, encoder::VELOCITY, encoder::INDEX]
            .map(|register| bench.addr(6, register));
        let mut counts = Vec::with_capacity(100);
        for window in 0..100 {
            let from = window * 5 * MS;
            bench.window(
                from + 5 * MS,
                &addresses.map(|addr| (from + 1000, addr, false)),
            );
            counts.push(COUNT.with(Cell::get));
        }
        // the bench itself stops allocating when its buffers have grown
        assert_eq!(counts[10], counts[99], "{delay}");
    }
    let before = COUNT.with(Cell::get);
    drop(vec![1]);
    assert!(COUNT.with(Cell::get) > before, "the counter counts");
}
