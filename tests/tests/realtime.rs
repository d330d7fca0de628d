//! Real time with real processes: as root and as an ordinary user, and with a process killed in the middle.
//!
//! Nothing here limits how late a busy machine may be.

use rack_tests::{Bench, Outcome, Signal, signal};
use std::process::Command;
use std::time::Duration;

/// Arguments of a run in real time.
fn run<'a>(scenario: &'a str, seconds: &'a str) -> [&'a str; 8] {
    ["run", scenario, "--pacing", "realtime", "--duration", seconds, "--out", "out"]
}

fn report(bench: &Bench) -> serde_json::Value {
    let text = std::fs::read_to_string(bench.path("out/report.json")).expect("report.json");
    serde_json::from_str(&text).expect("report.json is JSON")
}

/// A whole run with a table of what was measured.
fn expect_measured(bench: &Bench, outcome: Outcome) -> Outcome {
    let outcome = outcome.expect_code(0).expect_nothing_left();
    let variant = &report(bench)["variants"][0];
    assert_eq!(variant["ended"]["how"], "completed");
    let paths = variant["measured"].as_array().expect("measured paths");
    for path in ["wake-up hw_sim", "wake-up control_computer", "step control_computer"] {
        let row = paths.iter().find(|row| row["path"].as_str().is_some_and(|name| name.starts_with(path)));
        let n = row.unwrap_or_else(|| panic!("no {path} in {paths:#?}"))["n"].as_u64();
        assert!(n.is_some_and(|n| n >= 400), "{path}: {n:?}");
    }
    outcome
}

#[test]
fn two_seconds_in_real_time_end_with_every_job_done_and_a_table_of_what_was_measured() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    expect_measured(&bench, bench.run(&run(scenario, "2")));
}

#[test]
fn without_the_right_to_sched_fifo_a_run_says_so_once_and_goes_on() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    let mut command = Command::new("prlimit");
    command.args(["--rtprio=0:0", "--memlock=65536:65536"]);
    if rustix::process::geteuid().is_root() {
        let rights = "-sys_nice,-ipc_lock";
        command.args(["setpriv", "--bounding-set", rights, "--inh-caps", rights]);
    }
    command.arg(rack_tests::program("vmerack")).args(run(scenario, "2"));
    let outcome = expect_measured(&bench, bench.start_command(command).wait());
    assert_eq!(outcome.stderr.matches("SCHED_FIFO").count(), 1, "{}", outcome.stderr);
    outcome.expect_message("needs CAP_SYS_NICE or an rtprio limit: ulimit -r); the run goes on");
}

#[test]
fn a_process_killed_or_stopped_in_real_time_ends_the_run_with_its_name() {
    for (name, how) in [("control_computer", Signal::KILL), ("hw_sim", Signal::KILL), ("da_io", Signal::STOP)] {
        let bench = Bench::new();
        let scenario = bench.scenario("s.toml", &[]);
        let mut running = bench.start(&run(scenario, "50"));
        let processes = running.wait_for_processes(7);
        running.pause(Duration::from_millis(700));
        let victim = processes.iter().find(|process| process.name == name).expect("the process lives");
        signal(victim.pid, how);
        running.mark();
        let outcome = running.wait();
        println!("{name} {how:?}: ended after {:.2} s", outcome.took.as_secs_f64());
        let message = format!("process `{name}`");
        outcome.expect_code(1).expect_message(&message).expect_nothing_left();
        bench.digest_of("out/nominal.mcap");
    }
}

#[test]
fn a_strict_run_refuses_what_the_machine_refuses() {
    let bench = Bench::new();
    // no machine has this many processors
    let scenario = bench.scenario("s.toml", &[("process.hw_sim.cpus", toml::Value::from(vec![1000]))]);
    let outcome = bench.run(&[run(scenario, "1").as_slice(), &["--strict"]].concat());
    outcome.expect_code(1).expect_message("processors [1000]").expect_nothing_left();
    let outcome = bench.run(&run(scenario, "0.5")).expect_code(0);
    outcome.expect_message("hw_sim: real time without processors [1000]").expect_nothing_left();
}

#[test]
fn a_process_runs_on_the_processors_and_with_the_priority_that_the_scenario_gives_it() {
    let bench = Bench::new();
    let edits =
        [("process.hw_sim.cpus", toml::Value::from(vec![0])), ("process.hw_sim.priority", toml::Value::from(61))];
    let scenario = bench.scenario("s.toml", &edits);
    let mut running = bench.start(&run(scenario, "50"));
    let processes = running.wait_for_processes(7);
    running.pause(Duration::from_millis(1500));
    let proc = |name: &str, file: &str| {
        let pid = processes.iter().find(|process| process.name == name).expect("the process lives").pid;
        std::fs::read_to_string(format!("/proc/{pid}/{file}")).expect("/proc")
    };
    assert!(proc("hw_sim", "status").contains("Cpus_allowed_list:\t0\n"));
    let policy = |name: &str| {
        let stat = proc(name, "stat");
        let fields: Vec<&str> = stat.rsplit_once(')').expect("stat").1.split_whitespace().collect();
        (fields[38].to_owned(), fields[37].to_owned())
    };
    if policy("da_io").0 == "1" {
        // SCHED_FIFO is allowed here
        assert_eq!(policy("hw_sim"), ("1".into(), "61".into()));
        assert_eq!(policy("da_io"), ("1".into(), "50".into()));
    }
    signal(running.pid(), Signal::INT);
    running.wait().expect_code(1).expect_nothing_left();
}
