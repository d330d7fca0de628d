//! What a run made of the bus and the processors: use by each master, ages of the sensors' values at the decision, and
//! where the time from what the force sensor felt to the D/A's change went.
//!
//! All times are simulated. [`Accounting`] hears what happened window by window, tells the record, and closes into a
//! [`BusAccount`]. A job whose read or write failed has no way from sensor to actuator and is left out of it.

use crate::ledger::PathLatency;
use hdrhistogram::Histogram;
use messages::{BUCKETS, MasterUse, SensorPath};
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
/// Parts of the way, in their order.
const PARTS: [Part; messages::PARTS] =
    [Part::Filter, Part::Card, Part::Arbitration, Part::Transfer, Part::WaitForTask, Part::Execution, Part::Write];
/// Histograms count in powers of two from here.
const FIRST_BUCKET_NS: u64 = messages::FIRST_BUCKET_NS;
/// The record hears of the masters' use of the bus this often, and at the end.
const TELL_NS: Ns = vme::SECOND;

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
    /// Of these because an adaptor's link failed its parity check.
    pub parity_errors: u32,
    /// Adaptors whose link is down at the end.
    pub links_down: Vec<String>,
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
    /// Tasks of the control computer, in the order of the pipeline, and their jobs under way.
    control: Vec<(u16, ControlJob)>,
    /// The way so far of a value that the first of two cards has handed over.
    handed_over: Option<Waterfall>,
    cards: Vec<String>,
    filter: Filter,
    /// Ages by card, then the force sensor's since publication and since it was felt.
    ages: Vec<Histogram<u64>>,
    waterfall: WaterfallAccount,
    polls: u64,
    /// When the record hears of the masters next, and the end of the run.
    tell: (Ns, Ns),
    /// Ways that have ended in this window.
    paths: Vec<SensorPath>,
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
    /// What the job led to: the last actuator's write, or the hand-over to the second card.
    result: Option<Transfer>,
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
        Ok(Accounting {
            ledger: accounting::Ledger::new(timing.masters()),
            tasks: vec![TaskUse::default(); scenario.rack.tasks.len()],
            control: [scenario.task_of("control_computer"), scenario.second_control_task()]
                .into_iter()
                .flatten()
                .map(|task| (task, ControlJob { reads: Vec::with_capacity(64), ..ControlJob::default() }))
                .collect(),
            handed_over: None,
            ages: (0..cards.len() + 2).map(|_| crate::ledger::histogram()).collect(),
            cards,
            filter: Filter::of(scenario),
            waterfall: WaterfallAccount {
                jobs: 0,
                parts: PARTS.map(|part| PartAccount { part, sum_ns: 0, in_longest_ns: 0 }).to_vec(),
                whole_sum_ns: 0,
                whole_max_ns: 0,
            },
            polls: 0,
            tell: (TELL_NS, scenario.duration_ns()),
            paths: Vec::with_capacity(16),
        })
    }

    /// Adds the window that ends at `until`; `masters` and `paths` get what the record is to say of it.
    pub fn window(&mut self, until: Ns, log: &Log, masters: &mut Vec<MasterUse>, paths: &mut Vec<SensorPath>) {
        self.paths.clear();
        let mut jobs = log.jobs.iter().peekable();
        for transfer in &log.transfers {
            // a window can hold the end of one job and the reads of the next
            while let Some(job) = jobs.next_if(|job| job.end <= transfer.data_at) {
                self.job(job);
            }
            self.transfer(transfer);
        }
        jobs.for_each(|job| self.job(job));
        paths.extend_from_slice(&self.paths);
        if until >= self.tell.0.min(self.tell.1) {
            self.tell.0 = (until / TELL_NS + 1) * TELL_NS;
            masters.extend((0..).zip(&self.ledger.masters).map(|(i, used)| master_use(until, i, used)));
        }
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
        let last = self.control.last().map(|(task, _)| *task);
        let control = self.control.iter_mut().find(|(task, _)| *task == transfer.task);
        let (Some(slave), Some((task, job))) = (transfer.slave, control) else { return };
        if transfer.job != job.number {
            job.reads.clear();
            (job.number, job.force, job.result) = (transfer.job, None, None);
        }
        if transfer.status != Status::Ok {
            return;
        }
        let card = self.cards[usize::from(slave)].as_str();
        if transfer.access.dir == Direction::Read {
            job.reads.push((slave, transfer.data_at));
            if card == FORCE_SENSOR {
                job.force.get_or_insert(*transfer);
            }
        } else if card == LAST_ACTUATOR || Some(*task) != last {
            job.result = Some(*transfer);
        }
    }

    fn job(&mut self, record: &JobRecord) {
        if let Some(task) = self.tasks.get_mut(usize::from(record.task)) {
            task.jobs += 1;
            task.response_max_ns = task.response_max_ns.max(record.end - record.release);
        }
        let control = self.control.iter_mut().find(|(task, _)| *task == record.task);
        let Some((_, job)) = control.filter(|(_, job)| job.number == record.job) else { return };
        let Some(decide) = record.decide else { return };
        for &(slave, data_at) in &job.reads {
            // in real time a reading may have been told for a later instant than the decision then had
            let Some(age) = decide.checked_sub(data_at) else { continue };
            self.ages[usize::from(slave)].saturating_record(age);
        }
        let (force, result) = (job.force.take(), job.result.take());
        let so_far = match force {
            None => self.handed_over.take_if(|way| way.reached() <= decide),
            Some(read) => {
                let stamps = self.filter.stamps(read.data_at).filter(|(_, published)| *published <= decide);
                let Some((felt, published)) = stamps else { return };
                let [.., since_published, since_felt] = self.ages.as_mut_slice() else { return };
                since_published.saturating_record(decide - published);
                since_felt.saturating_record(decide - felt);
                // a value published between the request and the data has waited on the card for less than nothing
                Waterfall::begin(felt, published.min(read.requested), &read).ok()
            }
        };
        let (Some(so_far), Some(result)) = (so_far, result) else { return };
        if self.control.last().is_some_and(|(last, _)| *last == record.task) {
            if let Ok(whole) = so_far.write(record, &result) {
                self.waterfall.add(&whole);
                self.paths.push(SensorPath {
                    t: whole.reached(),
                    felt: whole.reached() - whole.whole(),
                    parts: PARTS.map(|part| whole.time(part)),
                    job: record.job,
                    reserved: 0,
                });
            }
        } else {
            self.handed_over = so_far.hand_over(record, &result).ok();
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
            parity_errors: counters.parity_errors,
            links_down: (0..)
                .zip(&timing.rack().adaptors)
                .filter(|(i, _)| !timing.link_up(*i))
                .map(|(_, adaptor)| adaptor.name.clone())
                .collect(),
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

/// Use of the bus by one master, as the record says it.
fn master_use(t: Ns, master: u32, used: &accounting::MasterUse) -> MasterUse {
    let buckets = |histogram: &Histogram<u64>| {
        let mut counts = [0; BUCKETS];
        for bucket in histogram.iter_log(FIRST_BUCKET_NS, 2.0) {
            let upper = bucket.value_iterated_to().div_ceil(FIRST_BUCKET_NS).next_power_of_two();
            counts[(upper.ilog2() as usize).min(BUCKETS - 1)] += bucket.count_since_last_iteration() as u32;
        }
        counts
    };
    MasterUse {
        t,
        held_ns: used.held_ns,
        wait_max_ns: used.wait.max(),
        service_max_ns: used.service.max(),
        master,
        transfers: used.transfers as u32,
        bus_errors: used.bus_errors as u32,
        access_timeouts: used.access_timeouts as u32,
        wait: buckets(&used.wait),
        service: buckets(&used.service),
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
            accounting.window(timing.now(), &log, &mut Vec::new(), &mut Vec::new());
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
    fn over_two_cards_the_parts_add_up_too_and_hold_both_cards_execution() {
        let mut scenario = scenario::load("table-5-3", &[]).unwrap().scenario().unwrap();
        let mut second = scenario.rack.tasks[0].clone();
        (second.name, second.processor, second.period_ns) = ("torque".into(), "cpu-2".into(), vme::MILLISECOND);
        scenario.rack.tasks.push(second);
        let access = |card: &str, dir, n| {
            let addr = scenario.card_base(card).unwrap();
            Op::Access(Access { am: 0x3D, addr, width: Width::D32, dir, n })
        };
        let [read, block] =
            [("force-sensor", Direction::Read, 1), ("cpu-2-dpram", Direction::Write, 43)].map(|(card, dir, n)| {
                match access(card, dir, n) {
                    Op::Access(access) if card == FORCE_SENSOR => Op::Access(Access { width: Width::D16, ..access }),
                    op => op,
                }
            });
        let (count, write) = (access("encoder-1", Direction::Read, 1), access(LAST_ACTUATOR, Direction::Write, 1));
        let mut accounting = Accounting::new(&scenario).unwrap();
        let mut timing = Timing::new(scenario.rack.clone()).unwrap();
        timing.set_program(0, &[Op::Exec(130_000), read, Op::Decide]);
        timing.set_program(2, &[Op::Exec(20_000), count, Op::Decide]);
        let (mut masters, mut paths) = (Vec::new(), Vec::new());
        let rests = [vec![Op::Exec(1_500_000), block], vec![], vec![Op::Exec(300_000), write]];
        while timing.now() < vme::SECOND {
            let mut log = Log::default();
            if let Stop::Decision { task, .. } = timing.advance(vme::SECOND, &mut log) {
                timing.resume(task, &rests[usize::from(task)]);
            }
            accounting.window(timing.now(), &log, &mut masters, &mut paths);
        }
        let account = accounting.close(&timing, &[vec![], vec![], vec![]]);
        let way = &account.waterfall;
        assert_eq!(way.jobs, 200);
        // the record hears the same
        assert_eq!(paths.len(), 200);
        assert!(paths.iter().all(|path| path.parts.iter().sum::<Ns>() == path.t - path.felt));
        assert_eq!(paths.iter().map(|path| path.t - path.felt).sum::<Ns>(), way.whole_sum_ns);
        assert_eq!(masters.len(), account.masters.len());
        for (told, master) in masters.iter().zip(&account.masters) {
            assert_eq!(u64::from(told.transfers), master.transfers);
            assert_eq!(told.wait.iter().sum::<u32>(), told.transfers);
            assert_eq!(told.held_ns as f64 / 1e9, master.utilisation);
            // arbitration alone takes 300 ns and 30 a slot: above 256, up to 512
            let processor = master.name.starts_with("cpu");
            assert!(!processor || told.transfers == 0 || told.wait[2] > 0, "{told:?}");
        }
        assert_eq!(way.parts.iter().map(|part| part.sum_ns).sum::<Ns>(), way.whole_sum_ns);
        assert_eq!(way.parts.iter().map(|part| part.in_longest_ns).sum::<Ns>(), way.whole_max_ns);
        let execution = way.parts.iter().find(|part| part.part == Part::Execution).unwrap();
        assert_eq!(execution.sum_ns, 200 * 1_800_000);
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
