//! After a stop: a board that was lost is powered up again, the operator acknowledges, and the task goes on from rest.

use rack_tests::{Bench, fault};
use serde_json::Value as Json;
use toml::Value;

/// 60 N on the board until the end, that board down from 2 to 3 s, and an operator who waits for so long.
fn interrupted(bench: &Bench, board: &str, kind: &str, wait_s: Option<f64>) {
    let more = [("duration_s", Value::Float(0.5))];
    let mut edits = vec![
        ("segment.1.until_s", Value::Float(8.0)),
        ("segment.2.until_s", Value::Float(9.0)),
        ("fault", Value::Array(vec![fault(board, kind, 2.0, &more)])),
    ];
    edits.extend(wait_s.map(|wait| ("safety.acknowledge_s", Value::Float(wait))));
    bench.scenario("interrupted.toml", &edits);
}

/// The variant's report and the record's digest.
fn run(bench: &Bench, out: &str, options: &[&str]) -> (Json, String) {
    let line = ["run", "interrupted.toml", "--duration", "8", "--json", "--out", out];
    let outcome = bench.run(&[&line, options].concat()).expect_code(0).expect_nothing_left();
    let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
    (report["variants"][0].clone(), bench.digest_of(&format!("{out}/nominal.mcap")))
}

/// Mean force of the last second, N.
fn closing_n(variant: &Json) -> f64 {
    variant["segments"][1]["mean_n"].as_f64().expect("the last second's force")
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
        if board == "encoder_if" || board == "control_computer" {
            assert_eq!(run(&bench, "across", &[]).1, digest, "{board}: across processes");
        }
    }
}

#[test]
fn nobody_acknowledges_unless_the_scenario_says_so() {
    let bench = Bench::new();
    interrupted(&bench, "encoder_if", "crash", None);
    let mean = closing_n(&run(&bench, "out", &["--in-process"]).0);
    assert!((mean - 60.0).abs() > 10.0, "{mean} N on the brakes: as they caught it, not as commanded");
}

#[test]
fn the_second_of_two_cards_is_acknowledged_through_the_first() {
    let bench = Bench::new();
    let crash = "fault=[{ target='encoder_if', kind='crash', start_s=2.0, duration_s=0.1 }]";
    let line = ["run", "processor-time", "--variant", "two-68030-customised", "--in-process", "--no-record", "--json"];
    let changes = ["--set", crash, "--set", "safety.acknowledge_s=0.3", "--set", "segment.1.until_s=6"];
    let length = ["--duration", "6", "--out", "out"];
    // cards that do not answer cost the task some releases, of which the scenario allows none
    let outcome = bench.run(&[&line[..], &changes, &length].concat()).expect_code(4).expect_nothing_left();
    let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
    let variant = &report["variants"][0];
    assert_eq!(variant["faults"][0]["reaction"], "off (STO)");
    let mean = closing_n(variant);
    assert!((mean - 60.0).abs() < 2.0, "{mean} N of 60 N at the end, without friction");
}
