//! The timing plane against hand-worked instants.

use super::*;
use crate::arbiter::Mode;
use crate::fault::Fault;
use crate::interrupt::{Interrupter, IrqRelease};
use crate::processor::Processor;
use crate::program::{Access, Direction, Op, Status, Width};
use crate::rack::{Overrun, Poll, Slave, Task};
use crate::requester::ReleasePolicy;
use crate::timer::Ticks;
use crate::traffic::{Arrivals, Traffic};

const AM: u8 = 0x39;
const RAM: u32 = 0x1000;

fn ram() -> Slave {
    Slave {
        name: "ram".into(),
        slot: 10,
        am: AM,
        base: RAM,
        size: 0x1000,
        width: Width::D16,
        read_ns: 200,
        write_ns: 400,
        ..Slave::default()
    }
}

fn task(name: &str, processor: &str, priority: u8, period_ns: Ns) -> Task {
    Task { name: name.into(), processor: processor.into(), priority, period_ns, ..Task::default() }
}

fn rack(tasks: Vec<Task>) -> Rack {
    Rack { slaves: vec![ram()], tasks, ..Rack::default() }
}

fn read() -> Op {
    access(RAM, Direction::Read)
}

fn write() -> Op {
    access(RAM + 2, Direction::Write)
}

fn access(addr: u32, dir: Direction) -> Op {
    Op::Access(Access { am: AM, addr, width: Width::D16, dir, n: 1 })
}

fn traffic(name: &str, slot: u8, level: u8, period_ns: Ns, offset_ns: Ns) -> Traffic {
    Traffic {
        name: name.into(),
        slot: Some(slot),
        level,
        release: ReleasePolicy::WhenDone,
        adaptor: None,
        arrivals: Arrivals::Periodic,
        period_ns,
        offset_ns,
        am: AM,
        addr: RAM,
        width: Width::D16,
        dir: Direction::Read,
        n: 1,
        seed: 0,
    }
}

fn run(timing: &mut Timing, limit: Ns) -> Log {
    let mut log = Log::default();
    assert_eq!(timing.advance(limit, &mut log), Stop::Limit);
    log
}

fn times(transfer: &Transfer) -> (Ns, Ns, Ns, Ns) {
    (transfer.requested, transfer.granted, transfer.data_at, transfer.done)
}

#[test]
fn alone_on_the_bus_a_task_arbitrates_once_and_then_keeps_it() {
    let mut timing = Timing::new(rack(vec![task("control", "cpu", 0, 100_000)])).unwrap();
    timing.set_program(0, &[Op::Exec(50), read(), write(), Op::Decide]);
    let mut transfers = Vec::new();
    assert_eq!(timing.advance(100_000, &mut transfers), Stop::Decision { task: 0, job: 0 });
    // 300 arbitration, 35 + 200 to the data, 100 handshake, 300 stall; then 35 + 400, 100
    assert_eq!(times(&transfers[0]), (50, 350, 585, 685));
    assert_eq!(times(&transfers[1]), (985, 985, 1420, 1520));
    assert_eq!(timing.now(), 1520);
    timing.resume(0, &[Op::Exec(80), write()]);
    transfers.clear();
    assert_eq!(timing.advance(100_000, &mut transfers), Stop::Limit);
    assert_eq!(times(&transfers[0]), (1600, 1600, 2035, 2135));
    assert_eq!((transfers[0].index, transfers[0].job), (2, 0));
    assert_eq!(timing.now(), 100_000);
    timing.advance(200_000, &mut transfers);
    assert_eq!((transfers[1].job, transfers[1].index, transfers[1].requested), (1, 0, 100_050));
}

#[test]
fn events_at_the_limit_are_left_for_later_and_a_copy_goes_the_same_way() {
    let mut timing = Timing::new(rack(vec![task("control", "cpu", 0, 10_000)])).unwrap();
    timing.set_program(0, &[read(), write()]);
    let mut whole = Log::default();
    timing.clone().advance(50_000, &mut whole);
    let mut parts = Log::default();
    for limit in (0..=50_000).step_by(535) {
        timing.advance(limit, &mut parts);
        assert!(parts.transfers.iter().all(|t| t.data_at < limit));
        let mut copy = timing.clone();
        copy.clone_from(&timing);
        timing = copy;
    }
    timing.advance(50_000, &mut parts);
    assert_eq!(parts.transfers, whole.transfers);
    assert_eq!(parts.jobs, whole.jobs);
}

#[test]
fn an_access_that_takes_place_twice_costs_the_bus_twice_and_the_program_goes_on_behind_both() {
    let twice = |kind| {
        let fault = Fault { from_ns: 0, until_ns: 100_000, kind };
        let mut timing =
            Timing::with_faults(rack(vec![task("control", "cpu", 0, 100_000)]), FaultPlan { faults: vec![fault] })
                .unwrap();
        timing.set_program(0, &[Op::Exec(50), read(), write()]);
        let mut log = Log::default();
        assert_eq!(timing.advance(200_000, &mut log), Stop::Fault { fault: 0 });
        assert_eq!(timing.advance(200_000, &mut log), Stop::Limit);
        let of = |job| log.transfers.iter().filter(move |t| t.job == job).map(|t| (t.origin, t.index, times(t)));
        assert_eq!(of(1).count(), 2, "the fault is over");
        assert_eq!(log.jobs[0].end, log.transfers[2].done);
        of(0).collect::<Vec<_>>()
    };
    use Origin::{Program, Repeat};
    // 35 + 200 to the data, 100 handshake, and the read stall once: the processor sees one access
    let reads =
        [(Program, 0, (50, 350, 585, 685)), (Repeat, 0, (685, 685, 920, 1020)), (Program, 1, (1320, 1320, 1755, 1855))];
    assert_eq!(twice(FaultKind::RepeatedRead(0)), reads);
    let writes = [
        (Program, 0, (50, 350, 585, 685)),
        (Program, 1, (985, 985, 1420, 1520)),
        (Repeat, 1, (1520, 1520, 1955, 2055)),
    ];
    assert_eq!(twice(FaultKind::RepeatedWrite(0)), writes);
}

#[test]
fn a_programs_change_takes_effect_at_the_next_release() {
    let mut timing = Timing::new(rack(vec![task("control", "cpu", 0, 10_000)])).unwrap();
    timing.set_program(0, &[Op::Exec(100), read()]);
    let mut transfers = Vec::new();
    timing.advance(50, &mut transfers);
    timing.set_program(0, &[write()]);
    timing.advance(20_000, &mut transfers);
    let dirs: Vec<_> = transfers.iter().map(|t| t.access.dir).collect();
    assert_eq!(dirs, [Direction::Read, Direction::Write]);
}

#[test]
fn an_urgent_task_preempts_and_the_switch_costs_time_both_ways() {
    let mut rack = rack(vec![task("slow", "cpu", 0, 1_000_000), task("fast", "cpu", 5, 300_000)]);
    rack.tasks[1].offset_ns = 100_000;
    rack.processors.push(Processor { switch_ns: 10_000, ..Processor::new("cpu") });
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[Op::Exec(150_000)]);
    timing.set_program(1, &[Op::Exec(20_000)]);
    let log = run(&mut timing, 400_000);
    let ends: Vec<_> = log.jobs.iter().map(|j| (j.task, j.start, j.end)).collect();
    // fast: 100 + 10 switch + 20; slow: 100 done before, then 10 switch and the last 50
    assert_eq!(ends, [(1, 110_000, 130_000), (0, 0, 190_000)]);
}

#[test]
fn a_stalled_processor_is_busy_and_does_not_switch_tasks() {
    let mut rack = rack(vec![task("slow", "cpu", 0, 1_000_000), task("fast", "cpu", 5, 1_000_000)]);
    rack.tasks[1].offset_ns = 400;
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[read(), Op::Exec(100)]);
    timing.set_program(1, &[Op::Exec(10)]);
    let log = run(&mut timing, 10_000);
    let ends: Vec<_> = log.jobs.iter().map(|j| (j.task, j.start, j.end)).collect();
    // 300 + 335 + 300 stalled, then the urgent task, then the rest of the other
    assert_eq!(ends, [(1, 935, 945), (0, 0, 1045)]);
    assert_eq!((log.jobs[1].stalled_ns, log.jobs[1].execution_ns), (935, 100));
}

#[test]
fn overruns_skip_finish_late_or_trip_as_stated() {
    for (overrun, jobs) in [(Overrun::Skip, vec![0, 2, 4]), (Overrun::Late, vec![0, 1, 2, 3])] {
        let mut rack = rack(vec![task("control", "cpu", 0, 1000)]);
        rack.tasks[0].overrun = Some(overrun);
        let mut timing = Timing::new(rack).unwrap();
        timing.set_program(0, &[Op::Exec(1200)]);
        let log = run(&mut timing, 5_900);
        assert_eq!(log.jobs.iter().map(|j| j.job).take(4).collect::<Vec<_>>(), jobs, "{overrun:?}");
        assert!(log.jobs.iter().all(|j| j.release == Ns::from(j.job) * 1000));
        assert_eq!(timing.skipped(0), if overrun == Overrun::Skip { 3 } else { 0 });
    }
    let mut rack = rack(vec![task("control", "cpu", 0, 1000)]);
    rack.tasks[0].overrun = Some(Overrun::Trip);
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[Op::Exec(1200)]);
    assert_eq!(timing.advance(9_000, &mut Log::default()), Stop::Overrun { task: 0, job: 1 });
    assert_eq!(timing.now(), 1000);
}

#[test]
fn a_job_that_ends_at_the_next_release_has_not_overrun() {
    let mut timing = Timing::new(rack(vec![task("control", "cpu", 0, 1000)])).unwrap();
    timing.set_program(0, &[Op::Exec(1000)]);
    assert_eq!(run(&mut timing, 5_001).jobs.len(), 5);
    assert_eq!(timing.skipped(0), 0);
}

#[test]
fn two_cards_that_ask_at_once_are_served_by_level_and_then_by_slot() {
    for (levels, first) in [((3, 3), 0), ((2, 3), 1)] {
        let mut rack = rack(vec![task("a", "cpu-1", 0, 100_000), task("b", "cpu-2", 0, 100_000)]);
        for (name, level, slot) in [("cpu-1", levels.0, 2), ("cpu-2", levels.1, 3)] {
            rack.processors.push(Processor { level, slot: Some(slot), ..Processor::new(name) });
        }
        let mut timing = Timing::new(rack).unwrap();
        timing.set_program(0, &[read()]);
        timing.set_program(1, &[read()]);
        let log = run(&mut timing, 50_000);
        let (winner, loser) = (&log.transfers[0], &log.transfers[1]);
        let chain = |slot: u64| 300 + 30 * (slot - 1);
        assert_eq!(winner.task, first);
        assert_eq!(winner.granted, chain(2 + u64::from(first)));
        // the other waits for the whole tenure and is then arbitrated for
        assert_eq!(loser.granted, winner.done + chain(3 - u64::from(first)));
    }
}

#[test]
fn release_policies_differ_between_the_bursts_of_one_access() {
    // a long run of single cycles; a lower and a higher requester come in its second cycle
    let grants = |release, rival_level| {
        let mut rack = rack(vec![task("dma", "cpu", 0, 1_000_000)]);
        rack.processors.push(Processor { level: 2, release, ..Processor::new("cpu") });
        rack.traffic.push(traffic("rival", 2, rival_level, 1_000_000, 700));
        let mut timing = Timing::new(rack).unwrap();
        let run_of_4 = Access { am: AM, addr: RAM, width: Width::D16, dir: Direction::Read, n: 4 };
        timing.set_program(0, &[Op::Access(run_of_4)]);
        let log = run(&mut timing, 50_000);
        let of = |origin| *log.transfers.iter().find(|t| t.origin == origin).unwrap();
        (of(Origin::Traffic).granted, of(Origin::Program).done)
    };
    // cycles take 335: 300 … 635 … 970 … 1305 … 1640; the rival 330 + 335
    let kept = (1640 + 330, 1640);
    let yielded = (970 + 330, 1640 + 330 + 335 + 300);
    assert_eq!(grants(ReleasePolicy::WhenDone, 3), kept);
    assert_eq!(grants(ReleasePolicy::OnRequest, 3), yielded);
    assert_eq!(grants(ReleasePolicy::OnBclr, 3), yielded);
    assert_eq!(grants(ReleasePolicy::OnBclr, 1), kept);
}

#[test]
fn a_miss_ends_in_berr_and_is_tried_again_as_often_as_the_task_says() {
    let mut rack = rack(vec![task("control", "cpu", 0, 1_000_000)]);
    rack.tasks[0].retries = 1;
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[access(0x8000, Direction::Write), write()]);
    let log = run(&mut timing, 500_000);
    let seen: Vec<_> = log.transfers.iter().map(|t| (t.index, t.attempt, t.status, t.data_at)).collect();
    let berr = |granted: Ns| granted + 35 + 64_000;
    let (first, second) = (berr(300), berr(berr(300) + 100));
    assert_eq!(
        seen,
        [(0, 0, Status::BusError, first), (0, 1, Status::BusError, second), (1, 0, Status::Ok, second + 100 + 435)]
    );
    assert_eq!(timing.counters().bus_errors, 2);
}

#[test]
fn a_posted_write_returns_early_and_its_berr_comes_late_as_an_interrupt() {
    let mut rack = rack(vec![task("control", "cpu", 0, 1_000_000)]);
    rack.processors.push(Processor { posted_write_ns: Some(120), ..Processor::new("cpu") });
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[access(0x8000, Direction::Write), Op::Exec(100_000)]);
    let log = run(&mut timing, 500_000);
    let late = &log.transfers[0];
    assert!(late.posted && late.status == Status::BusError);
    assert_eq!(late.done, 300 + 35 + 64_000 + 100);
    // 120 to post, 100 µs of work, 10 µs of them interrupted by the handler
    assert_eq!(log.jobs[0].end, 120 + 100_000 + 10_000);
    assert_eq!(timing.counters().posted_errors, 1);
}

#[test]
fn a_second_posted_write_waits_for_the_buffer_and_a_read_for_the_writes() {
    let mut rack = rack(vec![task("control", "cpu", 0, 1_000_000)]);
    rack.processors.push(Processor { posted_write_ns: Some(120), ..Processor::new("cpu") });
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[write(), write(), read()]);
    let log = run(&mut timing, 500_000);
    let (a, b, c) = (log.transfers[0], log.transfers[1], log.transfers[2]);
    assert_eq!(times(&a), (0, 300, 735, 835));
    assert_eq!(times(&b), (835, 835, 1270, 1370));
    assert_eq!((c.requested, c.granted), (835 + 120, 1370));
}

fn interrupter(name: &str, card: &str, level: u8, ticks: Option<Ticks>) -> Interrupter {
    let (name, card) = (name.into(), card.into());
    Interrupter { name, card, level, status_id: 0x40, release: IrqRelease::Roak, answer_ns: 350, ticks, local: false }
}

#[test]
fn an_interrupt_is_acknowledged_over_the_bus_and_releases_its_task() {
    let mut rack = rack(vec![task("force", "cpu", 0, 100_000)]);
    rack.tasks[0].release = Release::Interrupt("sample".into());
    let ticks = Ticks { period_ns: 125_000, offset_ns: 1_000 };
    rack.interrupters.push(interrupter("sample", "ram", 5, Some(ticks)));
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[Op::Exec(10), read()]);
    let log = run(&mut timing, 200_000);
    // arbitration, IACK: 35 + answer 350 + nine slots of chain, 100, read stall 300, then 10 µs to the handler
    let data = 1_000 + 300 + 35 + 350 + 9 * 30;
    let handler = data + 100 + 300 + 10_000;
    assert_eq!((log.transfers[0].origin, log.transfers[0].data_at), (Origin::Iack, data));
    assert_eq!((log.jobs[0].release, log.jobs[0].job), (handler, 0));
    assert_eq!(log.jobs[1].job, 1);
    assert_eq!((timing.counters().interrupts, timing.counters().merged_interrupts), (2, 0));
}

#[test]
fn a_rora_interrupter_needs_a_register_write_before_it_lets_go() {
    let mut rack = rack(vec![task("force", "cpu", 0, 100_000)]);
    rack.tasks[0].release = Release::Interrupt("sample".into());
    rack.interrupters.push(Interrupter {
        release: IrqRelease::Rora { am: AM, addr: RAM, width: Width::D16 },
        ..interrupter("sample", "ram", 5, Some(Ticks { period_ns: 12_000, offset_ns: 0 }))
    });
    let mut timing = Timing::new(rack).unwrap();
    let log = run(&mut timing, 24_000);
    let origins: Vec<_> = log.transfers.iter().map(|t| t.origin).collect();
    assert_eq!(origins, [Origin::Iack, Origin::InterruptRelease, Origin::Iack, Origin::InterruptRelease]);
    assert_eq!(log.jobs[0].release, log.transfers[1].done);
}

#[test]
fn the_highest_irq_level_is_served_first_and_then_the_nearest_slot() {
    let mut rack = rack(vec![]);
    rack.processors.push(Processor::new("cpu"));
    let at_once = Some(Ticks { period_ns: 1_000_000, offset_ns: 100 });
    for (i, (slot, level)) in [(12, 3), (11, 3), (13, 6)].into_iter().enumerate() {
        let name = format!("card-{i}");
        rack.slaves.push(Slave { name: name.clone(), slot, base: 0x4000 + 0x1000 * i as u32, ..ram() });
        rack.interrupters.push(interrupter(&name, &name, level, at_once));
        let mut task = task(&name, "cpu", 0, 1_000_000);
        task.release = Release::Interrupt(name);
        rack.tasks.push(task);
    }
    let mut timing = Timing::new(rack).unwrap();
    let log = run(&mut timing, 500_000);
    // all handlers run before the tasks they release
    let mut released: Vec<_> = log.jobs.iter().map(|j| (j.release, j.task)).collect();
    released.sort_unstable();
    assert_eq!(released.iter().map(|r| r.1).collect::<Vec<_>>(), [2, 1, 0]);
}

#[test]
fn a_mailbox_write_by_one_card_releases_a_task_on_the_other() {
    let mut rack = rack(vec![task("first", "cpu-1", 0, 1_000_000), task("second", "cpu-2", 0, 1_000_000)]);
    rack.tasks[1].release = Release::Interrupt("mailbox".into());
    rack.processors.push(Processor { slot: Some(1), ..Processor::new("cpu-1") });
    rack.processors.push(Processor { slot: Some(2), interrupt_ns: 2_000, ..Processor::new("cpu-2") });
    rack.slaves.push(Slave { name: "cpu-2".into(), slot: 2, base: 0x9000, monitor: Some("mailbox".into()), ..ram() });
    rack.interrupters.push(Interrupter { local: true, ..interrupter("mailbox", "cpu-2", 1, None) });
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[access(0x9000, Direction::Write)]);
    let log = run(&mut timing, 100_000);
    assert_eq!(log.jobs[1].release, log.transfers[0].data_at + 2_000);
    assert!(log.transfers.iter().all(|t| t.origin != Origin::Iack));
}

#[test]
fn polling_occupies_the_bus_until_the_event_has_come() {
    let mut rack = rack(vec![task("force", "cpu", 0, 100_000)]);
    rack.interrupters.push(interrupter("sample", "ram", 5, Some(Ticks { period_ns: 100_000, offset_ns: 5_000 })));
    rack.tasks[0].release =
        Release::Poll(Poll { interrupter: "sample".into(), am: AM, addr: RAM, width: Width::D16, interval_ns: 365 });
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[Op::Exec(10)]);
    let log = run(&mut timing, 99_000);
    // a look every 335 + 300 + 365 = 1000, the first at 300; sampled 235 after its grant
    let samples: Vec<_> = log.transfers.iter().filter(|t| t.origin == Origin::Poll).map(|t| t.data_at).collect();
    assert_eq!(&samples[..3], [535, 1535, 2535]);
    assert_eq!(log.jobs.len(), 1);
    // 5535 is the first sample at or after the event
    assert_eq!(log.jobs[0].release, 5_535 + 100 + 300);
    assert!(log.transfers.iter().all(|t| t.origin == Origin::Poll), "no interrupt beside the polling");
}

#[test]
fn a_workstation_reaches_the_bus_through_its_adaptor() {
    let mut rack = rack(vec![task("telemetry", "sun", 0, 10_000_000)]);
    rack.adaptors.push(crate::adaptor::Adaptor::new("vme-vme", crate::adaptor::Kind::VmeVme, 5));
    rack.processors.push(Processor { adaptor: Some("vme-vme".into()), ..Processor::new("sun") });
    let mut timing = Timing::new(rack).unwrap();
    let block = Access { am: 0x3B, addr: RAM, width: Width::D16, dir: Direction::Read, n: 512 };
    timing.set_program(0, &[read(), Op::Access(block)]);
    let log = run(&mut timing, 1_000_000);
    let single = &log.transfers[0];
    assert_eq!(times(single), (950, 950 + 420, 950 + 420 + 235, 950 + 420 + 335));
    let dma = &log.transfers[1];
    assert_eq!(dma.requested, single.done + 950 + 20_000);
    // four blocks of 35 + 128 · 300 at the RAM's rate, faster than which the link would be
    assert_eq!(dma.done - dma.granted, 4 * (35 + 128 * 300));
    assert_eq!(timing.master_name(dma.master), Some("vme-vme"));
}

#[test]
fn without_its_cable_the_adaptor_fails_on_both_sides() {
    let mut rack = rack(vec![task("telemetry", "sun", 0, 1_000_000), task("control", "cpu", 0, 1_000_000)]);
    rack.adaptors.push(crate::adaptor::Adaptor::new("vme-vme", crate::adaptor::Kind::VmeVme, 5));
    rack.processors.push(Processor { adaptor: Some("vme-vme".into()), ..Processor::new("sun") });
    rack.slaves.push(Slave { name: "vme-vme".into(), slot: 5, base: 0x9000, adaptor: Some("vme-vme".into()), ..ram() });
    let cut = Fault { from_ns: 900_000, until_ns: Ns::MAX, kind: FaultKind::CableOut(0) };
    let mut timing = Timing::with_faults(rack, FaultPlan { faults: vec![cut] }).unwrap();
    timing.set_program(0, &[read()]);
    timing.set_program(1, &[access(0x9000, Direction::Read)]);
    let mut log = Log::default();
    assert_eq!(timing.advance(2_000_000, &mut log), Stop::Fault { fault: 0 });
    assert!(log.transfers.iter().all(|t| t.status == Status::Ok));
    log.transfers.clear();
    timing.advance(2_000_000, &mut log);
    let failed: Vec<_> = log.transfers.iter().map(|t| (t.task, t.status, t.done)).collect();
    assert_eq!(failed[0], (0, Status::BusError, 1_010_000));
    assert_eq!((failed[1].0, failed[1].1), (1, Status::BusError));
}

#[test]
fn a_stuck_bus_and_a_starved_master_end_in_access_timeouts() {
    for kind in [FaultKind::StuckBus, FaultKind::Starvation(0)] {
        let mut rack = rack(vec![task("control", "cpu", 0, 1_000_000)]);
        rack.bus.access_timer_ns = 100_000;
        let fault = Fault { from_ns: 0, until_ns: 250_000, kind };
        let mut timing = Timing::with_faults(rack, FaultPlan { faults: vec![fault] }).unwrap();
        timing.set_program(0, &[read(), read(), read()]);
        let mut log = Log::default();
        assert_eq!(timing.advance(900_000, &mut log), Stop::Fault { fault: 0 });
        timing.advance(900_000, &mut log);
        let ends: Vec<_> = log.transfers.iter().map(|t| (t.status, t.done)).collect();
        let lost = |done| (Status::AccessTimeout, done);
        let third = 250_000 + 300 + 335;
        assert_eq!(ends, [lost(100_000), lost(200_300), (Status::Ok, third)], "{kind:?}");
    }
}

#[test]
fn lost_interrupts_slow_tasks_and_halted_ones_show_in_their_jobs() {
    let mut rack = rack(vec![task("force", "cpu", 0, 100_000), task("log", "cpu-2", 0, 100_000)]);
    rack.tasks[0].release = Release::Interrupt("sample".into());
    rack.interrupters.push(interrupter("sample", "ram", 5, Some(Ticks { period_ns: 100_000, offset_ns: 0 })));
    let faults = vec![
        Fault { from_ns: 150_000, until_ns: 350_000, kind: FaultKind::LostInterrupt(0) },
        Fault { from_ns: 400_000, until_ns: 500_000, kind: FaultKind::Slow { task: 1, percent: 300 } },
        Fault { from_ns: 600_500, until_ns: 750_000, kind: FaultKind::Halt(1) },
    ];
    let mut timing = Timing::with_faults(rack, FaultPlan { faults }).unwrap();
    timing.set_program(1, &[Op::Exec(1_000)]);
    let mut log = Log::default();
    let mut stops = Vec::new();
    while timing.now() < 1_000_000 {
        stops.push((timing.advance(1_000_000, &mut log), timing.now()));
    }
    let begins = [(0, 150_000), (1, 400_000), (2, 600_500)].map(|(fault, at)| (Stop::Fault { fault }, at));
    assert_eq!(stops[..3], begins);
    let jobs = |task| log.jobs.iter().filter(|j| j.task == task).collect::<Vec<_>>();
    assert_eq!(jobs(0).iter().map(|j| j.job).collect::<Vec<_>>(), [0, 1, 4, 5, 6, 7, 8, 9]);
    let log_jobs = jobs(1);
    assert_eq!(log_jobs.iter().map(|j| j.job).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 8, 9]);
    assert_eq!(log_jobs[4].end - log_jobs[4].release, 3_000);
}

#[test]
fn a_card_that_misses_two_ticks_looks_for_the_next_ones_itself() {
    let mut rack = rack(vec![task("reader", "cpu", 0, 100_000)]);
    rack.tasks[0].release = Release::Interrupt("sample".into());
    rack.interrupters.push(interrupter("sample", "ram", 5, Some(Ticks { period_ns: 100_000, offset_ns: 0 })));
    let faults = vec![Fault { from_ns: 150_000, until_ns: 650_000, kind: FaultKind::LostInterrupt(0) }];
    let mut timing = Timing::with_faults(rack, FaultPlan { faults }).unwrap();
    timing.set_program(0, &[Op::Exec(1_000)]);
    let mut log = Log::default();
    while timing.now() < 1_000_000 {
        timing.advance(1_000_000, &mut log);
    }
    assert_eq!(log.jobs.iter().map(|job| job.job).collect::<Vec<_>>(), [0, 1, 4, 5, 6, 7, 8, 9]);
}

#[test]
fn round_robin_is_fair_among_levels_that_all_want_more_than_the_bus() {
    let mut rack = rack(vec![]);
    rack.bus.arbiter = Mode::Rrs;
    rack.bus.chain_ns = 0;
    rack.traffic = (0..4).map(|level| traffic(&format!("t{level}"), 2 + level, level, 100, 0)).collect();
    let mut timing = Timing::new(rack).unwrap();
    let log = run(&mut timing, 635 * 1000);
    for level in 0..4 {
        let served = log.transfers.iter().filter(|t| t.task == level).count();
        assert!((249..=250).contains(&served), "level {level}: {served}");
    }
}

#[test]
fn a_transfer_over_a_link_that_fails_its_parity_check_ends_in_berr_and_beside_the_map_in_the_adaptor() {
    let mut rack = rack(vec![task("telemetry", "sun", 0, 100_000)]);
    let mut adaptor = crate::adaptor::Adaptor::new("vme-vme", crate::adaptor::Kind::VmeVme, 5);
    adaptor.maps.push(crate::adaptor::Map { remote_base: 0, base: RAM, size: 2 });
    rack.adaptors.push(adaptor);
    rack.processors.push(Processor { adaptor: Some("vme-vme".into()), ..Processor::new("sun") });
    let spoilt = Fault { from_ns: 100_000, until_ns: 200_000, kind: FaultKind::Parity(0) };
    let mut timing = Timing::with_faults(rack, FaultPlan { faults: vec![spoilt] }).unwrap();
    timing.set_program(0, &[read(), write()]);
    let mut log = Log::default();
    while timing.advance(300_000, &mut log) != Stop::Limit {}
    let ends: Vec<_> = log.transfers.iter().map(|t| (t.status, t.held_ns > 0)).collect();
    let (good, spoilt, unmapped) = ((Status::Ok, true), (Status::BusError, true), (Status::BusError, false));
    assert_eq!(ends, [good, unmapped, spoilt, unmapped, good, unmapped]);
    let counters = timing.counters();
    assert_eq!((counters.parity_errors, counters.bus_errors), (1, 4));
}

#[test]
fn with_constant_latency_nobody_waits_for_anybody() {
    let mut rack = rack(vec![task("a", "cpu-1", 0, 100_000), task("b", "cpu-2", 0, 100_000)]);
    rack.bus.constant_ns = Some(700);
    let mut timing = Timing::new(rack).unwrap();
    timing.set_program(0, &[read(), access(0x8000, Direction::Read), write()]);
    timing.set_program(1, &[Op::Exec(50), read()]);
    let log = run(&mut timing, 50_000);
    let seen: Vec<_> = log.transfers.iter().map(|t| (t.task, t.requested, t.data_at, t.status)).collect();
    let (ok, miss) = (Status::Ok, Status::BusError);
    assert_eq!(seen, [(0, 0, 700, ok), (1, 50, 750, ok), (0, 700, 1400, miss), (0, 1400, 2100, ok)]);
    assert_eq!(
        log.jobs.iter().map(|j| (j.task, j.end, j.stalled_ns)).collect::<Vec<_>>(),
        [(1, 750, 700), (0, 2100, 2100)]
    );
}

/// A task that its own card's interrupter releases, at once: by a tick at 5 µs, and whenever a job raises it.
fn released_by_itself(overrun: Overrun, interrupt_ns: Ns) -> Timing {
    let mut rack = rack(vec![Task { overrun: Some(overrun), ..task("loop", "cpu", 0, 100_000) }]);
    rack.processors.push(Processor { interrupt_ns, ..Processor::new("cpu") });
    rack.tasks[0].release = Release::Interrupt("self".into());
    let ticks = Ticks { period_ns: 100_000, offset_ns: 5_000 };
    rack.interrupters.push(Interrupter { local: true, ..interrupter("self", "cpu", 3, Some(ticks)) });
    Timing::new(rack).unwrap()
}

#[test]
fn a_task_that_releases_itself_in_no_time_is_named_and_time_stands_still() {
    let mut timing = released_by_itself(Overrun::Late, 0);
    timing.set_program(0, &[Op::Raise(3)]);
    let mut log = Log::default();
    for _ in 0..2 {
        assert_eq!(timing.advance(1_000_000, &mut log), Stop::Endless { task: 0 });
    }
    let (task, processor) = ("loop".into(), "cpu".into());
    assert_eq!(timing.endless(0), RackError::Endless { task, processor, at_ns: 5_000 });
}

#[test]
fn a_task_that_decides_and_releases_itself_in_no_time_is_found_too() {
    let mut timing = released_by_itself(Overrun::Late, 0);
    timing.set_program(0, &[Op::Decide]);
    let mut decisions = 0;
    let mut ahead = timing.clone();
    // as in lock step, where the windows' copies follow each other
    let last = loop {
        match timing.advance(1_000_000, &mut Log::default()) {
            Stop::Decision { task, .. } => timing.resume(task, &[Op::Raise(3)]),
            stop => break stop,
        }
        ahead.clone_from(&timing);
        std::mem::swap(&mut ahead, &mut timing);
        decisions += 1;
    };
    assert_eq!((last, timing.now()), (Stop::Endless { task: 0 }, 5_000));
    assert!(decisions > 1_000);
}

#[test]
fn a_task_that_releases_itself_goes_on_where_that_takes_time_or_the_release_is_lost() {
    for (overrun, interrupt_ns, jobs) in [(Overrun::Late, 10, 9_498), (Overrun::Skip, 0, 1)] {
        let mut timing = released_by_itself(overrun, interrupt_ns);
        timing.set_program(0, &[Op::Raise(3)]);
        assert_eq!(run(&mut timing, 100_000).jobs.len(), jobs, "{overrun:?}");
    }
}

#[test]
fn a_task_that_polls_a_status_bit_in_no_time_is_named() {
    let mut rack = rack(vec![task("force", "cpu", 0, 100_000)]);
    rack.bus = crate::rack::Bus {
        arbitration_ns: 0,
        chain_ns: 0,
        address_ns: 0,
        handshake_ns: 0,
        read_stall_ns: 0,
        ..crate::rack::Bus::default()
    };
    rack.slaves[0].read_ns = 0;
    rack.interrupters.push(interrupter("sample", "ram", 5, None));
    rack.tasks[0].release =
        Release::Poll(Poll { interrupter: "sample".into(), am: AM, addr: RAM, width: Width::D16, interval_ns: 0 });
    let mut timing = Timing::new(rack).unwrap();
    assert_eq!(timing.advance(1_000_000, &mut Log::default()), Stop::Endless { task: 0 });
}
