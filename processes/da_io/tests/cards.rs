//! The cards in their rack: exact instants, watchdog, safety logic, windows run again.

mod bench;

use bench::{Bench, MS, TASK, WRITE};
use bytemuck::Zeroable;
use messages::registers::{da, parallel};
use messages::{BusWord, EventKind, TransferRecord, drive_status};

#[test]
fn at_power_up_the_torque_is_off_and_the_brakes_are_engaged() {
    let bench = Bench::new();
    let command = bench.out.mail.amplifier[0];
    assert_eq!(
        (
            command.t,
            command.volts,
            command.enabled,
            command.brake_released
        ),
        (0, [0.0; 7], 0, 0)
    );
}

#[test]
fn a_code_becomes_a_voltage_at_the_instant_of_its_transfer() {
    let mut bench = Bench::powered();
    let (da_1, da_2) = (bench.da_1, bench.da_2);
    bench.write(17 * MS + 123, da_1 + da::code(3), 2048 + 1024);
    bench.write(17 * MS + 456, da_2 + da::code(2), 0);
    bench.read(17 * MS + 455, da_2 + da::read_back(2));
    bench.accesses.sort();
    let commands = bench.window(18 * MS);
    assert_eq!(
        commands.iter().map(|c| c.t).collect::<Vec<_>>(),
        [17 * MS + 123, 17 * MS + 456]
    );
    assert_eq!(commands[0].volts, [0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0]);
    assert_eq!(commands[1].volts, [0.0, 0.0, 0.0, 5.0, 0.0, 0.0, -10.0]);
    assert_eq!(
        (bench.out.mail.words[0].t, bench.out.mail.words[0].value),
        (17 * MS + 455, 2048)
    );
    bench.read(18 * MS + 1, da_2 + da::read_back(2));
    bench.window(19 * MS);
    assert_eq!(bench.out.mail.words[0].value, 0);
}

#[test]
fn a_word_posted_early_waits_for_its_transfer_and_a_failed_transfer_changes_nothing() {
    let mut bench = Bench::powered();
    let addr = bench.da_1;
    let word = BusWord {
        t: 0,
        addr,
        value: 4095,
        job: 7,
        task: TASK,
        index: 30,
    };
    bench.inputs.mail.words.push(word);
    bench.inputs.transfers.clear();
    assert!(bench.step(17 * MS).is_empty());
    let transfer = TransferRecord {
        data_at: 17 * MS + 5,
        addr,
        n: 1,
        job: 7,
        index: 30,
        dir: WRITE,
        status: 1,
        width: 2,
        ..TransferRecord::zeroed()
    };
    bench.inputs.transfers.push(transfer);
    assert!(bench.step(18 * MS).is_empty(), "BERR*");
    bench.inputs.transfers[0] = TransferRecord {
        data_at: 18 * MS + 5,
        status: 0,
        ..transfer
    };
    let commands = bench.step(19 * MS);
    assert_eq!(
        (commands.len(), commands[0].t, commands[0].volts[0]),
        (1, 18 * MS + 5, 10.0 - 20.0 / 4096.0)
    );
    bench.inputs.transfers[0].data_at = 19 * MS + 5;
    assert!(bench.step(20 * MS).is_empty(), "the word was used");
}

#[test]
fn a_brake_follows_its_line_after_the_delay_unless_the_line_goes_back() {
    let mut bench = Bench::new();
    let io = bench.io;
    bench.write(MS, io + parallel::BRAKE, 0x03);
    bench.write(5 * MS, io + parallel::BRAKE, 0x01);
    let commands = bench.window(40 * MS);
    assert_eq!(
        commands
            .iter()
            .map(|c| (c.t, c.brake_released))
            .collect::<Vec<_>>(),
        [(16 * MS, 0x01)]
    );
}

#[test]
fn a_heartbeat_that_stands_still_takes_the_torque_off_and_engages_the_brakes() {
    let mut bench = Bench::powered();
    let io = bench.io;
    let da_1 = bench.da_1;
    bench.write(17 * MS, da_1, 4095);
    // the same value again is no heartbeat
    bench.write(18 * MS, io + parallel::WATCHDOG, 1);
    let commands = bench.window(50 * MS);
    let expiry = MS + 2 + 20 * MS;
    let stop = commands.iter().find(|c| c.t == expiry).expect("expired");
    assert_eq!((stop.volts, stop.enabled), ([0.0; 7], 0));
    assert_eq!(
        commands.last().map(|c| (c.t, c.brake_released)),
        Some((expiry + 15 * MS, 0))
    );
    assert_eq!(bench.events(), [EventKind::WatchdogExpired as u32]);

    // latched: nothing that the control computer writes brings the torque back, until it acknowledges
    bench.write(51 * MS, da_1, 4095);
    bench.write(51 * MS + 1, io + parallel::ENABLE, 0x7F);
    bench.write(51 * MS + 2, io + parallel::WATCHDOG, 2);
    bench.read(51 * MS + 3, io + parallel::WATCHDOG_STATUS);
    assert!(bench.window(52 * MS).is_empty());
    assert_eq!(bench.out.mail.words[0].value, 1);
    bench.write(
        52 * MS,
        io + parallel::WATCHDOG_STATUS,
        parallel::ACKNOWLEDGE,
    );
    bench.write(52 * MS + 1, io + parallel::WATCHDOG, 3);
    bench.write(52 * MS + 2, io + parallel::ENABLE, 0x7F);
    let commands = bench.window(53 * MS);
    assert_eq!(
        commands.last().map(|c| (c.t, c.enabled)),
        Some((52 * MS + 2, 0x7F))
    );
}

#[test]
fn the_first_heartbeat_arms_the_watchdog() {
    let mut bench = Bench::new();
    bench.window(1000 * MS);
    assert!(bench.events().is_empty());
}

#[test]
fn a_tripped_amplifier_takes_the_torque_off_its_axis_alone() {
    let mut bench = Bench::powered();
    bench.signal(16 * MS + 10, 1 << 4);
    let io = bench.io;
    bench.write(17 * MS, io + parallel::ENABLE, 0x7F);
    bench.read(17 * MS + 5, io + parallel::INPUT);
    let commands = bench.window(18 * MS);
    assert_eq!(
        commands
            .iter()
            .map(|c| (c.t, c.enabled))
            .collect::<Vec<_>>(),
        [(16 * MS + 10, 0x6F)]
    );
    assert_eq!(bench.out.mail.words[0].value, 1 << 4);
    assert_eq!(
        (bench.events(), bench.out.mail.events[0].a),
        (vec![EventKind::AmplifierTrip as u32], 4.0)
    );
}

#[test]
fn an_open_emergency_chain_stops_all_axes() {
    let mut bench = Bench::powered();
    bench.signal(16 * MS + 10, drive_status::EMERGENCY_STOP | 1 << 9);
    let commands = bench.window(18 * MS);
    assert_eq!(
        commands
            .iter()
            .map(|c| (c.t, c.enabled))
            .collect::<Vec<_>>(),
        [(16 * MS + 10, 0)]
    );
    assert_eq!(bench.events(), [EventKind::SafetyState as u32]);
}

#[test]
fn a_window_run_again_starts_from_the_state_at_its_start() {
    let mut bench = Bench::powered();
    let da_1 = bench.da_1;
    let from = bench.inputs.from;
    bench.write(17 * MS, da_1, 4095);
    bench.write(19 * MS, da_1 + da::code(1), 4095);
    let first = bench.window(20 * MS);
    assert_eq!(first.len(), 2);

    // the plant cut the window at 18 ms: the second transfer is not part of it
    let cut = bench.inputs.transfers.remove(1);
    bench.inputs.from = from;
    bench.inputs.rerun = true;
    bench.signal(18 * MS, 1 << 2);
    assert_eq!(bench.step(18 * MS), first[..1]);
    assert!(
        bench.events().is_empty(),
        "the trip belongs to what follows"
    );

    bench.inputs.transfers[0] = TransferRecord {
        data_at: 19 * MS + 7,
        ..cut
    };
    let rest = bench.step(20 * MS);
    assert_eq!(
        rest.iter().map(|c| (c.t, c.enabled)).collect::<Vec<_>>(),
        [(18 * MS, 0x7B), (19 * MS + 7, 0x7B)]
    );
    assert_eq!(rest[1].volts[..2], first[1].volts[..2]);
}

#[test]
fn a_transfer_dated_after_its_window_takes_place_at_its_end_and_the_watchdog_still_runs() {
    let mut bench = Bench::powered();
    let (da_1, io) = (bench.da_1, bench.io);
    bench.write(u64::MAX - 1, da_1 + da::code(0), 4095);
    let commands = bench.window(17 * MS);
    assert_eq!(commands.iter().map(|command| command.t).collect::<Vec<_>>(), [17 * MS]);
    bench.write(17 * MS + 5, io + parallel::WATCHDOG, 2);
    assert!(bench.window(18 * MS).is_empty(), "{:?}", bench.out.mail.amplifier);
    bench.window(60 * MS);
    assert!(bench.events().contains(&(EventKind::WatchdogExpired as u32)));
}

#[test]
fn words_and_signals_that_nobody_fetches_do_not_pile_up() {
    let mut bench = Bench::powered();
    let memory = allocation_counter::measure(|| {
        for k in 0..20_000_u32 {
            let word = BusWord { t: 0, addr: k, value: 0, job: u32::MAX, task: TASK, index: 0 };
            bench.inputs.mail.words.push(word);
            bench.signal(u64::MAX, k);
            bench.step(17 * MS);
        }
    });
    assert!(memory.bytes_max < 64 << 10, "{} bytes", memory.bytes_max);
}
