//! The timing plane: resolves the tasks' programs into transfers with exact times.
//!
//! Bus, processors and interrupts are one discrete-event model in integer nanoseconds: a stalled
//! access lengthens a task, a task's end moves a request. It depends on programs, statuses and the
//! fault plan, never on data values. Data change timing only at decision points ([`Op::Decide`]):
//! [`Timing::advance`] stops there, and the board that runs the task says with [`Timing::resume`] how
//! the job goes on. `Timing` is pure and cheap to clone (use `clone_from`, which keeps memory): the
//! chassis runs a copy ahead and drops it when the plant cuts a window short.
//!
//! [`Op::Decide`]: crate::Op::Decide

mod agenda;
mod bus;
mod processor;
mod task;
mod wiring;

use crate::Ns;
use crate::arbiter::Arbiter;
use crate::check::RackError;
use crate::fault::{FaultKind, FaultPlan, Timer};
use crate::interrupt::Line;
use crate::program::{Origin, Transfer};
use crate::rack::{Rack, Release};
use crate::requester::Requester;
use crate::traffic::ArrivalStream;
use std::sync::Arc;
pub use task::JobRecord;
use wiring::{Source, Wiring};

/// Why [`Timing::advance`] stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The limit was reached.
    Limit,
    /// A task's block of reads is complete; its board decides now.
    Decision {
        /// Index of the task.
        task: u16,
        /// Its activation number.
        job: u32,
    },
    /// A release of a task with [`crate::rack::Overrun::Trip`] found the job before still running.
    Overrun {
        /// Index of the task.
        task: u16,
        /// Activation number of the lost release.
        job: u32,
    },
    /// A fault begins at this instant; nothing else of this instant has happened yet.
    Fault {
        /// Index in [`FaultPlan::faults`].
        fault: u16,
    },
    /// Time stands still: jobs release each other, or themselves, in no time. [`Timing::endless`] says it in words; there
    /// is no way on.
    Endless {
        /// Index of the task at which that was noticed.
        task: u16,
    },
}

/// Receives what happens, in the order of its instants.
pub trait Sink {
    /// A transfer whose data moved, or that failed, at `transfer.data_at`.
    fn transfer(&mut self, transfer: &Transfer);
    /// A job that has ended.
    fn job(&mut self, _job: &JobRecord) {}
}

/// The transfers of programs alone: what the data plane carries out.
impl Sink for Vec<Transfer> {
    fn transfer(&mut self, transfer: &Transfer) {
        if transfer.origin == Origin::Program {
            self.push(*transfer);
        }
    }
}

/// Everything that happens.
#[derive(Clone, Debug, Default)]
pub struct Log {
    /// All transfers, those of polling, interrupts and background traffic too.
    pub transfers: Vec<Transfer>,
    /// All jobs.
    pub jobs: Vec<JobRecord>,
}

impl Log {
    /// Empties it and keeps the memory.
    pub fn clear(&mut self) {
        self.transfers.clear();
        self.jobs.clear();
    }
}

impl Sink for Log {
    fn transfer(&mut self, transfer: &Transfer) {
        self.transfers.push(*transfer);
    }
    fn job(&mut self, job: &JobRecord) {
        self.jobs.push(*job);
    }
}

/// What went wrong, or by interrupt, so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Transfers that ended in BERR*.
    pub bus_errors: u32,
    /// Requests given up by the access timer.
    pub access_timeouts: u32,
    /// Of these because an adaptor's link failed its parity check.
    pub parity_errors: u32,
    /// Posted writes whose failure arrived late.
    pub posted_errors: u32,
    /// Interrupts taken up by a processor.
    pub interrupts: u32,
    /// Events hidden behind a pending request of the same interrupter.
    pub merged_interrupts: u32,
}

#[derive(Clone, Debug)]
struct Generator {
    arrivals: ArrivalStream,
    count: u32,
    set_up: bool,
}

/// Bus, processors and tasks, at one instant.
#[derive(Debug)]
pub struct Timing {
    wiring: Arc<Wiring>,
    faults: Arc<FaultPlan>,
    /// Begins and ends of faults in order: instant, fault, whether it begins.
    fault_times: Arc<[(Ns, u16, bool)]>,
    next_fault: usize,
    now: Ns,
    /// Where the call of [`Timing::advance`] under way ends.
    limit: Ns,
    /// When each of [`Wiring::sources`] has its next event.
    agenda: agenda::Agenda,
    arbiter: Arbiter,
    bus: bus::Bus,
    masters: Vec<Requester>,
    processors: Vec<processor::Processor>,
    tasks: Vec<task::Task>,
    lines: Vec<Line>,
    generators: Vec<Generator>,
    counters: Counters,
    /// The instant at which tasks took their last steps, and how many.
    steps: (Ns, u32),
}

impl Timing {
    /// A rack at time 0, with empty programs; see [`Timing::set_program`].
    pub fn new(rack: Rack) -> Result<Timing, RackError> {
        Timing::with_faults(rack, FaultPlan::default())
    }

    /// A rack at time 0 in which these faults will happen. A fault's index that counts something that
    /// the rack does not have is an error.
    pub fn with_faults(rack: Rack, faults: FaultPlan) -> Result<Timing, RackError> {
        let wiring = Wiring::new(rack)?;
        let rack = &wiring.rack;
        for (i, fault) in faults.faults.iter().enumerate() {
            let (kind, index, n) = match fault.kind {
                FaultKind::NoSlave(s) | FaultKind::RepeatedRead(s) => ("slave", s, rack.slaves.len()),
                FaultKind::Starvation(m) => ("master", m, wiring.masters.len()),
                FaultKind::StuckBus => continue,
                FaultKind::LostInterrupt(i) | FaultKind::Drift { timer: Timer::Interrupter(i), .. } => {
                    ("interrupter", i, rack.interrupters.len())
                }
                FaultKind::CableOut(a) | FaultKind::Parity(a) => ("adaptor", a, rack.adaptors.len()),
                FaultKind::Slow { task, .. }
                | FaultKind::Overrun { task, .. }
                | FaultKind::RepeatedWrite(task)
                | FaultKind::Drift { timer: Timer::Task(task), .. }
                | FaultKind::Halt(task) => ("task", task, rack.tasks.len()),
            };
            if usize::from(index) >= n {
                return Err(RackError::Unknown { party: format!("fault {i}"), kind, name: format!("number {index}") });
            }
        }
        let mut fault_times: Vec<_> = (faults.faults.iter().enumerate())
            .flat_map(|(i, fault)| [(fault.from_ns, i as u16, true), (fault.until_ns, i as u16, false)])
            .collect();
        fault_times.sort_by_key(|&(at, i, begins)| (at, begins, i));

        let mut agenda = agenda::Agenda::new(&wiring);
        agenda.set(Wiring::FAULT, fault_times.first().map_or(Ns::MAX, |f| f.0));
        for (t, task) in rack.tasks.iter().enumerate() {
            match task.release {
                Release::Timer => {
                    agenda.set(wiring.task(t as u16), faults.instant(Timer::Task(t as u16), task.offset_ns));
                }
                Release::Poll(_) => agenda.set(wiring.dispatch(wiring.processor_of_task[t]), 0),
                Release::Interrupt(_) => {}
            }
        }
        for (i, interrupter) in rack.interrupters.iter().enumerate() {
            let first = interrupter.ticks.map_or(Ns::MAX, |ticks| ticks.at(0));
            agenda.set(wiring.interrupter(i as u16), faults.instant(Timer::Interrupter(i as u16), first));
        }
        let generators: Vec<Generator> = (rack.traffic.iter().enumerate())
            .map(|(g, t)| Generator {
                arrivals: ArrivalStream::new(t.arrivals, t.period_ns as f64, t.offset_ns, t.seed, g as u64),
                count: 0,
                set_up: false,
            })
            .collect();
        for (g, generator) in generators.iter().enumerate() {
            agenda.set(wiring.traffic(g as u16), generator.arrivals.next());
        }
        Ok(Timing {
            arbiter: Arbiter::new(rack.bus.arbiter),
            bus: bus::Bus { owner: None, phase: bus::Phase::Free },
            masters: (wiring.masters.iter())
                .map(|m| Requester { place: m.place, release: m.release, queue: Vec::new() })
                .collect(),
            processors: vec![processor::Processor::new(); rack.processors.len()],
            tasks: (rack.tasks.iter().enumerate()).map(|(t, task)| task::Task::new(t as u16, &task.release)).collect(),
            lines: vec![Line::default(); rack.interrupters.len()],
            generators,
            counters: Counters::default(),
            steps: (0, 0),
            now: 0,
            limit: 0,
            agenda,
            faults: Arc::new(faults),
            fault_times: fault_times.into(),
            next_fault: 0,
            wiring: Arc::new(wiring),
        })
    }

    /// Simulated time reached.
    pub fn now(&self) -> Ns {
        self.now
    }

    /// The rack, with every card in its slot.
    pub fn rack(&self) -> &Rack {
        &self.wiring.rack
    }

    pub(crate) fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    /// What went wrong so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// What [`Stop::Endless`] means, in words.
    pub fn endless(&self, task: u16) -> RackError {
        let task = &self.wiring.rack.tasks[task as usize];
        RackError::Endless { task: task.name.clone(), processor: task.processor.clone(), at_ns: self.now }
    }

    /// Releases of the task that were lost because the job before still ran.
    pub fn skipped(&self, task: u16) -> u32 {
        self.tasks[task as usize].skipped
    }

    /// Name of a master on the bus. Masters count processor cards first, then adaptors, then
    /// generators of traffic; those that work through an adaptor are not counted.
    pub fn master_name(&self, master: u16) -> Option<&str> {
        self.wiring.masters.get(master as usize).map(|m| m.name.as_str())
    }

    /// Masters on the bus.
    pub fn masters(&self) -> usize {
        self.wiring.masters.len()
    }

    /// Runs to the next stop, or to `limit` if that comes first (events at `limit` are left for
    /// later). Gives the sink every transfer whose data moved on the way, in the order of `data_at`.
    pub fn advance(&mut self, limit: Ns, sink: &mut impl Sink) -> Stop {
        self.limit = limit;
        loop {
            let (at, next) = self.agenda.next();
            if at >= limit {
                self.now = self.now.max(limit);
                return Stop::Limit;
            }
            self.now = at;
            if let Some(stop) = self.event(self.wiring.sources[next], sink) {
                return stop;
            }
        }
    }

    fn event(&mut self, source: Source, sink: &mut impl Sink) -> Option<Stop> {
        match source {
            Source::Fault => return self.fault_event(),
            Source::Bus => self.bus_event(sink),
            Source::Processor(p) => self.processor_event(p, sink),
            Source::Dispatch(p) => return self.dispatch(p, sink),
            Source::Interrupter(i) => {
                let due = self.wiring.interrupter(i);
                let line = &mut self.lines[i as usize];
                line.tick += 1;
                let ticks = self.wiring.rack.interrupters[i as usize].ticks;
                let next = ticks.map_or(Ns::MAX, |ticks| ticks.at(line.tick));
                self.agenda.set(due, self.faults.instant(Timer::Interrupter(i), next));
                self.raise(i);
            }
            Source::Task(t) => return self.tick(t),
            Source::Traffic(g) => self.traffic_event(g, sink),
            Source::AccessTimer(m) => self.access_timeout(m, sink),
            Source::Arbiter => self.arbitrate(),
        }
        None
    }
}

impl Clone for Timing {
    fn clone(&self) -> Self {
        Timing {
            wiring: self.wiring.clone(),
            faults: self.faults.clone(),
            fault_times: self.fault_times.clone(),
            agenda: self.agenda.clone(),
            arbiter: self.arbiter.clone(),
            masters: self.masters.clone(),
            processors: self.processors.clone(),
            tasks: self.tasks.clone(),
            lines: self.lines.clone(),
            generators: self.generators.clone(),
            ..*self
        }
    }

    fn clone_from(&mut self, from: &Self) {
        self.wiring.clone_from(&from.wiring);
        self.faults.clone_from(&from.faults);
        self.fault_times.clone_from(&from.fault_times);
        self.next_fault = from.next_fault;
        self.now = from.now;
        self.limit = from.limit;
        self.agenda.clone_from(&from.agenda);
        self.arbiter.clone_from(&from.arbiter);
        self.bus = from.bus;
        self.masters.clone_from(&from.masters);
        self.processors.clone_from(&from.processors);
        self.tasks.clone_from(&from.tasks);
        self.lines.clone_from(&from.lines);
        self.generators.clone_from(&from.generators);
        self.counters = from.counters;
        self.steps = from.steps;
    }
}

#[cfg(test)]
mod tests;
