//! Makes the table of latencies of what the boards measured.
//!
//! Wake-up counts from the intended time of a step, so that a board that is late is late in every step that it delays
//! (no coordinated omission).

use super::cycle::{Clock, Cycle, PARTS, Stamps, WHOLE};
use super::row::{LatencyRow, Recorder, of_second};
use board::routes::ROUTES;
use hdrhistogram::Histogram;
use messages::{BOARDS, BoardId, Span, SpanKind};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};

/// Jobs after which one that has no torque yet is taken never to get one. Processes tell what they measured every few steps.
const PATIENCE: u64 = 64;
/// Steps that are remembered for the notes of long cycles.
const REMEMBERED: usize = 4096;
/// Cycles in the list of the longest.
const LONGEST: usize = 10;
/// Notes of a long cycle.
const NOTES: usize = 4;

/// Messages of one channel at one reader.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChannelCount {
    /// Channel, for example `hw_sim/plant`.
    pub channel: String,
    /// Reader.
    pub reader: String,
    /// Messages sent since the measurement began.
    pub sent: u64,
    /// Messages read.
    pub read: u64,
    /// Of these, after their modelled time.
    pub late: u64,
    /// Skipped: a later one was read, these never were.
    pub lost: u64,
    /// Read a second time.
    pub twice: u64,
}

/// What was measured in a run.
#[derive(Clone, Debug, Serialize)]
pub struct Measurement {
    /// Steps, messages, cycles.
    pub rows: Vec<LatencyRow>,
    /// Cycles that got their torque.
    pub cycles: u64,
    /// Cycles decided without their reading, or never answered.
    pub broken_cycles: u64,
    /// Sum of each of [`PARTS`] over all cycles, ns.
    pub parts_sum_ns: [u64; 3],
    /// Sum of the wholes, each from the arm's stamp and the D/A's stamp alone, ns.
    pub whole_sum_ns: u64,
    /// The longest cycles, longest first.
    pub longest: Vec<Cycle>,
    /// Every message counted.
    pub channels: Vec<ChannelCount>,
    /// Values that newer ones overwrote before they were used.
    pub overwritten: u64,
    /// Writes made later than their modelled time.
    pub delayed_writes: u64,
    /// Messages of measurements that were lost.
    pub unmeasured: u64,
}

/// Listens to a run.
pub struct Journal {
    clock: Clock,
    zero: u64,
    boards: [Option<Steps>; BOARDS.len()],
    /// By route, then reader.
    hops: Vec<Option<Hops>>,
    sent: BTreeMap<u32, u64>,
    age: Recorder,
    parts: [Recorder; 3],
    whole: Recorder,
    open: BTreeMap<u64, Stamps>,
    steps: VecDeque<Step>,
    /// Row to settle next, and what it needs for it: one at a time, so that nobody waits for all.
    turn: usize,
    of_second: Histogram<u64>,
    measurement: Measurement,
}

struct Steps {
    wake_up: Recorder,
    execution: Recorder,
    jitter: Recorder,
    /// When the last one was intended, and when it began.
    last: Option<(u64, u64)>,
}

/// What the notes of long cycles need of a step.
#[derive(Clone, Copy)]
struct Step {
    window: u64,
    due: u64,
    begin: u64,
    end: u64,
    board: u32,
}

struct Hops {
    latency: Recorder,
    first: u64,
    next: u64,
    count: ChannelCount,
}

/// Channel as tables name it.
fn channel_name(index: u32) -> String {
    ROUTES
        .get(index as usize)
        .map_or_else(String::new, |route| format!("{}/{:?}", route.from.name(), route.kind).to_lowercase())
}

fn board_name(number: u32) -> &'static str {
    BoardId::from_number(number as u8).map_or("unknown", BoardId::name)
}

impl Journal {
    /// An empty one. Simulated time 0 is at `zero` on the wall clock.
    pub fn new(clock: Clock, zero: u64) -> Journal {
        Journal {
            clock,
            zero,
            boards: Default::default(),
            hops: (0..ROUTES.len() * BOARDS.len()).map(|_| None).collect(),
            sent: BTreeMap::new(),
            age: Recorder::new("age of the force value when used"),
            parts: PARTS.map(Recorder::new),
            whole: Recorder::counting_misses(WHOLE),
            open: BTreeMap::new(),
            steps: VecDeque::with_capacity(REMEMBERED),
            turn: 0,
            of_second: of_second(),
            measurement: Measurement {
                rows: Vec::new(),
                cycles: 0,
                broken_cycles: 0,
                parts_sum_ns: [0; 3],
                whole_sum_ns: 0,
                longest: Vec::new(),
                channels: Vec::new(),
                overwritten: 0,
                delayed_writes: 0,
                unmeasured: 0,
            },
        }
    }

    /// Takes in what was measured; `lost` messages of it did not come.
    pub fn take(&mut self, spans: &[Span], lost: u32) {
        self.measurement.unmeasured += u64::from(lost);
        for span in spans {
            match SpanKind::from_number(span.kind) {
                Some(SpanKind::Step) => self.step(span),
                Some(SpanKind::Hop) => self.hop(span),
                Some(SpanKind::Sent) => {
                    self.sent.insert(span.channel, span.number);
                }
                Some(SpanKind::Read) => self.open.entry(span.number).or_default().read = Some(*span),
                Some(SpanKind::Output) => self.open.entry(span.number).or_default().output = Some(*span),
                Some(SpanKind::Decision) => {
                    self.open.entry(span.number).or_default().decision = Some(*span);
                    self.close(span.number.saturating_sub(PATIENCE));
                }
                None => {}
            }
        }
        self.settle_one();
    }

    fn settle_one(&mut self) {
        let boards = self.boards.iter_mut().flatten();
        let steps = boards.flat_map(|steps| [&mut steps.wake_up, &mut steps.execution, &mut steps.jitter]);
        let hops = self.hops.iter_mut().flatten().map(|hops| &mut hops.latency);
        let cycles = self.parts.iter_mut().chain([&mut self.age, &mut self.whole]);
        match steps.chain(hops).chain(cycles).nth(self.turn) {
            Some(row) => {
                row.settle(&mut self.of_second);
                self.turn += 1;
            }
            None => self.turn = 0,
        }
    }

    fn step(&mut self, span: &Span) {
        self.measurement.overwritten += u64::from(span.overwritten);
        self.measurement.delayed_writes += u64::from(span.delayed);
        let at = span.begin.saturating_sub(self.zero);
        let Some(steps) = self.boards.get_mut(span.board as usize) else { return };
        let steps = steps.get_or_insert_with(|| {
            let name = board_name(span.board);
            Steps {
                wake_up: Recorder::counting_misses(format!("wake-up {name}")),
                execution: Recorder::new(format!("step {name}")),
                jitter: Recorder::new(format!("jitter {name}")),
                last: None,
            }
        });
        steps.wake_up.record(at, span.begin.saturating_sub(span.due));
        if span.late != 0 {
            steps.wake_up.miss();
        }
        steps.execution.record(at, span.end.saturating_sub(span.begin));
        if let Some((due, begin)) = steps.last.replace((span.due, span.begin)) {
            let (intended, actual) = (span.due.abs_diff(due), span.begin.abs_diff(begin));
            steps.jitter.record(at, actual.abs_diff(intended));
        }
        if self.steps.len() == REMEMBERED {
            self.steps.pop_front();
        }
        let Span { window, due, begin, end, board, .. } = *span;
        self.steps.push_back(Step { window, due, begin, end, board });
    }

    fn hop(&mut self, span: &Span) {
        let (channel, reader) = (span.channel as usize, span.board as usize);
        let known = channel < ROUTES.len() && reader < BOARDS.len();
        let Some(hops) = known.then(|| &mut self.hops[channel * BOARDS.len() + reader]) else { return };
        let hops = hops.get_or_insert_with(|| {
            let (channel, reader) = (channel_name(span.channel), board_name(span.board).to_owned());
            Hops {
                latency: Recorder::counting_misses(format!("{channel} to {reader}")),
                first: span.number,
                next: span.number,
                count: ChannelCount { channel, reader, sent: 0, read: 0, late: 0, lost: 0, twice: 0 },
            }
        });
        if span.number < hops.next {
            hops.count.twice += 1;
            return;
        }
        hops.count.lost += span.number - hops.next;
        hops.next = span.number + 1;
        hops.count.read += 1;
        if span.late != 0 {
            hops.count.late += 1;
            hops.latency.miss();
        }
        // unstamped: sent before anything was measured
        if span.begin != 0 {
            hops.latency.record(span.end.saturating_sub(self.zero), span.end.saturating_sub(span.begin));
        }
    }

    /// Settles every cycle before `job`.
    fn close(&mut self, job: u64) {
        while let Some(entry) = self.open.first_entry().filter(|entry| *entry.key() < job) {
            let before = entry.get().decision.map_or(0, |decision| decision.window).saturating_sub(4);
            let stamps = entry.remove();
            let Some(decision) = stamps.decision else { continue };
            let at = match self.clock {
                Clock::Simulated => decision.t,
                Clock::Wall => decision.end.saturating_sub(self.zero),
            };
            if let Some(age) = stamps.age(self.clock) {
                self.age.record(at, age);
            }
            match stamps.cycle(self.clock) {
                None => {
                    self.measurement.broken_cycles += 1;
                    self.whole.miss();
                }
                Some(cycle) => {
                    let last = stamps.output.map_or(decision.window, |output| output.window);
                    self.answered(at, cycle, before.max(1)..=last);
                }
            }
        }
    }

    fn answered(&mut self, at: u64, mut cycle: Cycle, windows: std::ops::RangeInclusive<u64>) {
        let measurement = &mut self.measurement;
        measurement.cycles += 1;
        measurement.whole_sum_ns += cycle.whole_ns;
        for ((sum, part), recorder) in measurement.parts_sum_ns.iter_mut().zip(cycle.parts_ns).zip(&mut self.parts) {
            *sum += part;
            recorder.record(at, part);
        }
        self.whole.record(at, cycle.whole_ns);
        let place = measurement.longest.partition_point(|other| other.whole_ns >= cycle.whole_ns);
        if place < LONGEST {
            cycle.notes = notes(&self.steps, windows);
            measurement.longest.insert(place, cycle);
            measurement.longest.truncate(LONGEST);
        }
    }

    /// Rows so far: path, values, median and greatest, ns, and misses.
    pub fn rows(&self) -> impl Iterator<Item = &Recorder> {
        let boards = self.boards.iter().flatten().flat_map(|steps| [&steps.wake_up, &steps.execution, &steps.jitter]);
        let hops = self.hops.iter().flatten().map(|hops| &hops.latency);
        let cycles = [&self.age].into_iter().chain(&self.parts).chain([&self.whole]);
        boards.chain(hops).chain(cycles)
    }

    /// The measurement of the whole run.
    pub fn finish(mut self) -> Measurement {
        self.close(u64::MAX);
        let mut rows = Vec::new();
        for steps in self.boards.into_iter().flatten() {
            rows.extend([steps.wake_up, steps.execution, steps.jitter].map(Recorder::finish));
        }
        for (i, hops) in self.hops.into_iter().enumerate() {
            let Some(mut hops) = hops else { continue };
            let channel = (i / BOARDS.len()) as u32;
            // a run that broke off did not tell how many were sent; messages of the boot do not count
            hops.count.sent = self.sent.get(&channel).copied().unwrap_or(hops.next) - hops.first;
            rows.push(hops.latency.finish());
            self.measurement.channels.push(hops.count);
        }
        rows.push(self.age.finish());
        rows.extend(self.parts.map(Recorder::finish));
        rows.push(self.whole.finish());
        rows.retain(|row| row.n > 0);
        Measurement { rows, ..self.measurement }
    }
}

impl Measurement {
    /// The row of that path.
    pub fn row(&self, path: &str) -> Option<&LatencyRow> {
        self.rows.iter().find(|row| row.path == path)
    }
}

/// What stood out among the steps of these windows.
fn notes(steps: &VecDeque<Step>, windows: std::ops::RangeInclusive<u64>) -> Vec<String> {
    let mut found: Vec<(u64, String)> = Vec::new();
    for step in steps.iter().filter(|step| windows.contains(&step.window)) {
        let name = board_name(step.board);
        let (behind, took) = (step.begin.saturating_sub(step.due), step.end.saturating_sub(step.begin));
        let micro = |ns: u64| ns as f64 * 1e-3;
        found.push((behind, format!("{name} began {:.0} µs late (window {})", micro(behind), step.window)));
        found.push((took, format!("{name} took {:.0} µs (window {})", micro(took), step.window)));
    }
    found.sort_by_key(|(ns, _)| std::cmp::Reverse(*ns));
    found.truncate(NOTES);
    found.into_iter().map(|(_, note)| note).collect()
}
