//! Planned crashes and hangs: real signals across processes, the same digest inside one, a safe arm, and boards that come
//! up again.

use rack_tests::{Bench, Signal, signal};
use serde_json::Value as Json;
use std::time::Duration;
use toml::{Table, Value};

/// A board that crashes or hangs from 1.202 s on, in contact, for 0.3 s where it comes up again.
fn outage(board: &str, kind: &str, again: bool) -> Value {
    let mut fault = Table::new();
    fault.insert("target".into(), board.into());
    fault.insert("kind".into(), kind.into());
    fault.insert("start_s".into(), Value::Float(1.202));
    if again {
        fault.insert("duration_s".into(), Value::Float(0.3));
    }
    Value::Table(fault)
}

/// Part of the record that a recorder that came up again wrote.
const SECOND: &str = "nominal.part2.mcap";

#[test]
fn a_board_that_goes_down_and_comes_up_again_gives_the_same_record_across_processes_and_inside_one() {
    for (board, kind) in [
        ("workstation", "crash"),
        ("da_io", "hang"),
        ("da_io", "crash"),
        ("control_computer", "crash"),
        ("encoder_if", "hang"),
        ("force_sensor_if", "crash"),
        ("bus_analyzer", "crash"),
    ] {
        let bench = Bench::new();
        let scenario = bench.scenario("outage.toml", &[("fault", Value::Array(vec![outage(board, kind, true)]))]);
        let digests = |out: &str, options: &[&str]| {
            let arguments = ["run", scenario, "--duration", "2.4", "--out", out];
            bench.run(&[&arguments, options].concat()).expect_code(0).expect_nothing_left();
            let second = format!("{out}/{SECOND}");
            let second = bench.path(&second).exists().then(|| bench.digest_of(&second));
            assert_eq!(second.is_some(), board == "bus_analyzer", "{board}");
            (bench.digest_of(&format!("{out}/nominal.mcap")), second)
        };
        assert_eq!(digests("across", &[]), digests("inside", &["--in-process"]), "{kind} of {board}");
    }
}

/// The report's row of one fault that lasts for good.
fn row(board: &str, kind: &str) -> Json {
    let bench = Bench::new();
    let scenario = bench.scenario("outage.toml", &[("fault", Value::Array(vec![outage(board, kind, false)]))]);
    let outcome =
        bench.run(&["run", scenario, "--duration", "2", "--in-process", "--no-record", "--json", "--out", "out"]);
    let report: Json = serde_json::from_str(&outcome.expect_code(0).expect_nothing_left().stdout).expect("JSON");
    report["variants"][0]["faults"][0].clone()
}

#[test]
fn every_board_that_control_needs_leaves_a_braked_arm_behind() {
    for board in ["da_io", "force_sensor_if", "encoder_if", "control_computer"] {
        for kind in ["crash", "hang"] {
            let row = row(board, kind);
            let after = row["detected_after_s"].as_f64().unwrap_or_else(|| panic!("{kind} of {board} undetected"));
            // the output watchdog's 20 ms are the longest, after the period that began before
            assert!(after < 0.026, "{kind} of {board}: {row}");
            // the first contact's own peak is about 75 N
            assert!(row["peak_force_n"].as_f64().expect("force") < 90.0, "{kind} of {board}: {row}");
            assert!(row["distance_m"].as_f64().expect("distance") < 0.01, "{kind} of {board}: {row}");
        }
    }
}

#[test]
fn a_hang_stops_the_real_process_and_the_run_goes_on_and_leaves_nothing() {
    let bench = Bench::new();
    let mut fault = outage("workstation", "hang", false);
    if let Some(fault) = fault.as_table_mut() {
        fault.insert("start_s".into(), Value::Float(0.05));
    }
    let scenario = bench.scenario("hang.toml", &[("fault", Value::Array(vec![fault]))]);
    let mut run = bench.start(&["run", scenario, "--duration", "30000", "--out", "out"]);
    let processes = run.wait_for_processes(7);
    let victim = processes.iter().find(|process| process.name == "workstation").expect("workstation").pid;
    let state = || std::fs::read_to_string(format!("/proc/{victim}/stat")).unwrap_or_default();
    while !state().contains(") T ") {
        run.pause(Duration::from_millis(5));
    }
    run.pause(Duration::from_millis(300));
    assert_eq!(run.wait_for_processes(7).len(), 7, "the others live");
    signal(run.pid(), Signal::INT);
    run.wait().expect_code(1).expect_message("interrupted").expect_nothing_left();
}

#[test]
fn outages_in_real_time_and_restarts_of_what_control_needs_are_refused() {
    let bench = Bench::new();
    let scenario =
        bench.scenario("outage.toml", &[("fault", Value::Array(vec![outage("workstation", "crash", true)]))]);
    let refused = |options: &[&str], message: &str| {
        bench.run(&[&["run", scenario, "--out", "out"], options].concat()).expect_code(2).expect_message(message);
    };
    refused(&["--pacing", "realtime"], "expected lock step");
    refused(&["--restart", "da_io=always"], "workstation and bus_analyzer");
    refused(&["--restart", "workstation=sometimes"], "PROCESS=never");
    refused(&["--restart", "nobody=once"], "there is no process `nobody`");
}
