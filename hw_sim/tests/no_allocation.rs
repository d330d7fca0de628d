//! A step does not allocate: counted by a global allocator of this test binary.

#![allow(unsafe_code)] // a global allocator cannot be written without

mod common;

use common::{Bench, free, scenario};
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
fn a_step_in_steady_state_does_not_allocate() {
    for integrator in ["semi-implicit", "rk4"] {
        let mut scenario = scenario(&[&format!("plant.integrator={integrator}")]);
        // in contact, sliding down
        scenario.surfaces[0].position_m[2] = -0.001;
        let mut bench = Bench::new(&scenario);
        bench.window(5_000_000, &[free(1_000_001, [0.0; 7])]);
        let before = COUNT.with(Cell::get);
        for _ in 0..20 {
            let at = bench.t;
            bench.window(at + 5_000_000, &[free(at + 1_000_001, [0.0, -3.1, -0.9, 4.2, 1.9, -0.1, 0.0])]);
        }
        assert_eq!(COUNT.with(Cell::get) - before, 0, "{integrator}");
        assert!(bench.out.mail.plant.len() >= 51);
    }
}
