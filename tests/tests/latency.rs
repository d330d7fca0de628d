//! Latency and jitter: a delay put into one board on purpose shows where it belongs, nothing is lost or counted twice, and
//! the tools that look at machine and runs say what they should.
//!
//! Nothing here limits how late a busy machine may be; in real time every statement is "at least".

use board::{Board, BoardId, Inputs, Mail, Ns, Op, Outputs};
use messages::Span;
use pacing::{Context, Flow, Lockstep, Observer, Realtime};
use rack_tests::Bench;
use report::latency::{Clock, Journal, Measurement};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use vme::{Log, MILLISECOND};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// The cycle with the delay.
const CYCLE: u32 = 137;
const CYCLES: u64 = 200;
const PERIOD: Ns = 5 * MILLISECOND;

/// A control computer that takes longer in one of its jobs.
struct Delayed {
    inner: Box<dyn Board>,
    simulated: Ns,
    real: Duration,
    rest: Vec<Op>,
}

impl Board for Delayed {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        self.inner.step(now, inputs, out);
        let Some(decision) = inputs.decision else { return };
        if let Some(rest) = &out.rest {
            self.rest.clone_from(rest);
        }
        if decision.job == CYCLE {
            std::thread::sleep(self.real);
            out.rest = Some([&[Op::Exec(self.simulated)], self.rest.as_slice()].concat());
        } else {
            out.rest = Some(self.rest.clone());
        }
    }
}

struct Listener(Journal);

impl Observer for Listener {
    fn window(&mut self, _until: Ns, _mail: &Mail, _log: &Log) -> Flow {
        Flow::Continue
    }

    fn measured(&mut self, spans: &[Span], lost: u32) {
        self.0.take(spans, lost);
    }
}

fn context() -> Context {
    let settings = [format!("rack.tasks.control.period_ns={PERIOD}")];
    let scenario = scenario::load("table-5-3", &settings).and_then(|document| document.scenario()).expect("scenario");
    Context { prefix: String::new(), variant: "nominal".into(), record: None, measure: true, in_process: true, scenario }
}

fn factory(simulated: Ns, real: Duration) -> impl Fn(BoardId, &Context) -> Result<Box<dyn Board>, String> {
    move |role, context| {
        let inner = chassis::boards::build(role, context)?;
        Ok(match role {
            BoardId::ControlComputer => Box::new(Delayed { inner, simulated, real, rest: Vec::new() }),
            _ => inner,
        })
    }
}

fn simulated(delay: Ns) -> Measurement {
    let mut listener = Listener(Journal::new(Clock::Simulated, 0));
    let factory = factory(delay, Duration::ZERO);
    let mut rack = Lockstep::power_up(context(), &factory, &|_| Vec::new(), &INTERRUPTED).expect("power up");
    rack.run(CYCLES * PERIOD, &mut listener).expect("run");
    listener.0.finish()
}

#[test]
fn in_simulated_time_a_delay_of_one_cycle_shows_to_the_nanosecond_in_the_right_rows_and_nowhere_else() {
    let (plain, delayed) = (simulated(0), simulated(3 * MILLISECOND));
    assert!(plain.cycles >= CYCLES - 2 && plain.broken_cycles <= 1, "{} cycles", plain.cycles);
    assert_eq!(delayed.cycles, plain.cycles);
    let [sensor, decision, output] = plain.parts_sum_ns;
    assert_eq!(delayed.parts_sum_ns, [sensor, decision, output + 3 * MILLISECOND]);
    assert_eq!(delayed.whole_sum_ns, plain.whole_sum_ns + 3 * MILLISECOND);
    for path in ["age of the force value when used", "arm to force sensor", "force sensor to decision"] {
        let row = |measured: &Measurement| measured.row(path).map(|row| row.histogram.clone());
        assert!(row(&plain).is_some());
        assert_eq!(row(&delayed), row(&plain), "{path}");
    }
    let longest = &delayed.longest[0];
    assert_eq!(longest.job, u64::from(CYCLE));
    assert_eq!(plain.longest.iter().filter(|cycle| cycle.whole_ns >= longest.whole_ns).count(), 0);
    assert!(delayed.longest[1].whole_ns <= plain.longest[0].whole_ns);
    for measured in [&plain, &delayed] {
        assert_eq!(measured.parts_sum_ns.iter().sum::<u64>(), measured.whole_sum_ns);
        for cycle in &measured.longest {
            assert_eq!(cycle.parts_ns.iter().sum::<u64>(), cycle.whole_ns, "{cycle:?}");
        }
    }
}

#[test]
fn in_real_time_a_delay_of_one_cycle_shows_in_its_board_and_among_the_longest_cycles() {
    let delay = Duration::from_millis(60);
    let factory = factory(0, delay);
    let mut rack = Realtime::power_up(context(), &factory, &|_| Vec::new(), &INTERRUPTED).expect("power up");
    let mut listener = Listener(Journal::new(Clock::Wall, rack.zero()));
    rack.run(CYCLES * PERIOD, &mut listener).expect("run");
    rack.finish(&mut listener).expect("finish");
    let measured = listener.0.finish();
    let at_least = delay.as_nanos() as u64;
    let step = measured.row("step control_computer").expect("measured");
    assert!(step.max_ns >= at_least, "{step:?}");
    let whole = measured.row("arm to D/A").expect("measured");
    assert!(whole.max_ns >= at_least, "{whole:?}");
    let cycle = measured.longest.iter().find(|cycle| cycle.job == u64::from(CYCLE));
    let cycle = cycle.unwrap_or_else(|| panic!("not among {:#?}", measured.longest));
    assert!(cycle.parts_ns[1] >= at_least, "{cycle:?}");
    assert!(cycle.notes.iter().any(|note| note.starts_with("control_computer took")), "{cycle:?}");
    assert_eq!(measured.parts_sum_ns.iter().sum::<u64>(), measured.whole_sum_ns);
}

#[test]
fn ten_seconds_at_1_khz_lose_no_message_and_count_none_twice() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    let arguments = ["latency", scenario, "--seconds", "10", "--rate", "1000", "--out", "out", "--json"];
    let outcome = bench.run(&arguments).expect_code(0).expect_nothing_left();
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    let measured = &report["measured"];
    let channels = measured["channels"].as_array().expect("channels");
    assert!(channels.len() > 8, "{channels:#?}");
    for channel in channels {
        let count = |key: &str| channel[key].as_u64().expect("a count");
        assert_eq!((count("lost"), count("twice")), (0, 0), "{channel:#}");
        // what was sent last may still be under way when its reader ends
        assert!(count("read") <= count("sent") && count("sent") - count("read") <= 80, "{channel:#}");
    }
    let words = channels.iter().find(|channel| channel["channel"] == "force_sensor_if/words").expect("channel");
    assert!(words["read"].as_u64() >= Some(9_900), "{words:#}");
    for path in ["wake-up hw_sim", "step da_io", "jitter encoder_if", "hw_sim/plant to force_sensor_if", "arm to D/A"] {
        let row = measured["rows"].as_array().expect("rows").iter().find(|row| row["path"] == path);
        assert!(row.unwrap_or_else(|| panic!("no {path}"))["n"].as_u64() >= Some(5_000), "{path}");
    }
    for means in ["timer", "pipe", "unix socket", "futex on shared memory", "iceoryx2 polled", "iceoryx2 blocking"] {
        let row = report["baselines"].as_array().expect("baselines").iter().find(|row| row["path"] == means);
        let row = row.unwrap_or_else(|| panic!("no {means}"));
        assert!(row["n"].as_u64() >= Some(900) && row["p50_to_pipe"].as_f64() > Some(0.0), "{row:#}");
    }
    let read = |name: &str| std::fs::read_to_string(bench.path("out").join(name)).expect(name);
    assert!(read("latency.hlog").lines().filter(|line| line.starts_with("Tag=wake-up_hw_sim,")).count() >= 9);
    assert!(read("latency.hist").contains("# Max Latencies:"));
    assert!(read("latency.html").contains("wake-up control_computer"));
}

#[test]
fn a_violated_limit_on_a_latency_gives_exit_code_4() {
    let bench = Bench::new();
    let limit = "path = \"wake-up hw_sim\"\nquantile = 0.5\nmax_us = 0.001".parse().expect("a limit");
    let limits = toml::Value::Array(vec![toml::Value::Table(limit)]);
    let scenario = bench.scenario("s.toml", &[("realtime.limit", limits)]);
    let outcome = bench.run(&["latency", scenario, "--seconds", "0.5", "--out", "out"]).expect_code(4);
    assert!(outcome.stdout.contains("VIOLATED"), "{}", outcome.stdout);
}

#[test]
fn what_measuring_costs_is_told_of_every_process_from_stretches_of_one_run() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    let arguments = ["latency", scenario, "--seconds", "0.5", "--rate", "1000", "--cost", "--out", "out", "--json"];
    let outcome = bench.run(&arguments).expect_code(0).expect_nothing_left();
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    let cost = &report["measuring_cost"];
    // 20 s in stretches of 0.2 s
    assert_eq!(cost["pairs"], 50, "{cost:#}");
    let processes = cost["processes"].as_array().expect("rows");
    assert_eq!(processes.len(), 8, "{cost:#}");
    for row in processes.iter().chain([&cost["on_the_way"], &cost["all"]]) {
        let ns = |key: &str| row[key].as_f64().expect("a number");
        assert!(ns("with_ns") > 0.0 && ns("without_ns") > 0.0, "{row:#}");
        let [low, high] = [0, 1].map(|i| row["interval_ns"][i].as_f64().expect("a number"));
        assert!(low <= ns("difference_ns") && ns("difference_ns") <= high, "{row:#}");
    }
    let sum = |key: &str| processes.iter().filter_map(|row| row[key].as_f64()).sum::<f64>();
    let all = cost["all"]["mean_ns"].as_f64().expect("a number");
    assert!((sum("mean_ns") - all).abs() < 1e-6 * sum("with_ns"), "{cost:#}");
}

#[test]
fn the_doctor_gives_a_remedy_for_everything_that_hurts() {
    let outcome = Bench::new().run(&["doctor", "--json"]).expect_code(0).expect_nothing_left();
    let findings: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    let findings = findings.as_array().expect("a list");
    for subject in
        ["preemption", "governor", "SCHED_FIFO", "RT throttling", "hypervisor", "shared memory", "stale runs"]
    {
        assert!(findings.iter().any(|finding| finding["subject"] == subject), "{subject}");
    }
    for finding in findings {
        let remedy = finding["remedy"].as_str().expect("text");
        assert_eq!(finding["hurts"] == true, !remedy.is_empty(), "{finding}");
    }
}

#[test]
fn top_shows_a_run_in_real_time_while_it_lives_and_nothing_afterwards() {
    let bench = Bench::new();
    let scenario = bench.scenario("s.toml", &[]);
    let mut run =
        bench.start(&["run", scenario, "--pacing", "realtime", "--duration", "50", "--no-record", "--out", "out"]);
    run.wait_for_processes(7);
    let runs: serde_json::Value = loop {
        // the run's own watchdog ends this
        run.pause(Duration::from_millis(200));
        let mut top = std::process::Command::new(rack_tests::program("vmerack"));
        let output = top.args(["top", "--once", "--json"]).env("TMPDIR", bench.path("t")).output().expect("top");
        let runs: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        // a busy machine may take its time until every path has values
        if runs[0]["simulated_s"].as_f64() > Some(2.0) {
            break runs;
        }
    };
    let rows = runs[0]["rows"].as_array().expect("rows");
    for path in ["wake-up control_computer", "step hw_sim", "hw_sim/plant to da_io", "age of the force value when used"]
    {
        let row = rows.iter().find(|row| row["path"] == path).unwrap_or_else(|| panic!("no {path} in {rows:#?}"));
        assert!(row["per_s"].as_f64() > Some(0.0), "{row:#}");
    }
    rack_tests::signal(run.pid(), rack_tests::Signal::INT);
    run.wait().expect_code(1).expect_nothing_left();
    bench.run(&["top", "--once"]).expect_code(1);
}
