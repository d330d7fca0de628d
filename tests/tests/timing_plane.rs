//! Two checks that keep the timing plane honest: values are read, and outputs change, at the instants of their bus
//! transfers, not at the period's start or end.
//!
//! The rack runs in this process with spies around its boards, which see what goes over wires and bus.

use board::{Board, BoardId, Inputs, Mail, Ns, Outputs};
use messages::registers::force;
use messages::{AmplifierCommand, BusWord, ControlProbe, PlantSample, TransferRecord};
use pacing::{Context, Flow, Lockstep, Observer, RunError};
use scenario::Scenario;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use vme::interrupt::{Interrupter, IrqRelease};
use vme::rack::{Overrun, Release};
use vme::timer::Ticks;
use vme::{Log, MICROSECOND, MILLISECOND, Op, Origin, RackError};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Period of the force receiver's samples.
const SAMPLE_NS: Ns = 125 * MICROSECOND;

/// What went over the wires and the bus.
#[derive(Default)]
struct Seen {
    plant: Vec<PlantSample>,
    force_words: Vec<BusWord>,
    amplifier: Vec<AmplifierCommand>,
    decisions: Vec<ControlProbe>,
    transfers: Vec<TransferRecord>,
}

type Notes = Arc<Mutex<Seen>>;

/// A board that is watched, and whose outputs may be changed.
struct Spy {
    board: Box<dyn Board>,
    notes: Notes,
    /// Called after each step.
    note: fn(&Inputs, &mut Outputs, &mut Seen),
}

/// A board and what is called after each of its steps.
type Watched = (BoardId, fn(&Inputs, &mut Outputs, &mut Seen));

impl Board for Spy {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        self.board.step(now, inputs, out);
        (self.note)(inputs, out, &mut self.notes.lock().expect("one thread"));
    }
}

/// The chassis' own view.
struct Windows(Notes);

impl Observer for Windows {
    fn window(&mut self, _until: Ns, mail: &Mail, log: &Log) -> Flow {
        let mut seen = self.0.lock().expect("one thread");
        seen.decisions.extend_from_slice(&mail.control_probe);
        let programs = log.transfers.iter().filter(|transfer| transfer.origin == Origin::Program);
        seen.transfers.extend(programs.map(TransferRecord::from));
        Flow::Continue
    }
}

/// Runs the scenario for `seconds`, with these spies.
fn run(scenario: Scenario, seconds: f64, spies: &[Watched]) -> Seen {
    attempt(scenario, seconds, spies).expect("run")
}

/// The same of a run that may fail.
fn attempt(scenario: Scenario, seconds: f64, spies: &[Watched]) -> Result<Seen, RunError> {
    let notes = Notes::default();
    let factory = |role: BoardId, context: &Context| -> Result<Box<dyn Board>, String> {
        let board = chassis::boards::build(role, context)?;
        Ok(match spies.iter().find(|(spied, _)| *spied == role) {
            Some((_, note)) => Box::new(Spy { board, notes: Arc::clone(&notes), note: *note }),
            None => board,
        })
    };
    let context = Context { prefix: String::new(), variant: "nominal".into(), record: None, measure: false, in_process: true, scenario };
    let mut rack = Lockstep::power_up(context, &factory, &|_| Vec::new(), &INTERRUPTED).expect("power-up");
    rack.run(scenario::nanoseconds(seconds), &mut Windows(Arc::clone(&notes)))?;
    rack.finish()?;
    Ok(std::mem::take(&mut *notes.lock().expect("one thread")))
}

fn table_5_3() -> Scenario {
    scenario::load("table-5-3", &[]).expect("built-in").scenario().expect("built-in")
}

/// Counts of the z force at `t`, from the wires.
fn counts_at(plant: &[PlantSample], t: Ns) -> i64 {
    let i = plant.partition_point(|sample| sample.t < t);
    let (b, a) = (&plant[i], &plant[i.saturating_sub(1)]);
    let share = if b.t == a.t { 1.0 } else { (t - a.t) as f64 / (b.t - a.t) as f64 };
    ((a.wrench[2] + share * (b.wrench[2] - a.wrench[2])) * 16384.0 / 400.0).round() as i64
}

/// Every force value that the control computer read, checked against the wires; how many of them differ from the value at
/// the period's start.
fn check_force_reads(offset: Ns) -> usize {
    let mut scenario = table_5_3();
    let task = usize::from(scenario.task_of("control_computer").expect("control task"));
    scenario.rack.tasks[task].offset_ns = offset;
    let period = scenario.rack.tasks[task].period_ns;
    let base = scenario.card_base("force-sensor").expect("card");
    let seen = run(
        scenario,
        1.4,
        &[
            (BoardId::HwSim, |_, out, seen| seen.plant.extend_from_slice(&out.mail.plant)),
            (BoardId::ForceSensorIf, |_, out, seen| seen.force_words.extend_from_slice(&out.mail.words)),
        ],
    );
    let address = base + force::filter(0) + 2 * 2;
    let reads: Vec<&BusWord> = seen.force_words.iter().filter(|word| word.addr == address).collect();
    assert!(reads.len() > 250, "{} reads", reads.len());
    let mut newer_than_the_period = 0;
    for read in reads {
        let transfer = seen
            .transfers
            .iter()
            .find(|transfer| (transfer.task, transfer.job, transfer.index) == (read.task, read.job, read.index));
        let at = transfer.expect("the read's transfer").data_at;
        assert_eq!(read.t, at);
        let release = offset + Ns::from(read.job) * period;
        assert!(at > release && at < release + MILLISECOND, "job {} released at {release} reads at {at} ns", read.job);
        let newest = at / SAMPLE_NS * SAMPLE_NS;
        let value = i64::from(read.value as u16 as i16);
        let expected = counts_at(&seen.plant, newest);
        // the last bit of the wires' interpolation may round the other way
        assert!(
            (value - expected).abs() <= 1,
            "job {}: {value} counts at {at} ns, {expected} on the wires at {newest} ns",
            read.job
        );
        let start = counts_at(&seen.plant, Ns::from(read.job) * period);
        newer_than_the_period += usize::from((value - start).abs() > 1);
    }
    // the control law is told the age that this makes
    for decision in &seen.decisions[1..] {
        let published = decision.t - decision.force_age;
        assert_eq!(
            published % SAMPLE_NS,
            0,
            "job {}: age {} ns at {} ns",
            decision.job,
            decision.force_age,
            decision.t
        );
    }
    newer_than_the_period
}

#[test]
fn the_force_read_is_the_sample_at_or_before_the_access() {
    assert!(check_force_reads(0) > 0, "the force never changed between release and access");
}

#[test]
fn a_release_1_ms_later_reads_the_force_1_ms_later() {
    assert!(check_force_reads(MILLISECOND) > check_force_reads(0), "the later values are not newer");
}

#[test]
fn a_stop_decided_at_t_reaches_the_amplifiers_at_t_plus_its_modelled_path() {
    const TRIP_AT: Ns = 1_202_000_000;
    /// Safety state STO, as the telemetry numbers it.
    const TORQUE_OFF: u32 = 4;
    let scenario = table_5_3();
    let task = usize::from(scenario.task_of("control_computer").expect("control task"));
    let bus = scenario.rack.bus.clone();
    let card = scenario.rack.slaves.iter().find(|slave| slave.name == "parallel-io").expect("card").clone();
    let seen = run(
        scenario,
        1.3,
        &[
            // one amplifier reports a trip; its own card stops this one, the control computer has to stop the others
            (BoardId::HwSim, |_, out, _| {
                let tripped = out.mail.plant.iter_mut().filter(|sample| sample.t >= TRIP_AT);
                tripped.for_each(|sample| sample.status |= 1);
            }),
            (BoardId::DaIo, |_, out, seen| seen.amplifier.extend_from_slice(&out.mail.amplifier)),
        ],
    );
    let others = 0x7E;
    let off = seen
        .amplifier
        .iter()
        .find(|command| command.t >= TRIP_AT && command.enabled & others == 0)
        .expect("torque off");
    let own = seen.amplifier.iter().find(|command| command.t >= TRIP_AT && command.enabled & 1 == 0).expect("own trip");
    assert!(own.t < off.t && own.enabled & others == others, "the card stops the tripped axis at once, and no other");
    let decided = seen.decisions.iter().find(|decision| decision.state == TORQUE_OFF).expect("decision");
    assert!(decided.t > TRIP_AT && decided.t < off.t, "decided at {} ns", decided.t);
    // 20 µs of processor time, then one write; the processor card has kept the bus since its last read: no arbitration
    let write = seen
        .transfers
        .iter()
        .find(|transfer| !transfer.is_read() && transfer.job == decided.job && transfer.task == task as u16);
    assert_eq!(write.expect("the stop's first write").data_at, off.t);
    assert_eq!(off.t, decided.t + 20 * MICROSECOND + bus.address_ns + card.write_ns);
}

#[test]
fn a_task_that_releases_itself_in_no_time_ends_the_run_with_its_name() {
    let mut scenario = table_5_3();
    let task = usize::from(scenario.task_of("control_computer").expect("control task"));
    let task = &mut scenario.rack.tasks[task];
    (task.release, task.overrun) = (Release::Interrupt("self".into()), Some(Overrun::Late));
    let (name, card) = ("control", task.processor.clone());
    let processor = scenario.rack.processors.iter_mut().find(|processor| processor.name == card).expect("card");
    processor.interrupt_ns = 0;
    let ticks = Some(Ticks { period_ns: 5 * MILLISECOND, offset_ns: MILLISECOND });
    let (status_id, release) = (0x70, IrqRelease::Roak);
    let own = Interrupter { name: "self".into(), card, level: 3, status_id, release, answer_ns: 350, ticks, local: true };
    scenario.rack.interrupters.push(own);
    // a program of the user's own
    let raises = |_: &Inputs, out: &mut Outputs, _: &mut Seen| {
        out.programs.iter_mut().for_each(|(_, program)| *program = vec![Op::Raise(3)]);
    };
    let error = attempt(scenario, 0.1, &[(BoardId::ControlComputer, raises)]).err().expect("no end");
    let RunError::Rack(RackError::Endless { task, at_ns, .. }) = &error else { panic!("{error}") };
    assert_eq!((task.as_str(), *at_ns), (name, MILLISECOND));
    assert!(chassis::rack_run::is_of_the_scenario(&error), "the command ends with exit code 2");
}
