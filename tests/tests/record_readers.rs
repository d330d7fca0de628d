//! The record opens with the tools that others use, which agree about what it says.

use rack_tests::{Bench, target_folder, workspace};
use serde_json::Value;
use std::process::Command;

#[test]
fn python_mcap_and_rosbags_read_the_same_from_a_record() {
    let python = Command::new(workspace().join("scripts/python-env.sh"))
        .env("CARGO_TARGET_DIR", target_folder())
        .output()
        .expect("scripts/python-env.sh");
    assert!(python.status.success(), "{}", String::from_utf8_lossy(&python.stderr));
    let python = String::from_utf8_lossy(&python.stdout).trim().to_owned();

    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    bench.run(&["run", scenario, "--duration", "1.2", "--out", "out"]).expect_code(0);
    let mut read = Command::new(workspace().join(python));
    read.arg(workspace().join("tests/readers/read_record.py")).arg("out/nominal.mcap");
    let outcome = bench.start_command(read).wait().expect_code(0);
    let read: Value = serde_json::from_str(&outcome.stdout).expect("the reader prints JSON");
    // 200 Hz of control
    let states = read["messages"]["/control/state"].as_u64().expect("count");
    assert!((235..=240).contains(&states), "{states} control jobs in 1.2 s");
    let torques = read["last_torque"].as_array().expect("torques");
    assert!(torques.len() == 7 && torques.iter().any(|torque| torque.as_f64() != Some(0.0)), "{torques:?}");
}
