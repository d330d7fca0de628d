//! `vmerack bus show` for people: memory map, masters, bus programs with their worst cases, and the rack
//! drawn as text.

use report::BusAccount;
use std::fmt::{self, Display, Write};
use vme::analysis::{self, Bounds};
use vme::cycle::address_bits;
use vme::rack::{Overrun, Rack, Release};
use vme::traffic::Arrivals;
use vme::{Access, Direction, Ns, Op, Program, RackError, Timing};

/// All of it. `programs[t]` is what task `t` does in its longest job; a task without an entry is shown
/// without a program, and no bounds are claimed then. Observed maxima stand beside the bounds where there is an account.
pub fn rack(rack: &Rack, programs: &[Program], observed: Option<&BusAccount>) -> Result<String, RackError> {
    let timing = Timing::new(rack.clone())?;
    let rack = timing.rack();
    let known = programs.len() >= rack.tasks.len();
    let bounds = known.then(|| analysis::bounds(&timing, programs));
    let mut text = String::new();
    // Writing into a String cannot fail.
    let _ = drawing(&mut text, rack)
        .and_then(|()| memory_map(&mut text, rack))
        .and_then(|()| masters(&mut text, rack))
        .and_then(|()| tasks(&mut text, rack, programs, bounds.as_ref(), observed));
    Ok(text)
}

/// The chassis from the front: a column for each slot, names written downwards.
fn drawing(out: &mut String, rack: &Rack) -> fmt::Result {
    let slots = rack.slots().unwrap_or_default();
    let height = slots.iter().flatten().map(|name| name.chars().count()).max().unwrap_or(0);
    let border: String = slots[1..].iter().map(|_| "+---").collect::<String>() + "+";
    writeln!(out, "Rack (arbiter {} in slot 1)\n", rack.bus.arbiter)?;
    writeln!(out, "{border}")?;
    let numbers: String = (1..slots.len()).map(|slot| format!("|{slot:>2} ")).collect();
    writeln!(out, "{numbers}|\n{border}")?;
    for row in 0..height {
        let letter = |name: &Option<String>| name.as_ref().and_then(|name| name.chars().nth(row)).unwrap_or(' ');
        let line: String = slots[1..].iter().map(|name| format!("| {} ", letter(name))).collect();
        writeln!(out, "{line}|")?;
    }
    writeln!(out, "{border}")?;
    for adaptor in &rack.adaptors {
        let beyond: Vec<&str> = (rack.processors.iter().filter(|p| p.adaptor.as_ref() == Some(&adaptor.name)))
            .map(|p| p.name.as_str())
            .chain(rack.traffic.iter().filter(|t| t.adaptor.as_ref() == Some(&adaptor.name)).map(|t| t.name.as_str()))
            .collect();
        let cable = if adaptor.link { "=====" } else { "== / ==" };
        writeln!(out, "slot {} {} {cable} {} {cable} {}", adaptor.slot, adaptor.name, adaptor.kind, beyond.join(", "))?;
    }
    Ok(())
}

fn memory_map(out: &mut String, rack: &Rack) -> fmt::Result {
    writeln!(out, "\nMemory map\n")?;
    writeln!(out, "{:<4} {:>10} {:>10} {:>4} {:>5} {:>4} {:>8} {:>8}  card", "", "first", "last", "AM", "width", "slot", "read ns", "write ns")?;
    let mut windows: Vec<_> = rack.slaves.iter().collect();
    windows.sort_by_key(|slave| (address_bits(slave.am), slave.base));
    for slave in windows {
        let bits = address_bits(slave.am).map_or("?".into(), |bits| format!("A{bits}"));
        let last = slave.base + (slave.size - 1);
        write!(out, "{bits:<4} {:>#10x} {last:>#10x} {:>4X} {:>5} {:>4} ", slave.base, slave.am, format!("{:?}", slave.width), slave.slot)?;
        write!(out, "{:>8} {:>8}  {}", slave.read_ns, slave.write_ns, slave.name)?;
        if let Some(adaptor) = &slave.adaptor {
            write!(out, ", through {adaptor} to {:#x}", slave.remote_base.unwrap_or(slave.base))?;
        }
        if let Some(interrupter) = &slave.monitor {
            write!(out, ", a write raises {interrupter}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn masters(out: &mut String, rack: &Rack) -> fmt::Result {
    writeln!(out, "\nMasters\n")?;
    for processor in rack.processors.iter() {
        match (&processor.adaptor, processor.slot) {
            (Some(adaptor), _) => writeln!(out, "{} through {adaptor}", processor.name)?,
            (None, slot) => {
                let slot = slot.map_or("?".into(), |slot| slot.to_string());
                writeln!(out, "{}: slot {slot}, BR{}*, {}", processor.name, processor.level, processor.release)?;
            }
        }
    }
    for adaptor in &rack.adaptors {
        writeln!(out, "{}: slot {}, BR{}*, {}", adaptor.name, adaptor.slot, adaptor.level, adaptor.release)?;
        for map in &adaptor.maps {
            let last = map.base + (map.size - 1);
            writeln!(out, "  maps {:#x} to {last:#x} to {:#x} of the workstation's bus", map.base, map.remote_base)?;
        }
    }
    for traffic in &rack.traffic {
        let arrivals = match traffic.arrivals {
            Arrivals::Periodic => "traffic every",
            Arrivals::Poisson => "Poisson traffic, on the average every",
        };
        write!(out, "{}: {arrivals} {} ns, ", traffic.name, traffic.period_ns)?;
        match (&traffic.adaptor, traffic.slot) {
            (None, Some(slot)) => write!(out, "slot {slot}, BR{}*, {}: ", traffic.level, traffic.release)?,
            _ => write!(out, "through {}: ", traffic.adaptor.as_deref().unwrap_or("?"))?,
        }
        access(out, rack, &traffic.access())?;
    }
    for interrupter in &rack.interrupters {
        let wire = if interrupter.local { "local".into() } else { format!("IRQ{}*", interrupter.level) };
        writeln!(out, "{}: interrupter on {}, {wire}, status/ID {:#04x}", interrupter.name, interrupter.card, interrupter.status_id)?;
    }
    Ok(())
}

fn tasks(
    out: &mut String,
    rack: &Rack,
    programs: &[Program],
    bounds: Option<&Bounds>,
    observed: Option<&BusAccount>,
) -> fmt::Result {
    for (t, task) in rack.tasks.iter().enumerate() {
        write!(out, "\nTask {} of {} on {}, priority {}, {}", task.name, task.board, task.processor, task.priority, released(task))?;
        writeln!(out, "; an overrun {}", overrun(task.overrun.unwrap_or_default()))?;
        let Some(program) = programs.get(t) else {
            writeln!(out, "  (its board sets the program when it boots)")?;
            continue;
        };
        for op in program {
            write!(out, "  ")?;
            match op {
                Op::Exec(ns) => writeln!(out, "execute {ns} ns")?,
                Op::Access(of) => access(out, rack, of)?,
                Op::Raise(level) => writeln!(out, "raise IRQ{level}*")?,
                Op::Decide => writeln!(out, "decide")?,
            }
        }
        if let Some(bounds) = bounds {
            writeln!(out, "  worst case: one access {}, the job {}", bound(bounds.access[t]), bound(bounds.response[t]))?;
        }
        if let Some(task) = observed.and_then(|account| account.tasks.get(t)) {
            write!(out, "  observed:   one access {} ns, the job {} ns", task.access_max_ns, task.response_max_ns)?;
            write!(out, "; {:.1} accesses keep the bus for {:.3} µs a job", task.accesses_per_job, 1e-3 * task.bus_per_job_ns)?;
            writeln!(out, "; {} jobs, {} lost releases", task.jobs, task.lost_releases)?;
        }
    }
    Ok(())
}

fn overrun(policy: Overrun) -> &'static str {
    match policy {
        Overrun::Skip => "skips the release",
        Overrun::Late => "lets the job finish late",
        Overrun::Trip => "trips the card",
    }
}

fn released(task: &vme::rack::Task) -> impl Display + '_ {
    match &task.release {
        Release::Timer => format!("every {} ns", task.period_ns),
        Release::Interrupt(name) => format!("by the interrupt {name}"),
        Release::Poll(poll) => format!("polls {:#x} for {} every {} ns", poll.addr, poll.interrupter, poll.interval_ns),
    }
}

fn access(out: &mut String, rack: &Rack, access: &Access) -> fmt::Result {
    let kind = match access.dir {
        _ if access.is_address_only() => "address-only",
        _ if access.reads_and_modifies() => "read-modify-write",
        Direction::Read => "read",
        Direction::Write => "write",
    };
    let slave = rack.slaves.iter().find(|slave| slave.answers(access)).map_or("nobody", |slave| slave.name.as_str());
    writeln!(out, "{kind} {:?} × {} at {:#x} ({slave})", access.width, access.n, access.addr)
}

fn bound(bound: Option<Ns>) -> String {
    bound.map_or("none".into(), |ns| format!("{ns} ns"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vme::Width;

    fn figure_6_1() -> Rack {
        scenario::builtin::figure_6_1()
    }

    #[test]
    fn every_card_of_figure_6_1_stands_in_the_drawing_and_in_the_memory_map() {
        let rack = figure_6_1();
        let text = super::rack(&rack, &[], None).unwrap();
        for slave in &rack.slaves {
            let line = text.lines().find(|line| line.split("  ").any(|cell| cell.split(",").next() == Some(&slave.name)));
            assert!(line.is_some_and(|line| line.contains(&format!("{:#x}", slave.base))), "{}\n{text}", slave.name);
        }
        assert!(text.contains("| 1 | 2 | 3 |"));
    }

    #[test]
    fn programs_are_shown_with_the_cards_they_meet_and_their_worst_cases() {
        let rack = figure_6_1();
        let slave = &rack.slaves[0];
        let read = Access { am: slave.am, addr: slave.base, width: Width::D16, dir: Direction::Read, n: 1 };
        let mut programs = vec![Program::new(); rack.tasks.len()];
        programs[0] = vec![Op::Exec(500), Op::Access(read), Op::Decide];
        let text = super::rack(&rack, &programs, None).unwrap();
        assert!(text.contains(&format!("read D16 × 1 at {:#x} ({})", slave.base, slave.name)), "{text}");
        assert!(text.contains("worst case: one access") && !text.contains("the job none"), "{text}");
    }

    #[test]
    fn a_program_that_no_board_answers_is_refused() {
        let rack = figure_6_1();
        let miss = Access { am: 0x3D, addr: 0xFF_0000, width: Width::D16, dir: Direction::Read, n: 1 };
        let error = rack.check_program(0, &[Op::Access(miss)]).unwrap_err();
        assert!(matches!(error, RackError::NoSlave { addr: 0xFF_0000, .. }), "{error}");
    }
}
