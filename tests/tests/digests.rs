//! The record of a run depends on its scenario and seed alone: not on how its boards are spread over processes, on who
//! starts first, or on what else the machine does.

use rack_tests::{Bench, Draw};
use std::sync::atomic::{AtomicBool, Ordering};
use toml::{Table, Value};

const BOARDS: [&str; 7] =
    ["da_io", "hw_sim", "force_sensor_if", "encoder_if", "control_computer", "workstation", "bus_analyzer"];
/// Long enough for free space, first contact and pressing.
const SECONDS: f64 = 1.4;

/// Value of the scenario's `process`.
fn processes(list: &[(String, Vec<&str>)]) -> Value {
    let process = |(name, boards): &(String, Vec<&str>)| {
        let boards = boards.iter().map(|board| Value::from(*board)).collect();
        Value::Table(Table::from_iter([
            ("name".into(), Value::from(name.as_str())),
            ("boards".into(), Value::Array(boards)),
        ]))
    };
    Value::Array(list.iter().map(process).collect())
}

fn one_each(boards: impl Iterator<Item = &'static str>) -> Value {
    processes(&boards.map(|board| (board.to_owned(), vec![board])).collect::<Vec<_>>())
}

/// Noise on the force sensor, so that the seed matters.
fn noise() -> (&'static str, Value) {
    ("force_sensor_if.noise_n", Value::Float(0.2))
}

#[test]
fn lock_step_across_processes_and_in_one_process_record_the_same() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[noise()]);
    let apart = bench.digest(scenario, SECONDS, &[]);
    assert_eq!(apart, bench.digest(scenario, SECONDS, &[]), "run again");
    assert_eq!(apart, bench.digest(scenario, SECONDS, &["--in-process"]));
}

#[test]
fn another_seed_gives_another_record_where_there_is_noise() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[noise()]);
    let of = |seed| bench.digest(scenario, 0.3, &["--in-process", "--seed", seed]);
    assert_eq!(of("1"), of("1"));
    assert_ne!(of("1"), of("2"));
}

#[test]
fn where_the_boards_live_does_not_show_in_the_record() {
    let bench = Bench::new();
    let reference = bench.digest(bench.scenario("s.toml", &[noise()]), SECONDS, &["--in-process"]);
    let mut draw = Draw::new(7);
    for _ in 0..4 {
        let count = 2 + draw.below(4);
        let mut list: Vec<(String, Vec<&str>)> = (0..count).map(|i| (format!("p{i}"), Vec::new())).collect();
        // boards in the command's own process
        list[0].0 = "chassis".into();
        for board in BOARDS {
            let place = draw.below(count);
            list[place].1.push(board);
        }
        draw.shuffle(&mut list);
        list.retain(|(_, boards)| !boards.is_empty());
        let scenario = bench.scenario("placed.toml", &[noise(), ("process", processes(&list))]);
        assert_eq!(bench.digest(scenario, SECONDS, &[]), reference, "{list:?}");
    }
}

#[test]
fn the_order_in_which_processes_start_does_not_show_in_the_record() {
    let bench = Bench::new();
    let forwards = bench.scenario("forwards.toml", &[("process", one_each(BOARDS.into_iter()))]);
    let backwards = bench.scenario("backwards.toml", &[("process", one_each(BOARDS.into_iter().rev()))]);
    assert_eq!(bench.digest(forwards, SECONDS, &[]), bench.digest(backwards, SECONDS, &[]));
}

#[test]
fn two_busy_loops_beside_it_do_not_show_in_the_record() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[noise()]);
    let quiet = bench.digest(scenario, SECONDS, &["--in-process"]);
    let busy = AtomicBool::new(true);
    let disturbed = std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| while busy.load(Ordering::Relaxed) {});
        }
        // the loops must end where the run fails, too
        let run = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| bench.digest(scenario, SECONDS, &[])));
        busy.store(false, Ordering::Relaxed);
        run
    });
    assert_eq!(disturbed.unwrap_or_else(|failure| std::panic::resume_unwind(failure)), quiet);
}

#[test]
fn two_runs_side_by_side_record_what_each_records_alone() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[noise()]);
    let alone = ["1", "2"].map(|seed| bench.digest(scenario, SECONDS, &["--seed", seed]));
    // of one user in one TMPDIR
    let seconds = SECONDS.to_string();
    let together =
        ["1", "2"].map(|seed| bench.start(&["run", scenario, "--seed", seed, "--duration", &seconds, "--out", seed]));
    // each waits until nothing of either is left
    for run in together {
        run.wait().expect_code(0).expect_nothing_left();
    }
    let records = ["1", "2"].map(|seed| bench.digest_of(&format!("{seed}/nominal.mcap")));
    assert_eq!(records, alone);
    assert_ne!(records[0], records[1]);
}
