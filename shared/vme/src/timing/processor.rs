//! Processors in the timing plane: fixed-priority preemptive tasks, stalls, interrupt service.

use super::bus::{asked, iack, pending};
use super::task::State;
use super::{Sink, Stop, Timing};
use crate::Ns;
use crate::interrupt::IrqRelease;
use crate::program::{Access, Direction, Op, Origin, Status, Transfer};
use crate::rack::Release;
use crate::requester::{Client, Pending, ReleasePolicy};

/// Ticks missed in a row after which a card goes on by polling.
const MISSED_TICKS: u32 = 2;
/// Steps that tasks take at one instant at most: far more than all operations of all programs.
const STEPS_AT_ONCE: u32 = 100_000;

/// What a processor carries out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Strand {
    /// The interrupt being served.
    Service,
    /// A task.
    Task(u16),
}

/// Why a processor is stalled.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stall {
    /// Its access is on its way out through the adaptor.
    Outbound(Pending),
    /// Its access ends so without the bus: its adaptor refuses it, or latencies are constant.
    Aside(Transfer),
    /// Its access waits for the bus or is on it.
    Access,
    /// Its access has ended so.
    Ended(Status),
    /// Its write buffer is full.
    Buffer,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Processor {
    /// Task whose context is loaded.
    loaded: Option<u16>,
    /// What runs since when; preemption takes it off.
    running: Option<(Strand, Ns)>,
    stalled: Option<(Strand, Stall, Ns)>,
    pub service: Option<Service>,
    /// Interrupters that wait for this processor, as bits.
    pub requests: u64,
    /// Its write buffer holds a write that is not done.
    buffer_full: bool,
    /// Posted writes that failed and have not been reported yet.
    posted_errors: u32,
}

/// Service of one interrupt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Service {
    /// The interrupter; a posted write's late BERR* has none.
    pub line: Option<u16>,
    step: Step,
    remaining: Ns,
    /// Event that the acknowledged request stood for.
    event: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// The IACK cycle of this level is to be asked for, or under way.
    Acknowledge(u8),
    /// On the way to the handler.
    Latency,
    /// The handler's write to a RORA register is under way.
    Release,
}

impl Processor {
    pub fn new() -> Processor {
        Processor {
            loaded: None,
            running: None,
            stalled: None,
            service: None,
            requests: 0,
            buffer_full: false,
            posted_errors: 0,
        }
    }
}

/// Whether the processor goes on at this instant.
enum Next {
    Goes,
    Waits,
    Stops(Stop),
}

impl Timing {
    /// Lets the processor look at its work again, unless a bus access stalls it.
    pub(super) fn reschedule(&mut self, p: u16) {
        if self.processors[p as usize].stalled.is_none() {
            let dispatch = self.wiring.dispatch(p);
            self.agenda.set(dispatch, self.now);
        }
    }

    fn stall(&mut self, p: u16, strand: Strand, stall: Stall) {
        self.processors[p as usize].stalled = Some((strand, stall, self.now));
        let due = self.wiring.processor(p);
        self.agenda.set(due, Ns::MAX);
    }

    /// The processor is due: a slice of execution or a stall is over.
    pub(super) fn processor_event(&mut self, p: u16, sink: &mut impl Sink) {
        let due = self.wiring.processor(p);
        self.agenda.set(due, Ns::MAX);
        if let Some((strand, stall, since)) = self.processors[p as usize].stalled.take() {
            match stall {
                Stall::Outbound(pending) => {
                    self.processors[p as usize].stalled = Some((strand, Stall::Access, since));
                    self.enqueue(pending);
                    return;
                }
                Stall::Aside(mut transfer) => {
                    (transfer.data_at, transfer.done) = (self.now, self.now);
                    self.count_aside(&transfer);
                    sink.transfer(&transfer);
                    self.after_access(p, strand, transfer.status, since);
                }
                Stall::Ended(status) => self.after_access(p, strand, status, since),
                // woken by the buffer: the same write is taken up again
                Stall::Access | Stall::Buffer => {}
            }
        }
        self.account(p);
        // a job that has nothing left to do ends before the releases of this instant
        if let Some(t) = self.processors[p as usize].loaded {
            let task = &self.tasks[t as usize];
            if task.state == State::Active && task.started && task.remaining == 0 && task.operation().is_none() {
                self.finish(t, sink);
            }
        }
        let dispatch = self.wiring.dispatch(p);
        self.agenda.set(dispatch, self.now);
    }

    /// Takes off what runs, and notes how far it got.
    fn account(&mut self, p: u16) {
        if let Some((strand, since)) = self.processors[p as usize].running.take() {
            let used = self.now - since;
            match strand {
                Strand::Task(t) => {
                    let task = &mut self.tasks[t as usize];
                    task.remaining -= used;
                    task.record.execution_ns += used;
                }
                Strand::Service => {
                    if let Some(service) = &mut self.processors[p as usize].service {
                        service.remaining -= used;
                    }
                }
            }
        }
        let due = self.wiring.processor(p);
        self.agenda.set(due, Ns::MAX);
    }

    /// The processor chooses what to do from this instant on.
    pub(super) fn dispatch(&mut self, p: u16, sink: &mut impl Sink) -> Option<Stop> {
        let dispatch = self.wiring.dispatch(p);
        self.agenda.set(dispatch, Ns::MAX);
        if self.processors[p as usize].stalled.is_some() {
            return None;
        }
        self.account(p);
        loop {
            let next = match self.choose(p) {
                Some(Strand::Service) => self.serve(p),
                Some(Strand::Task(t)) if self.is_endless() => Next::Stops(Stop::Endless { task: t }),
                Some(Strand::Task(t)) => self.run(p, t, sink),
                None => Next::Waits,
            };
            match next {
                Next::Goes => {}
                Next::Waits => return None,
                Next::Stops(stop) => return Some(stop),
            }
        }
    }

    /// Counts a task's step. True where so many have been taken at this instant that it never ends.
    fn is_endless(&mut self) -> bool {
        let (at, steps) = self.steps;
        self.steps = (self.now, if at == self.now { steps.saturating_add(1) } else { 1 });
        self.steps.1 > STEPS_AT_ONCE
    }

    /// The most urgent work: interrupts, then tasks by priority.
    fn choose(&mut self, p: u16) -> Option<Strand> {
        if self.processors[p as usize].service.is_none() {
            self.accept_interrupt(p);
        }
        if self.processors[p as usize].service.is_some() {
            return Some(Strand::Service);
        }
        let tasks = &self.wiring.tasks_of_processor[p as usize];
        tasks.iter().find(|&&t| self.tasks[t as usize].runnable()).map(|&t| Strand::Task(t))
    }

    fn accept_interrupt(&mut self, p: u16) {
        let wiring = &self.wiring;
        let processor = &mut self.processors[p as usize];
        let latency = wiring.rack.processors[p as usize].interrupt_ns;
        if processor.posted_errors > 0 {
            processor.posted_errors -= 1;
            processor.service = Some(Service { line: None, step: Step::Latency, remaining: latency, event: 0 });
            return;
        }
        if processor.requests == 0 {
            return;
        }
        let waiting = (0..wiring.irqs.len()).filter(|i| processor.requests & (1 << i) != 0);
        let urgent = |i: &usize| (wiring.rack.interrupters[*i].level, std::cmp::Reverse(wiring.irqs[*i].slot));
        let Some(found) = waiting.max_by_key(urgent) else {
            return;
        };
        let spec = &wiring.rack.interrupters[found];
        self.counters.interrupts += 1;
        processor.service = if spec.local {
            processor.requests &= !(1 << found);
            let event = self.lines[found].event;
            self.lines[found].pending = false;
            Some(Service { line: Some(found as u16), step: Step::Latency, remaining: latency, event })
        } else {
            Some(Service { line: None, step: Step::Acknowledge(spec.level), remaining: 0, event: 0 })
        };
    }

    /// Goes on with the interrupt in service.
    fn serve(&mut self, p: u16) -> Next {
        let Some(service) = self.processors[p as usize].service else {
            return Next::Goes;
        };
        let master = self.wiring.processors[p as usize].0;
        match service.step {
            Step::Acknowledge(level) => {
                let transfer = asked(Origin::Iack, u16::MAX, master, iack(level), self.now);
                self.stall(p, Strand::Service, Stall::Access);
                self.enqueue(pending(transfer, Client::Processor(p), 0));
                Next::Waits
            }
            Step::Latency if service.remaining > 0 => {
                self.processors[p as usize].running = Some((Strand::Service, self.now));
                let due = self.wiring.processor(p);
                self.agenda.set(due, self.now + service.remaining);
                Next::Waits
            }
            Step::Latency => {
                let release = service.line.map(|line| self.wiring.rack.interrupters[line as usize].release);
                if let Some(IrqRelease::Rora { am, addr, width }) = release {
                    let access = Access { am, addr, width, dir: Direction::Write, n: 1 };
                    let transfer = asked(Origin::InterruptRelease, u16::MAX, master, access, self.now);
                    if let Some(service) = &mut self.processors[p as usize].service {
                        service.step = Step::Release;
                    }
                    self.stall(p, Strand::Service, Stall::Access);
                    self.enqueue(pending(transfer, Client::Processor(p), 0));
                    return Next::Waits;
                }
                self.served(p, service)
            }
            Step::Release => {
                if let Some(line) = service.line {
                    self.lines[line as usize].pending = false;
                    self.processors[p as usize].requests &= !(1 << line);
                }
                self.served(p, service)
            }
        }
    }

    /// The handler has run: it releases the tasks that wait for this interrupt.
    fn served(&mut self, p: u16, service: Service) -> Next {
        self.processors[p as usize].service = None;
        let mut stop = None;
        if let Some(line) = service.line {
            let wiring = self.wiring.clone();
            for &t in &wiring.irqs[line as usize].tasks {
                stop = self.release_task(t, service.event).or(stop);
            }
        }
        match stop {
            None => Next::Goes,
            Some(stop) => {
                self.reschedule(p);
                Next::Stops(stop)
            }
        }
    }

    /// The interrupter's status/ID is on the bus: it has been acknowledged.
    pub(super) fn answered(&mut self, p: u16) {
        let processor = &mut self.processors[p as usize];
        let Some(service) = &mut processor.service else {
            return;
        };
        let Some(i) = service.line else { return };
        let line = &mut self.lines[i as usize];
        service.event = line.event;
        if self.wiring.rack.interrupters[i as usize].release == IrqRelease::Roak {
            line.pending = false;
            processor.requests &= !(1 << i);
        }
    }

    /// An event of an interrupter. Where its interrupts get lost, the handler's card misses its ticks, and after
    /// [`MISSED_TICKS`] in a row looks for each by itself when it is due, which takes what serving an interrupt does.
    pub(super) fn raise(&mut self, i: u16) {
        if self.faults.holds(self.now, crate::FaultKind::LostInterrupt(i)).is_some() {
            let line = &mut self.lines[i as usize];
            line.missed += 1;
            if line.missed <= MISSED_TICKS {
                line.events = line.events.wrapping_add(1);
                return;
            }
        } else {
            self.lines[i as usize].missed = 0;
        }
        if !self.lines[i as usize].raise(self.now) {
            self.counters.merged_interrupts += 1;
            return;
        }
        let wire = &self.wiring.irqs[i as usize];
        if !wire.polled {
            let p = wire.handler;
            self.processors[p as usize].requests |= 1 << i;
            self.reschedule(p);
        }
    }

    /// Goes on with a task: the rest of a slice, or its next operation.
    fn run(&mut self, p: u16, t: u16, sink: &mut impl Sink) -> Next {
        let switch_ns = self.wiring.rack.processors[p as usize].switch_ns;
        let processor = &mut self.processors[p as usize];
        let task = &mut self.tasks[t as usize];
        if processor.loaded != Some(t) {
            if processor.loaded.is_some() {
                task.remaining += switch_ns;
            }
            processor.loaded = Some(t);
        }
        if task.remaining > 0 {
            processor.running = Some((Strand::Task(t), self.now));
            let due = self.wiring.processor(p);
            self.agenda.set(due, self.now + task.remaining);
            return Next::Waits;
        }
        match task.state {
            State::Deciding => Next::Waits,
            State::Polling { .. } => self.poll(p, t),
            _ => self.operate(p, t, sink),
        }
    }

    /// Carries out the task's next operation.
    fn operate(&mut self, p: u16, t: u16, sink: &mut impl Sink) -> Next {
        let task = &mut self.tasks[t as usize];
        if !task.started {
            task.started = true;
            task.record.start = self.now;
        }
        let Some(op) = task.operation() else {
            self.finish(t, sink);
            return Next::Goes;
        };
        task.pc += 1;
        match op {
            Op::Exec(ns) => {
                task.remaining = self.faults.stretched(self.now, t, ns) + std::mem::take(&mut task.overrun);
                Next::Goes
            }
            Op::Raise(level) => {
                let card = &self.wiring.rack.processors[p as usize].name;
                let own = |i: &crate::interrupt::Interrupter| i.card == *card && i.level == level;
                if let Some(i) = self.wiring.rack.interrupters.iter().position(own) {
                    self.raise(i as u16);
                }
                Next::Goes
            }
            Op::Access(access) => self.access(p, t, access, sink),
            Op::Decide => {
                task.record.decide = Some(self.now);
                task.state = State::Deciding;
                Next::Stops(Stop::Decision { task: t, job: task.job })
            }
        }
    }

    /// A task asks for a transfer.
    fn access(&mut self, p: u16, t: u16, access: Access, sink: &mut impl Sink) -> Next {
        let master = self.wiring.processors[p as usize].0;
        let spec = &self.wiring.rack.processors[p as usize];
        let posted = spec.posted_write_ns.filter(|_| access.dir == Direction::Write);
        let task = &mut self.tasks[t as usize];
        if posted.is_some() && self.processors[p as usize].buffer_full {
            task.pc -= 1;
            self.stall(p, Strand::Task(t), Stall::Buffer);
            return Next::Waits;
        }
        let mut transfer = asked(Origin::Program, t, master, access, self.now);
        (transfer.job, transfer.index, transfer.attempt) = (task.job, task.index, task.attempt);
        task.index = task.index.wrapping_add(1);
        if task.record.first_request.is_none() {
            task.record.first_request = Some(self.now);
            task.record.entry_ns = task.record.execution_ns;
        }
        if let Some(constant_ns) = self.wiring.rack.bus.constant_ns {
            return self.aside(p, t, transfer, constant_ns, sink);
        }
        let Some(accepted_ns) = posted else {
            if self.pass(p, t, &mut transfer) {
                sink.transfer(&transfer);
                return Next::Goes;
            }
            self.send_out(p, Strand::Task(t), transfer);
            return Next::Waits;
        };
        task.remaining = accepted_ns;
        transfer.posted = true;
        self.processors[p as usize].buffer_full = true;
        self.enqueue(pending(transfer, Client::WriteBuffer(p), 0));
        Next::Goes
    }

    /// An access where latencies are constant: it is in nobody's way.
    fn aside(&mut self, p: u16, t: u16, mut transfer: Transfer, constant_ns: Ns, sink: &mut impl Sink) -> Next {
        transfer.slave = self.wiring.slave(&transfer.access);
        if transfer.slave.is_none() && !transfer.access.is_address_only() {
            transfer.status = Status::BusError;
        }
        let ends = self.now + constant_ns;
        if ends >= self.limit.min(self.agenda.next().0) {
            self.stall(p, Strand::Task(t), Stall::Aside(transfer));
            let due = self.wiring.processor(p);
            self.agenda.set(due, ends);
            return Next::Waits;
        }
        self.now = ends;
        (transfer.data_at, transfer.done) = (ends, ends);
        self.count_aside(&transfer);
        let task = &mut self.tasks[t as usize];
        task.attempt = 0;
        task.record.stalled_ns += constant_ns;
        sink.transfer(&transfer);
        Next::Goes
    }

    fn count_aside(&mut self, transfer: &Transfer) {
        self.counters.bus_errors += u32::from(transfer.status == Status::BusError);
        if transfer.origin == Origin::Program {
            self.tasks[transfer.task as usize].record.last_data = Some(transfer.data_at);
        }
    }

    /// The short way of the usual case: the processor's master has kept the bus, nobody else asks and
    /// nothing at all happens before the processor goes on. The transfer's times are the ones that the
    /// events would give it, and time has then passed.
    fn pass(&mut self, p: u16, t: u16, transfer: &mut Transfer) -> bool {
        let (master, adaptor) = self.wiring.processors[p as usize];
        let requester = &self.masters[master as usize];
        let alone = adaptor.is_none()
            && self.bus.owner == Some(master)
            && matches!(self.bus.phase, super::bus::Phase::Free)
            && requester.release == ReleasePolicy::OnRequest
            && requester.queue.is_empty()
            && !self.arbiter.requested_by_others(requester.place)
            && self.faults.faults.is_empty();
        if !alone {
            return false;
        }
        let rack = &self.wiring.rack;
        let plan = self.wiring.plan(&transfer.access, rack.processors[p as usize].splits_width);
        let burst = plan.burst(&rack.bus, transfer.access.addr, 0, 0);
        let linked = plan.slave.is_none_or(|slave| self.wiring.slaves[slave as usize] != (None, None));
        let stall_ns = if transfer.access.awaits_data() { rack.bus.read_stall_ns } else { 0 };
        let goes_on = self.now + burst.done_ns + stall_ns;
        if !burst.last || plan.fails || linked || goes_on >= self.limit.min(self.agenda.next().0) {
            return false;
        }
        transfer.slave = plan.slave;
        transfer.data_at = self.now + burst.data_ns;
        transfer.done = self.now + burst.done_ns;
        transfer.held_ns = burst.done_ns;
        let task = &mut self.tasks[t as usize];
        task.attempt = 0;
        task.record.last_data = Some(transfer.data_at);
        task.record.stalled_ns += goes_on - self.now;
        self.now = goes_on;
        true
    }

    /// Sends an access to the bus, through the processor's adaptor where it has one.
    fn send_out(&mut self, p: u16, strand: Strand, mut transfer: Transfer) {
        let Some(adaptor) = self.wiring.processors[p as usize].1 else {
            self.stall(p, strand, Stall::Access);
            self.enqueue(pending(transfer, Client::Processor(p), 0));
            return;
        };
        let spec = &self.wiring.rack.adaptors[adaptor as usize];
        let block = transfer.access.n > 1;
        let (stall, after) = if self.link_up(adaptor) && spec.reaches(&transfer.access) {
            let pace_ns = if block { spec.pace_ns(transfer.access.width.bytes()) } else { 0 };
            let out_ns = if block { spec.dma_setup_ns } else { link_ns(spec, &transfer).0 };
            transfer.requested = self.now + out_ns;
            (Stall::Outbound(pending(transfer, Client::Processor(p), pace_ns)), out_ns)
        } else {
            transfer.status = Status::BusError;
            (Stall::Aside(transfer), spec.link_timeout_ns)
        };
        self.stall(p, strand, stall);
        let due = self.wiring.processor(p);
        self.agenda.set(due, self.now + after);
    }

    /// The bus has done with the access that stalls this processor.
    pub(super) fn access_ended(&mut self, p: u16, transfer: &Transfer) {
        let mut stall_ns = if transfer.access.awaits_data() { self.wiring.rack.bus.read_stall_ns } else { 0 };
        if let Some(adaptor) = self.wiring.processors[p as usize].1 {
            stall_ns = link_ns(&self.wiring.rack.adaptors[adaptor as usize], transfer).1;
        }
        if transfer.origin == Origin::Program {
            self.tasks[transfer.task as usize].record.last_data = Some(transfer.data_at);
        }
        if let Some((_, stall, _)) = &mut self.processors[p as usize].stalled {
            *stall = Stall::Ended(transfer.status);
        }
        let due = self.wiring.processor(p);
        self.agenda.set(due, self.now + stall_ns);
    }

    /// The stall is over; an access that failed may be tried again.
    fn after_access(&mut self, p: u16, strand: Strand, status: Status, since: Ns) {
        match strand {
            Strand::Task(t) => {
                let retries = self.wiring.rack.tasks[t as usize].retries;
                let task = &mut self.tasks[t as usize];
                task.record.stalled_ns += self.now - since;
                if matches!(task.state, State::Active) && task.pc > 0 {
                    if status == Status::BusError && task.attempt < retries {
                        task.pc -= 1;
                        task.index = task.index.wrapping_sub(1);
                        task.attempt += 1;
                    } else {
                        task.attempt = 0;
                    }
                }
            }
            Strand::Service => {
                let latency = self.wiring.rack.processors[p as usize].interrupt_ns;
                let Some(service) = &mut self.processors[p as usize].service else {
                    return;
                };
                match service.step {
                    // nobody got through: the request is still there and is taken up again
                    Step::Acknowledge(_) if service.line.is_none() || status != Status::Ok => {
                        self.processors[p as usize].service = None;
                    }
                    Step::Acknowledge(_) => {
                        service.step = Step::Latency;
                        service.remaining = latency;
                    }
                    Step::Latency | Step::Release => {}
                }
            }
        }
    }

    /// The write buffer is empty again; a failed write becomes an interrupt.
    pub(super) fn buffer_emptied(&mut self, p: u16, status: Status) {
        let processor = &mut self.processors[p as usize];
        processor.buffer_full = false;
        if status != Status::Ok {
            processor.posted_errors += 1;
            self.counters.posted_errors += 1;
        }
        if let Some((_, Stall::Buffer, _)) = processor.stalled {
            let due = self.wiring.processor(p);
            self.agenda.set(due, self.now);
        } else if status != Status::Ok {
            self.reschedule(p);
        }
    }

    /// A polling task looks, or waits until it looks again.
    fn poll(&mut self, p: u16, t: u16) -> Next {
        let Release::Poll(poll) = &self.wiring.rack.tasks[t as usize].release else {
            return Next::Waits;
        };
        let task = &mut self.tasks[t as usize];
        let State::Polling { looked, event } = task.state else {
            return Next::Goes;
        };
        if let Some(event) = event {
            self.start(t, event, self.now);
            return Next::Goes;
        }
        task.state = State::Polling { looked: !looked, event: None };
        if looked && poll.interval_ns > 0 {
            task.remaining = poll.interval_ns;
            return Next::Goes;
        }
        task.state = State::Polling { looked: true, event: None };
        let access = Access { am: poll.am, addr: poll.addr, width: poll.width, dir: Direction::Read, n: 1 };
        let transfer = asked(Origin::Poll, t, self.wiring.processors[p as usize].0, access, self.now);
        self.send_out(p, Strand::Task(t), transfer);
        Next::Waits
    }

    /// The status register is sampled for a polling task.
    pub(super) fn look(&mut self, t: u16) {
        let Some(i) = self.wiring.polls[t as usize] else {
            return;
        };
        let line = &mut self.lines[i as usize];
        if line.pending {
            line.pending = false;
            let event = Some(line.event);
            if let State::Polling { looked, .. } = self.tasks[t as usize].state {
                self.tasks[t as usize].state = State::Polling { looked, event };
            }
        }
    }
}

/// Link time of a workstation's access on the way in and out.
fn link_ns(spec: &crate::adaptor::Adaptor, transfer: &Transfer) -> (Ns, Ns) {
    let both = if transfer.access.awaits_data() { spec.link_read_ns } else { spec.link_write_ns };
    (both / 2, both - both / 2)
}
