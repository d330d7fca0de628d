//! The control computer against its registers: what it reads, writes, accepts, refuses, and how it stops.

mod rig;

use messages::registers::{da, mailbox, parallel};
use messages::{CommandKind, Detector, EventKind, drive_status};
use rig::{DECISION, PERIOD, Rig, command, table_5_3};
use vme::{Op, Width};

fn state(rig: &Rig) -> u32 {
    rig.out.mail.control_probe[0].state
}

#[test]
fn the_program_reads_every_sensor_register_once_and_then_decides() {
    let rig = Rig::new(table_5_3());
    assert_eq!(rig.reads.len(), 27);
    let mut addresses: Vec<u32> = rig.reads.iter().map(|read| read.addr).collect();
    addresses.dedup();
    addresses.sort_unstable();
    addresses.dedup();
    assert_eq!(addresses.len(), 27);
    let force = rig.address("force-sensor", 0);
    for read in &rig.reads {
        let of_force_card = (force..force + 0x4000).contains(&read.addr);
        assert_eq!(read.width == Width::D16, of_force_card);
        assert_eq!(read.am, 0x3D);
    }
}

#[test]
fn the_first_job_enables_the_amplifiers_and_lets_go_of_the_brakes_once() {
    let mut rig = Rig::new(table_5_3());
    rig.run();
    let (enable, brake) = (rig.address("parallel-io", parallel::ENABLE), rig.address("parallel-io", parallel::BRAKE));
    assert_eq!((rig.written(enable), rig.written(brake)), (Some(0x7F), Some(0x7F)));
    assert_eq!(rig.writes().last().unwrap().0, brake, "torque stands before the brakes let go");
    assert_eq!(rig.rest[0], Op::Exec(1_500_000));
    rig.run();
    assert_eq!((rig.written(enable), rig.written(brake)), (None, None));
    let rest = rig.rest.clone();
    for job in 2..5 {
        rig.run();
        assert_eq!(rig.rest, rest);
        assert_eq!(rig.written(rig.address("parallel-io", parallel::WATCHDOG)), Some(job));
    }
}

#[test]
fn an_arm_at_rest_in_its_posture_gets_the_torques_that_carry_it() {
    // the gauges of the rig show nothing, as those of a tool without weight would
    let mut scenario = table_5_3();
    scenario.controller.tool_compensation = false;
    let mut rig = Rig::new(scenario);
    rig.run();
    rig.run();
    let arm = rig.scenario.controller_arm().unwrap();
    let drives = rig.scenario.drives().unwrap();
    let probe = rig.out.mail.control_probe[0];
    assert_eq!(probe.fe, [0.0; 6]);
    let q = rig.scenario.initial_posture().unwrap();
    let (writes, gravity) = (rig.writes(), arm::gravity_torque(&arm, &q));
    for joint in 0..7 {
        let card = format!("da-{}", joint / 4 + 1);
        let code = writes.iter().find(|w| w.0 == rig.address(&card, da::code(joint as u32 % 4))).unwrap().1;
        let gain = drives.joints[joint].amplifier_nm_per_v;
        let torque = (f64::from(code) - 2048.0) * 20.0 / 4096.0 * gain;
        assert!((torque - probe.torque[joint]).abs() <= 0.5 * gain * 20.0 / 4096.0 + 1e-9);
        assert!((probe.torque[joint] - gravity[joint]).abs() < 0.01, "{joint}: {}", gravity[joint]);
    }
}

#[test]
fn a_command_counts_from_its_transfer_on_and_is_judged_once() {
    let mut rig = Rig::new(table_5_3());
    rig.run();
    rig.inputs.mail.commands.push(command(1, CommandKind::Segment));
    rig.run();
    assert_eq!(rig.out.mail.control_probe[0].segment, u32::MAX, "posted, but not transferred");
    let n = size_of::<messages::Command>() as u32 / 4;
    rig.transfer(mailbox::COMMAND, n, 1, 0, rig.now() - 10);
    rig.run();
    assert_eq!(rig.out.mail.control_probe[0].segment, 0);
    let start = rig.events(EventKind::SegmentStart);
    assert_eq!((start.len(), start[0].a, start[0].t), (1, 0.0, rig.now() - PERIOD));

    rig.command(command(1, CommandKind::Segment), 0);
    rig.run();
    let refused = rig.events(EventKind::CommandRefused);
    assert_eq!((refused.len(), refused[0].a, refused[0].b), (1, 1.0, 2.0));
    assert_eq!(state(&rig), 2, "whoever repeats an old command may not go on commanding");

    let mut bad = command(2, CommandKind::Segment);
    bad.mass[0] = 0.0;
    rig.command(bad, 0);
    rig.run();
    let refused = rig.events(EventKind::CommandRefused);
    assert_eq!((refused.len(), refused[0].a, refused[0].b), (1, 2.0, 5.0));
}

#[test]
fn a_command_whose_write_failed_is_not_taken_and_can_be_sent_again() {
    let mut rig = Rig::new(table_5_3());
    rig.run();
    rig.command(command(1, CommandKind::Segment), 1);
    rig.run();
    assert_eq!(rig.out.mail.control_probe[0].segment, u32::MAX);
    rig.command(command(1, CommandKind::Segment), 0);
    rig.run();
    assert_eq!(rig.out.mail.control_probe[0].segment, 0);
}

#[test]
fn too_many_waiting_segments_are_refused() {
    let mut rig = Rig::new(table_5_3());
    rig.run();
    for epoch in 1..=control_computer::QUEUE as u32 + 1 {
        let mut later = command(epoch, CommandKind::Segment);
        (later.start, later.end) = (5_000_000_000, 9_000_000_000);
        rig.command(later, 0);
    }
    rig.run();
    let refused = rig.events(EventKind::CommandRefused);
    assert_eq!((refused.len(), refused[0].b), (1, 10.0));
}

#[test]
fn a_telemetry_read_shows_the_last_job_that_had_ended_by_then() {
    let mut rig = Rig::new(table_5_3());
    for _ in 0..4 {
        rig.run();
    }
    // job 3 decided at 3 T + DECISION and writes its block 1.5 ms later
    let decided = 3 * PERIOD + DECISION;
    for (at, heartbeat) in [(decided + 1_000_000, 2), (decided + 1_500_000, 3), (decided + 4_000_000, 3)] {
        rig.transfer(mailbox::TELEMETRY, 26, 0, 0, at);
        let shown = heartbeat;
        rig.out.clear();
        let (inputs, out) = (&rig.inputs, &mut rig.out);
        board::Board::step(&mut rig.board, at, inputs, out);
        rig.inputs.transfers.clear();
        let telemetry = rig.out.mail.telemetry[0];
        assert_eq!((telemetry.heartbeat, telemetry.t), (shown, at));
        assert_eq!(telemetry.written, u64::from(shown) * PERIOD + DECISION + 1_500_000);
    }
}

#[test]
fn an_emergency_stop_takes_the_torque_off_in_the_job_that_sees_it() {
    let mut rig = Rig::new(table_5_3());
    for _ in 0..3 {
        rig.run();
    }
    rig.status = drive_status::EMERGENCY_STOP;
    rig.run();
    assert_eq!(state(&rig), 4);
    let writes = rig.writes();
    assert_eq!(writes[0], (rig.address("parallel-io", parallel::ENABLE), 0));
    assert_eq!(writes[1], (rig.address("parallel-io", parallel::BRAKE), 0));
    for joint in 0..4 {
        assert_eq!(rig.written(rig.address("da-1", da::code(joint))), Some(2048));
    }
    assert!(matches!(rig.rest[0], Op::Exec(ns) if ns <= 50_000), "nothing is computed before a stop");
    let event = rig.events(EventKind::SafetyState)[0];
    assert_eq!((event.a, event.b), (0.0, 4.0));

    rig.status = 0;
    rig.run();
    assert_eq!(state(&rig), 4, "latched");
    rig.command(command(1, CommandKind::Segment), 0);
    rig.run();
    assert_eq!(rig.events(EventKind::CommandRefused)[0].b, 11.0);
    rig.command(command(2, CommandKind::Acknowledge), 0);
    rig.run();
    assert_eq!(state(&rig), 0);
    assert_eq!(rig.written(rig.address("parallel-io", parallel::ENABLE)), Some(0x7F));
}

#[test]
fn a_card_that_does_not_answer_stops_the_arm_until_it_answers_and_somebody_acknowledges() {
    let mut rig = Rig::new(table_5_3());
    for _ in 0..3 {
        rig.run();
    }
    rig.failing = vec![rig.reads[4].addr];
    let mut states = Vec::new();
    for job in 0..5 {
        rig.run();
        states.push(state(&rig));
        let errors = rig.events(EventKind::BusError);
        assert_eq!(errors.len(), usize::from(job == 0));
        if job == 0 {
            assert_eq!((errors[0].a, errors[0].b), (3.0, f64::from(rig.reads[4].addr)));
        }
    }
    // an arm at rest has nothing to decelerate: SS1 ends at once
    assert_eq!(states, [3, 4, 4, 4, 4]);
    rig.command(command(1, CommandKind::Acknowledge), 0);
    rig.run();
    assert_eq!(state(&rig), 4, "it still does not answer");
    rig.failing.clear();
    rig.run();
    assert_eq!(state(&rig), 4, "nobody has acknowledged since");
    rig.command(command(2, CommandKind::Acknowledge), 0);
    rig.run();
    assert_eq!(state(&rig), 0);
}

#[test]
fn a_hold_drops_the_segments_and_keeps_the_tool_where_it_is() {
    let mut rig = Rig::new(table_5_3());
    rig.run();
    let mut away = command(1, CommandKind::Segment);
    (away.path, away.position) = (messages::PathKind::Step as u32, [0.0, 0.0, -0.1]);
    rig.command(away, 0);
    rig.run();
    assert_eq!(rig.out.mail.control_probe[0].xd, [0.0, 0.0, -0.1]);
    rig.command(command(2, CommandKind::Hold), 0);
    rig.run();
    let probe = rig.out.mail.control_probe[0];
    assert_eq!((probe.state, probe.segment), (2, u32::MAX));
    for axis in 0..3 {
        assert!((probe.xd[axis] - probe.x[axis]).abs() < 1e-12);
    }
    rig.command(command(3, CommandKind::Acknowledge), 0);
    rig.run();
    assert_eq!(state(&rig), 0);
}

#[test]
fn a_computer_powered_up_again_in_the_middle_of_a_run_keeps_the_torque_off_until_acknowledged() {
    let mut rig = Rig::new(table_5_3());
    let boot = board::Inputs { boot: true, from: 1_000_000, until: 1_000_000, ..board::Inputs::default() };
    rig.out.clear();
    board::Board::step(&mut rig.board, 1_000_000, &boot, &mut rig.out);
    let event = rig.events(EventKind::SafetyState)[0];
    assert_eq!((event.b, event.cause), (4.0, messages::Detector::Heartbeat as u32));
    rig.run();
    assert_eq!(state(&rig), 4);
    assert_eq!(rig.written(rig.address("parallel-io", parallel::ENABLE)), Some(0));
    rig.command(command(1, CommandKind::Acknowledge), 0);
    rig.run();
    assert_eq!(state(&rig), 0);
    // the I/O card's own stop is acknowledged before anything else is written to it
    let io = |offset| rig.written(rig.address("parallel-io", offset));
    assert_eq!(io(parallel::WATCHDOG_STATUS), Some(parallel::ACKNOWLEDGE));
    assert_eq!((io(parallel::ENABLE), io(parallel::BRAKE)), (Some(0x7F), Some(0x7F)));
    rig.run();
    assert_eq!(rig.written(rig.address("parallel-io", parallel::WATCHDOG_STATUS)), None, "once");
}

#[test]
fn a_message_that_is_missing_is_lost_in_lock_step_and_late_where_nobody_waits_for_it() {
    for (free_running, detector) in [(false, Detector::Sequence), (true, Detector::MessageAge)] {
        let mut rig = Rig::new(table_5_3());
        rig.inputs.free_running = free_running;
        rig.run();
        rig.answer();
        let encoder = rig.address("encoder-1", 0);
        rig.inputs.mail.words.retain(|word| word.addr & !0xFF != encoder);
        rig.step();
        let seen: Vec<u32> = rig.out.mail.events.iter().filter(|event| event.kind == EventKind::Detected as u32).map(|event| event.cause).collect();
        assert_eq!(seen, [detector as u32]);
        rig.finish();
        rig.run();
        assert_eq!(state(&rig), 0, "the next job has all it needs");
    }
}
