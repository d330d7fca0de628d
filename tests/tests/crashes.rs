//! Processes killed and stopped for real, at drawn moments. One that control needs ends the run with exit code 1 and a
//! message that names it; workstation and recorder are started again, and the run ends with exit code 3. The record is
//! readable, and nothing is left on the machine.
//!
//! Every run is under the bench's watchdog of 60 s and prints the time that its end took. `scripts/soak.sh` runs the long
//! versions.

use rack_tests::{Bench, Draw, Outcome, Running, Signal, signal};
use std::time::Duration;

/// Where the runs record.
const RECORD: &str = "out/nominal.mcap";

/// Their loss ends the run.
const NEEDED: [&str; 5] = ["hw_sim", "da_io", "force_sensor_if", "encoder_if", "control_computer"];
/// The run goes on without them.
const DISPENSABLE: [&str; 2] = ["workstation", "bus_analyzer"];

/// Starts a run that would last very long, and lets it go on for `delay` after its processes have started.
fn start(bench: &Bench, delay: Duration) -> Running {
    start_for(bench, "30000", delay)
}

/// The same with so many simulated seconds.
fn start_for(bench: &Bench, seconds: &str, delay: Duration) -> Running {
    let scenario = bench.scenario("long.toml", &[]);
    let mut run = bench.start(&["run", scenario, "--duration", seconds, "--out", "out"]);
    run.wait_for_processes(NEEDED.len() + DISPENSABLE.len());
    run.pause(delay);
    run
}

fn drawn_delay(draw: &mut Draw) -> Duration {
    Duration::from_millis(draw.below(1500) as u64)
}

/// The simulated time in a message.
fn simulated_s(message: &str) -> f64 {
    let (_, rest) = message.split_once("simulated time ").unwrap_or_else(|| panic!("no simulated time in: {message}"));
    rest.split_whitespace()
        .next()
        .and_then(|number| number.parse().ok())
        .unwrap_or_else(|| panic!("no number in: {message}"))
}

/// Time of the last message of the record, which must be whole.
fn recorded_s(bench: &Bench) -> f64 {
    let record = RECORD;
    bench.digest_of(record);
    let outcome = bench.run(&["log", "recover", record, "-o", "whole.mcap"]).expect_code(0);
    let (_, rest) = outcome.stdout.split_once("up to ").unwrap_or_else(|| panic!("{}", outcome.stdout));
    rest.split_whitespace()
        .next()
        .and_then(|number| number.parse().ok())
        .unwrap_or_else(|| panic!("{}", outcome.stdout))
}

/// Waits until some chunks of the record are on disk, however slow the machine is; the run's watchdog is the limit.
fn wait_for_record(bench: &Bench) {
    let begun = std::time::Instant::now();
    let size = || std::fs::metadata(bench.path(RECORD)).map_or(0, |file| file.len());
    while size() < 300_000 && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn expect_failure_of(outcome: Outcome, process: &str) -> Outcome {
    outcome.expect_code(1).expect_message(&format!("process `{process}`")).expect_nothing_left()
}

/// Sends `name` the signal `delay` after the start.
fn harm(name: &str, with: Signal, delay: Duration) {
    let bench = Bench::new();
    let mut run = start(&bench, delay);
    let victim = run.processes().into_iter().find(|process| process.name == name);
    let victim = victim.unwrap_or_else(|| panic!("no process `{name}`"));
    run.mark();
    signal(victim.pid, with);
    let outcome = expect_failure_of(run.wait(), name);
    let reached = simulated_s(&outcome.stderr);
    println!("{name}, {with:?} after {delay:?}: over in {:.2?}, at {reached} s of simulated time", outcome.took);
    // a moment at which the record has hardly begun tells nothing
    if reached > 0.1 {
        let recorded = recorded_s(&bench);
        assert!(recorded > 0.0 && recorded >= reached - 0.05, "record up to {recorded} s, run up to {reached} s");
    }
}

/// The same with a process that the run goes on without: it is started again.
fn harm_and_go_on(name: &str, with: Signal, delay: Duration) {
    let bench = Bench::new();
    let mut run = start_for(&bench, "12", Duration::ZERO);
    wait_for_record(&bench);
    run.pause(delay);
    let victim = run.processes().into_iter().find(|process| process.name == name);
    let victim = victim.unwrap_or_else(|| panic!("no process `{name}`"));
    run.mark();
    signal(victim.pid, with);
    let outcome = run.wait().expect_code(3).expect_nothing_left();
    let outcome = outcome.expect_message(&format!("process `{name}`")).expect_message("it is started again");
    println!("{name}, {with:?} after {delay:?}: at {} s of simulated time", simulated_s(&outcome.stderr));
    recorded_s(&bench);
    let second = "out/nominal.part2.mcap";
    assert_eq!(bench.path(second).exists(), name == "bus_analyzer");
    if name == "bus_analyzer" {
        bench.digest_of(second);
    }
}

#[test]
fn a_killed_process_ends_the_run_with_its_name() {
    let mut draw = Draw::new(1);
    for name in NEEDED {
        harm(name, Signal::KILL, drawn_delay(&mut draw));
    }
}

#[test]
fn a_stopped_process_ends_the_run_with_its_name() {
    harm("encoder_if", Signal::STOP, Duration::from_millis(700));
}

#[test]
fn workstation_and_recorder_are_started_again_and_the_run_ends_with_losses() {
    harm_and_go_on("workstation", Signal::KILL, Duration::from_millis(150));
    harm_and_go_on("bus_analyzer", Signal::KILL, Duration::from_millis(250));
    harm_and_go_on("bus_analyzer", Signal::STOP, Duration::from_millis(200));
}

#[test]
fn in_real_time_the_run_goes_on_without_workstation_or_recorder_and_ends_with_losses() {
    for name in DISPENSABLE {
        let bench = Bench::new();
        let scenario = bench.scenario("short.toml", &[]);
        let mut run = bench.start(&["run", scenario, "--duration", "2", "--pacing", "realtime", "--out", "out"]);
        let processes = run.wait_for_processes(7);
        let victim = processes.iter().find(|process| process.name == name).expect("process").pid;
        run.pause(Duration::from_millis(700));
        signal(victim, Signal::KILL);
        let outcome = run.wait().expect_code(3).expect_nothing_left();
        outcome.expect_message(&format!("process `{name}`")).expect_message("the run went on without it");
        recorded_s(&bench);
    }
}

#[test]
fn a_recorder_that_is_not_to_be_started_again_ends_the_run() {
    let bench = Bench::new();
    let scenario = bench.scenario("long.toml", &[]);
    let arguments = ["run", scenario, "--duration", "30000", "--restart", "bus_analyzer=never", "--out", "out"];
    let mut run = bench.start(&arguments);
    let processes = run.wait_for_processes(7);
    let recorder = processes.iter().find(|process| process.name == "bus_analyzer").expect("recorder").pid;
    run.pause(Duration::from_millis(400));
    signal(recorder, Signal::KILL);
    expect_failure_of(run.wait(), "bus_analyzer");
}

#[test]
#[ignore = "minutes; scripts/soak.sh runs it"]
fn every_process_killed_and_stopped_at_many_moments() {
    let rounds: u64 = std::env::var("SOAK_ROUNDS").ok().and_then(|rounds| rounds.parse().ok()).unwrap_or(5);
    let mut draw = Draw::new(2);
    for round in 0..rounds {
        println!("round {round}");
        for with in [Signal::KILL, Signal::STOP] {
            for name in NEEDED {
                harm(name, with, drawn_delay(&mut draw));
            }
            for name in DISPENSABLE {
                harm_and_go_on(name, with, drawn_delay(&mut draw) / 5);
            }
        }
    }
}

/// A file system of so many KiB, unmounted at its end; none where the system refuses.
struct Small(std::path::PathBuf);

impl Small {
    fn mount(at: std::path::PathBuf, kib: u32) -> Option<Small> {
        std::fs::create_dir(&at).expect("mount point");
        let size = format!("size={kib}k");
        let mut mount = std::process::Command::new("mount");
        let mounted = mount.args(["-t", "tmpfs", "-o", &size, "none"]).arg(&at).status();
        mounted.is_ok_and(|status| status.success()).then(|| Small(at))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        // whatever is left goes with the container
        let _ = std::process::Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_stops_the_record_and_not_the_control() {
    let bench = Bench::new();
    let Some(small) = Small::mount(bench.path("small"), 300) else {
        println!("no small file system: not allowed to mount one");
        return;
    };
    let scenario = bench.scenario("short.toml", &[]);
    std::fs::create_dir(bench.path("out")).expect("folder");
    std::os::unix::fs::symlink(small.0.join("nominal.mcap"), bench.path(RECORD)).expect("link");
    let outcome = bench.run(&["run", scenario, "--duration", "4", "--json", "--out", "out"]).expect_code(3);
    let outcome = outcome.expect_message("the record ends at").expect_message("No space left on device");
    let report: serde_json::Value = serde_json::from_str(&outcome.expect_nothing_left().stdout).expect("JSON");
    assert_eq!(report["variants"][0]["ended"]["how"], "completed");
    assert!(recorded_s(&bench) > 0.0);
}

#[test]
fn ctrl_c_ends_the_run_in_order() {
    for delay in [0, 600] {
        let bench = Bench::new();
        let mut run = start(&bench, Duration::from_millis(delay));
        run.mark();
        signal(run.pid(), Signal::INT);
        let outcome = run.wait().expect_code(1).expect_message("interrupted").expect_nothing_left();
        let reached = simulated_s(&outcome.stderr);
        println!("Ctrl-C after {delay} ms: over in {:.2?}, at {reached} s of simulated time", outcome.took);
        if reached > 0.1 {
            let recorded = recorded_s(&bench);
            assert!(recorded >= reached - 0.05, "record up to {recorded} s, run up to {reached} s");
        }
    }
}

#[test]
fn a_killed_chassis_leaves_a_whole_record_and_nothing_else() {
    for delay in [0, 900] {
        let bench = Bench::new();
        let mut run = start(&bench, Duration::from_millis(delay));
        if delay > 0 {
            wait_for_record(&bench);
        }
        run.mark();
        signal(run.pid(), Signal::KILL);
        let outcome = run.wait().expect_nothing_left();
        println!("SIGKILL of the chassis after {delay} ms: over in {:.2?}", outcome.took);
        if delay > 0 {
            assert!(recorded_s(&bench) > 0.1);
        }
    }
}

#[test]
fn a_finished_run_leaves_its_results_and_nothing_else() {
    let bench = Bench::new();
    let scenario = bench.scenario("short.toml", &[]);
    bench.run(&["run", scenario, "--duration", "0.2", "--out", "out"]).expect_code(0).expect_nothing_left();
    let mut files: Vec<_> =
        std::fs::read_dir(bench.path("out")).expect("results").flatten().map(|file| file.file_name()).collect();
    files.sort();
    assert_eq!(files, ["charts.json", "nominal.mcap", "report.html", "report.json"]);
}
