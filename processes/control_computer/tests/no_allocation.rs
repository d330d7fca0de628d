//! A job in the steady state allocates nothing: counted by a global allocator of this test binary.

#![allow(unsafe_code)] // a global allocator cannot be written without

mod rig;

use messages::CommandKind;
use rig::{Rig, command, table_5_3};
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

/// Allocations in the board's step of the next job.
fn allocations(rig: &mut Rig) -> u64 {
    rig.answer();
    let before = COUNT.with(Cell::get);
    rig.step();
    let count = COUNT.with(Cell::get) - before;
    rig.finish();
    count
}

#[test]
fn a_job_allocates_only_where_the_list_of_its_writes_changes() {
    let mut rig = Rig::new(table_5_3());
    assert!(allocations(&mut rig) > 0, "the counter counts");
    rig.command(command(1, CommandKind::Segment), 0);
    for _ in 0..3 {
        rig.run();
    }
    for _ in 0..20 {
        assert_eq!(allocations(&mut rig), 0);
    }
    // a command that starts a segment, and its event
    rig.command(command(2, CommandKind::Segment), 0);
    assert_eq!(allocations(&mut rig), 0);
    assert_eq!(rig.out.mail.events.len(), 1);
}
