//! The windows of a real-time run: boards that only listen, all in the chassis.

use board::{Board, BoardId, Inputs, Mail, Ns, Op, Outputs};
use messages::{Span, SpanKind};
use pacing::{Context, Flow, Observer, Realtime};
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Sender, channel};
use vme::{Log, MILLISECOND};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Tells the windows and decisions that it is given.
struct Listener {
    role: BoardId,
    heard: Sender<(BoardId, Ns, Ns, Option<u32>)>,
}

impl Board for Listener {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if inputs.boot && self.role == BoardId::ControlComputer {
            out.programs.push((0, vec![Op::Exec(10_000), Op::Decide]));
        }
        assert!(inputs.boot || inputs.free_running);
        if !inputs.boot && !inputs.finish {
            let job = inputs.decision.map(|decision| decision.job);
            self.heard.send((self.role, inputs.from, inputs.until, job)).expect("the test listens");
        }
    }
}

#[derive(Default)]
struct Windows(Vec<Ns>, Vec<Span>);

impl Observer for Windows {
    fn window(&mut self, until: Ns, _mail: &Mail, _log: &Log) -> Flow {
        self.0.push(until);
        Flow::Continue
    }

    fn measured(&mut self, spans: &[Span], _lost: u32) {
        self.1.extend(spans);
    }
}

#[test]
fn every_board_gets_every_window_once_and_in_order_and_every_job_is_decided_once() {
    let scenario = scenario::load("table-5-3", &[]).and_then(|document| document.scenario()).expect("scenario");
    let boards = messages::BOARDS[1..].iter().map(|board| board.name().to_owned()).collect();
    let chassis = scenario::Process { name: "chassis".into(), boards, ..Default::default() };
    let scenario = scenario::Scenario { processes: vec![chassis], ..scenario };
    let context = Context { prefix: String::new(), variant: String::new(), record: None, measure: true, in_process: false, scenario };
    let (heard, hear) = channel();
    let factory = |role, _: &Context| Ok(Box::new(Listener { role, heard: heard.clone() }) as Box<dyn Board>);
    let mut rack = Realtime::power_up(context, &factory, &|_| Vec::new(), &INTERRUPTED).expect("power up");
    let end = 200 * MILLISECOND;
    let mut windows = Windows::default();
    rack.run(end, &mut windows).expect("run");
    rack.finish(&mut windows).expect("finish");

    assert_eq!(windows.0.last(), Some(&end));
    assert!(windows.0.is_sorted());
    let heard: Vec<_> = hear.try_iter().collect();
    for board in [BoardId::DaIo, BoardId::HwSim, BoardId::ForceSensorIf, BoardId::EncoderIf, BoardId::BusAnalyzer] {
        let mut reached = 0;
        for (_, from, until, _) in heard.iter().filter(|(role, ..)| *role == board) {
            assert_eq!(*from, reached, "{board:?}");
            reached = *until;
        }
        assert_eq!(reached, end, "{board:?}");
    }
    let jobs: Vec<u32> =
        heard.iter().filter(|(role, ..)| *role == BoardId::ControlComputer).filter_map(|(.., job)| *job).collect();
    assert_eq!(jobs, (0..40).collect::<Vec<u32>>());
    let of_the_arm = |span: &&Span| span.kind == SpanKind::Step as u32 && span.board == BoardId::HwSim as u32;
    let steps: Vec<&Span> = windows.1.iter().filter(of_the_arm).collect();
    assert!(steps.len() >= 40);
    assert!(steps.iter().all(|step| step.due <= step.begin && step.begin <= step.end), "{steps:?}");
}
