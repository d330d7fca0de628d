//! Any content of any message: a board takes it without a panic, a hang or memory without bound.
//!
//! The corpus is what the boards of a short run hear. Each draw says the same to a board of its own again, spoilt in places,
//! in windows that are those of the run: which windows there are is the host's to check, and a test here.

use board::{Board, BoardId, Inputs, Mail, Outputs, routes::ROUTES};
use bytemuck::Pod;
use channels::Tampering;
use messages::{BOARDS, Grant, Kind, NOBODY, OpRecord, TransferRecord, flags};
use pacing::{Context, Flow, Host, Lockstep, Observer};
use rack_tests::{Draw, fuzz, spoil};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use vme::{Log, Ns};

/// Draws of each board in an ordinary test.
const DRAWS: u64 = 60;
/// Most memory that a board takes for a draw, bytes: some hundred steps, each with a few hundred spoilt elements at most.
const MEMORY: u64 = 32 << 20;
/// Simulated time of the corpus: past the first commands and a console period.
const CORPUS_NS: Ns = 220_000_000;

static NEVER: AtomicBool = AtomicBool::new(false);

fn context(scenario: &str, overrides: &[&str]) -> Context {
    let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
    let scenario = scenario::load(scenario, &overrides).unwrap().scenario().unwrap();
    let (prefix, variant) = (String::new(), String::new());
    Context { prefix, variant, record: None, measure: false, in_process: true, scenario }
}

/// One card for the whole pipeline, and two that share it, with the encoders' and the receiver's other modes.
fn contexts() -> [Context; 2] {
    let two_cards = r#"rack.tasks=[
        { name = "control", board = "control_computer", processor = "cpu-1", period_ns = 5000000 },
        { name = "torque", board = "control_computer", processor = "cpu-2", period_ns = 1000000 },
        { name = "console", board = "workstation", processor = "sun", period_ns = 100000000 }]"#;
    let delay = "force_sensor_if.filter={ delay_ms = 3.0 }";
    [context("table-5-3", &[]), context("table-5-3", &["controller.processor=modern", two_cards, delay])]
}

/// What every board has heard in each step.
type Heard = Arc<Mutex<Vec<(BoardId, Inputs)>>>;

struct Listening {
    id: BoardId,
    board: Box<dyn Board>,
    heard: Heard,
}

impl Board for Listening {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        self.heard.lock().unwrap().push((self.id, copy(inputs)));
        self.board.step(now, inputs, out);
    }
}

struct Silent;

impl Observer for Silent {
    fn window(&mut self, _until: Ns, _mail: &Mail, _log: &Log) -> Flow {
        Flow::Continue
    }
}

fn copy(inputs: &Inputs) -> Inputs {
    Inputs {
        transfers: inputs.transfers.clone(),
        mail: inputs.mail.clone(),
        defects: inputs.defects.clone(),
        ..*inputs
    }
}

/// What the boards of a run hear.
fn corpus(context: &Context) -> Vec<(BoardId, Inputs)> {
    let heard = Heard::default();
    let factory = |id: BoardId, context: &Context| -> Result<Box<dyn Board>, String> {
        Ok(Box::new(Listening { id, board: chassis::boards::build(id, context)?, heard: Arc::clone(&heard) }))
    };
    let mut rack = Lockstep::power_up(context.clone(), &factory, &|_| Vec::new(), &NEVER).unwrap();
    rack.run(CORPUS_NS, &mut Silent).unwrap();
    drop(rack);
    std::mem::take(&mut *heard.lock().unwrap())
}

/// Spoils some of the elements of a list, or their number and order.
fn spoil_list<T: Pod>(draw: &mut Draw, list: &mut Vec<T>, now: Ns) {
    match draw.below(24) {
        0 => list.push(T::zeroed()),
        1 => draw.shuffle(list),
        2 if !list.is_empty() => drop(list.remove(draw.below(list.len()))),
        3 => {
            for _ in 0..draw.below(200) {
                list.push(list.last().copied().unwrap_or_else(T::zeroed));
                if let Some(last) = list.last_mut() {
                    spoil(draw, bytemuck::bytes_of_mut(last), now);
                }
            }
        }
        4..=9 if !list.is_empty() => {
            for _ in 0..=draw.below(3) {
                let i = draw.below(list.len());
                spoil(draw, bytemuck::bytes_of_mut(&mut list[i]), now);
            }
        }
        _ => {}
    }
}

/// Spoils what a board hears, on the channels that it listens to.
fn spoil_inputs(draw: &mut Draw, id: BoardId, inputs: &mut Inputs) {
    let (now, mail) = (inputs.until, &mut inputs.mail);
    for route in ROUTES.iter().filter(|route| route.to.contains(&id)) {
        match route.kind {
            Kind::Amplifier => spoil_list(draw, &mut mail.amplifier, now),
            Kind::Plant => spoil_list(draw, &mut mail.plant, now),
            Kind::Words => spoil_list(draw, &mut mail.words, now),
            Kind::Commands => spoil_list(draw, &mut mail.commands, now),
            Kind::Telemetry => spoil_list(draw, &mut mail.telemetry, now),
            Kind::PlantProbe => spoil_list(draw, &mut mail.plant_probe, now),
            Kind::ControlProbe => spoil_list(draw, &mut mail.control_probe, now),
            Kind::Events => spoil_list(draw, &mut mail.events, now),
            Kind::Transfers => spoil_list(draw, &mut mail.transfers, now),
            Kind::Masters => spoil_list(draw, &mut mail.masters, now),
            Kind::Paths => spoil_list(draw, &mut mail.paths, now),
        }
    }
    spoil_list(draw, &mut inputs.transfers, now);
    if let Some(decision) = inputs.decision.as_mut().filter(|_| draw.below(8) == 0) {
        (decision.task, decision.job) = (draw.below(4) as u16, draw.next() as u32);
    }
    inputs.rerun |= draw.below(16) == 0;
}

/// Says the corpus to a board again, spoilt.
fn hostile(id: BoardId) {
    let corpora = contexts().map(|context| (corpus(&context), context));
    fuzz(DRAWS, |draw| {
        let (heard, context) = &corpora[draw.below(2)];
        let steps: Vec<&Inputs> = heard.iter().filter(|(who, _)| *who == id).map(|(_, inputs)| inputs).collect();
        let mut board = chassis::boards::build(id, context).unwrap();
        // sometimes everything that it hears is spoilt, sometimes only now and then a word
        let rate = 1 + draw.below(16);
        let memory = allocation_counter::measure(|| {
            let mut out = Outputs::default();
            for step in &steps {
                let mut inputs = copy(step);
                if draw.below(rate) == 0 {
                    spoil_inputs(draw, id, &mut inputs);
                }
                out.clear();
                board.step(inputs.until, &inputs, &mut out);
            }
        });
        assert!(memory.bytes_max < MEMORY, "{} took {} bytes", id.name(), memory.bytes_max);
    });
}

#[test]
fn no_message_breaks_the_outputs() {
    hostile(BoardId::DaIo);
}

#[test]
fn no_message_breaks_the_arm() {
    hostile(BoardId::HwSim);
}

#[test]
fn no_message_breaks_the_force_sensor() {
    hostile(BoardId::ForceSensorIf);
}

#[test]
fn no_message_breaks_the_encoders() {
    hostile(BoardId::EncoderIf);
}

#[test]
fn no_message_breaks_the_control_computer() {
    hostile(BoardId::ControlComputer);
}

#[test]
fn no_message_breaks_the_workstation() {
    hostile(BoardId::Workstation);
}

/// The recorder writes while it is told nonsense.
#[test]
fn no_message_breaks_the_recorder() {
    let folder = tempfile::tempdir().unwrap();
    let [context, _] = contexts();
    let heard = corpus(&context);
    let context = Context { record: Some(folder.path().join("hostile.mcap")), ..context };
    fuzz(DRAWS / 2, |draw| {
        let mut board = chassis::boards::build(BoardId::BusAnalyzer, &context).unwrap();
        let memory = allocation_counter::measure(|| {
            let mut out = Outputs::default();
            for (_, step) in heard.iter().filter(|(who, _)| *who == BoardId::BusAnalyzer) {
                let mut inputs = copy(step);
                spoil_inputs(draw, BoardId::BusAnalyzer, &mut inputs);
                out.clear();
                board.step(inputs.until, &inputs, &mut out);
            }
        });
        assert!(memory.bytes_max < MEMORY, "the recorder took {} bytes", memory.bytes_max);
    });
}

/// A host refuses a window that does not follow the one before, or steps its board; it never hangs in one.
#[test]
fn no_grant_breaks_a_host() {
    let context = context("table-5-3", &[]);
    fuzz(DRAWS, |draw| {
        let here: Vec<BoardId> = BOARDS[1..].to_vec();
        let exchange = channels::Exchange::open(&here, None, |_| 0, &Tampering::default()).unwrap();
        let mut host = Host::new(&here, exchange, &context, &chassis::boards::build).unwrap();
        // boards that are powered up again begin at any time
        let mut time = if draw.below(4) == 0 { draw.next() >> (4 + draw.below(40)) } else { 0 };
        let mut window = 0;
        for _ in 0..60 {
            let until = time + draw.below(2_000_000) as Ns;
            for board in 1..BOARDS.len() as u32 {
                let flags = if window == 0 { flags::BOOT } else { 0 };
                let mut grant =
                    Grant { window, from: time, until, board, flags, task: 0, job: 0, next: NOBODY, turn: 0 };
                if draw.below(12) == 0 {
                    spoil(draw, bytemuck::bytes_of_mut(&mut grant), until);
                }
                let mut transfers: Vec<TransferRecord> = Vec::new();
                spoil_list(draw, &mut transfers, until);
                // refused or carried out
                let _ = host.step(&grant, &transfers);
            }
            time = until;
            window += 1;
        }
    });
}

/// A board whose programs are nonsense.
struct Noise(Draw, u16);

impl Board for Noise {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        let draw = &mut self.0;
        let operations = |draw: &mut Draw| -> board::Program {
            let count = draw.below(6);
            let op = |_| {
                let mut record = OpRecord { ns: 1000, addr: 0, n: 1, kind: draw.below(5) as u32, am_width: 0x13D };
                if draw.below(2) == 0 {
                    spoil(draw, bytemuck::bytes_of_mut(&mut record), inputs.until);
                }
                record.op()
            };
            (0..count).filter_map(op).collect()
        };
        if inputs.boot || draw.below(8) == 0 {
            let program = operations(draw);
            let task = if draw.below(8) == 0 { draw.next() as u16 } else { self.1 };
            out.programs.push((task, program));
        }
        if draw.below(4) == 0 {
            out.rest = Some(operations(draw));
        }
        if draw.below(64) == 0 {
            out.early = Some(draw.next());
        }
    }
}

/// The timing plane carries nonsense out or the run ends with an error that names the board; within a bounded time.
#[test]
fn no_bus_program_breaks_the_rack() {
    let context = context("table-5-3", &[]);
    fuzz(2 * DRAWS, |draw| {
        let (seed, noisy) = (draw.next(), [BoardId::ControlComputer, BoardId::Workstation][draw.below(2)]);
        let task = context.scenario.task_of(noisy.name()).unwrap();
        let factory = |id: BoardId, context: &Context| -> Result<Box<dyn Board>, String> {
            match id == noisy {
                true => Ok(Box::new(Noise(Draw::new(seed), task))),
                false => chassis::boards::build(id, context),
            }
        };
        if let Ok(mut rack) = Lockstep::power_up(context.clone(), &factory, &|_| Vec::new(), &NEVER) {
            let _ = rack.run(100_000_000, &mut Silent);
        }
    });
}
