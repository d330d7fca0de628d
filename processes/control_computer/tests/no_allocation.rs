//! A job in the steady state allocates nothing.

mod rig;

use messages::CommandKind;
use rig::{Rig, command, table_5_3};

/// Allocations in the board's step of the next job.
fn allocations(rig: &mut Rig) -> u64 {
    rig.answer();
    let count = allocation_counter::measure(|| rig.step()).count_total;
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
