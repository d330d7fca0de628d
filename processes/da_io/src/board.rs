//! The cards on the rack's time: register accesses, drive signals and timers in the order of their instants.
//!
//! A written word arrives ahead of its transfer and waits for it; a transfer that failed changes nothing, its word waits
//! for the retry. A window that is run again starts from the copy made at its start.

use crate::cards::{Addresses, Cards, Damage};
use board::{Board, Inputs, Ns, Outputs, Told};
use messages::{AmplifierCommand, BusWord, Event, TransferRecord};
use scenario::{FaultKind, Progress, Scenario, Schedule, Site, nanoseconds};

/// Shortest time for which the supply holds after ACFAIL*, ms (VMEbus standard).
const HOLD_UP_MS: f64 = 4.0;
/// Words and signal changes that may wait; of more, which only a peer gone wrong sends, the oldest are forgotten.
const PENDING: usize = 256;

/// Two D/A cards and the parallel I/O card.
pub struct DaIo {
    addresses: Addresses,
    schedule: Schedule,
    state: State,
    /// State at the start of the last window, with what had arrived by then.
    saved: State,
    told: Told,
}

#[derive(Debug)]
struct State {
    cards: Cards,
    /// Written values whose transfer has not come.
    words: Vec<BusWord>,
    /// Changes of the drives' signals whose time has not come.
    signals: Vec<(Ns, u32)>,
    last_signal: u32,
    progress: Progress,
}

impl State {
    fn copy_from(&mut self, other: &State) {
        self.cards = other.cards;
        self.words.clone_from(&other.words);
        self.signals.clone_from(&other.signals);
        self.last_signal = other.last_signal;
        self.progress = other.progress;
    }

    fn absorb(&mut self, inputs: &Inputs) {
        for word in &inputs.mail.words {
            let same = |w: &BusWord| {
                (w.task, w.job, w.index, w.addr) == (word.task, word.job, word.index, word.addr)
            };
            match self.words.iter_mut().find(|w| same(w)) {
                Some(known) => *known = *word,
                None => push_bounded(&mut self.words, *word),
            }
        }
        for sample in &inputs.mail.plant {
            if sample.status != self.last_signal {
                self.last_signal = sample.status;
                push_bounded(&mut self.signals, (sample.t, sample.status));
            }
        }
    }
}

impl DaIo {
    /// The cards of a scenario, at power-up. The message says what is missing.
    pub fn new(scenario: &Scenario) -> Result<DaIo, String> {
        let cards = Cards::new(scenario)?;
        let state = || State {
            cards,
            words: Vec::with_capacity(PENDING),
            signals: Vec::with_capacity(PENDING),
            last_signal: messages::drive_status::BRAKE_ENGAGED,
            progress: Progress::default(),
        };
        Ok(DaIo {
            addresses: Addresses::new(scenario)?,
            schedule: Schedule::new(scenario, |site| matches!(site, Site::Converter(_) | Site::Power)),
            state: state(),
            saved: state(),
            told: Told::default(),
        })
    }

    fn transfer(&mut self, transfer: &TransferRecord, out: &mut Outputs) {
        let TransferRecord {
            task,
            job,
            index,
            data_at,
            ..
        } = *transfer;
        if !transfer.is_ok() {
            return;
        }
        if transfer.is_read() {
            for addr in transfer.cycles() {
                let value = self
                    .addresses
                    .register(addr)
                    .map_or(u32::MAX, |register| self.state.cards.read(register));
                out.mail.words.push(BusWord {
                    t: data_at,
                    addr,
                    value,
                    job,
                    task,
                    index,
                });
            }
            return;
        }
        let state = &mut self.state;
        for word in &state.words {
            if (word.task, word.job, word.index) == (task, job, index)
                && let Some(register) = self.addresses.register(word.addr)
            {
                state.cards.write(data_at, register, word.value, &mut out.mail.events);
            }
        }
        // an earlier job's words will never be fetched
        state
            .words
            .retain(|w| w.task != task || (w.job >= job && (w.job, w.index) != (job, index)));
    }
}

impl DaIo {
    /// Faults that begin or end at `t`.
    fn break_down(&mut self, t: Ns, events: &mut Vec<Event>) {
        let Self { schedule, state, .. } = self;
        schedule.advance(&mut state.progress, t, |place, from| {
            events.push(Event::injected(from, schedule.entries()[place].number));
        });
        let mut damage = Damage::default();
        for (_, entry) in schedule.holding(&state.progress) {
            match (entry.site, entry.fault.kind) {
                (Site::Converter(joint), FaultKind::DaStuck) => damage.stuck |= 1 << joint,
                (Site::Converter(joint), FaultKind::DaOffset) => damage.offset[joint] += entry.fault.amount,
                (Site::Power, _) => damage.power_fail = Some(nanoseconds(entry.fault.amount.max(HOLD_UP_MS) * 1e-3)),
                _ => {}
            }
        }
        state.cards.damaged(t, damage, events);
    }
}

impl Board for DaIo {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if inputs.rerun {
            self.state.copy_from(&self.saved);
        }
        self.told.tell(inputs.until, &inputs.defects, &mut out.mail.events);
        self.state.absorb(inputs);
        self.saved.copy_from(&self.state);
        if inputs.boot {
            out.mail.amplifier.push(self.state.cards.outputs(inputs.until));
        }

        let mut transfers = inputs.transfers.iter().peekable();
        loop {
            let signal = self
                .state
                .signals
                .first()
                .map_or(Ns::MAX, |signal| signal.0.max(inputs.from));
            // no transfer of a window takes place after it
            let transfer = transfers
                .peek()
                .map_or(Ns::MAX, |transfer| transfer.data_at.min(inputs.until));
            let timer = self.state.cards.next_timer();
            let fault = self.schedule.next_change(&self.state.progress);
            let t = signal.min(transfer).min(timer).min(fault);
            if t == Ns::MAX || transfer == Ns::MAX && t >= inputs.until {
                break;
            }
            let before = self.state.cards.outputs(t);
            // at one instant: a fault and a new signal first, then a transfer (a heartbeat just in time counts), then timers
            if fault == t {
                self.break_down(t, &mut out.mail.events);
            } else if signal == t {
                let (_, status) = self.state.signals.remove(0);
                self.state.cards.signals(t, status, &mut out.mail.events);
            } else if transfer == t {
                if let Some(transfer) = transfers.next() {
                    self.transfer(&TransferRecord { data_at: t, ..*transfer }, out);
                }
            } else {
                self.state.cards.timer(t, &mut out.mail.events);
            }
            let after = self.state.cards.outputs(t);
            if after != before {
                push_merged(&mut out.mail.amplifier, after);
            }
        }
    }
}

fn push_bounded<T>(waiting: &mut Vec<T>, item: T) {
    if waiting.len() == PENDING {
        waiting.remove(0);
    }
    waiting.push(item);
}

/// Outputs that change twice at one instant are one command.
fn push_merged(commands: &mut Vec<AmplifierCommand>, command: AmplifierCommand) {
    match commands.last_mut() {
        Some(last) if last.t == command.t => *last = command,
        _ => commands.push(command),
    }
}
