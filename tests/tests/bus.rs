//! The bus under strain: arbitration, interrupts, two cards at different rates and background load at once, in lock step
//! across processes and in one process.

use rack_tests::{Bench, program};
use serde_json::Value as Json;
use std::process::Command;
use toml::{Table, Value};

fn toml(text: &str) -> Value {
    let table: Table = format!("value = {text}").parse().expect("TOML");
    table["value"].clone()
}

/// Two cards, the first released by the force card's interrupt, the second at 1 kHz; the console polls through its
/// adaptor; a grabber loads the bus at random, and the SGI with block transfers.
fn strained<'n>(bench: &Bench, name: &'n str) -> &'n str {
    let tasks = r#"[
        { name = "control", board = "control_computer", processor = "cpu-1", period_ns = 4000000, release = { interrupt = "force-sample" } },
        { name = "torque", board = "control_computer", processor = "cpu-2", period_ns = 1000000, overrun = "late" },
        { name = "console", board = "workstation", processor = "sun", period_ns = 20000000 },
    ]"#;
    let traffic = r#"[
        { name = "sgi", adaptor = "vme-gio", period_ns = 3333333, am = 0x3F, addr = 0x400000, width = "D32", dir = "read", n = 32 },
        { name = "grabber", slot = 15, level = 2, release = "RWD", arrivals = "poisson", period_ns = 60000, am = 0x3F, addr = 0x410000, width = "D32", dir = "write", n = 64, seed = 3 },
    ]"#;
    bench.scenario(
        name,
        &[
            ("force_sensor_if.noise_n", Value::Float(0.2)),
            ("rack.tasks", toml(tasks)),
            ("rack.traffic", toml(traffic)),
            ("rack.bus.arbiter", Value::from("RRS")),
            ("rack.interrupters.force-sample.ticks", toml("{ period_ns = 4000000, offset_ns = 500000 }")),
            ("controller.execution_us", Value::Float(1000.0)),
            ("controller.second_card.execution_us", Value::Float(200.0)),
        ],
    )
}

fn report(bench: &Bench, arguments: &[&str]) -> Json {
    let outcome = bench.run(&[&["run", "--json", "--no-record", "--in-process"], arguments].concat());
    serde_json::from_str(&outcome.stdout).unwrap_or_else(|error| panic!("{error}: {}", outcome.stderr))
}

/// The element of a list that has this name.
fn named<'a>(list: &'a Json, name: &str) -> &'a Json {
    let found = list.as_array().into_iter().flatten().find(|element| element["name"] == name);
    found.unwrap_or_else(|| panic!("no {name} in {list}"))
}

#[test]
fn arbitration_interrupts_two_cards_and_load_record_the_same_in_lock_step_and_in_one_process() {
    let bench = Bench::new();
    let scenario = strained(&bench, "strained.toml");
    let apart = bench.digest(scenario, 1.4, &[]);
    assert_eq!(apart, bench.digest(scenario, 1.4, &["--in-process"]));
    assert_ne!(apart, bench.digest(scenario, 1.4, &["--in-process", "--set", "rack.traffic.grabber.seed=4"]));
}

#[test]
fn every_part_of_the_strain_was_there() {
    let bench = Bench::new();
    let scenario = strained(&bench, "strained.toml");
    let report = report(&bench, &[scenario, "--duration", "1.4"]);
    let bus = &report["variants"][0]["bus"];
    let count = |list: &str, name: &str, key: &str| named(&bus[list], name)[key].as_u64().unwrap_or(0);
    assert!(count("tasks", "torque", "jobs") >= 1399 && count("tasks", "control", "jobs") >= 349, "{bus}");
    assert!(bus["interrupts"].as_u64() >= Some(349), "{bus}");
    assert!(count("masters", "grabber", "transfers") > 20_000 && count("masters", "vme-gio", "transfers") > 400);
    // the first card waits for blocks that others transfer
    let longest_wait = named(&bus["masters"], "cpu-1")["wait"]["max_ns"].as_u64();
    assert!(longest_wait > Some(15_000), "{longest_wait:?}");
    let way = &bus["waterfall"];
    let parts = way["parts"].as_array().into_iter().flatten();
    let sum: u64 = parts.filter_map(|part| part["sum_ns"].as_u64()).sum();
    assert_eq!((Some(sum), way["jobs"].as_u64() > Some(300)), (way["whole_sum_ns"].as_u64(), true), "{way}");
}

#[test]
fn the_nominal_rack_uses_a_hundredth_of_the_bus_at_most_and_the_loop_does_not_notice_it() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[("plant.friction_scale", Value::Float(0.0))]);
    let real = report(&bench, &[scenario, "--duration", "4"]);
    let ideal = report(&bench, &[scenario, "--duration", "4", "--set", "rack.bus.constant_ns=1"]);
    let bus = &real["variants"][0]["bus"];
    let control = named(&bus["tasks"], "control");
    let (accesses, held_us) = (control["accesses_per_job"].as_f64(), control["bus_per_job_ns"].as_f64());
    assert!(accesses > Some(22.0) && accesses < Some(36.0), "{accesses:?} accesses a job");
    assert!(held_us > Some(15_000.0) && held_us < Some(25_000.0), "the bus is kept for {held_us:?} ns a job");
    assert!(bus["utilisation"].as_f64() < Some(0.01));
    let mean = |report: &Json| report["variants"][0]["segments"][1]["mean_n"].as_f64().expect("mean force");
    assert!((mean(&real) - mean(&ideal)).abs() < 0.05, "{} N, {} N on a bus without time", mean(&real), mean(&ideal));
}

#[test]
fn bus_show_says_the_rack_in_the_fields_terms_with_every_boards_program() {
    let bench = Bench::new();
    let text = bench.run(&["bus", "show", "table-5-3"]).expect_code(0).stdout;
    for part in
        ["VME–VME", "VME–GIO", "ROR", "BR3*", "0x100000", "encoder-4", "Task control", "Task console", "worst case"]
    {
        assert!(text.contains(part), "no {part} in:\n{text}");
    }
    for rust in ["OnRequest", "VmeVme", "Some(", "Periodic"] {
        assert!(!text.contains(rust), "{rust} in:\n{text}");
    }
}

#[test]
fn a_rack_that_cannot_be_is_refused_with_both_parties_named() {
    let bench = Bench::new();
    let cases: [(&str, &str, &[&str]); 5] = [
        ("rack.slaves.encoder-2.base", "0x200080", &["encoder-1", "encoder-2"]),
        ("rack.slaves.encoder-2.slot", "5", &["encoder-1", "encoder-2"]),
        ("rack.processors.cpu-1.level", "4", &["cpu-1", "0 to 3"]),
        ("rack.slaves.encoder-3.width", "\"D16\"", &["control", "encoder-3", "D32", "D16"]),
        ("rack.tasks.control.period_ns", "10000", &["control", "cpu-1", "period"]),
    ];
    for (key, value, parties) in cases {
        let scenario = bench.scenario("bad.toml", &[(key, toml(value))]);
        let outcome = bench.run(&["bus", "show", scenario]).expect_code(2);
        for party in parties {
            assert!(outcome.stderr.contains(party), "{key}: no {party} in:\n{}", outcome.stderr);
        }
    }
}

#[test]
fn a_reader_that_has_gone_ends_no_command_in_a_panic() {
    let bench = Bench::new();
    for arguments in
        ["bus show table-5-3", "bus sim --load 0.1,0.1,0.1,0.1 --transfers 10", "scenario show table-5-3", "scenarios"]
    {
        let mut command = Command::new("bash");
        // the reader is gone before the command writes
        let script = format!("set -o pipefail; (sleep 0.2; exec \"$0\" {arguments}) | true");
        command.args(["-c", &script]).arg(program("vmerack"));
        let outcome = bench.start_command(command).wait().expect_code(0);
        assert!(outcome.stderr.is_empty(), "{arguments}: {}", outcome.stderr);
    }
}
