//! A step of the card does not allocate: counted by a global allocator of this test binary.

#![allow(unsafe_code)] // a global allocator cannot be written without

mod card;

use card::{Bench, MS, read, scenario, write};
use messages::registers::force;
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
    for filter in ["{ cascade = 4 }", "{ delay_ms = 128.0 }"] {
        let filter = format!("force_sensor_if.filter={filter}");
        let scenario = scenario(&[&filter, "force_sensor_if.noise_n=0.5"]);
        let mut bench = Bench::new(&scenario, |t| [10.0 * t; 6]);
        let mut counts = Vec::with_capacity(200);
        for window in 0..200 {
            let from = window * 5 * MS;
            let mut accesses = [read(from + 1000, force::filter(4)); 8];
            accesses[7] = write(from + 2000, force::OFFSET, window as i16);
            bench.window(from + 5 * MS, &accesses);
            counts.push(COUNT.with(Cell::get));
        }
        // the bench itself stops allocating when its buffers have grown
        assert_eq!(counts[10], counts[199], "{filter}");
    }
    let before = COUNT.with(Cell::get);
    drop(vec![1]);
    assert!(COUNT.with(Cell::get) > before, "the counter counts");
}
