//! Fault campaigns as whole commands: what they find, that cores do not matter, how they end.

use rack_tests::{Bench, Signal, signal};
use std::process::Command;
use std::time::Duration;

/// Two kinds that the rack sees, each twice in one phase.
const SMALL: &str = r#"
repeats = 2
twins = 2
least_effective = 2
watch_s = 0.4
force_growth_n = 40.0

[[phase]]
name = "steady contact"
from_s = 1.7
until_s = 1.9

[[kind]]
kind = "saturation"
targets = ["force_sensor"]
axes = [2]
detect = { periods = 1.0, ms = 0.1 }
reaction = ["stop", "off"]

[[kind]]
kind = "stuck"
targets = ["force_sensor"]
detect = { periods = 12.0, ms = 0.1 }
reaction = ["hold", "off"]
"#;

fn on_cores(bench: &Bench, cores: &str, out: &str) {
    let mut command = Command::new("taskset");
    command.arg("-c").arg(cores).arg(rack_tests::program("vmerack"));
    command.args(["faults", "--campaign", "small.toml", "--out", out]);
    bench.start_command(command).wait().expect_code(0).expect_nothing_left();
}

#[test]
fn the_same_campaign_and_seed_give_the_same_bytes_on_one_core_and_on_two() {
    let bench = Bench::new();
    bench.write("small.toml", SMALL);
    on_cores(&bench, "0", "one");
    on_cores(&bench, "0,1", "two");
    for file in ["campaign.json", "campaign.csv", "report.html"] {
        let read = |folder: &str| std::fs::read(bench.path(folder).join(file)).expect("written");
        assert!(read("one") == read("two"), "{file} differs");
    }
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(bench.path("one").join("campaign.json")).expect("written"))
            .expect("JSON");
    let rows = json["rows"].as_array().expect("rows");
    assert_eq!(rows.len(), 4);
    for row in rows {
        assert_eq!((&row["effect"], &row["verdict"]), (&true.into(), &"passed".into()), "{row}");
    }
    assert_eq!(json["totals"]["false_trips"], 0);
}

#[test]
fn a_bound_that_does_not_hold_and_a_reaction_that_was_not_expected_end_in_exit_code_4() {
    let bench = Bench::new();
    bench.write("late.toml", SMALL.replace("periods = 12.0", "periods = 2.0"));
    let late = bench.run(&["faults", "--campaign", "late.toml", "--kinds", "stuck", "--out", "late"]).expect_code(4);
    assert!(late.stdout.contains("2 detected late"), "{}", late.stdout);
    bench.write("mild.toml", SMALL.replace("[\"stop\", \"off\"]", "[\"run\", \"run\"]"));
    let mild =
        bench.run(&["faults", "--campaign", "mild.toml", "--kinds", "saturation", "--out", "mild"]).expect_code(4);
    assert!(mild.stdout.contains("2 wrong reactions"), "{}", mild.stdout);
}

#[test]
fn a_kind_with_too_few_effective_faults_is_not_shown_and_fails_a_whole_campaign_only() {
    let bench = Bench::new();
    bench.write("few.toml", SMALL.replace("least_effective = 2", "least_effective = 20"));
    let whole = bench.run(&["faults", "--campaign", "few.toml", "--kinds", "stuck", "--out", "a"]).expect_code(4);
    assert!(whole.stdout.contains("not shown"), "{}", whole.stdout);
    bench.run(&["faults", "--campaign", "few.toml", "--kinds", "stuck", "--repeat", "1", "--out", "b"]).expect_code(0);
}

#[test]
fn bad_campaigns_and_kinds_are_refused_with_their_key() {
    let bench = Bench::new();
    bench.write("bad.toml", SMALL.replace("watch_s = 0.4", "watch_s = -1.0"));
    let refused = |arguments: &[&str]| bench.run(&[&["faults", "--out", "out"][..], arguments].concat()).expect_code(2);
    refused(&["--campaign", "bad.toml"]).expect_message("bad.toml:5: watch_s: is -1");
    refused(&["--kinds", "stick"]).expect_message("--kinds: stick: there is no such kind");
    refused(&["failures", "--set", "fault=[{target='bus', kind='stuck-bus', start_s=1.0}]"])
        .expect_message("without faults");
}

#[test]
fn ctrl_c_ends_a_campaign_in_order_and_leaves_nothing() {
    let bench = Bench::new();
    let mut running = bench.start(&["faults", "--kinds", "stuck,saturation", "--null-hours", "10", "--out", "out"]);
    running.pause(Duration::from_millis(1500));
    signal(running.pid(), Signal::INT);
    running.wait().expect_code(1).expect_nothing_left().expect_message("interrupted");
    assert!(!bench.path("out").exists());
}
