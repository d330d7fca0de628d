//! After a stop: a board that was lost is powered up again, the operator acknowledges, and the task goes on from rest.

use rack_tests::{Bench, fault};
use serde_json::Value as Json;
use toml::Value;

/// 60 N on the board until the end, that board down from 2 to 3 s, and an operator who waits for so long.
fn interrupted(bench: &Bench, board: &str, kind: &str, wait_s: Option<f64>) {
    let more = [("duration_s", Value::Float(0.5))];
    let mut edits = vec![
        ("segment.1.until_s", Value::Float(6.0)),
        ("fault", Value::Array(vec![fault(board, kind, 2.0, &more)])),
    ];
    edits.extend(wait_s.map(|wait| ("safety.acknowledge_s", Value::Float(wait))));
    bench.scenario("interrupted.toml", &edits);
}

/// The variant's report and the record's digest.
fn run(bench: &Bench, out: &str, options: &[&str]) -> (Json, String) {
    let line = ["run", "interrupted.toml", "--duration", "9", "--json", "--out", out];
    let outcome = bench.run(&[&line, options].concat()).expect_code(0).expect_nothing_left();
    let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
    (report["variants"][0].clone(), bench.digest_of(&format!("{out}/nominal.mcap")))
}

/// Mean force of the second segment's last second, N, where it was carried out.
fn closing_n(variant: &Json) -> f64 {
    let row = &variant["segments"][1];
    row["mean_n"].as_f64().unwrap_or_else(|| panic!("no last second: {row}"))
}

/// How a segment went, and when, s.
fn course(variant: &Json, segment: usize) -> (String, f64, f64) {
    let row = &variant["segments"][segment];
    let time = |key: &str| row[key].as_f64().expect("time");
    (row["course"].as_str().expect("course").into(), time("start_s"), time("end_s"))
}

#[test]
fn an_arm_stopped_by_a_lost_board_regulates_force_again_once_acknowledged() {
    for (board, kind) in [
        ("encoder_if", "crash"),
        ("force_sensor_if", "hang"),
        ("control_computer", "crash"),
        ("da_io", "crash"),
        ("da_io", "hang"),
        ("workstation", "crash"),
    ] {
        let bench = Bench::new();
        interrupted(&bench, board, kind, Some(0.5));
        let (variant, digest) = run(&bench, "inside", &["--in-process"]);
        let row = &variant["faults"][0];
        let stopped = if board == "workstation" { "hold (SS2)" } else { "off (STO)" };
        assert_eq!(row["reaction"], stopped, "{kind} of {board}");
        let [before, peak] = ["force_before_n", "peak_force_n"].map(|key| row[key].as_f64().expect("force"));
        assert!(peak < before + 25.0, "{kind} of {board}: {row}");
        let mean = closing_n(&variant);
        println!("{kind} of {board}: {mean:.1} N of 60 N at the end");
        // what the scheme's friction leaves of it takes its time to wear off
        assert!((mean - 60.0).abs() < 6.0, "{kind} of {board}: {mean} N of 60 N at the end");
        // stopped within it, begun anew and carried out in its whole length
        let (how, start, end) = course(&variant, 1);
        assert_eq!(how, "again");
        assert!(start > 3.0 && (end - start - 5.0).abs() < 0.006, "{kind} of {board}: {start} to {end} s");
        assert_eq!(course(&variant, 0), ("as_planned".into(), 0.0, 1.0));
        if board == "encoder_if" || board == "control_computer" {
            assert_eq!(run(&bench, "across", &[]).1, digest, "{board}: across processes");
        }
    }
}

#[test]
fn nobody_acknowledges_unless_the_scenario_says_so() {
    let bench = Bench::new();
    interrupted(&bench, "encoder_if", "crash", None);
    let variant = run(&bench, "out", &["--in-process"]).0;
    let (how, start, end) = course(&variant, 1);
    assert_eq!((how.as_str(), start), ("cut_off", 1.0));
    // SS1 begins with the next job
    assert!(end > 2.0 && end < 2.0055, "cut off at {end} s");
    assert_eq!(variant["segments"][1]["mean_n"], Json::Null);
    assert_eq!(course(&variant, 2), ("not_begun".into(), 6.0, 7.0));
}

#[test]
fn a_console_that_dies_after_the_task_was_resumed_comes_up_and_sends_the_segments_left_so_much_later() {
    let bench = Bench::new();
    interrupted(&bench, "encoder_if", "crash", Some(0.5));
    let sound = run(&bench, "sound", &["--in-process"]).0;
    let (_, _, end) = course(&sound, 1);
    assert_eq!(course(&sound, 2).1, end, "the third segment follows the second");
    // up again before the control computer misses it, which would hold the arm
    let mut both = vec![fault("encoder_if", "crash", 2.0, &[("duration_s", Value::Float(0.5))])];
    both.push(fault("workstation", "crash", 5.52, &[("duration_s", Value::Float(0.01))]));
    bench.scenario(
        "interrupted.toml",
        &[
            ("segment.1.until_s", Value::Float(6.0)),
            ("safety.acknowledge_s", Value::Float(0.5)),
            ("process.workstation.boot_ms", Value::Float(100.0)),
            ("fault", Value::Array(both)),
        ],
    );
    let (variant, digest) = run(&bench, "inside", &["--in-process"]);
    assert_eq!(variant["faults"][1]["reaction"], "run", "{}", variant["faults"][1]);
    assert_eq!(course(&variant, 2), course(&sound, 2), "as if it had never been away");
    assert_eq!(course(&variant, 2).0, "later");
    // the real process is killed
    assert_eq!(run(&bench, "across", &[]).1, digest);
}

#[test]
fn the_second_of_two_cards_is_acknowledged_through_the_first() {
    let bench = Bench::new();
    let crash = "fault=[{ target='encoder_if', kind='crash', start_s=2.0, duration_s=0.1 }]";
    let line = ["run", "processor-time", "--variant", "two-68030-customised", "--in-process", "--no-record", "--json"];
    let changes = ["--set", crash, "--set", "safety.acknowledge_s=0.3", "--set", "segment.1.until_s=4"];
    let length = ["--duration", "7.5", "--out", "out"];
    // cards that do not answer cost the task some releases, of which the scenario allows none
    let outcome = bench.run(&[&line[..], &changes, &length].concat()).expect_code(4).expect_nothing_left();
    let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
    let variant = &report["variants"][0];
    assert_eq!(variant["faults"][0]["reaction"], "off (STO)");
    let mean = closing_n(variant);
    assert!((mean - 60.0).abs() < 2.0, "{mean} N of 60 N at the end, without friction");
}
