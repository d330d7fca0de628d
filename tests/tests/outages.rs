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
        // what a recorder that is down does not see is lost, planned or not
        let code = if board == "bus_analyzer" { 3 } else { 0 };
        let run = |out: &str, options: &[&str]| {
            let arguments = ["run", scenario, "--duration", "2.4", "--json", "--out", out];
            let outcome = bench.run(&[&arguments, options].concat()).expect_code(code).expect_nothing_left();
            let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
            (report["variants"][0]["unrecorded"].clone(), bench.digest_of(&format!("{out}/nominal.mcap")))
        };
        let (unrecorded, digest) = run("across", &[]);
        assert_eq!(run("inside", &["--in-process"]), (unrecorded.clone(), digest), "{kind} of {board}");
        let stretches = unrecorded.as_array().expect("a list");
        assert_eq!(stretches.len(), usize::from(board == "bus_analyzer"), "{kind} of {board}: {unrecorded}");
        for stretch in stretches {
            let [from, to] = [0, 1].map(|end| stretch[end].as_f64().expect("seconds"));
            // down from 1.202 s, for 0.3 s and the 0.5 s of its boot; the chunk that it had begun goes with it
            assert!(from > 0.5 && from < 1.2021 && (to - 2.002).abs() < 6e-3, "{stretch}");
        }
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
            // a card that does not answer is seen in the next job, by the bus timer; the control computer by the output
            // watchdog, 20 ms after its last heartbeat, and so is a da_io that hangs
            let is_watched = board == "control_computer" || (board, kind) == ("da_io", "hang");
            assert!(after < if is_watched { 0.0255 } else { 0.0055 }, "{kind} of {board}: {row}");
            // SS1 may take its 200 ms first, and the brakes 15 ms
            let braked =
                row["braked_after_s"].as_f64().unwrap_or_else(|| panic!("{kind} of {board}: not braked: {row}"));
            assert!(braked < 0.25, "{kind} of {board}: {row}");
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
fn in_real_time_the_signals_are_real_and_the_arm_is_stopped_as_in_lock_step() {
    for (board, kind, reaction, code) in [
        ("encoder_if", "crash", "off (STO)", 0),
        ("force_sensor_if", "hang", "off (STO)", 0),
        ("da_io", "hang", "off (STO)", 0),
        ("control_computer", "crash", "off (STO)", 0),
        ("workstation", "crash", "hold (SS2)", 0),
        ("bus_analyzer", "crash", "run", 3),
    ] {
        let bench = Bench::new();
        let scenario = bench.scenario("outage.toml", &[("fault", Value::Array(vec![outage(board, kind, true)]))]);
        let line = ["run", scenario, "--duration", "2.6", "--pacing", "realtime", "--json", "--out", "out"];
        let outcome = bench.run(&line).expect_code(code).expect_nothing_left();
        let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
        let row = &report["variants"][0]["faults"][0];
        println!("{kind} of {board}: {row}");
        // on a machine that is busy the arm may be stopped for more than this fault
        let states = ["run", "degraded", "hold (SS2)", "stop (SS1)", "off (STO)"];
        let place = |state: &str| states.iter().position(|known| *known == state);
        assert!(place(row["reaction"].as_str().expect("state")) >= place(reaction), "{kind} of {board}: {row}");
        bench.digest_of("out/nominal.mcap");
    }
}

#[test]
fn restarts_of_what_control_needs_are_refused() {
    let bench = Bench::new();
    let scenario = bench.scenario("plain.toml", &[]);
    let refused = |options: &[&str], message: &str| {
        bench.run(&[&["run", scenario, "--out", "out"], options].concat()).expect_code(2).expect_message(message);
    };
    refused(&["--restart", "da_io=always"], "workstation and bus_analyzer");
    refused(&["--restart", "workstation=sometimes"], "PROCESS=never");
    refused(&["--restart", "nobody=once"], "there is no process `nobody`");
}
