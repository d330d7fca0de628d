//! Faults that a scenario injects: what sees them, what comes of them, and that they too repeat to the bit.

use rack_tests::{Bench, FaultRow};
use toml::Value;

/// A fault at 1.202 s, in contact.
fn fault(target: &str, kind: &str, more: &[(&str, Value)]) -> Value {
    rack_tests::fault(target, kind, 1.202, more)
}

fn row(fault: Value) -> FaultRow {
    FaultRow::of_one(fault, 2.0, &[])
}

/// Control period, and the time from a release to its decision, ms.
const PERIOD_MS: f64 = 5.0;
const DECISION_MS: f64 = 0.2;

#[test]
fn an_open_cable_and_a_silent_card_are_seen_in_the_next_job_and_end_in_torque_off() {
    for (target, kind, detector) in [
        ("force_sensor", "wire-break", "force-error-word"),
        ("force-sensor", "no-slave", "bus-error"),
        ("encoder-2", "no-slave", "bus-error"),
    ] {
        let row = row(fault(target, kind, &[]));
        assert_eq!((row.reaction.as_str(), row.detected_by.as_str()), ("off (STO)", detector), "{target}");
        // BERR* comes a bus timer later at most, for each of the card's reads
        assert!(row.after_ms > 0.0 && row.after_ms < PERIOD_MS + DECISION_MS + 1.0, "{target}: {row:?}");
        // the first contact's own peak is about 75 N
        assert!(row.peak_force_n < 90.0, "{target}: {row:?}");
    }
}

#[test]
fn a_force_sample_that_grows_old_is_held_on_and_then_ends_in_torque_off() {
    let row = row(fault("force_sensor", "dropout", &[]));
    assert_eq!((row.reaction.as_str(), row.detected_by.as_str()), ("off (STO)", "force-age"));
    // 15 ms of age, then the next job
    assert!(row.after_ms > 15.0 && row.after_ms < 15.0 + PERIOD_MS + DECISION_MS, "{row:?}");
}

#[test]
fn a_sensor_that_repeats_itself_is_held_on_without_moving() {
    let row = row(fault("force_sensor", "stuck", &[]));
    assert_eq!((row.reaction.as_str(), row.detected_by.as_str()), ("hold (SS2)", "force-frozen"));
    assert!(row.after_ms > 10.0 * PERIOD_MS && row.after_ms < 13.0 * PERIOD_MS, "{row:?}");
}

#[test]
fn a_bus_that_grants_nobody_lets_the_output_watchdog_take_the_torque_off() {
    let row = row(fault("bus", "stuck-bus", &[]));
    assert_eq!((row.reaction.as_str(), row.detected_by.as_str()), ("off (STO)", "access-timer"));
    assert!(row.after_ms < 20.0 + PERIOD_MS, "{row:?}");
}

#[test]
fn a_small_bias_cannot_be_seen_and_the_report_says_so() {
    let bias = [("amount", Value::Float(5.0)), ("axes", Value::Array(vec![2.into()]))];
    let row = row(fault("force_sensor", "bias", &bias));
    assert_eq!((row.reaction.as_str(), row.detected_by.as_str()), ("run", "none"));
}

#[test]
fn faults_drawn_from_the_seed_record_the_same_in_lock_step_and_in_one_process() {
    let bench = Bench::new();
    let again = |key: &'static str, every: f64| [(key, Value::Float(every)), ("duration_s", Value::Float(0.01))];
    let noise: Vec<_> = again("mean_time_between_s", 0.05).into_iter().chain([("amount", Value::Float(1.0))]).collect();
    let faults = vec![
        fault("force_sensor", "noise", &noise),
        fault("force-sensor", "no-slave", &again("every_s", 0.1)),
        fault("control", "slow", &[("amount", Value::Float(2.0)), ("duration_s", Value::Float(0.05))]),
    ];
    let scenario = bench.scenario("faulty.toml", &[("fault", Value::Array(faults))]);
    let apart = bench.digest(scenario, 1.6, &[]);
    assert_eq!(apart, bench.digest(scenario, 1.6, &["--in-process"]));
    assert_ne!(apart, bench.digest(scenario, 1.6, &["--in-process", "--seed", "9"]));
}

#[test]
fn a_fault_of_something_that_the_rack_does_not_have_is_refused_with_what_it_has() {
    let bench = Bench::new();
    let scenario = bench.scenario("bad.toml", &[("fault", Value::Array(vec![fault("encoder-9", "no-slave", &[])]))]);
    let outcome = bench.run(&["run", scenario, "--out", "out"]).expect_code(2);
    outcome
        .expect_message("fault.0.target")
        .expect_message("is `encoder-9`, expected a slave of the rack")
        .expect_message("encoder-4");
}
