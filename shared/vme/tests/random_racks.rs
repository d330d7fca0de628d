//! Properties of the timing plane over random racks and programs: nothing is lost, nobody shares the
//! bus, time goes forward, and no observed time exceeds its bound.
//!
//! A few hundred racks by default; the ignored tests draw the full numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use vme::analysis::{Stream, bounds, sporadic};
use vme::arbiter::Mode;
use vme::interrupt::{Interrupter, IrqRelease};
use vme::processor::Processor;
use vme::rack::{Overrun, Rack, Release, Slave, Task};
use vme::requester::ReleasePolicy;
use vme::timer::Ticks;
use vme::traffic::{Arrivals, Traffic};
use vme::{Access, Direction, Log, Ns, Op, Origin, Status, Stop, Timing, Width};

struct Draw(ChaCha8Rng);

impl Draw {
    fn new(seed: u64) -> Draw {
        Draw(ChaCha8Rng::seed_from_u64(seed))
    }
    /// Uniform in `low..high`.
    fn from(&mut self, low: u64, high: u64) -> u64 {
        low + self.0.next_u64() % (high - low)
    }
    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.from(0, of.len() as u64) as usize]
    }
    fn chance(&mut self, percent: u64) -> bool {
        self.from(0, 100) < percent
    }
    /// `n` different slots from 1 to 21.
    fn slots(&mut self, n: usize) -> Vec<u8> {
        let mut slots: Vec<u8> = (1..=21).collect();
        for i in (1..slots.len()).rev() {
            slots.swap(i, self.from(0, i as u64 + 1) as usize);
        }
        slots.truncate(n);
        slots
    }
}

const POLICIES: [ReleasePolicy; 3] = [ReleasePolicy::WhenDone, ReleasePolicy::OnRequest, ReleasePolicy::OnBclr];

/// A rack of up to three cards with up to four tasks, interrupts and traffic, and its programs.
fn random_rack(draw: &mut Draw) -> (Rack, Vec<Vec<Op>>) {
    let mut rack = Rack::default();
    let slots = draw.slots(21);
    let mut slots = slots.into_iter();
    let mut slot = || slots.next().unwrap();
    rack.bus.arbiter = draw.pick(&[Mode::Pri, Mode::Rrs, Mode::Sgl]);
    let sgl = rack.bus.arbiter == Mode::Sgl;
    let level = |draw: &mut Draw| if sgl { 3 } else { draw.from(0, 4) as u8 };
    rack.bus.arbitration_ns = draw.from(100, 500);
    rack.bus.chain_ns = draw.from(0, 40);
    rack.bus.access_timer_ns = 1 << 40;
    for i in 0..draw.from(1, 4) as u32 {
        rack.slaves.push(Slave {
            name: format!("board-{i}"),
            slot: slot(),
            am: 0x39,
            base: 0x1_0000 * (i + 1),
            size: 0x1_0000,
            width: Width::D32,
            read_ns: draw.from(50, 1500),
            write_ns: draw.from(50, 1500),
            ..Slave::default()
        });
    }
    for i in 0..draw.from(1, 4) {
        rack.processors.push(Processor {
            slot: Some(slot()),
            level: level(draw),
            release: draw.pick(&POLICIES),
            switch_ns: draw.pick(&[0, 0, 2_000]),
            posted_write_ns: draw.pick(&[None, Some(150)]),
            interrupt_ns: draw.from(500, 3_000),
            ..Processor::new(&format!("cpu-{i}"))
        });
    }
    let mut programs = Vec::new();
    for i in 0..draw.from(1, 5) {
        let mut task = Task {
            name: format!("task-{i}"),
            processor: format!("cpu-{}", draw.from(0, rack.processors.len() as u64)),
            period_ns: draw.from(100_000, 600_000),
            offset_ns: draw.from(0, 100_000),
            priority: draw.from(0, 3) as u8,
            overrun: Some(draw.pick(&[Overrun::Skip, Overrun::Late])),
            ..Task::default()
        };
        if draw.chance(25) {
            let name = format!("event-{i}");
            rack.interrupters.push(Interrupter {
                name: name.clone(),
                card: "board-0".into(),
                level: draw.from(1, 8) as u8,
                status_id: i as u8,
                release: draw
                    .pick(&[IrqRelease::Roak, IrqRelease::Rora { am: 0x39, addr: 0x1_0000, width: Width::D16 }]),
                answer_ns: draw.from(100, 500),
                ticks: Some(Ticks { period_ns: task.period_ns, offset_ns: task.offset_ns }),
                local: false,
            });
            task.release = Release::Interrupt(name);
        }
        rack.tasks.push(task);
        programs.push((0..draw.from(0, 12)).map(|_| random_op(draw, &rack)).collect());
    }
    for i in 0..draw.from(0, 4) {
        let Op::Access(access) = random_access(draw, &rack) else { unreachable!() };
        rack.traffic.push(Traffic {
            name: format!("traffic-{i}"),
            slot: Some(slot()),
            level: level(draw),
            release: draw.pick(&POLICIES),
            adaptor: None,
            arrivals: if draw.chance(15) { Arrivals::Poisson } else { Arrivals::Periodic },
            period_ns: draw.from(20_000, 300_000),
            offset_ns: draw.from(0, 20_000),
            am: access.am,
            addr: access.addr,
            width: access.width,
            dir: access.dir,
            n: access.n,
            seed: draw.from(0, 1000),
        });
    }
    (rack, programs)
}

fn random_op(draw: &mut Draw, rack: &Rack) -> Op {
    if draw.chance(40) { Op::Exec(draw.from(0, 8_000)) } else { random_access(draw, rack) }
}

fn random_access(draw: &mut Draw, rack: &Rack) -> Op {
    let base = 0x1_0000 * draw.from(1, 1 + rack.slaves.len() as u64) as u32;
    let width = draw.pick(&[Width::D8, Width::D16, Width::D32]);
    let (am, n) = match draw.from(0, 10) {
        0 => (0x3B, draw.from(2, 200) as u32),
        1 => (0x39, draw.from(2, 8) as u32),
        2 => (0x39, 0),
        3 => (0x39 | vme::program::READ_MODIFY_WRITE, 1),
        _ => (0x39, 1),
    };
    let addr = base + 4 * draw.from(0, 64) as u32;
    Op::Access(Access { am, addr, width, dir: draw.pick(&[Direction::Read, Direction::Write]), n })
}

fn run(timing: &mut Timing, programs: &[Vec<Op>], limit: Ns) -> Log {
    for (t, program) in programs.iter().enumerate() {
        timing.set_program(t as u16, program);
    }
    let mut log = Log::default();
    while timing.advance(limit, &mut log) != Stop::Limit {}
    log
}

/// Counts (times compared with a bound, times without one).
fn no_time_exceeds_its_bound(seed: u64) -> (usize, usize) {
    let mut draw = Draw::new(seed);
    let (rack, programs) = random_rack(&mut draw);
    let mut timing = Timing::new(rack).unwrap();
    let bounds = bounds(&timing, &programs);
    let log = run(&mut timing, &programs, 6_000_000);
    let (mut compared, mut free) = (0, 0);
    let mut compare = |bound: Option<Ns>, observed: Ns, what: &dyn std::fmt::Debug| match bound {
        Some(bound) => {
            assert!(observed <= bound, "seed {seed}: {observed} > {bound}: {what:?}\n{:#?}", timing.rack());
            compared += 1;
        }
        None => free += 1,
    };
    for transfer in &log.transfers {
        let list = match transfer.origin {
            Origin::Program => &bounds.access,
            Origin::Traffic => &bounds.traffic,
            _ => continue,
        };
        compare(list[transfer.task as usize], transfer.done - transfer.requested, transfer);
    }
    for job in &log.jobs {
        compare(bounds.response[job.task as usize], job.end - job.release, job);
    }
    (compared, free)
}

#[test]
fn no_observed_time_exceeds_its_bound_in_random_racks() {
    let (mut compared, mut free) = (0, 0);
    // two of the seeds once broke bounds that forgot late traffic, and handlers that run late
    for seed in (0..250).chain([1_003_575, 1_009_720]) {
        let (c, f) = no_time_exceeds_its_bound(seed);
        compared += c;
        free += f;
    }
    // the bounds say something: most times have one
    assert!(compared > free, "{compared} compared, {free} without a bound");
}

#[test]
#[ignore = "10 000 random racks: run with --release -- --ignored"]
fn no_observed_time_exceeds_its_bound_in_ten_thousand_random_racks() {
    (0..10_000).for_each(|seed| {
        no_time_exceeds_its_bound(1_000_000 + seed);
    });
}

#[test]
fn every_request_ends_once_the_bus_has_one_owner_and_time_goes_forward() {
    for seed in 0..300 {
        let mut draw = Draw::new(10_000_000 + seed);
        let (mut rack, mut programs) = random_rack(&mut draw);
        // misses and access timers too
        rack.bus.bus_timer_ns = 8_000;
        rack.bus.access_timer_ns = draw.from(3_000, 60_000);
        for program in &mut programs {
            if draw.chance(30) {
                let (am, addr, width) = (0x39, 0xF0_0000, Width::D16);
                program.push(Op::Access(Access {
                    am,
                    addr,
                    width,
                    dir: draw.pick(&[Direction::Read, Direction::Write]),
                    n: 1,
                }));
            }
        }
        let mut timing = Timing::new(rack).unwrap();
        let log = run(&mut timing, &programs, 4_000_000);

        let in_order = log.transfers.windows(2).all(|pair| pair[0].data_at <= pair[1].data_at);
        assert!(in_order, "seed {seed}");
        for t in &log.transfers {
            assert!(t.requested <= t.granted && t.granted <= t.data_at && t.data_at <= t.done, "seed {seed}: {t:?}");
        }
        // each job that ended has had each of its accesses end once, posted ones perhaps later
        let mut ended: Vec<_> =
            log.transfers.iter().filter(|t| t.origin == Origin::Program).map(|t| (t.task, t.job, t.index)).collect();
        let all = ended.len();
        ended.sort_unstable();
        ended.dedup();
        assert_eq!(ended.len(), all, "seed {seed}: an access ended twice");
        for job in log.jobs.iter().filter(|job| job.end < 3_000_000) {
            let asked = programs[job.task as usize].iter().filter(|op| matches!(op, Op::Access(_))).count();
            let seen = ended.iter().filter(|e| (e.0, e.1) == (job.task, job.job)).count();
            assert_eq!(seen, asked, "seed {seed}: {job:?}");
        }
        // never two owners: what each transfer held adds up to no more than the time, and tenures of
        // one burst are disjoint
        let mut held: Vec<(Ns, Ns)> = Vec::new();
        let mut sum = 0;
        for t in log.transfers.iter().filter(|t| t.status != Status::AccessTimeout) {
            sum += t.held_ns;
            if t.access.n <= 1 {
                held.push((t.done - t.held_ns, t.done));
            }
        }
        assert!(sum <= timing.now() + 1_000_000, "seed {seed}");
        held.sort_unstable();
        for pair in held.windows(2) {
            assert!(pair[0].1 <= pair[1].0, "seed {seed}: {pair:?} overlap");
        }
    }
}

#[test]
fn many_short_windows_give_the_same_transfers_and_jobs_as_one_long_one() {
    for seed in 0..150 {
        let mut draw = Draw::new(20_000_000 + seed);
        let (rack, programs) = random_rack(&mut draw);
        let mut whole = Timing::new(rack).unwrap();
        let mut parts = whole.clone();
        let expected = run(&mut whole, &programs, 1_500_000);
        for (t, program) in programs.iter().enumerate() {
            parts.set_program(t as u16, program);
        }
        let mut log = Log::default();
        let mut limit = 0;
        while limit < 1_500_000 {
            limit = (limit + draw.from(1, 700)).min(1_500_000);
            while parts.advance(limit, &mut log) != Stop::Limit {}
        }
        assert_eq!(log.transfers, expected.transfers, "seed {seed}");
        assert_eq!(log.jobs, expected.jobs, "seed {seed}");
    }
}

/// A random set of sporadic masters under PRI with unlike tenures; most urgent first.
fn random_set(draw: &mut Draw) -> Rack {
    let n = draw.from(2, 9) as usize;
    let slots = draw.slots(n + 1);
    let mut rack = Rack::default();
    rack.bus.access_timer_ns = 1 << 40;
    let mut left = 0.97;
    for (i, &slot) in slots[..n].iter().enumerate() {
        let read_ns = draw.from(50, 20_000);
        let name = format!("window-{i}");
        let base = 0x1000 * (i as u32 + 1);
        rack.slaves.push(Slave {
            name,
            slot: slots[n],
            am: 0x39,
            base,
            size: 0x100,
            width: Width::D16,
            read_ns,
            ..Slave::default()
        });
        let service = 300 + 30 * (Ns::from(slot) - 1) + 35 + read_ns + 100;
        let share = left * draw.from(20, 80) as f64 / 100.0;
        left -= share;
        rack.traffic.push(Traffic {
            name: format!("master-{i}"),
            slot: Some(slot),
            level: draw.from(0, 4) as u8,
            release: ReleasePolicy::WhenDone,
            adaptor: None,
            arrivals: Arrivals::Periodic,
            period_ns: (service as f64 / share).ceil() as Ns,
            offset_ns: 1,
            am: 0x39,
            addr: base,
            width: Width::D16,
            dir: Direction::Read,
            n: 1,
            seed: 0,
        });
    }
    for slave in &mut rack.slaves {
        slave.name = "memory".into();
    }
    rack.traffic.sort_by_key(|t| (std::cmp::Reverse(t.level), t.slot));
    rack
}

fn streams(rack: &Rack) -> Vec<Stream> {
    let service = |t: &Traffic| {
        let slave = rack.slaves.iter().find(|s| s.base == t.addr).unwrap();
        300 + 30 * (Ns::from(t.slot.unwrap()) - 1) + 35 + slave.read_ns + 100
    };
    let of = |t: &Traffic| Stream { service_ns: service(t), period_ns: t.period_ns, jitter_ns: 0 };
    rack.traffic.iter().map(of).collect()
}

/// The critical instant of every master of a random set: the longest lower request has just begun,
/// everybody else asks 1 ns later.
fn the_critical_instant_reaches_the_bound(seed: u64) {
    let rack = random_set(&mut Draw::new(seed));
    let streams = streams(&rack);
    for i in 0..streams.len() {
        let Some(bound) = sporadic(&streams, i) else { panic!("seed {seed}: {i} has no bound") };
        let mut rack = rack.clone();
        let blocker = (i + 1..streams.len()).max_by_key(|&k| streams[k].service_ns);
        rack.traffic = (0..streams.len())
            .filter(|&k| k <= i || Some(k) == blocker)
            .map(|k| {
                let mut traffic = rack.traffic[k].clone();
                if Some(k) == blocker {
                    (traffic.offset_ns, traffic.period_ns) = (0, 1 << 41);
                }
                traffic
            })
            .collect();
        let mut timing = Timing::new(rack).unwrap();
        // the level-i busy period is over by then: its demand fits
        let horizon = 200 * streams[..=i].iter().map(|s| s.period_ns).max().unwrap();
        let mut worst = Worst { task: i as u16, response: 0 };
        timing.advance(horizon, &mut worst);
        assert_eq!(worst.response, bound, "seed {seed}, master {i}: {streams:?}");
    }
}

struct Worst {
    task: u16,
    response: Ns,
}

impl vme::Sink for Worst {
    fn transfer(&mut self, transfer: &vme::Transfer) {
        if transfer.task == self.task {
            self.response = self.response.max(transfer.done - transfer.requested);
        }
    }
}

#[test]
fn the_critical_instant_reaches_the_davis_bound_exactly() {
    (0..25).for_each(the_critical_instant_reaches_the_bound);
}

#[test]
#[ignore = "1000 random sets: run with --release -- --ignored"]
fn the_critical_instant_reaches_the_davis_bound_exactly_in_a_thousand_sets() {
    (1000..2000).for_each(the_critical_instant_reaches_the_bound);
}
