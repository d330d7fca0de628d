//! Two cards share the pipeline: what they hand each other, and that together they do what one does alone.

mod rig;

use messages::registers::{mailbox, parallel};
use messages::{EventKind, TransferRecord};
use rig::{DECISION, PERIOD, Rig, table_5_3};
use scenario::Scenario;
use vme::{Access, Direction, MILLISECOND, Ns, Op};

/// The pipeline of Table 5-3 on two cards, the second at 1 kHz.
fn split() -> Scenario {
    let mut scenario = table_5_3();
    let mut second = scenario.rack.tasks[0].clone();
    (second.name, second.processor, second.period_ns) = ("torque".into(), "cpu-2".into(), MILLISECOND);
    scenario.rack.tasks.push(second);
    scenario
}

fn accesses(rest: &[Op]) -> Vec<Access> {
    rest.iter().filter_map(|op| if let Op::Access(access) = op { Some(*access) } else { None }).collect()
}

/// The first card's job runs and its hand-over is carried out at `at`, well or not.
fn hand_over(rig: &mut Rig, at: Ns, ok: bool) {
    rig.answer();
    rig.step();
    rig.finish();
    let block = accesses(&rig.rest)[0];
    rig.inputs.transfers.push(TransferRecord {
        data_at: at,
        addr: block.addr,
        n: block.n,
        width: 2,
        dir: 1,
        am: block.am,
        status: u8::from(!ok),
        job: rig.job - 1,
        task: 0,
        index: rig.reads.len() as u16,
        ..bytemuck::Zeroable::zeroed()
    });
}

#[test]
fn the_first_card_reads_the_seconds_state_and_writes_the_hand_over_block_into_its_ram() {
    let mut rig = Rig::new(split());
    let ram = rig.address("cpu-2-dpram", 0);
    let state = rig.reads.last().unwrap();
    assert_eq!((rig.reads.len(), state.addr, state.dir), (27, ram + mailbox::STATE, Direction::Read));
    rig.run();
    let block = accesses(&rig.rest);
    // 20 doubles, and four longwords: job, demand, cause, acknowledgement
    assert_eq!((block.len(), block[0].addr, block[0].n), (1, ram + mailbox::HANDOVER, 44));
    assert!(rig.out.mail.words.is_empty(), "the block is the cards' own business");
    let (_, reads) = rig.second.clone().unwrap();
    // counts and speeds of seven joints, and the drives' status
    assert_eq!((reads.len(), reads[14].addr), (15, rig.address("parallel-io", parallel::INPUT)));
}

#[test]
fn until_a_block_has_come_the_drives_stay_off() {
    let mut rig = Rig::new(split());
    let enable = rig.address("parallel-io", parallel::ENABLE);
    let enabled = |rig: &Rig| rig.out.mail.words.iter().find(|word| word.addr == enable).map(|word| word.value);
    rig.run_second(0, DECISION);
    assert_eq!(enabled(&rig), Some(0));
    hand_over(&mut rig, 3 * MILLISECOND, false);
    rig.run_second(1, 4 * MILLISECOND);
    assert_ne!(enabled(&rig), Some(0x7F), "the block got lost on the bus");
    hand_over(&mut rig, PERIOD + 3 * MILLISECOND, true);
    rig.run_second(2, PERIOD + 4 * MILLISECOND);
    assert_eq!(enabled(&rig), Some(0x7F));
}

#[test]
fn two_cards_send_the_torques_that_one_sends_for_the_same_registers() {
    let mut one = Rig::new(table_5_3());
    let mut two = Rig::new(split());
    for job in 0..20 {
        one.run();
        let alone: Vec<u32> = one.out.mail.words.iter().map(|word| word.value).collect();
        let done = two.now() + MILLISECOND;
        hand_over(&mut two, done, true);
        two.run_second(job, done + 10_000);
        let shared: Vec<u32> = two.out.mail.words.iter().map(|word| word.value).collect();
        assert_eq!(shared, alone, "job {job}");
    }
    one.run();
    two.run();
    assert_eq!(one.out.mail.control_probe[0].qdd, two.out.mail.control_probe[0].qdd);
}

#[test]
fn a_first_card_that_is_gone_degrades_the_arm_and_then_stops_it() {
    let mut rig = Rig::new(split());
    hand_over(&mut rig, 2 * MILLISECOND, true);
    let mut changes = Vec::new();
    for job in 0..40 {
        let now = 3 * MILLISECOND + Ns::from(job) * MILLISECOND;
        rig.run_second(job, now);
        let change = rig.events(EventKind::SafetyState).first().map(|event| (now / MILLISECOND, event.b));
        changes.extend(change);
    }
    // the first block is missed 2.5 ms after its time, the fourth at 2 + 20 + 2.5 ms; at rest SS1 ends at once
    assert_eq!(changes, [(10, 1.0), (25, 3.0), (26, 4.0)]);
}
