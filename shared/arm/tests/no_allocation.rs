//! No algorithm allocates: counted by a global allocator of this test binary.

#![allow(unsafe_code)] // a global allocator cannot be written without

use arm::{ArmModel, ArmState, FrozenArm, JointVector, Spatial, aba, bias, crba, gravity_torque, rnea, tip_motion};
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
fn no_algorithm_allocates() {
    let model = ArmModel::rediestro();
    let slide = ArmModel::slide(3.0);
    let before = COUNT.with(Cell::get);
    let mut sum = 0.0;
    for model in [&model, &slide] {
        let (q, qd) = (JointVector::repeat(0.3), JointVector::repeat(-0.2));
        sum += tip_motion(model, &q, &qd).pose.p.sum();
        sum += rnea(model, &q, &qd, &q).sum() + bias(model, &q, &qd).sum() + gravity_torque(model, &q).sum();
        sum += crba(model, &q).sum() + aba(model, &q, &qd, &q, &qd.abs(), &Spatial::repeat(1.0)).sum();
        let state = ArmState::new(model, &q, &qd);
        sum += state.mass_matrix().sum() + state.rnea(&q).sum() + state.tip_motion().twist.sum();
        let frozen = FrozenArm::new(&state, &qd.abs());
        sum += frozen.accelerations(&q, &Spatial::repeat(1.0)).sum() + frozen.tip_acceleration(&q).sum();
        sum += frozen.pose(&qd).p.sum() + frozen.twist(&qd).sum();
        sum += state.potential_energy();
        // a large angle, whose reduction takes another way
        sum += rnea(model, &JointVector::repeat(1e9), &qd, &q).sum();
    }
    let after = COUNT.with(Cell::get);
    assert!(sum.is_finite());
    assert_eq!(after - before, 0);
    drop(vec![1]);
    assert!(COUNT.with(Cell::get) > after, "the counter counts");
}
