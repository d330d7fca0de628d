//! The book's experiments as a user runs them: every scenario keeps its own limits, and what relates several of them.

use rack_tests::{Bench, Outcome};
use serde_json::Value;

const QUIETLY: [&str; 5] = ["--in-process", "--no-record", "--json", "--out", "out"];

fn report(outcome: &Outcome) -> Value {
    serde_json::from_str(&outcome.stdout).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

/// Row of a segment of a scenario's variant `friction`.
fn with_friction(scenario: &str, segment: &str) -> Value {
    let line = [&["run", scenario, "--variant", "friction"][..], &QUIETLY].concat();
    let report = report(&Bench::new().run(&line).expect_code(0));
    let rows = report["variants"][0]["segments"].as_array().expect("segments").clone();
    rows.into_iter().find(|row| row["name"] == segment).expect("the segment")
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number `{key}` in {row}"))
}

#[test]
fn the_three_impedance_sets_rise_faster_in_their_order_and_slide_with_ever_less_error() {
    let scenarios = ["figure-6-5", "figure-6-6", "after-6-6"];
    let rise = scenarios.map(|scenario| number(&with_friction(scenario, "press"), "rise_s"));
    assert!((7.0..12.0).contains(&rise[0]) && (3.5..6.0).contains(&rise[1]) && rise[2] < 1.0, "{rise:?}");
    assert!((1.7..2.4).contains(&(rise[0] / rise[1])), "{rise:?}");
    let sliding = scenarios.map(|scenario| number(&with_friction(scenario, "slide"), "tracking_error_n"));
    assert!(sliding[0] > sliding[1] && sliding[1] > sliding[2], "{sliding:?}");
}

#[test]
fn every_other_experiment_keeps_its_limits() {
    for scenario in ["figure-6-3", "surface-cleaning", "self-motion", "joint-limits", "friction-compensation"] {
        let outcome = Bench::new().run(&[&["run", scenario][..], &QUIETLY].concat()).expect_code(0);
        assert_eq!(report(&outcome)["verdict"], "passed", "{scenario}");
    }
}

#[test]
fn one_ideal_axis_is_the_ideal_impedance_within_1_n_throughout() {
    let outcome = Bench::new().run(&[&["run", "one-axis-ideal"][..], &QUIETLY].concat()).expect_code(0);
    let report = report(&outcome);
    let fast = &report["variants"][0];
    assert_eq!(fast["name"], "0.5-ms");
    assert!(number(&fast["run"], "ideal_force_deviation_n") < 1.0, "{}", fast["run"]);
}

#[test]
fn the_one_axis_checks_keep_their_limits() {
    for scenario in ["one-axis-delay", "sampled-wall"] {
        Bench::new().run(&[&["run", scenario][..], &QUIETLY].concat()).expect_code(0);
    }
}

#[test]
fn a_limit_between_variants_is_not_judged_where_one_of_them_was_not_run() {
    let line = [&["run", "joint-limits", "--variant", "with-task"][..], &QUIETLY].concat();
    let report = report(&Bench::new().run(&line).expect_code(0));
    let checks = report["variants"][0]["checks"].as_array().expect("checks");
    let relative = checks.iter().find(|check| check["relative_to"] == "without-task").expect("the limit");
    assert!(relative["passed"].is_null(), "{relative}");
}

#[test]
fn bad_input_to_sweep_margin_and_compare_ends_with_exit_code_2() {
    for line in [
        "sweep one-axis-delay --vary encoder_if.nonsense=1..2:2 --out s",
        "sweep one-axis-delay --vary encoder_if.delay_ms=2..1 --out s",
        "sweep one-axis-delay --vary encoder_if.delay_ms=1..2:2 --measure beauty --out s",
        "margin one-axis-delay --key encoder_if.nonsense",
        "margin one-axis-delay",
        "margin one-axis-delay --key encoder_if.delay_ms --from 9 --to 5",
        "compare nowhere nothing",
        "compare nowhere",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let outcome = Bench::new().run(&words).expect_code(2);
        assert!(!outcome.stderr.is_empty(), "{line}");
    }
}
