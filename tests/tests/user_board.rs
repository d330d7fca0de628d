//! A user's own board, built outside the workspace, in the place of the control computer; and boards that answer badly or
//! not at all.

use rack_tests::{Bench, target_folder, workspace};
use serde_json::Value as Json;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;
use toml::{Table, Value};

/// Builds the user's crate; the folder of its programs. It takes the registry's packages as the workspace has locked them.
fn built() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let source = workspace().join("tests/user_board");
        std::fs::copy(workspace().join("Cargo.lock"), source.join("Cargo.lock")).expect("lock file");
        // the packages that both use are built already
        let target = target_folder();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--offline", "--manifest-path"])
            .arg(source.join("Cargo.toml"))
            .arg("--target-dir")
            .arg(&target)
            .output()
            .expect("cargo");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        target.join("debug")
    })
}

/// The scenario's processes with this command as the control computer.
fn processes(command: &[&str]) -> Value {
    let process = |name: &str, boards: &[&str], command: &[&str]| {
        let list = |items: &[&str]| Value::Array(items.iter().map(|item| Value::from(*item)).collect());
        let entries = [("name", Value::from(name)), ("boards", list(boards)), ("command", list(command))];
        Value::Table(Table::from_iter(entries.map(|(key, value)| (key.to_owned(), value))))
    };
    let plant = ["hw_sim", "da_io", "force_sensor_if", "encoder_if", "workstation"];
    Value::Array(vec![
        process("plant", &plant, &[]),
        process("bus_analyzer", &["bus_analyzer"], &[]),
        process("mine", &["control_computer"], command),
    ])
}

#[test]
fn a_users_board_holds_the_arm_and_its_runs_repeat_to_the_bit() {
    let program = built().join("user_board");
    let bench = Bench::new();
    let processes = processes(&[program.to_str().expect("path")]);
    let scenario = bench.scenario("mine.toml", &[("process", processes)]);
    assert_eq!(bench.digest(scenario, 1.0, &[]), bench.digest(scenario, 1.0, &[]));

    let outcome =
        bench.run(&["run", scenario, "--duration", "1", "--json", "--out", "out"]).expect_code(0).expect_nothing_left();
    let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
    let off = report["variants"][0]["segments"][0]["position_error_m"].as_f64();
    // the first segment holds the start pose; the user's controller sends no probe of its own
    assert!(off.is_none_or(|off| off < 1e-3), "the tool moved by {off:?} m");
    let contact = &report["variants"][0]["run"]["first_contact_s"];
    assert!(contact.is_null(), "an arm that is held does not touch the surface, 5 mm away: {contact}");
}

/// Runs a board that goes wrong at its 100th job; what it does must be reported by `message`.
fn fault(how: &str, message: &[&str]) {
    let program = built().join("faulty_board");
    let bench = Bench::new();
    let processes = processes(&[program.to_str().expect("path"), how]);
    let scenario = bench.scenario("faulty.toml", &[("process", processes)]);
    let mut outcome = bench.run(&["run", scenario, "--out", "out"]).expect_code(1).expect_nothing_left();
    for part in message.iter().chain(&["at simulated time 0.50"]) {
        outcome = outcome.expect_message(part);
    }
    println!("{how}: over in {:.2?}", outcome.took);
    bench.digest_of("out/nominal.mcap");
}

#[test]
fn a_board_that_sleeps_is_a_reported_fault() {
    fault("sleeps", &["process `mine` is stalled", "uses no processor time"]);
}

#[test]
fn a_board_that_spins_for_ever_is_a_reported_fault() {
    fault("spins", &["process `mine` is stalled", "it has used 5 s of processor time"]);
}

#[test]
fn a_board_that_leaves_is_a_reported_fault() {
    fault("leaves", &["process `mine` ended with exit code 7"]);
}

#[test]
fn a_board_that_panics_is_a_reported_fault() {
    fault("panics", &["process `mine` ended with exit code 101"]);
}

#[test]
fn a_board_that_cuts_a_window_is_a_reported_fault() {
    fault("cuts", &["board `control_computer` answered badly", "only hw_sim may cut a window"]);
}

#[test]
fn a_command_that_does_not_exist_is_named() {
    let bench = Bench::new();
    let scenario = bench.scenario("none.toml", &[("process", processes(&["./no_such_program"]))]);
    let outcome = bench.run(&["run", scenario, "--out", "out"]).expect_code(1);
    outcome.expect_message("./no_such_program").expect_nothing_left();
}
