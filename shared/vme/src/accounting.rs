//! What was observed: use of the bus by each master, waits and services, and where the time from a
//! sensor's value to the actuator went.
//!
//! All times here are simulated ones. [`Ledger`] is a [`Sink`]: give it to [`Timing::advance`] beside
//! or in place of the list of transfers.
//!
//! [`Timing::advance`]: crate::Timing::advance

use crate::Ns;
use crate::program::{Status, Transfer};
use crate::timing::{JobRecord, Sink};
use hdrhistogram::Histogram;

/// Longest time that the histograms tell apart; longer ones count as this.
const LONGEST: Ns = crate::SECOND;

/// Use of the bus by one master.
#[derive(Clone, Debug)]
pub struct MasterUse {
    /// Transfers that ended, however.
    pub transfers: u64,
    /// Transfers that ended in BERR*.
    pub bus_errors: u64,
    /// Requests given up by the access timer.
    pub access_timeouts: u64,
    /// Time for which it kept the bus from others, arbitration included.
    pub held_ns: Ns,
    /// Request to grant.
    pub wait: Histogram<u64>,
    /// Grant to the free bus.
    pub service: Histogram<u64>,
}

impl MasterUse {
    fn new() -> MasterUse {
        let histogram =
            || Histogram::new_with_max(LONGEST, 3).unwrap_or_else(|error| unreachable!("constant bounds: {error}"));
        MasterUse {
            transfers: 0,
            bus_errors: 0,
            access_timeouts: 0,
            held_ns: 0,
            wait: histogram(),
            service: histogram(),
        }
    }

    /// Part of `elapsed_ns` for which it kept the bus.
    pub fn utilisation(&self, elapsed_ns: Ns) -> f64 {
        if elapsed_ns == 0 { 0.0 } else { self.held_ns as f64 / elapsed_ns as f64 }
    }
}

/// Use of the bus by every master, as [`crate::Timing::master_name`] counts them.
#[derive(Clone, Debug)]
pub struct Ledger {
    /// For each master.
    pub masters: Vec<MasterUse>,
}

impl Ledger {
    /// An empty ledger of this many masters.
    pub fn new(masters: usize) -> Ledger {
        Ledger { masters: (0..masters).map(|_| MasterUse::new()).collect() }
    }
}

impl Sink for Ledger {
    fn transfer(&mut self, transfer: &Transfer) {
        let Some(master) = self.masters.get_mut(transfer.master as usize) else {
            return;
        };
        master.transfers += 1;
        master.held_ns += transfer.held_ns;
        match transfer.status {
            Status::Ok => {}
            Status::BusError => master.bus_errors += 1,
            Status::AccessTimeout => {
                // it was never served: no wait and no service to speak of
                master.access_timeouts += 1;
                return;
            }
        }
        master.wait.saturating_record(transfer.granted - transfer.requested);
        master.service.saturating_record(transfer.done - transfer.granted);
    }
}

/// A part of the way from sensor to actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The sensor's filter: from what was felt to the value in the register.
    Filter,
    /// The value lies in the card's register until a task asks for it.
    Card,
    /// From the request of the read to its grant.
    Arbitration,
    /// From the grant of the read to its data.
    Transfer,
    /// The processor is there for others, or for other transfers of the job.
    WaitForTask,
    /// The job executes.
    Execution,
    /// From the request of the write to the change of the actuator's register.
    Write,
}

/// Where the time from a sensor's value to the actuator went: parts without gap or overlap.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Waterfall {
    /// The parts in the order in which they begin, with begin and end.
    pub parts: Vec<(Part, Ns, Ns)>,
}

/// A stamp came before the one that causes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{part:?} would end at {end} ns, before it begins at {begin} ns")]
pub struct OutOfOrder {
    /// The part that would be negative.
    pub part: Part,
    /// Its begin.
    pub begin: Ns,
    /// Its end.
    pub end: Ns,
}

impl Waterfall {
    /// From a value felt at `felt` and published by the card at `published`, through the transfer
    /// that read it.
    pub fn begin(felt: Ns, published: Ns, read: &Transfer) -> Result<Waterfall, OutOfOrder> {
        let mut waterfall = Waterfall { parts: Vec::with_capacity(10) };
        waterfall.push(Part::Filter, felt, published)?;
        waterfall.until(Part::Card, read.requested)?;
        waterfall.until(Part::Arbitration, read.granted)?;
        waterfall.until(Part::Transfer, read.data_at)?;
        Ok(waterfall)
    }

    /// On through the job that used the value, and the transfer that handed its result to another card.
    pub fn hand_over(mut self, job: &JobRecord, block: &Transfer) -> Result<Waterfall, OutOfOrder> {
        self.compute(job, block.requested)?;
        self.until(Part::Arbitration, block.granted)?;
        self.until(Part::Transfer, block.data_at)?;
        Ok(self)
    }

    /// On through the job that used the value, to the write that it led to.
    pub fn write(mut self, job: &JobRecord, write: &Transfer) -> Result<Waterfall, OutOfOrder> {
        self.compute(job, write.requested)?;
        self.until(Part::Write, write.data_at)?;
        Ok(self)
    }

    /// Up to `end` the job either executes or waits; its execution is counted last, at most as much as
    /// fits.
    fn compute(&mut self, job: &JobRecord, end: Ns) -> Result<(), OutOfOrder> {
        let between = end.saturating_sub(self.reached());
        let execution = job.execution_ns - job.entry_ns;
        self.until(Part::WaitForTask, end - execution.min(between))?;
        self.until(Part::Execution, end)
    }

    fn until(&mut self, part: Part, end: Ns) -> Result<(), OutOfOrder> {
        self.push(part, self.reached(), end)
    }

    fn push(&mut self, part: Part, begin: Ns, end: Ns) -> Result<(), OutOfOrder> {
        if end < begin {
            return Err(OutOfOrder { part, begin, end });
        }
        self.parts.push((part, begin, end));
        Ok(())
    }

    /// Last stamp so far.
    pub fn reached(&self) -> Ns {
        self.parts.last().map_or(0, |&(_, _, end)| end)
    }

    /// Time of one part.
    pub fn time(&self, part: Part) -> Ns {
        self.parts.iter().filter(|(of, ..)| *of == part).map(|(_, begin, end)| end - begin).sum()
    }

    /// From the first stamp to the last one.
    pub fn whole(&self) -> Ns {
        match (self.parts.first(), self.parts.last()) {
            (Some(first), Some(last)) => last.2 - first.1,
            _ => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rack::{Rack, Slave, Task};
    use crate::{Access, Direction, Log, Op, Timing, Width};

    fn log() -> (Log, usize) {
        let slave = Slave {
            name: "card".into(),
            slot: 4,
            am: 0x39,
            base: 0x1000,
            size: 0x100,
            width: Width::D16,
            read_ns: 500,
            write_ns: 400,
            ..Slave::default()
        };
        let task =
            |name: &str| Task { name: name.into(), processor: name.into(), period_ns: 100_000, ..Task::default() };
        let rack = Rack { slaves: vec![slave], tasks: vec![task("a"), task("b")], ..Rack::default() };
        let mut timing = Timing::new(rack).unwrap();
        let access = |dir| Op::Access(Access { am: 0x39, addr: 0x1000, width: Width::D16, dir, n: 1 });
        for t in 0..2 {
            timing.set_program(t, &[access(Direction::Read), Op::Exec(20_000), access(Direction::Write)]);
        }
        let mut log = Log::default();
        timing.advance(90_000, &mut log);
        (log, timing.masters())
    }

    #[test]
    fn the_parts_of_a_waterfall_add_up_to_the_whole_to_the_nanosecond() {
        let (log, _) = log();
        let of = |dir| *log.transfers.iter().find(|t| t.task == 1 && t.access.dir == dir).unwrap();
        let (mut read, mut write) = (of(Direction::Read), of(Direction::Write));
        for transfer in [&mut read, &mut write] {
            (transfer.requested, transfer.granted) = (transfer.requested + 1_000, transfer.granted + 1_000);
            transfer.data_at += 1_000;
        }
        let job = *log.jobs.iter().find(|job| job.task == 1).unwrap();
        let waterfall = Waterfall::begin(100, 700, &read).and_then(|way| way.write(&job, &write)).unwrap();
        let sum: Ns = waterfall.parts.iter().map(|(_, begin, end)| end - begin).sum();
        assert_eq!(sum, write.data_at - 100);
        assert_eq!(waterfall.whole(), sum);
        assert_eq!(waterfall.time(Part::Filter), 600);
        assert_eq!(waterfall.time(Part::Execution), 20_000);
        // the rest of the handshake and the read's stall
        assert_eq!(waterfall.time(Part::WaitForTask), 100 + 300);
        assert_eq!(waterfall.time(Part::Arbitration), read.granted - read.requested);
        assert!(Waterfall::begin(100, 99, &read).is_err());
    }

    #[test]
    fn a_ledger_splits_each_masters_time_into_wait_and_service() {
        let (log, masters) = log();
        let mut ledger = Ledger::new(masters);
        log.transfers.iter().for_each(|transfer| ledger.transfer(transfer));
        let held: Ns = ledger.masters.iter().map(|master| master.held_ns).sum();
        assert_eq!(held, log.transfers.iter().map(|t| t.held_ns).sum::<Ns>());
        assert_eq!(ledger.masters[0].transfers, 2);
        // card a is nearer: it waits for its arbitration only, b for a's whole tenure too
        assert_eq!(ledger.masters[0].wait.max(), 300);
        assert_eq!(ledger.masters[1].wait.max(), 300 + 635 + 330);
        assert!((ledger.masters[0].utilisation(2 * ledger.masters[0].held_ns) - 0.5).abs() < 1e-12);
    }
}
