//! The bus in the timing plane: requests, ownership, bursts, and what the end of a transfer causes.

use super::{Sink, Timing, Wiring};
use crate::Ns;
use crate::cycle::Plan;
use crate::fault::FaultKind;
use crate::interrupt;
use crate::program::{Access, Direction, Origin, Status, Transfer, Width};
use crate::requester::{Client, Pending, ReleasePolicy};

/// What the data transfer bus is doing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Phase {
    /// Nothing; an owner may have kept BBSY*.
    Free,
    /// A burst that is not the access's last runs until the bus is due.
    Burst { cycles: u32 },
    /// Between two bursts of the owner's access.
    Boundary,
    /// The last burst: data (or BERR*) when the bus is due, free at `done`.
    Last { done: Ns, status: Status },
    /// The last handshake ends when the bus is due.
    Finishing,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Bus {
    pub owner: Option<u16>,
    pub phase: Phase,
}

/// An access of processor or generator, before the bus has seen it.
pub(super) fn pending(transfer: Transfer, client: Client, pace_ns: Ns) -> Pending {
    let plan = Plan { slave: None, good: 0, fails: true, bytes: 1, answer_ns: 0, block: false };
    Pending { transfer, client, plan, cycles_done: 0, begun: false, pace_ns }
}

/// A transfer that has been asked for and nothing more.
pub(super) fn asked(origin: Origin, task: u16, master: u16, access: Access, now: Ns) -> Transfer {
    Transfer {
        task,
        job: 0,
        index: 0,
        access,
        slave: None,
        requested: now,
        granted: now,
        data_at: now,
        done: now,
        status: Status::Ok,
        origin,
        master,
        held_ns: 0,
        posted: false,
        attempt: 0,
    }
}

/// The interrupt acknowledge cycle of this level.
pub(super) fn iack(level: u8) -> Access {
    Access { am: 0, addr: u32::from(level) << 1, width: Width::D8, dir: Direction::Read, n: 1 }
}

impl Timing {
    /// Gives a transfer to its master's requester.
    pub(super) fn enqueue(&mut self, pending: Pending) {
        let m = pending.transfer.master;
        let queue = &mut self.masters[m as usize].queue;
        queue.push(pending);
        if queue.len() == 1 {
            self.ask(m);
        }
    }

    /// Drives BR* for the first transfer of the queue.
    fn ask(&mut self, m: u16) {
        let timer = self.wiring.access_timer(m);
        self.agenda.set(timer, self.now.saturating_add(self.wiring.rack.bus.access_timer_ns));
        if self.faults.holds(self.now, FaultKind::Starvation(m)).is_none() {
            self.arbiter.request(self.masters[m as usize].place);
            self.wake_arbiter();
        }
    }

    /// Lets the arbiter look at the end of this instant, if the bus can change hands.
    pub(super) fn wake_arbiter(&mut self) {
        if matches!(self.bus.phase, Phase::Free | Phase::Boundary) {
            let arbiter = self.wiring.arbiter();
            self.agenda.set(arbiter, self.now);
        }
    }

    /// The arbiter and the owner's requester settle who has the bus from now on.
    pub(super) fn arbitrate(&mut self) {
        let arbiter = self.wiring.arbiter();
        self.agenda.set(arbiter, Ns::MAX);
        if self.faults.holds(self.now, FaultKind::StuckBus).is_some() {
            return;
        }
        if let Some(owner) = self.bus.owner {
            let requester = &self.masters[owner as usize];
            let place = requester.place;
            let between_bursts = matches!(self.bus.phase, Phase::Boundary);
            let keeps = match requester.release {
                ReleasePolicy::OnRequest => !self.arbiter.requested_by_others(place),
                ReleasePolicy::WhenDone => between_bursts,
                ReleasePolicy::OnBclr => between_bursts && !self.arbiter.bclr(place),
            };
            if keeps {
                if between_bursts || self.arbiter.requests(place) {
                    self.arbiter.withdraw(place);
                    self.begin(owner, self.now);
                }
                return;
            }
            self.bus.owner = None;
            self.bus.phase = Phase::Free;
            if between_bursts {
                self.ask(owner);
                self.agenda.set(arbiter, Ns::MAX);
            }
        }
        if let Some(place) = self.arbiter.grant() {
            let master = self.wiring.master_in_slot[place.slot as usize];
            self.bus.owner = Some(master);
            self.begin(master, self.now + self.wiring.arbitration_ns(place.slot));
        }
    }

    /// The next burst of the owner's first transfer begins at `granted`.
    fn begin(&mut self, m: u16, granted: Ns) {
        let timer = self.wiring.access_timer(m);
        self.agenda.set(timer, Ns::MAX);
        let first = self.masters[m as usize].queue[0];
        if !first.begun {
            let plan = self.plan(&first);
            let head = &mut self.masters[m as usize].queue[0];
            head.begun = true;
            head.plan = plan;
            head.transfer.granted = granted;
            head.transfer.slave = plan.slave;
        }
        let head = &mut self.masters[m as usize].queue[0];
        let burst = head.plan.burst(&self.wiring.rack.bus, head.transfer.access.addr, head.cycles_done, head.pace_ns);
        head.transfer.held_ns += granted + burst.done_ns - self.now;
        if burst.last {
            self.bus.phase = Phase::Last { done: granted + burst.done_ns, status: burst.status };
            self.agenda.set(Wiring::BUS, granted + burst.data_ns);
        } else {
            self.bus.phase = Phase::Burst { cycles: burst.cycles };
            self.agenda.set(Wiring::BUS, granted + burst.done_ns);
        }
    }

    /// How the cycles of this transfer go, as things stand now.
    fn plan(&mut self, pending: &Pending) -> Plan {
        let transfer = &pending.transfer;
        if transfer.origin == Origin::Iack {
            let answer_ns = self.acknowledge(pending);
            return Plan { slave: None, good: 1, fails: false, bytes: 1, answer_ns, block: false };
        }
        let splits = match pending.client {
            Client::Processor(p) | Client::WriteBuffer(p) => self.wiring.rack.processors[p as usize].splits_width,
            Client::Traffic(_) => false,
        };
        let mut plan = self.wiring.plan(&transfer.access, splits);
        if let Some(slave) = plan.slave.filter(|_| !transfer.access.is_address_only()) {
            let dead = self.faults.holds(self.now, FaultKind::NoSlave(slave)).is_some();
            let cut = self.wiring.slaves[slave as usize].1.is_some_and(|adaptor| !self.link_up(adaptor));
            if dead || cut {
                plan.good = 0;
                plan.fails = true;
            }
        }
        plan
    }

    /// Whether the owner's first transfer goes over a link that fails its parity check.
    fn parity_fails(&self, owner: u16) -> bool {
        if self.faults.faults.is_empty() {
            return false;
        }
        let head = &self.masters[owner as usize].queue[0];
        let carrier = match head.client {
            Client::Processor(p) | Client::WriteBuffer(p) => self.wiring.processors[p as usize].1,
            Client::Traffic(g) => self.wiring.traffic[g as usize].1,
        };
        let window = head.transfer.slave.and_then(|slave| self.wiring.slaves[slave as usize].1);
        let fails = |adaptor: u16| self.faults.holds(self.now, FaultKind::Parity(adaptor)).is_some();
        [carrier, window].into_iter().flatten().any(fails)
    }

    /// Whether the adaptor's cable is plugged in.
    pub fn link_up(&self, adaptor: u16) -> bool {
        self.wiring.rack.adaptors[adaptor as usize].link
            && self.faults.holds(self.now, FaultKind::CableOut(adaptor)).is_none()
    }

    /// The IACK daisy chain finds the interrupter that answers; the time until it does.
    fn acknowledge(&mut self, pending: &Pending) -> Ns {
        let Client::Processor(p) = pending.client else {
            return 0;
        };
        let level = (pending.transfer.access.addr >> 1) as u8;
        let (wiring, lines) = (&self.wiring, &self.lines);
        let requests = wiring
            .irqs
            .iter()
            .zip(&wiring.rack.interrupters)
            .enumerate()
            .filter(|(i, (wire, spec))| lines[*i].pending && wire.handler == p && !wire.polled && !spec.local)
            .map(|(i, (wire, spec))| (i, spec.level, wire.slot));
        let Some(found) = interrupt::acknowledged(level, requests) else {
            return 0;
        };
        if let Some(service) = &mut self.processors[p as usize].service {
            service.line = Some(found as u16);
        }
        let slots = Ns::from(wiring.irqs[found].slot.saturating_sub(1));
        wiring.rack.interrupters[found].answer_ns + slots * wiring.rack.bus.chain_ns
    }

    /// The bus is due: the phase that ran is over.
    pub(super) fn bus_event(&mut self, sink: &mut impl Sink) {
        self.agenda.set(Wiring::BUS, Ns::MAX);
        let Some(owner) = self.bus.owner else { return };
        match self.bus.phase {
            Phase::Free | Phase::Boundary => {}
            Phase::Burst { cycles } => {
                self.masters[owner as usize].queue[0].cycles_done += cycles;
                self.bus.phase = Phase::Boundary;
                self.wake_arbiter();
            }
            Phase::Last { done, mut status } => {
                if status == Status::Ok && self.parity_fails(owner) {
                    status = Status::BusError;
                    self.counters.parity_errors += 1;
                }
                let head = &mut self.masters[owner as usize].queue[0];
                head.transfer.data_at = self.now;
                head.transfer.done = done;
                head.transfer.status = status;
                let (transfer, client) = (head.transfer, head.client);
                self.bus.phase = Phase::Finishing;
                self.agenda.set(Wiring::BUS, done);
                self.data_moved(&transfer, client);
                sink.transfer(&transfer);
            }
            Phase::Finishing => {
                self.bus.phase = Phase::Free;
                let requester = &mut self.masters[owner as usize];
                if requester.release != ReleasePolicy::OnRequest {
                    self.bus.owner = None;
                }
                let ended = requester.queue.remove(0);
                let again = self.repeated(&ended);
                let queue = &mut self.masters[owner as usize].queue;
                if let Some(again) = again {
                    queue.insert(0, again);
                }
                if !queue.is_empty() {
                    self.ask(owner);
                }
                self.wake_arbiter();
                if again.is_none() {
                    self.ended(ended.client, &ended.transfer);
                }
            }
        }
    }

    /// The same access once more, where a fault repeats it; its client waits for both.
    fn repeated(&self, ended: &Pending) -> Option<Pending> {
        let transfer = &ended.transfer;
        if self.faults.faults.is_empty() || transfer.origin != Origin::Program || transfer.status != Status::Ok {
            return None;
        }
        let kind = match transfer.access.dir {
            Direction::Read => FaultKind::RepeatedRead(transfer.slave?),
            Direction::Write => FaultKind::RepeatedWrite(transfer.task),
        };
        self.faults.holds(self.now, kind)?;
        let again = Transfer { requested: self.now, held_ns: 0, origin: Origin::Repeat, ..*transfer };
        Some(pending(again, ended.client, ended.pace_ns))
    }

    /// What the instant of the data causes beside the data.
    fn data_moved(&mut self, transfer: &Transfer, client: Client) {
        if transfer.status != Status::Ok {
            self.counters.bus_errors += 1;
            return;
        }
        let noticed = transfer.access.dir == Direction::Write || transfer.access.is_address_only();
        if let Some(line) = transfer.slave.filter(|_| noticed).and_then(|slave| self.wiring.slaves[slave as usize].0) {
            self.raise(line);
        }
        let Client::Processor(p) = client else { return };
        match transfer.origin {
            Origin::Poll => self.look(transfer.task),
            Origin::Iack => self.answered(p),
            _ => {}
        }
    }

    /// The access timer: the master was not granted the bus and gives up.
    pub(super) fn access_timeout(&mut self, m: u16, sink: &mut impl Sink) {
        let timer = self.wiring.access_timer(m);
        self.agenda.set(timer, Ns::MAX);
        let requester = &mut self.masters[m as usize];
        self.arbiter.withdraw(requester.place);
        let mut ended = requester.queue.remove(0);
        let more = !requester.queue.is_empty();
        ended.transfer.status = Status::AccessTimeout;
        if !ended.begun {
            ended.transfer.granted = self.now;
        }
        ended.transfer.data_at = self.now;
        ended.transfer.done = self.now;
        self.counters.access_timeouts += 1;
        sink.transfer(&ended.transfer);
        if more {
            self.ask(m);
        }
        self.ended(ended.client, &ended.transfer);
    }

    /// Tells whoever waited for the transfer.
    fn ended(&mut self, client: Client, transfer: &Transfer) {
        match client {
            Client::Processor(p) => self.access_ended(p, transfer),
            Client::WriteBuffer(p) => self.buffer_emptied(p, transfer.status),
            Client::Traffic(g) => self.traffic_ended(g),
        }
    }

    /// A generator's event: its request arrives, or its DMA engine is set up.
    pub(super) fn traffic_event(&mut self, g: u16, sink: &mut impl Sink) {
        let due = self.wiring.traffic(g);
        let (master, adaptor) = self.wiring.traffic[g as usize];
        let spec = &self.wiring.rack.traffic[g as usize];
        let access = spec.access();
        let generator = &mut self.generators[g as usize];
        let arrival = generator.arrivals.next();
        let mut pace_ns = 0;
        let mut requested = arrival;
        if let Some(adaptor) = adaptor {
            let spec = &self.wiring.rack.adaptors[adaptor as usize];
            if !generator.set_up {
                generator.set_up = true;
                self.agenda.set(due, self.now + spec.dma_setup_ns);
                return;
            }
            generator.set_up = false;
            pace_ns = spec.pace_ns(access.width.bytes());
            requested = self.now;
            if !self.link_up(adaptor) || !self.wiring.rack.adaptors[adaptor as usize].reaches(&access) {
                let mut refused = asked(Origin::Traffic, g, master, access, self.now);
                refused.status = Status::BusError;
                self.counters.bus_errors += 1;
                sink.transfer(&refused);
                self.traffic_ended(g);
                return;
            }
        }
        self.agenda.set(due, Ns::MAX);
        let mut transfer = asked(Origin::Traffic, g, master, access, requested);
        let generator = &mut self.generators[g as usize];
        transfer.job = generator.count;
        generator.count = generator.count.wrapping_add(1);
        self.enqueue(pending(transfer, Client::Traffic(g), pace_ns));
    }

    /// The generator's next request arrives, or has long been waiting.
    fn traffic_ended(&mut self, g: u16) {
        let due = self.wiring.traffic(g);
        let arrivals = &mut self.generators[g as usize].arrivals;
        arrivals.advance();
        self.agenda.set(due, arrivals.next().max(self.now));
    }
}
