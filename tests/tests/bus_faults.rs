//! Faults of messages over the bus, of bus, processors and clocks: what sees each, how soon, and what comes of it.

use rack_tests::{Bench, Edit, FaultRow};
use serde_json::Value as Json;
use toml::{Table, Value};

/// Control period, and the time from a release to its decision, ms.
const PERIOD_MS: f64 = 5.0;
const DECISION_MS: f64 = 0.2;

/// A fault at 1.202 s, in contact.
fn fault(target: &str, kind: &str, more: &[(&str, f64)]) -> Value {
    let more: Vec<_> = more.iter().map(|(key, value)| (*key, Value::Float(*value))).collect();
    rack_tests::fault(target, kind, 1.202, &more)
}

/// What the fault is seen by, at most so many ms after its begin, and what comes of it.
fn expect(fault: Value, edits: &[Edit<'_>], (detector, within_ms, reaction): (&str, f64, &str)) {
    let row = FaultRow::of_one(fault.clone(), 2.0, edits);
    assert_eq!((row.detected_by.as_str(), row.reaction.as_str()), (detector, reaction), "{fault}: {row:?}");
    assert!(row.after_ms > 0.0 && row.after_ms < within_ms, "{fault}: {row:?}");
    assert!(row.peak_force_n < 90.0, "{fault}: {row:?}");
}

#[test]
fn messages_that_are_corrupted_or_lost_are_seen_in_the_next_job_bridged_and_then_stop_the_arm() {
    let bound = PERIOD_MS + DECISION_MS;
    for sender in ["encoder_if", "force_sensor_if"] {
        for (kind, detector, amount) in [("bit-flip", "crc", 1.0), ("drop", "sequence", 0.0)] {
            let amount = ("amount", amount);
            expect(fault(sender, kind, &[amount]), &[], (detector, bound, "off (STO)"));
            // one job's
            expect(fault(sender, kind, &[amount, ("duration_s", 0.005)]), &[], (detector, bound, "degraded"));
        }
    }
}

#[test]
fn messages_that_come_twice_are_used_once_and_overtaken_ones_are_bridged() {
    let bound = PERIOD_MS + DECISION_MS;
    expect(fault("encoder_if", "duplicate", &[]), &[], ("sequence", bound, "run"));
    expect(fault("encoder_if", "reorder", &[]), &[], ("sequence", bound, "degraded"));
}

#[test]
fn messages_that_come_late_are_used_and_seen_by_their_age_and_hold_the_arm_when_they_go_on() {
    // the first one is missing when its job decides
    let first = ("sequence", PERIOD_MS + DECISION_MS, "hold (SS2)");
    expect(fault("encoder_if", "delay", &[("amount", 2.0)]), &[], first);
}

#[test]
fn outputs_that_get_no_messages_are_taken_to_zero_by_their_watchdog() {
    let row = FaultRow::of_one(fault("control_computer", "drop", &[]), 2.0, &[]);
    assert_eq!(row.detected_by, "output-watchdog", "{row:?}");
    assert!(row.after_ms < 20.0 + PERIOD_MS, "{row:?}");
    assert!(row.peak_force_n < 90.0, "{row:?}");
}

#[test]
fn no_grant_is_told_from_no_answer_by_the_access_timer() {
    // one access timer after the next job's first read
    let bound = PERIOD_MS + DECISION_MS + 1.0;
    expect(fault("cpu-1", "starvation", &[]), &[], ("access-timer", bound, "off (STO)"));
    // one bus timer after it
    expect(fault("encoder-1", "no-slave", &[]), &[], ("bus-error", PERIOD_MS + DECISION_MS + 0.064, "off (STO)"));
}

#[test]
fn the_card_that_does_not_answer_is_named_by_the_address_of_the_cycle_that_timed_out() {
    for (target, kind, card) in [
        ("encoder-3", "no-slave", "encoder-3"),
        ("force-sensor", "no-slave", "force-sensor"),
        // its first register that a job reads
        ("da_io", "crash", "parallel-io"),
        // nobody was asked
        ("cpu-1", "starvation", "none"),
        ("bus", "stuck-bus", "none"),
    ] {
        let row = FaultRow::of_one(fault(target, kind, &[]), 1.5, &[]);
        assert_eq!(row.card, card, "{row:?}");
    }
}

#[test]
fn a_card_whose_interrupts_get_lost_misses_two_ticks_and_goes_on_by_polling() {
    let interrupt = |text: &str| text.parse::<Table>().expect("TOML")["value"].clone();
    let edits = [
        ("rack.tasks.control.release", interrupt(r#"value = { interrupt = "force-sample" }"#)),
        ("rack.interrupters.force-sample.ticks", interrupt("value = { period_ns = 5000000 }")),
    ];
    let bound = 3.0 * PERIOD_MS + DECISION_MS;
    expect(fault("force-sample", "lost-interrupt", &[]), &edits, ("missed-tick", bound, "degraded"));
}

#[test]
fn a_cable_that_is_out_is_seen_by_the_workstation_and_the_arm_is_held_without_it() {
    let edits = [("rack.tasks.console.period_ns", Value::Integer(20_000_000))];
    expect(fault("vme-vme", "cable-out", &[]), &edits, ("link-status", 25.0, "hold (SS2)"));
}

#[test]
fn a_job_that_takes_too_long_costs_a_release_and_the_card_sees_it() {
    expect(fault("control", "overrun", &[("amount", 6.0)]), &[], ("overrun", 3.0 * PERIOD_MS, "degraded"));
}

#[test]
fn clocks_that_drift_apart_are_seen_by_their_stamps_and_set_anew() {
    // 200 µs at 1000 ppm take 200 ms; the first window of 100 ms that lies behind that ends 200 ms later at most
    for board in ["control_computer", "encoder_if"] {
        expect(fault(board, "clock-drift", &[("amount", 1000.0)]), &[], ("clock-slope", 410.0, "run"));
    }
}

#[test]
fn faults_of_messages_and_clocks_record_the_same_in_lock_step_and_in_one_process() {
    let bench = Bench::new();
    let again = |every: f64, amount: f64| [("mean_time_between_s", every), ("duration_s", 0.004), ("amount", amount)];
    let faults = vec![
        fault("encoder_if", "bit-flip", &again(0.06, 3.0)),
        fault("force_sensor_if", "drop", &again(0.05, 0.5)),
        fault("da_io", "jitter", &again(0.04, 6.0)),
        fault("encoder_if", "reorder", &again(0.07, 0.0)),
        fault("control_computer", "duplicate", &again(0.05, 0.0)),
        fault("force_sensor_if", "delay", &again(0.08, 3.0)),
        fault("workstation", "bit-flip", &[("amount", 1.0), ("duration_s", 0.3)]),
        fault("control_computer", "clock-drift", &[("amount", 2000.0)]),
    ];
    let scenario = bench.scenario("faulty.toml", &[("fault", Value::Array(faults))]);
    let apart = bench.digest(scenario, 1.6, &[]);
    assert_eq!(apart, bench.digest(scenario, 1.6, &["--in-process"]));
    assert_ne!(apart, bench.digest(scenario, 1.6, &["--in-process", "--seed", "9"]));
}

#[test]
fn faults_of_messages_and_of_the_bus_leave_their_event_in_real_time_too() {
    let bench = Bench::new();
    let at = |target: &str, kind: &str, start_s: f64| {
        rack_tests::fault(target, kind, start_s, &[("duration_s", Value::Float(0.004)), ("amount", Value::Float(1.0))])
    };
    let faults = vec![at("encoder_if", "drop", 0.402), at("force-sensor", "no-slave", 0.602)];
    let scenario = bench.scenario("faulty.toml", &[("fault", Value::Array(faults))]);
    let line = ["run", scenario, "--duration", "0.8", "--pacing", "realtime", "--json", "--out", "out"];
    let outcome = bench.run(&line);
    let report: Json = serde_json::from_str(&outcome.stdout).unwrap_or_else(|_| panic!("{}", outcome.stderr));
    let rows = report["variants"][0]["faults"].as_array().expect("rows");
    let begins: Vec<_> = rows.iter().map(|row| row["injected_s"].as_f64().expect("number")).collect();
    assert_eq!(begins.len(), 2, "{rows:?}");
    assert!((begins[0] - 0.402).abs() < 1e-9 && (begins[1] - 0.602).abs() < 1e-9, "{begins:?}");
}

#[test]
fn an_amount_that_makes_no_sense_is_refused_with_its_range() {
    for (kind, amount, range) in [("drop", 1.5, "0 to 1"), ("bit-flip", 40.0, "1 to 32"), ("delay", 0.0, "0.001 to 10000")] {
        let bench = Bench::new();
        let bad = fault("encoder_if", kind, &[("amount", amount)]);
        let scenario = bench.scenario("bad.toml", &[("fault", Value::Array(vec![bad]))]);
        let outcome = bench.run(&["run", scenario, "--out", "out"]).expect_code(2);
        outcome.expect_message("fault.0.amount").expect_message(&format!("expected {range}"));
    }
}
