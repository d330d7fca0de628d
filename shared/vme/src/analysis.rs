//! Worst cases beside the emulation: bounds that no observed time may exceed, or none.
//!
//! * [`sporadic`]: requests of known least distance under PRI, the non-preemptive fixed-priority
//!   response-time analysis of Davis et al. 2007 (which examines every request of the busy period; the
//!   form of 1994 that looks at the first one only is wrong). Times are integers: a lower request can
//!   have begun 1 ns before at the latest, so it blocks for its length less 1 ns.
//! * [`bounds`]: a whole rack. PRI and SGL: the demand of nearer-to-grant masters in the window, plus
//!   one tenure of a lower one for each time the access competes. RRS: one longest tenure of each
//!   other level; only the nearest slot of a level has a bound. Tasks: preemptive response time, each
//!   access inflated by its bus bound (a stalled processor is busy, not suspended).
//!
//! A bound holds without faults, and while every job ends before the next release of its task: where
//! that does not follow, nothing that rests on it has a bound. Poisson traffic has none, nor has
//! whoever waits for it without limit.

use crate::Ns;
use crate::arbiter::{Mode, SLOTS};
use crate::interrupt::IrqRelease;
use crate::program::{Access, Direction, Op};
use crate::rack::{Overrun, Rack, Release, Slave, Task};
use crate::requester::ReleasePolicy;
use crate::timing::Timing;
use crate::traffic::Arrivals;

/// Windows beyond this are taken for unbounded.
const HORIZON: Ns = 1 << 42;
/// So are those that a bus with no time left creeps up to in more steps.
const STEPS: u32 = 1 << 20;

/// A stream of requests, in the order of a list of them: earlier ones are granted first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stream {
    /// Longest time for which a request keeps the bus, arbitration included.
    pub service_ns: Ns,
    /// Least time between two requests.
    pub period_ns: Ns,
    /// How much later than its turn a request may come.
    pub jitter_ns: Ns,
}

impl Stream {
    /// Requests that can fall into a window of this length, both ends included.
    fn requests(&self, window: Ns) -> Ns {
        (window.saturating_add(self.jitter_ns) / self.period_ns).saturating_add(1)
    }
}

/// What these streams ask for in a window. A sum that no window holds stays the longest time there is.
fn asked<'a>(streams: impl IntoIterator<Item = &'a Stream>, window: Ns) -> Ns {
    sum(streams.into_iter().map(|s| s.requests(window).saturating_mul(s.service_ns)))
}

fn sum(times: impl IntoIterator<Item = Ns>) -> Ns {
    times.into_iter().fold(0, Ns::saturating_add)
}

/// Longest time from request to end for stream `i` of `streams` (most urgent first) under PRI.
pub fn sporadic(streams: &[Stream], i: usize) -> Option<Ns> {
    let own = streams[i];
    let higher = &streams[..i];
    let blocking = streams[i + 1..].iter().map(|s| s.service_ns.saturating_sub(1)).max().unwrap_or(0);
    let load: f64 = streams[..=i].iter().map(|s| s.service_ns as f64 / s.period_ns as f64).sum();
    if load > 1.0 {
        return None;
    }
    // ⌈(w + J)/T⌉ requests of every urgent enough stream: the level-i busy period
    let busy = fixed_point(blocking + own.service_ns, |busy| sum([blocking, asked(&streams[..=i], busy - 1)]))?;
    let requests = (busy + own.jitter_ns).div_ceil(own.period_ns);
    let mut worst = 0;
    for q in 0..requests {
        let before = blocking + q * own.service_ns;
        let begins = fixed_point(before, |begins| sum([before, asked(higher, begins)]))?;
        let arrival = (q * own.period_ns).saturating_sub(own.jitter_ns);
        worst = worst.max((begins + own.service_ns).saturating_sub(arrival));
    }
    Some(worst)
}

/// The least fixed point of a growing function at or above `start`; none within the horizon.
fn fixed_point(start: Ns, f: impl Fn(Ns) -> Ns) -> Option<Ns> {
    let mut x = start;
    for _ in 0..STEPS {
        if x >= HORIZON {
            break;
        }
        let next = f(x).max(start);
        if next == x {
            return Some(x);
        }
        x = next;
    }
    None
}

/// Bounds of a rack.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// For each task its longest access, from request to the free bus.
    pub access: Vec<Option<Ns>>,
    /// For each task its longest job, from release to end.
    pub response: Vec<Option<Ns>>,
    /// For each generator of traffic its longest request, from request to the free bus.
    pub traffic: Vec<Option<Ns>>,
}

/// What one source of requests asks of the bus.
#[derive(Clone, Debug)]
struct Demand {
    master: u16,
    /// Who asks; it must end in time for `stream` to hold. Handlers and polling loops cannot be late.
    source: Option<Source>,
    /// The accesses of one job.
    accesses: Vec<Tenure>,
    /// `None`: without limit.
    stream: Option<Stream>,
}

/// What one access asks of the bus.
#[derive(Clone, Copy, Debug)]
struct Tenure {
    /// All bursts, each arbitrated for.
    total: Ns,
    /// The longest burst, arbitrated for.
    burst: Ns,
    /// Times that it competes for the bus.
    competes: Ns,
}

/// The rack with what each task does in its longest job (before and after the decision).
struct Analysis<'a> {
    timing: &'a Timing,
    demands: Vec<Demand>,
    /// Whose jobs or requests are not known to end before the next one.
    late: Vec<Source>,
}

/// Bounds of the timing plane's rack, where task `t` does `programs[t]` at most in each job.
pub fn bounds(timing: &Timing, programs: &[Vec<Op>]) -> Bounds {
    let rack = timing.rack();
    if rack.bus.constant_ns.is_some() {
        // nobody waits for anybody, but what a job takes is not analysed then
        return Bounds {
            access: vec![None; rack.tasks.len()],
            response: vec![None; rack.tasks.len()],
            traffic: vec![None; rack.traffic.len()],
        };
    }
    let mut analysis = Analysis { timing, demands: demands(timing, programs), late: Vec::new() };
    loop {
        let late_before = analysis.late.len();
        let in_time = |source, bound: Option<Ns>, period: Ns| {
            let bound = bound.filter(|&bound| bound <= period && !analysis.late.contains(&source));
            (source, bound)
        };
        let response: Vec<_> = (0..rack.tasks.len())
            .map(|t| in_time(Source::Task(t), analysis.response(t, programs), rack.tasks[t].period_ns))
            .collect();
        let traffic: Vec<_> = (rack.traffic.iter().enumerate())
            .map(|(g, spec)| {
                let periodic = spec.arrivals == Arrivals::Periodic;
                let bound = analysis.access(Source::Traffic(g), &spec.access()).filter(|_| periodic);
                in_time(Source::Traffic(g), bound, spec.period_ns)
            })
            .collect();
        let late: Vec<Source> =
            response.iter().chain(&traffic).filter(|(_, bound)| bound.is_none()).map(|(source, _)| *source).collect();
        if late.len() == late_before {
            let access = (0..rack.tasks.len())
                .map(|t| {
                    let bound = |access| analysis.access(Source::Task(t), &access);
                    accesses(&programs[t]).map(bound).try_fold(0, longest)
                })
                .collect();
            let bounds = |of: Vec<(Source, Option<Ns>)>| of.into_iter().map(|(_, bound)| bound).collect();
            return Bounds { access, response: bounds(response), traffic: bounds(traffic) };
        }
        // what rested on them has to be looked at again
        analysis.late = late;
    }
}

fn longest(worst: Ns, bound: Option<Ns>) -> Option<Ns> {
    bound.map(|bound| worst.max(bound))
}

fn accesses(program: &[Op]) -> impl Iterator<Item = Access> + '_ {
    program.iter().filter_map(|op| if let Op::Access(access) = op { Some(*access) } else { None })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Task(usize),
    Traffic(usize),
}

/// How much later than its turn a task may be released. An interrupter holds one request while another
/// is served, so releases n periods apart may come as if they were n - 2.
fn release_jitter(task: &Task) -> Ns {
    match task.release {
        Release::Timer | Release::Poll(_) => 0,
        Release::Interrupt(_) => 2 * task.period_ns,
    }
}

/// The plan's demand on the bus from this master.
fn tenure(timing: &Timing, source: Source, access: &Access) -> Tenure {
    let (rack, wiring) = (timing.rack(), timing.wiring());
    let (master, adaptor, splits) = match source {
        Source::Task(t) => {
            let p = wiring.processor_of_task[t] as usize;
            (wiring.processors[p].0, wiring.processors[p].1, rack.processors[p].splits_width)
        }
        Source::Traffic(g) => (wiring.traffic[g].0, wiring.traffic[g].1, false),
    };
    let dma = adaptor.filter(|_| access.n > 1 || matches!(source, Source::Traffic(_)));
    let pace = dma.map_or(0, |a| rack.adaptors[a as usize].pace_ns(access.width.bytes()));
    let arbitration = wiring.arbitration_ns(wiring.masters[master as usize].place.slot);
    let mut tenure = Tenure { total: 0, burst: 0, competes: 0 };
    for burst in wiring.plan(access, splits).bursts(&rack.bus, access.addr, pace) {
        tenure.total = sum([tenure.total, arbitration, burst.done_ns]);
        tenure.burst = tenure.burst.max(arbitration + burst.done_ns);
        tenure.competes += 1;
    }
    if wiring.masters[master as usize].release == ReleasePolicy::WhenDone {
        tenure.competes = 1;
    }
    tenure
}

fn demands(timing: &Timing, programs: &[Vec<Op>]) -> Vec<Demand> {
    let (rack, wiring) = (timing.rack(), timing.wiring());
    let mut demands = Vec::new();
    for (t, task) in rack.tasks.iter().enumerate() {
        let master = wiring.processors[wiring.processor_of_task[t] as usize].0;
        let mut tenures = Vec::new();
        for access in accesses(&programs[t]) {
            tenures.extend((0..=task.retries).map(|_| tenure(timing, Source::Task(t), &access)));
        }
        let service_ns = sum(tenures.iter().map(|tenure| tenure.total));
        // a job that ends before the next release: its accesses come up to a period late
        let stream =
            Some(Stream { service_ns, period_ns: task.period_ns, jitter_ns: task.period_ns + release_jitter(task) });
        demands.push(Demand { master, source: Some(Source::Task(t)), accesses: tenures, stream });
        if let Release::Poll(poll) = &task.release {
            let look = Access { am: poll.am, addr: poll.addr, width: poll.width, dir: Direction::Read, n: 1 };
            let look = tenure(timing, Source::Task(t), &look);
            let period_ns = poll.interval_ns + rack.bus.read_stall_ns + rack.bus.address_ns;
            let stream = Some(Stream { service_ns: look.total, period_ns: period_ns.max(1), jitter_ns: 0 });
            demands.push(Demand { master, source: None, accesses: vec![look], stream });
        }
    }
    for (i, (wire, spec)) in wiring.irqs.iter().zip(&rack.interrupters).enumerate() {
        if wire.polled || spec.local || is_silent(rack, i, programs) {
            continue;
        }
        let master = wiring.processors[wire.handler as usize].0;
        let accesses = service_tenures(timing, i);
        let service_ns = sum(accesses.iter().map(|tenure| tenure.total));
        // one in service and one pending may be left from before the window
        let stream =
            spec.ticks.map(|ticks| Stream { service_ns, period_ns: ticks.period_ns, jitter_ns: 2 * ticks.period_ns });
        demands.push(Demand { master, source: None, accesses, stream });
    }
    for (g, traffic) in rack.traffic.iter().enumerate() {
        let tenure = tenure(timing, Source::Traffic(g), &traffic.access());
        let period_ns = traffic.period_ns;
        let stream = (traffic.arrivals == Arrivals::Periodic).then_some(Stream {
            service_ns: tenure.total,
            period_ns,
            jitter_ns: period_ns,
        });
        demands.push(Demand {
            master: wiring.traffic[g].0,
            source: Some(Source::Traffic(g)),
            accesses: vec![tenure],
            stream,
        });
    }
    demands
}

/// Whether nothing ever raises the interrupter.
fn is_silent(rack: &Rack, i: usize, programs: &[Vec<Op>]) -> bool {
    let spec = &rack.interrupters[i];
    let raises = |op: &Op| matches!(op, Op::Raise(_));
    let monitored = |slave: &Slave| slave.monitor.as_ref() == Some(&spec.name);
    spec.ticks.is_none() && !rack.slaves.iter().any(monitored) && !programs.iter().flatten().any(raises)
}

/// The bus cycles of one interrupt's service: IACK, and the release of a RORA interrupter.
fn service_tenures(timing: &Timing, i: usize) -> Vec<Tenure> {
    let (rack, wiring) = (timing.rack(), timing.wiring());
    let master = wiring.processors[wiring.irqs[i].handler as usize].0;
    let arbitration = wiring.arbitration_ns(wiring.masters[master as usize].place.slot);
    // any interrupter of the level may answer; the slowest one in the farthest slot is a bound
    let answer = rack.interrupters.iter().map(|spec| spec.answer_ns).max().unwrap_or(0);
    let chain = rack.bus.chain_ns * Ns::from(SLOTS - 1);
    let cycle = arbitration + rack.bus.address_ns + answer + chain + rack.bus.handshake_ns;
    let mut tenures = vec![Tenure { total: cycle, burst: cycle, competes: 1 }];
    if let IrqRelease::Rora { am, addr, width } = rack.interrupters[i].release {
        let write = Access { am, addr, width, dir: Direction::Write, n: 1 };
        let mut total = arbitration;
        for burst in wiring.plan(&write, false).bursts(&rack.bus, addr, 0) {
            total += burst.done_ns;
        }
        tenures.push(Tenure { total, burst: total, competes: 1 });
    }
    tenures
}

impl Analysis<'_> {
    fn mode(&self) -> Mode {
        self.timing.rack().bus.arbiter
    }

    /// Granted first: higher level, then nearer slot.
    fn rank(&self, master: u16) -> (std::cmp::Reverse<u8>, u8) {
        let place = self.timing.wiring().masters[master as usize].place;
        (std::cmp::Reverse(place.level), place.slot)
    }

    /// Longest time for which `owner` keeps the bus from `master`, who asks for it.
    fn hold(&self, owner: u16, master: u16) -> Ns {
        let wiring = self.timing.wiring();
        let (owning, asking) = (&wiring.masters[owner as usize], &wiring.masters[master as usize]);
        let bclr = self.mode() == Mode::Pri && asking.place.level > owning.place.level;
        let yields = match owning.release {
            ReleasePolicy::WhenDone => false,
            ReleasePolicy::OnRequest => true,
            ReleasePolicy::OnBclr => bclr,
        };
        let of = |tenure: &Tenure| if yields { tenure.burst } else { tenure.total };
        let own = self.demands.iter().filter(|demand| demand.master == owner);
        own.flat_map(|demand| &demand.accesses).map(of).max().unwrap_or(0)
    }

    /// Longest time from the request of an access to the free bus.
    fn access(&self, source: Source, access: &Access) -> Option<Ns> {
        let own = tenure(self.timing, source, access);
        let wiring = self.timing.wiring();
        let master = match source {
            Source::Task(t) => wiring.processors[wiring.processor_of_task[t] as usize].0,
            Source::Traffic(g) => wiring.traffic[g].0,
        };
        self.bus(master, own)
    }

    /// Longest time from a request of `master` with this tenure to the free bus.
    fn bus(&self, master: u16, own: Tenure) -> Option<Ns> {
        let masters = 0..self.timing.masters() as u16;
        let others = masters.filter(|&other| other != master);
        // one transfer of each other client of the same requester may stand before it in the queue
        let queued = self.queued_before(master);
        let total = sum([own.total, queued.total]);
        let competes = own.competes + queued.competes;
        match self.mode() {
            Mode::Rrs => {
                let place = |m: u16| self.timing.wiring().masters[m as usize].place;
                let mut levels = [0; crate::arbiter::LEVELS];
                for other in others {
                    let longest = self.hold(other, master);
                    if place(other).level == place(master).level
                        && place(other).slot < place(master).slot
                        && longest > 0
                    {
                        return None;
                    }
                    let level = &mut levels[place(other).level as usize];
                    *level = longest.max(*level);
                }
                Some(sum([total, competes.saturating_mul(sum(levels))]))
            }
            Mode::Pri | Mode::Sgl => {
                let (higher, lower): (Vec<u16>, Vec<u16>) = others.partition(|&m| self.rank(m) < self.rank(master));
                let blocking = lower.iter().map(|&m| self.hold(m, master)).max().unwrap_or(0).saturating_sub(1);
                let mut streams = Vec::new();
                for demand in self.demands.iter().filter(|demand| higher.contains(&demand.master)) {
                    if demand.accesses.is_empty() {
                        continue;
                    }
                    if demand.source.is_some_and(|source| self.late.contains(&source)) {
                        return None;
                    }
                    streams.push(demand.stream?);
                }
                let alone = sum([total, competes.saturating_mul(blocking)]);
                fixed_point(alone, |window| sum([alone, asked(&streams, window)]))
            }
        }
    }

    /// What can stand before an access in its master's own queue.
    fn queued_before(&self, master: u16) -> Tenure {
        let wiring = self.timing.wiring();
        let rack = self.timing.rack();
        let own = |p: usize| wiring.processors[p].0 == master;
        let buffers = (0..rack.processors.len()).any(|p| own(p) && rack.processors[p].posted_write_ns.is_some());
        let generators = wiring.traffic.iter().filter(|t| t.0 == master).count();
        let processors = (0..rack.processors.len()).filter(|&p| own(p)).count();
        let clients = processors + generators + usize::from(buffers);
        let each = self.demands.iter().filter(|demand| demand.master == master).flat_map(|demand| &demand.accesses);
        let worst = each.fold(Tenure { total: 0, burst: 0, competes: 0 }, |worst, tenure| Tenure {
            total: worst.total.max(tenure.total),
            burst: worst.burst.max(tenure.burst),
            competes: worst.competes.max(tenure.competes),
        });
        let before = clients.saturating_sub(1) as Ns;
        Tenure { total: worst.total.saturating_mul(before), burst: worst.burst, competes: worst.competes * before }
    }

    /// Time for which an access of task `t` stalls its processor.
    fn stall(&self, t: usize, access: &Access) -> Option<Ns> {
        let (rack, wiring) = (self.timing.rack(), self.timing.wiring());
        let p = wiring.processor_of_task[t] as usize;
        let beyond = match wiring.processors[p].1 {
            Some(adaptor) => {
                let spec = &rack.adaptors[adaptor as usize];
                spec.link_read_ns.max(spec.link_write_ns) + if access.n > 1 { spec.dma_setup_ns } else { 0 }
            }
            None => rack.bus.read_stall_ns + rack.processors[p].posted_write_ns.unwrap_or(0),
        };
        Some(sum([self.access(Source::Task(t), access)?, beyond]))
    }

    /// Processor time of one job of task `t`, stalls included.
    fn job(&self, t: usize, programs: &[Vec<Op>]) -> Option<Ns> {
        let rack = self.timing.rack();
        let switch = rack.processors[self.timing.wiring().processor_of_task[t] as usize].switch_ns;
        let tries = Ns::from(rack.tasks[t].retries) + 1;
        // it is switched to, and back from where it preempted
        programs[t].iter().try_fold(2 * switch, |total, op| match op {
            Op::Exec(ns) => Some(sum([total, *ns])),
            Op::Access(access) => Some(sum([total, tries.saturating_mul(self.stall(t, access)?)])),
            Op::Raise(_) | Op::Decide => Some(total),
        })
    }

    /// Longest time from release to end of a job of task `t`.
    fn response(&self, t: usize, programs: &[Vec<Op>]) -> Option<Ns> {
        let (rack, wiring) = (self.timing.rack(), self.timing.wiring());
        let p = wiring.processor_of_task[t];
        let tasks = &wiring.tasks_of_processor[p as usize];
        let at = tasks.iter().position(|&other| other as usize == t)?;
        let mut own = self.job(t, programs)?;
        let late = rack.tasks[t].overrun == Some(Overrun::Late);
        if late && matches!(rack.tasks[t].release, Release::Interrupt(_)) {
            // two releases whose handlers ran late may stand before this one
            own = own.saturating_mul(3);
        }
        let mut interference = Vec::new();
        for &urgent in &tasks[..at] {
            let spec = &rack.tasks[urgent as usize];
            if matches!(spec.release, Release::Poll(_)) {
                // it never leaves the processor
                return None;
            }
            let jitter_ns = release_jitter(spec);
            let service_ns = self.job(urgent as usize, programs)?;
            interference.push(Stream { service_ns, period_ns: spec.period_ns, jitter_ns });
        }
        for (i, spec) in rack.interrupters.iter().enumerate() {
            let wire = &wiring.irqs[i];
            if wire.handler != p || wire.polled || is_silent(rack, i, programs) {
                continue;
            }
            let mut service_ns = rack.processors[p as usize].interrupt_ns;
            if !spec.local {
                let master = wiring.processors[p as usize].0;
                for tenure in service_tenures(self.timing, i) {
                    service_ns = sum([service_ns, self.bus(master, tenure)?, rack.bus.read_stall_ns]);
                }
            }
            let period_ns = spec.ticks?.period_ns;
            interference.push(Stream { service_ns, period_ns, jitter_ns: 2 * period_ns });
        }
        let mut blocking = 0;
        for &lazy in &tasks[at + 1..] {
            let mut stalls = accesses(&programs[lazy as usize]);
            blocking = stalls.try_fold(blocking, |worst, access| longest(worst, self.stall(lazy as usize, &access)))?;
            if let Release::Poll(poll) = &rack.tasks[lazy as usize].release {
                let look = Access { am: poll.am, addr: poll.addr, width: poll.width, dir: Direction::Read, n: 1 };
                blocking = blocking.max(self.stall(lazy as usize, &look)?);
            }
        }
        let alone = sum([own, blocking]);
        fixed_point(alone, |window| sum([alone, asked(&interference, window)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(service_ns: Ns, period_ns: Ns) -> Stream {
        Stream { service_ns, period_ns, jitter_ns: 0 }
    }

    #[test]
    fn the_second_request_of_a_busy_period_can_be_the_worst() {
        // Davis et al. 2007, section 3.1: C = 1, T = 2.5, 3.5, 3.5; the form of 1994 gives 3 for the
        // last message and so misses its deadline. In thousandths, with blocking cut by the 1 ns grain.
        let streams = [stream(1000, 2500), stream(1000, 3500), stream(1000, 3500)];
        assert_eq!(sporadic(&streams, 0), Some(1999));
        assert_eq!(sporadic(&streams, 1), Some(2999));
        assert_eq!(sporadic(&streams, 2), Some(3500));
    }

    #[test]
    fn an_overloaded_bus_has_no_bound() {
        let streams = [stream(600, 1000), stream(500, 1000)];
        assert_eq!(sporadic(&streams, 0), Some(600 + 499));
        assert_eq!(sporadic(&streams, 1), None);
    }

    #[test]
    fn neither_a_bus_with_no_time_left_nor_one_for_absurd_requests_has_a_bound() {
        // 100 ns of every 100 ns: each step of the busy period is as long as the one before
        let full = [stream(99, 100), stream(1, 100)];
        assert_eq!(sporadic(&full, 1), Some(100));
        assert_eq!(fixed_point(100, |window| sum([100, asked(&full, window)])), None);
        let absurd = [stream(Ns::MAX / 2, 100), stream(Ns::MAX / 2, 1)];
        assert_eq!(fixed_point(1, |window| asked(&absurd, window)), None);
    }
}
