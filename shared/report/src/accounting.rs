//! What a run made of the bus and the processors: use by each master, ages of the sensors' values at the decision, and
//! where the time from what the force sensor felt to the D/A's change went.
//!
//! All times are simulated. [`Accounting`] hears what happened window by window and closes into a [`BusAccount`]. A job
//! whose read or write failed has no way from sensor to actuator and is left out of it.

use crate::ledger::PathLatency;
use hdrhistogram::Histogram;
use scenario::{ForceFilter, Scenario};
use serde::Serialize;
use vme::accounting::{self, Part, Waterfall};
use vme::analysis::Bounds;
use vme::{Direction, JobRecord, Log, Ns, Op, Origin, RackError, Sink, Status, Timing, Transfer};

/// Period of the force sensor's samples, 8 kHz.
const SAMPLE_NS: Ns = 125 * vme::MICROSECOND;
/// The last D/A card written in a job: the arm has its torques then.
const LAST_ACTUATOR: &str = "da-2";
const FORCE_SENSOR: &str = "force-sensor";
/// Histograms count in powers of two from here.
const FIRST_BUCKET_NS: u64 = 128;

/// Use of the bus by one master.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MasterAccount {
    /// Name of the card.
    pub name: String,
    /// Transfers that ended, however.
    pub transfers: u64,
    /// Part of the time for which it kept the bus from others.
    pub utilisation: f64,
    /// Request to grant.
    pub wait: Spread,
    /// Grant to the free bus.
    pub service: Spread,
    /// Transfers that ended in BERR*.
    pub bus_errors: u64,
    /// Requests given up by the access timer.
    pub access_timeouts: u64,
}

/// A distribution of times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Mean, ns.
    pub mean_ns: f64,
    /// 99 of 100 are at most this long.
    pub p99_ns: u64,
    /// Greatest.
    pub max_ns: u64,
    /// Upper bound of each bucket that is not empty, and how many fell into it.
    pub histogram: Vec<(u64, u64)>,
}

/// One task, its observed maxima beside their bounds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskAccount {
    /// Name of the task.
    pub name: String,
    /// Jobs that ended.
    pub jobs: u64,
    /// Releases lost because the job before still ran.
    pub lost_releases: u32,
    /// Accesses in a job, on the average.
    pub accesses_per_job: f64,
    /// Time for which a job keeps the bus, on the average.
    pub bus_per_job_ns: f64,
    /// Longest access observed, from the request to the free bus.
    pub access_max_ns: Ns,
    /// Bound of that; `None`: none is known.
    pub access_bound_ns: Option<Ns>,
    /// Longest job observed, from its release to its end.
    pub response_max_ns: Ns,
    /// Bound of that; `None`: none is known.
    pub response_bound_ns: Option<Ns>,
}

/// The way from what the force sensor felt to the last D/A's change, over all jobs of the control task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WaterfallAccount {
    /// Jobs counted.
    pub jobs: u64,
    /// Parts in their order.
    pub parts: Vec<PartAccount>,
    /// Sum of the whole, from first and last stamp alone.
    pub whole_sum_ns: Ns,
    /// Longest whole.
    pub whole_max_ns: Ns,
}

/// One part of the way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartAccount {
    /// Which.
    pub part: Part,
    /// Sum over all jobs; over all parts it is the sum of the whole.
    pub sum_ns: Ns,
    /// In the job whose whole was longest.
    pub in_longest_ns: Ns,
}

/// The whole account.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BusAccount {
    /// Simulated time.
    pub elapsed_ns: Ns,
    /// Part of it for which somebody kept the bus.
    pub utilisation: f64,
    /// Every master.
    pub masters: Vec<MasterAccount>,
    /// Every task.
    pub tasks: Vec<TaskAccount>,
    /// Ages at the control task's decisions, by card: since the register was sampled, and of the force sensor since its
    /// filter published and since it was felt.
    pub ages: Vec<PathLatency>,
    /// The way from sensor to actuator.
    pub waterfall: WaterfallAccount,
    /// Transfers that ended in BERR*.
    pub bus_errors: u32,
    /// Requests given up by the access timer.
    pub access_timeouts: u32,
    /// Posted writes whose failure arrived late.
    pub posted_errors: u32,
    /// Interrupts taken up by a processor.
    pub interrupts: u32,
    /// Events hidden behind a pending request of the same interrupter.
    pub merged_interrupts: u32,
    /// Looks of polling tasks.
    pub polls: u64,
}

/// Collects an account while a run goes on.
#[derive(Debug)]
pub struct Accounting {
    ledger: accounting::Ledger,
    tasks: Vec<TaskUse>,
    control: Option<u16>,
    cards: Vec<String>,
    filter: Filter,
    /// Job of the control task under way.
    job: ControlJob,
    /// Ages by card, then the force sensor's since publication and since it was felt.
    ages: Vec<Histogram<u64>>,
    waterfall: WaterfallAccount,
    polls: u64,
}

#[derive(Clone, Debug, Default)]
struct TaskUse {
    jobs: u64,
    accesses: u64,
    held_ns: Ns,
    access_max_ns: Ns,
    response_max_ns: Ns,
}

#[derive(Clone, Debug, Default)]
struct ControlJob {
    number: u32,
    reads: Vec<(u16, Ns)>,
    force: Option<Transfer>,
    actuator: Option<Transfer>,
}

/// When the force sensor's values come out, and how late they are then.
#[derive(Clone, Copy, Debug)]
struct Filter {
    period_ns: Ns,
    delay_ns: Ns,
}

impl Filter {
    /// Filter n publishes every 4ⁿ samples and delays by 12 inputs of each of its stages: 12·(4ⁿ − 1)/3 samples.
    fn of(scenario: &Scenario) -> Filter {
        match scenario.force_sensor_if.filter {
            ForceFilter::DelayMs(ms) => Filter { period_ns: SAMPLE_NS, delay_ns: scenario::nanoseconds(ms * 1e-3) },
            ForceFilter::Cascade(n) => {
                let decimation = 4u64.pow(n.into());
                Filter { period_ns: decimation * SAMPLE_NS, delay_ns: 4 * (decimation - 1) * SAMPLE_NS }
            }
        }
    }

    /// Felt and published, of the value that a register shows at `t`; none before the first whole delay.
    fn stamps(&self, t: Ns) -> Option<(Ns, Ns)> {
        let published = t / self.period_ns * self.period_ns;
        Some((published.checked_sub(self.delay_ns)?, published))
    }
}

impl Accounting {
    /// An empty account over the scenario's rack; the error says what is wrong with the rack.
    pub fn new(scenario: &Scenario) -> Result<Accounting, RackError> {
        let timing = Timing::new(scenario.rack.clone())?;
        let cards: Vec<String> = scenario.rack.slaves.iter().map(|slave| slave.name.clone()).collect();
        let parts = [
            Part::Filter,
            Part::Card,
            Part::Arbitration,
            Part::Transfer,
            Part::WaitForTask,
            Part::Execution,
            Part::Write,
        ];
        Ok(Accounting {
            ledger: accounting::Ledger::new(timing.masters()),
            tasks: vec![TaskUse::default(); scenario.rack.tasks.len()],
            control: scenario.task_of("control_computer"),
            ages: (0..cards.len() + 2).map(|_| crate::ledger::histogram()).collect(),
            cards,
            filter: Filter::of(scenario),
            job: ControlJob { reads: Vec::with_capacity(64), ..ControlJob::default() },
            waterfall: WaterfallAccount {
                jobs: 0,
                parts: parts.map(|part| PartAccount { part, sum_ns: 0, in_longest_ns: 0 }).to_vec(),
                whole_sum_ns: 0,
                whole_max_ns: 0,
            },
            polls: 0,
        })
    }

    /// Adds a window.
    pub fn window(&mut self, log: &Log) {
        let mut jobs = log.jobs.iter().peekable();
        for transfer in &log.transfers {
            // a window can hold the end of one job and the reads of the next
            while let Some(job) = jobs.next_if(|job| job.end <= transfer.data_at) {
                self.job(job);
            }
            self.transfer(transfer);
        }
        jobs.for_each(|job| self.job(job));
    }

    fn transfer(&mut self, transfer: &Transfer) {
        self.ledger.transfer(transfer);
        self.polls += u64::from(transfer.origin == Origin::Poll);
        if transfer.origin != Origin::Program {
            return;
        }
        if let Some(task) = self.tasks.get_mut(usize::from(transfer.task)) {
            task.accesses += 1;
            task.held_ns += transfer.held_ns;
            task.access_max_ns = task.access_max_ns.max(transfer.done - transfer.requested);
        }
        let Some(slave) = transfer.slave.filter(|_| Some(transfer.task) == self.control) else { return };
        if transfer.job != self.job.number {
            self.job.reads.clear();
            (self.job.number, self.job.force, self.job.actuator) = (transfer.job, None, None);
        }
        if transfer.status != Status::Ok {
            return;
        }
        let card = self.cards[usize::from(slave)].as_str();
        if transfer.access.dir == Direction::Read {
            self.job.reads.push((slave, transfer.data_at));
            if card == FORCE_SENSOR {
                self.job.force.get_or_insert(*transfer);
            }
        } else if card == LAST_ACTUATOR {
            self.job.actuator = Some(*transfer);
        }
    }

    fn job(&mut self, record: &JobRecord) {
        if let Some(task) = self.tasks.get_mut(usize::from(record.task)) {
            task.jobs += 1;
            task.response_max_ns = task.response_max_ns.max(record.end - record.release);
        }
        if Some(record.task) != self.control || record.job != self.job.number {
            return;
        }
        let Some(decide) = record.decide else { return };
        for &(slave, data_at) in &self.job.reads {
            // in real time a reading may have been told for a later instant than the decision then had
            let Some(age) = decide.checked_sub(data_at) else { continue };
            self.ages[usize::from(slave)].saturating_record(age);
        }
        let Some(read) = self.job.force.take() else { return };
        let Some((felt, published)) = self.filter.stamps(read.data_at).filter(|(_, published)| *published <= decide) else {
            return;
        };
        let [.., since_published, since_felt] = self.ages.as_mut_slice() else { return };
        since_published.saturating_record(decide - published);
        since_felt.saturating_record(decide - felt);
        let Some(write) = self.job.actuator.take() else { return };
        // a value published between the request and the data has waited on the card for less than nothing
        if let Ok(waterfall) = Waterfall::new(felt, published.min(read.requested), &read, record, &write) {
            self.waterfall.add(&waterfall);
        }
    }

    /// The account up to where `timing` stands. `programs` holds the longest job of each task, for the bounds.
    pub fn close(&self, timing: &Timing, programs: &[Vec<Op>]) -> BusAccount {
        let elapsed_ns = timing.now();
        let bounds: Bounds = vme::analysis::bounds(timing, programs);
        let masters: Vec<MasterAccount> = (0..)
            .zip(&self.ledger.masters)
            .map(|(i, used)| MasterAccount {
                name: timing.master_name(i).unwrap_or_default().to_owned(),
                transfers: used.transfers,
                utilisation: used.utilisation(elapsed_ns),
                wait: Spread::of(&used.wait),
                service: Spread::of(&used.service),
                bus_errors: used.bus_errors,
                access_timeouts: used.access_timeouts,
            })
            .collect();
        let tasks = (0..)
            .zip(&self.tasks)
            .zip(&timing.rack().tasks)
            .map(|((i, used), task)| TaskAccount {
                name: task.name.clone(),
                jobs: used.jobs,
                lost_releases: timing.skipped(i),
                accesses_per_job: used.accesses as f64 / used.jobs.max(1) as f64,
                bus_per_job_ns: used.held_ns as f64 / used.jobs.max(1) as f64,
                access_max_ns: used.access_max_ns,
                access_bound_ns: bounds.access[usize::from(i)],
                response_max_ns: used.response_max_ns,
                response_bound_ns: bounds.response[usize::from(i)],
            })
            .collect();
        let names = self.cards.iter().cloned();
        let names = names.chain(["force-sensor, since published".into(), "force-sensor, since felt".into()]);
        let counters = timing.counters();
        BusAccount {
            elapsed_ns,
            utilisation: masters.iter().map(|master| master.utilisation).sum(),
            masters,
            tasks,
            ages: names
                .zip(&self.ages)
                .filter(|(_, ages)| !ages.is_empty())
                .map(|(name, ages)| PathLatency::of(name, ages))
                .collect(),
            waterfall: self.waterfall.clone(),
            bus_errors: counters.bus_errors,
            access_timeouts: counters.access_timeouts,
            posted_errors: counters.posted_errors,
            interrupts: counters.interrupts,
            merged_interrupts: counters.merged_interrupts,
            polls: self.polls,
        }
    }
}

impl WaterfallAccount {
    fn add(&mut self, waterfall: &Waterfall) {
        let longest = waterfall.whole() > self.whole_max_ns;
        self.jobs += 1;
        self.whole_sum_ns += waterfall.whole();
        self.whole_max_ns = self.whole_max_ns.max(waterfall.whole());
        for part in &mut self.parts {
            let time = waterfall.time(part.part);
            part.sum_ns += time;
            if longest {
                part.in_longest_ns = time;
            }
        }
    }

    /// Mean of a sum over the jobs, ns.
    pub fn mean_ns(&self, sum_ns: Ns) -> f64 {
        sum_ns as f64 / self.jobs.max(1) as f64
    }
}

impl BusAccount {
    /// Releases that the tasks of the control computer and the others lost.
    pub fn lost_releases(&self) -> u64 {
        self.tasks.iter().map(|task| u64::from(task.lost_releases)).sum()
    }
}

impl Spread {
    fn of(histogram: &Histogram<u64>) -> Spread {
        Spread {
            mean_ns: histogram.mean(),
            p99_ns: histogram.value_at_quantile(0.99),
            max_ns: histogram.max(),
            histogram: histogram
                .iter_log(FIRST_BUCKET_NS, 2.0)
                .filter(|bucket| bucket.count_since_last_iteration() > 0)
                .map(|bucket| (bucket.value_iterated_to(), bucket.count_since_last_iteration()))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vme::{Access, Stop, Width};

    /// The control task of Figure 6.1 reads the force sensor, decides, computes for 1.5 ms and writes the last D/A, in
    /// windows that end at its decisions as those of a run do.
    fn account(seconds: u64) -> BusAccount {
        let scenario = scenario::load("table-5-3", &[]).unwrap().scenario().unwrap();
        let mut accounting = Accounting::new(&scenario).unwrap();
        let mut timing = Timing::new(scenario.rack.clone()).unwrap();
        let access = |card: &str, dir, width| {
            let addr = scenario.card_base(card).unwrap();
            Op::Access(Access { am: 0x3D, addr, width, dir, n: 1 })
        };
        let read = access(FORCE_SENSOR, Direction::Read, Width::D16);
        let write = access(LAST_ACTUATOR, Direction::Write, Width::D32);
        let (program, rest) = ([Op::Exec(130_000), read, Op::Decide], [Op::Exec(1_500_000), write]);
        timing.set_program(0, &program);
        let end = seconds * vme::SECOND;
        while timing.now() < end {
            let mut log = Log::default();
            let stop = timing.advance(end, &mut log);
            if let Stop::Decision { task, .. } = stop {
                timing.resume(task, &rest);
            }
            accounting.window(&log);
        }
        accounting.close(&timing, &[[program.to_vec(), rest.to_vec()].concat(), Vec::new()])
    }

    #[test]
    fn the_parts_of_every_job_add_up_to_first_and_last_stamp_to_the_nanosecond() {
        let account = account(1);
        let way = &account.waterfall;
        assert_eq!(way.jobs, 200);
        assert_eq!(way.parts.iter().map(|part| part.sum_ns).sum::<Ns>(), way.whole_sum_ns);
        assert_eq!(way.parts.iter().map(|part| part.in_longest_ns).sum::<Ns>(), way.whole_max_ns);
        let execution = way.parts.iter().find(|part| part.part == Part::Execution).unwrap();
        assert_eq!(execution.sum_ns, 200 * 1_500_000);
    }

    #[test]
    fn nothing_observed_exceeds_its_bound_and_every_master_is_accounted_for() {
        let account = account(1);
        let control = &account.tasks[0];
        assert_eq!((control.jobs, control.lost_releases, control.accesses_per_job), (200, 0, 2.0));
        assert!(control.access_max_ns <= control.access_bound_ns.unwrap());
        assert!(control.response_max_ns <= control.response_bound_ns.unwrap());
        let used: Vec<_> = account.masters.iter().filter(|master| master.transfers > 0).collect();
        let names: Vec<_> = used.iter().map(|master| master.name.as_str()).collect();
        assert_eq!(names, ["cpu-1", "vme-gio"]);
        for master in used {
            let counted: u64 = master.wait.histogram.iter().map(|(_, n)| n).sum();
            assert_eq!(counted, master.transfers, "{}", master.name);
        }
        assert!(account.utilisation > 0.0 && account.utilisation < 0.01);
    }

    #[test]
    fn a_cascades_delay_is_the_closed_form_of_its_stages() {
        let mut scenario = scenario::load("table-5-3", &[]).unwrap().scenario().unwrap();
        scenario.force_sensor_if.filter = ForceFilter::Cascade(4);
        let filter = Filter::of(&scenario);
        // 12·(1/8000 + 1/2000 + 1/500 + 1/125) s, published at 31.25 Hz
        assert_eq!((filter.delay_ns, filter.period_ns), (127_500_000, 32_000_000));
        assert_eq!(filter.stamps(127_999_999), None);
        assert_eq!(filter.stamps(130_000_000), Some((500_000, 128_000_000)));
    }
}
