//! Faults of converters and supply, as the amplifiers and the bus see them.

mod bench;

use bench::{Bench, MS, scenario};
use messages::registers::{da, parallel};
use messages::{Detector, Event, EventKind, drive_status};
use scenario::{Fault, FaultKind};

/// One fault from 20 ms on, to the end of the run, met with the drives on.
fn bench(target: &str, kind: FaultKind, amount: f64) -> Bench {
    let mut scenario = scenario();
    scenario.faults = vec![Fault {
        target: target.into(),
        kind,
        start_s: 0.020,
        duration_s: None,
        every_s: None,
        mean_time_between_s: None,
        probability: 1.0,
        axes: vec![],
        amount,
    }];
    Bench::of(&scenario).power_up()
}

/// Instants at which the fault was injected, and at which the read-back of a joint was found wrong.
fn told(events: &[Event]) -> (Vec<u64>, Vec<(u64, f64)>) {
    let injected = events.iter().filter(|event| event.kind == EventKind::FaultInjected as u32);
    let detected = events.iter().filter(|event| event.cause == Detector::DaReadBack as u32);
    (injected.map(|event| event.t).collect(), detected.map(|event| (event.t, event.a)).collect())
}

#[test]
fn an_offset_output_is_read_back_at_once_and_costs_its_axis_the_torque() {
    let mut bench = bench("joint-3", FaultKind::DaOffset, 0.5);
    bench.write(17 * MS, bench.io + parallel::WATCHDOG, 2);
    bench.read(19 * MS, bench.da_1 + da::read_back(2));
    bench.read(21 * MS, bench.da_1 + da::read_back(2));
    bench.read(22 * MS, bench.io + parallel::INPUT);
    let commands = bench.window(23 * MS);
    assert_eq!(told(&bench.out.mail.events), (vec![20 * MS], vec![(20 * MS, 2.0)]));
    assert_eq!(commands.iter().map(|c| (c.t, c.enabled)).collect::<Vec<_>>(), [(20 * MS, 0x7B)]);
    assert_eq!(commands[0].volts[2], 0.5);
    let read: Vec<u32> = bench.out.mail.words.iter().map(|word| word.value).collect();
    // 0.5 V are 102.4 steps
    assert_eq!(&read[..2], [2048, 2048 + 102]);
    assert_eq!(read[2] & drive_status::DA_FAULT, drive_status::DA_FAULT);
}

#[test]
fn an_offset_within_two_and_a_half_steps_of_the_converter_cannot_be_seen() {
    // a step is 20/4096 V
    let mut bench = bench("joint-3", FaultKind::DaOffset, 2.4 * 20.0 / 4096.0);
    bench.write(17 * MS, bench.io + parallel::WATCHDOG, 2);
    bench.window(23 * MS);
    assert_eq!(told(&bench.out.mail.events), (vec![20 * MS], vec![]));
}

#[test]
fn a_stuck_output_shows_when_it_is_to_change() {
    let mut bench = bench("joint-5", FaultKind::DaStuck, 0.0);
    bench.write(17 * MS, bench.io + parallel::WATCHDOG, 2);
    bench.write(18 * MS, bench.da_2 + da::code(0), 2048 + 512);
    bench.write(21 * MS, bench.da_2 + da::code(0), 2048 + 514);
    bench.write(22 * MS, bench.da_2 + da::code(0), 2048);
    let commands = bench.window(23 * MS);
    assert_eq!(told(&bench.out.mail.events), (vec![20 * MS], vec![(22 * MS, 4.0)]));
    let (last, others) = (commands[commands.len() - 1], 0x7F & !(1 << 4));
    assert_eq!((last.t, last.volts[4], last.enabled), (22 * MS, 2.5, others));
}

#[test]
fn acfail_warns_for_its_time_then_amplifiers_go_off_and_brakes_fall_in_for_good() {
    for (stated_ms, holds) in [(0.0, 4 * MS), (7.5, 7 * MS + 500_000)] {
        let mut bench = bench("power", FaultKind::PowerFail, stated_ms);
        bench.write(17 * MS, bench.io + parallel::WATCHDOG, 2);
        bench.read(20 * MS, bench.io + parallel::INPUT);
        bench.write(30 * MS, bench.io + parallel::WATCHDOG_STATUS, parallel::ACKNOWLEDGE);
        bench.write(31 * MS, bench.io + parallel::ENABLE, 0x7F);
        let commands = bench.window(32 * MS);
        assert_ne!(bench.out.mail.words[0].value & drive_status::POWER_FAIL, 0);
        let changes: Vec<_> = commands.iter().map(|c| (c.t, c.enabled, c.brake_released)).collect();
        assert_eq!(changes, [(20 * MS + holds, 0, 0)], "no brake delay without power");
    }
}
