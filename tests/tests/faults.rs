//! Faults that a scenario injects: what sees them, what comes of them, and that they too repeat to the bit.

use rack_tests::Bench;
use serde_json::Value as Json;
use toml::{Table, Value};

/// A fault of the scenario at 1.202 s, in contact.
fn fault(target: &str, kind: &str, more: &[(&str, Value)]) -> Value {
    let stated =
        [("target", Value::from(target)), ("kind", Value::from(kind)), ("start_s", Value::Float(1.202))];
    Value::Table(Table::from_iter(stated.iter().chain(more).map(|(key, value)| ((*key).to_owned(), value.clone()))))
}

/// The report's row of one fault.
fn row(fault: Value) -> Json {
    let bench = Bench::new();
    let edits =
        [("force_sensor_if.noise_n", Value::Float(0.2)), ("safety.max_same_force_jobs", Value::Integer(10)), ("fault", Value::Array(vec![fault]))];
    let scenario = bench.scenario("faulty.toml", &edits);
    let outcome =
        bench.run(&["run", scenario, "--duration", "2", "--in-process", "--no-record", "--json", "--out", "out"]);
    let report: Json = serde_json::from_str(&outcome.expect_code(0).expect_nothing_left().stdout).expect("JSON");
    let rows = report["variants"][0]["faults"].as_array().expect("rows").clone();
    assert_eq!(rows.len(), 1, "{rows:?}");
    rows[0].clone()
}

/// Reaction, event that showed the fault, and the milliseconds that it took.
fn reaction(row: &Json) -> (&str, &str, f64) {
    let text = |key: &str| row[key].as_str().unwrap_or("none");
    (text("reaction"), text("detected_by"), 1e3 * row["detected_after_s"].as_f64().unwrap_or(f64::NAN))
}

/// Control period, and the time from a release to its decision, ms.
const PERIOD_MS: f64 = 5.0;
const DECISION_MS: f64 = 0.2;

#[test]
fn an_open_cable_and_a_silent_card_are_seen_in_the_next_job_and_end_in_torque_off() {
    for (target, kind, event) in [
        ("force_sensor", "wire-break", "safety-state"),
        ("force-sensor", "no-slave", "bus-error"),
        ("encoder-2", "no-slave", "bus-error"),
    ] {
        let row = row(fault(target, kind, &[]));
        let (reaction, by, after) = reaction(&row);
        assert_eq!((reaction, by), ("off (STO)", event), "{target}");
        // BERR* comes a bus timer later at most, for each of the card's reads
        assert!(after > 0.0 && after < PERIOD_MS + DECISION_MS + 1.0, "{target}: {after} ms");
        // the first contact's own peak is about 75 N
        let peak = row["peak_force_n"].as_f64().expect("force");
        assert!(peak < 90.0, "{target}: {peak} N");
    }
}

#[test]
fn a_force_sample_that_grows_old_is_held_on_and_then_ends_in_torque_off() {
    let row = row(fault("force_sensor", "dropout", &[]));
    let (reaction, by, after) = reaction(&row);
    assert_eq!((reaction, by), ("off (STO)", "safety-state"));
    // 15 ms of age, then the next job
    assert!(after > 15.0 && after < 15.0 + PERIOD_MS + DECISION_MS, "{after} ms");
}

#[test]
fn a_sensor_that_repeats_itself_is_held_on_without_moving() {
    let row = row(fault("force_sensor", "stuck", &[]));
    let (reaction, by, after) = reaction(&row);
    assert_eq!((reaction, by), ("hold (SS2)", "safety-state"));
    assert!(after > 10.0 * PERIOD_MS && after < 13.0 * PERIOD_MS, "{after} ms");
}

#[test]
fn a_bus_that_grants_nobody_lets_the_output_watchdog_take_the_torque_off() {
    let row = row(fault("bus", "stuck-bus", &[]));
    let (reaction, by, after) = reaction(&row);
    assert_eq!((reaction, by), ("off (STO)", "watchdog-expired"));
    assert!(after < 20.0 + PERIOD_MS, "{after} ms");
}

#[test]
fn a_bias_cannot_be_seen_and_the_report_says_so() {
    let bias = [("amount", Value::Float(5.0)), ("axes", Value::Array(vec![2.into()]))];
    let row = row(fault("force_sensor", "bias", &bias));
    assert!(row["detected_by"].is_null() && row["reaction"] == "run", "{row}");
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
    outcome.expect_message("fault.0.target").expect_message("is `encoder-9`, expected a slave of the rack").expect_message("encoder-4");
}
