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

/// How the time of a run goes: options of the command.
type Pace = &'static [&'static str];
const LOCK_STEP: Pace = &[];
const REAL_TIME: Pace = &["--pacing", "realtime"];

/// Starts a run that would last very long, and lets it go on for `delay` after its processes have started.
fn start(bench: &Bench, delay: Duration) -> Running {
    let mut run = start_for(bench, without_end(LOCK_STEP), LOCK_STEP);
    run.pause(delay);
    run
}

/// A length that no run here comes to the end of; in real time, it is what a run locks memory for.
fn without_end(pace: Pace) -> &'static str {
    if pace == REAL_TIME { "100" } else { "30000" }
}

/// Starts a run of so many simulated seconds, at that pace; in real time, waits until it runs.
fn start_for(bench: &Bench, seconds: &str, pace: Pace) -> Running {
    let scenario = bench.scenario("long.toml", &[]);
    let line = ["run", scenario, "--duration", seconds, "--out", "out"];
    let mut run = bench.start(&[&line, pace].concat());
    run.wait_for_processes(NEEDED.len() + DISPENSABLE.len());
    if pace == REAL_TIME {
        run.wait_until_it_runs();
    }
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

fn victim(run: &Running, name: &str) -> u32 {
    let processes = run.processes();
    processes.iter().find(|process| process.name == name).unwrap_or_else(|| panic!("no process `{name}`")).pid
}

/// Sends a process that control needs the signal, `delay` after the start: the run ends with its name.
fn harm(name: &str, with: Signal, pace: Pace, delay: Duration) {
    let bench = Bench::new();
    let mut run = start_for(&bench, without_end(pace), pace);
    run.pause(delay);
    let pid = victim(&run, name);
    run.mark();
    signal(pid, with);
    let outcome = expect_failure_of(run.wait(), name);
    let reached = simulated_s(&outcome.stderr);
    println!(
        "{name}, {with:?} after {delay:?} {pace:?}: over in {:.2?}, at {reached} s of simulated time",
        outcome.took
    );
    // a moment at which the record has hardly begun tells nothing
    if reached > 0.1 {
        let recorded = recorded_s(&bench);
        assert!(recorded > 0.0 && recorded >= reached - 0.05, "record up to {recorded} s, run up to {reached} s");
    }
}

/// The same with a process that the run goes on without: it is started again, and the report says what is not recorded.
fn harm_and_go_on(name: &str, with: Signal, pace: Pace, delay: Duration) {
    let bench = Bench::new();
    // in lock step as long as it takes for the signal to come in time
    let seconds = if pace == REAL_TIME { "4" } else { "40" };
    let mut run = start_for(&bench, seconds, pace);
    if pace == LOCK_STEP {
        wait_for_record(&bench);
    }
    run.pause(delay);
    let pid = victim(&run, name);
    run.mark();
    signal(pid, with);
    let outcome = run.wait().expect_code(3).expect_nothing_left();
    let outcome = outcome.expect_message(&format!("process `{name}`")).expect_message("it is started again");
    println!("{name}, {with:?} after {delay:?} {pace:?}: at {} s of simulated time", simulated_s(&outcome.stderr));
    recorded_s(&bench);
    let report = std::fs::read_to_string(bench.path("out/report.json")).expect("report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let variant = &report["variants"][0];
    assert_eq!(variant["ended"]["how"], "completed");
    let gaps = variant["unrecorded"].as_array().expect("a list").len();
    assert_eq!(
        gaps,
        usize::from(name == "bus_analyzer"),
        "one record, and the report says what it lacks: {}",
        outcome.stderr
    );
    assert!(!bench.path("out/nominal.part2.mcap").exists());
}

/// Draw `n` of the kill matrix: each process and the chassis in its turn, killed and stopped alternately, at a moment drawn.
fn harm_any(n: usize, pace: Pace, draw: &mut Draw) {
    let with = if n % 2 == 0 { Signal::KILL } else { Signal::STOP };
    match NEEDED.iter().chain(&DISPENSABLE).nth(n % (NEEDED.len() + DISPENSABLE.len() + 1)) {
        Some(name) if DISPENSABLE.contains(name) => harm_and_go_on(name, with, pace, drawn_delay(draw) / 5),
        Some(name) => harm(name, with, pace, drawn_delay(draw)),
        None => harm_the_chassis(with, pace, drawn_delay(draw)),
    }
}

#[test]
fn ten_draws_of_the_kill_matrix_in_lock_step_end_safely() {
    let mut draw = Draw::new(3);
    (0..10).for_each(|n| harm_any(n, LOCK_STEP, &mut draw));
}

#[test]
fn ten_draws_of_the_kill_matrix_in_real_time_end_safely() {
    let mut draw = Draw::new(4);
    (0..10).for_each(|n| harm_any(n, REAL_TIME, &mut draw));
}

/// The chassis itself: killed, whether it runs or is stopped, it leaves a record that is whole up to there, and nothing else.
fn harm_the_chassis(with: Signal, pace: Pace, delay: Duration) {
    let bench = Bench::new();
    let mut run = start_for(&bench, without_end(pace), pace);
    if pace == LOCK_STEP {
        wait_for_record(&bench);
    }
    run.pause(delay);
    run.mark();
    signal(run.pid(), with);
    if with == Signal::STOP {
        run.pause(Duration::from_millis(300));
        signal(run.pid(), Signal::KILL);
    }
    let outcome = run.wait().expect_nothing_left();
    assert_eq!(outcome.status.code(), None, "ended by the signal: {}", outcome.stderr);
    println!("chassis, {with:?} after {delay:?} {pace:?}: over in {:.2?}", outcome.took);
    assert!(recorded_s(&bench) > 0.0);
}

#[test]
fn a_chassis_that_is_killed_or_killed_while_it_is_stopped_leaves_a_whole_record_and_nothing_else() {
    for pace in [LOCK_STEP, REAL_TIME] {
        for with in [Signal::KILL, Signal::STOP] {
            harm_the_chassis(with, pace, Duration::from_millis(500));
        }
    }
}

/// Stops the chassis while a run goes on, as Ctrl-Z does, and lets it go on.
fn stop_and_continue(run: &mut Running, stopped: Duration) {
    signal(run.pid(), Signal::STOP);
    run.pause(stopped);
    signal(run.pid(), Signal::CONT);
}

#[test]
fn in_lock_step_simulated_time_stands_still_with_a_stopped_chassis_and_the_digest_is_the_same() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    let whole = bench.digest(scenario, 40.0, &["--in-process"]);
    let mut run = bench.start(&["run", scenario, "--duration", "40", "--out", "out"]);
    run.wait_for_processes(NEEDED.len() + DISPENSABLE.len());
    wait_for_record(&bench);
    // longer than a board may be silent
    stop_and_continue(&mut run, Duration::from_secs(6));
    run.wait().expect_code(0).expect_nothing_left();
    assert_eq!(bench.digest_of(RECORD), whole);
}

#[test]
fn in_real_time_a_chassis_that_was_stopped_ends_the_run_with_its_name_once_it_goes_on() {
    let bench = Bench::new();
    let mut run = start_for(&bench, without_end(REAL_TIME), REAL_TIME);
    run.pause(Duration::from_millis(500));
    stop_and_continue(&mut run, Duration::from_millis(1500));
    run.mark();
    let outcome = expect_failure_of(run.wait(), "chassis").expect_message("stopped by a signal");
    let (reached, recorded) = (simulated_s(&outcome.stderr), recorded_s(&bench));
    // within a horizon of 10 ms the boards have nothing more to do, and none of them goes on by itself
    assert!(reached > 0.1 && recorded >= reached - 0.05 && recorded < reached + 0.05, "{recorded} s, {reached} s");
}

#[test]
fn a_chassis_that_is_told_to_go_on_but_was_not_stopped_goes_on() {
    for pace in [LOCK_STEP, REAL_TIME] {
        let bench = Bench::new();
        let run = start_for(&bench, "2", pace);
        signal(run.pid(), Signal::CONT);
        run.wait().expect_code(0).expect_nothing_left();
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

/// Every process at many moments.
fn harm_each(with: Signal, pace: Pace, seed: u64) {
    let rounds: u64 = std::env::var("SOAK_ROUNDS").ok().and_then(|rounds| rounds.parse().ok()).unwrap_or(50);
    let mut draw = Draw::new(seed);
    for round in 0..rounds {
        println!("round {round}");
        for name in NEEDED {
            harm(name, with, pace, drawn_delay(&mut draw));
        }
        for name in DISPENSABLE {
            harm_and_go_on(name, with, pace, drawn_delay(&mut draw) / 5);
        }
        harm_the_chassis(with, pace, drawn_delay(&mut draw));
    }
}

#[test]
#[ignore = "long; scripts/soak.sh runs it"]
fn every_process_killed_in_lock_step_at_many_moments() {
    harm_each(Signal::KILL, LOCK_STEP, 20);
}

#[test]
#[ignore = "long; scripts/soak.sh runs it"]
fn every_process_stopped_in_lock_step_at_many_moments() {
    harm_each(Signal::STOP, LOCK_STEP, 21);
}

#[test]
#[ignore = "long; scripts/soak.sh runs it"]
fn every_process_killed_in_real_time_at_many_moments() {
    harm_each(Signal::KILL, REAL_TIME, 22);
}

#[test]
#[ignore = "long; scripts/soak.sh runs it"]
fn every_process_stopped_in_real_time_at_many_moments() {
    harm_each(Signal::STOP, REAL_TIME, 23);
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
fn a_chassis_killed_while_its_processes_start_leaves_nothing() {
    let bench = Bench::new();
    let mut run = start(&bench, Duration::ZERO);
    run.mark();
    signal(run.pid(), Signal::KILL);
    run.wait().expect_nothing_left();
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
