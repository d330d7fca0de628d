//! The rack as the timing plane walks it: names resolved to indices, once.

use crate::Ns;
use crate::arbiter::{Place, SLOTS};
use crate::check::RackError;
use crate::cycle;
use crate::program::Access;
use crate::rack::{Rack, Release};
use crate::requester::ReleasePolicy;
use crate::timer::Ticks;

/// Where an event comes from. Events of one instant are taken in the order of this list: what ends
/// before what begins, then the processors choose among all that they could do, and at last the
/// arbiter among all who ask.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    Fault,
    Bus,
    Processor(u16),
    Interrupter(u16),
    Task(u16),
    Traffic(u16),
    AccessTimer(u16),
    Dispatch(u16),
    Arbiter,
}

/// A master on the bus.
#[derive(Clone, Debug)]
pub(crate) struct Master {
    pub name: String,
    pub place: Place,
    pub release: ReleasePolicy,
}

#[derive(Debug)]
pub(crate) struct IrqWire {
    /// Processor that handles it.
    pub handler: u16,
    pub slot: u8,
    /// Tasks that its interrupt releases.
    pub tasks: Vec<u16>,
    /// A task polls its status bit: no interrupt.
    pub polled: bool,
}

#[derive(Debug)]
pub(crate) struct Wiring {
    pub rack: Rack,
    pub masters: Vec<Master>,
    /// Master in each slot.
    pub master_in_slot: [u16; SLOTS as usize + 1],
    /// For each processor its master, and the adaptor that it works through.
    pub processors: Vec<(u16, Option<u16>)>,
    pub processor_of_task: Vec<u16>,
    /// For each processor its tasks, most urgent first.
    pub tasks_of_processor: Vec<Vec<u16>>,
    /// For each task the interrupter that it polls.
    pub polls: Vec<Option<u16>>,
    pub ticks: Vec<Ticks>,
    /// For each generator its master and adaptor.
    pub traffic: Vec<(u16, Option<u16>)>,
    pub irqs: Vec<IrqWire>,
    /// For each slave its window: modifier of single cycles, first address, bytes.
    windows: Vec<(u8, u32, u32)>,
    /// For each slave its location monitor's interrupter and its adaptor.
    pub slaves: Vec<(Option<u16>, Option<u16>)>,
    pub sources: Vec<Source>,
}

impl Wiring {
    pub fn new(rack: Rack) -> Result<Wiring, RackError> {
        let rack = rack.checked()?;
        let index = |found: Option<usize>| found.map(|i| i as u16);
        let adaptor =
            |name: &Option<String>| index(name.as_ref().and_then(|n| rack.adaptors.iter().position(|a| a.name == *n)));
        let interrupter = |name: &str| index(rack.interrupters.iter().position(|i| i.name == *name));

        let mut masters = Vec::new();
        let mut add = |name: &str, level, slot: Option<u8>, release| {
            let place = Place { level, slot: slot.unwrap_or(SLOTS) };
            masters.push(Master { name: name.into(), place, release });
            masters.len() as u16 - 1
        };
        let own: Vec<Option<u16>> = rack
            .processors
            .iter()
            .map(|p| p.adaptor.is_none().then(|| add(&p.name, p.level, p.slot, p.release)))
            .collect();
        let adaptors: Vec<u16> = rack.adaptors.iter().map(|a| add(&a.name, a.level, Some(a.slot), a.release)).collect();
        let generators: Vec<Option<u16>> = rack
            .traffic
            .iter()
            .map(|t| t.adaptor.is_none().then(|| add(&t.name, t.level, t.slot, t.release)))
            .collect();
        let mut master_in_slot = [u16::MAX; SLOTS as usize + 1];
        for (i, master) in masters.iter().enumerate() {
            master_in_slot[master.place.slot as usize] = i as u16;
        }
        // the checks have made sure that whoever has no requester of its own names an adaptor
        let carried = |own: Option<u16>, adaptor: Option<u16>| {
            (own.or(adaptor.map(|a| adaptors[a as usize])).unwrap_or_default(), adaptor)
        };
        let processors: Vec<_> =
            rack.processors.iter().zip(own).map(|(p, own)| carried(own, adaptor(&p.adaptor))).collect();
        let traffic = rack.traffic.iter().zip(generators).map(|(t, own)| carried(own, adaptor(&t.adaptor))).collect();

        let processor_index = |name: &str| rack.processors.iter().position(|p| p.name == *name);
        let processor_of_task: Vec<u16> =
            rack.tasks.iter().map(|t| processor_index(&t.processor).unwrap_or_default() as u16).collect();
        let tasks_of_processor = (0..rack.processors.len())
            .map(|p| {
                let mut tasks: Vec<u16> =
                    (0..rack.tasks.len() as u16).filter(|&t| processor_of_task[t as usize] == p as u16).collect();
                tasks.sort_by_key(|&t| (std::cmp::Reverse(rack.tasks[t as usize].priority), t));
                tasks
            })
            .collect();
        let polls: Vec<Option<u16>> = rack
            .tasks
            .iter()
            .map(|task| match &task.release {
                Release::Poll(poll) => interrupter(&poll.interrupter),
                _ => None,
            })
            .collect();

        let slots = rack.slots()?;
        let first = rack.processors.iter().position(|p| p.adaptor.is_none());
        let irqs = rack
            .interrupters
            .iter()
            .enumerate()
            .map(|(i, spec)| {
                let claimed = rack.processors.iter().position(|p| p.handles.contains(&spec.level));
                let handler = if spec.local { processor_index(&spec.card) } else { claimed.or(first) };
                let released = |release: &Release| matches!(release, Release::Interrupt(name) if *name == spec.name);
                IrqWire {
                    handler: handler.unwrap_or_default() as u16,
                    slot: slots.iter().position(|s| s.as_ref() == Some(&spec.card)).unwrap_or(1) as u8,
                    tasks: (0..rack.tasks.len() as u16)
                        .filter(|&t| released(&rack.tasks[t as usize].release))
                        .collect(),
                    polled: polls.contains(&Some(i as u16)),
                }
            })
            .collect();
        let slaves =
            rack.slaves.iter().map(|s| (s.monitor.as_deref().and_then(interrupter), adaptor(&s.adaptor))).collect();
        let ticks = rack.tasks.iter().map(|t| Ticks { period_ns: t.period_ns, offset_ns: t.offset_ns }).collect();

        let mut sources = vec![Source::Fault, Source::Bus];
        sources.extend((0..rack.processors.len() as u16).map(Source::Processor));
        sources.extend((0..rack.interrupters.len() as u16).map(Source::Interrupter));
        sources.extend((0..rack.tasks.len() as u16).map(Source::Task));
        sources.extend((0..rack.traffic.len() as u16).map(Source::Traffic));
        sources.extend((0..masters.len() as u16).map(Source::AccessTimer));
        sources.extend((0..rack.processors.len() as u16).map(Source::Dispatch));
        sources.push(Source::Arbiter);
        Ok(Wiring {
            masters,
            master_in_slot,
            processors,
            processor_of_task,
            tasks_of_processor,
            polls,
            ticks,
            traffic,
            irqs,
            windows: rack.slaves.iter().map(|s| (cycle::single(s.am), s.base, s.size)).collect(),
            slaves,
            sources,
            rack,
        })
    }

    // places of the sources in the list of due times
    pub const FAULT: usize = 0;
    pub const BUS: usize = 1;
    pub fn processor(&self, p: u16) -> usize {
        2 + p as usize
    }
    pub fn interrupter(&self, i: u16) -> usize {
        2 + self.rack.processors.len() + i as usize
    }
    pub fn task(&self, t: u16) -> usize {
        self.interrupter(0) + self.rack.interrupters.len() + t as usize
    }
    pub fn traffic(&self, g: u16) -> usize {
        self.task(0) + self.rack.tasks.len() + g as usize
    }
    pub fn access_timer(&self, m: u16) -> usize {
        self.traffic(0) + self.rack.traffic.len() + m as usize
    }
    pub fn dispatch(&self, p: u16) -> usize {
        self.access_timer(0) + self.masters.len() + p as usize
    }
    pub fn arbiter(&self) -> usize {
        self.sources.len() - 1
    }

    /// The window that an access meets.
    pub fn slave(&self, access: &Access) -> Option<u16> {
        let am = cycle::single(access.am);
        let holds = |&(of, base, size): &(u8, u32, u32)| of == am && access.addr.wrapping_sub(base) < size;
        self.windows.iter().position(holds).map(|i| i as u16)
    }

    /// Time from the arbiter's choice to the ownership of the bus in this slot.
    pub fn arbitration_ns(&self, slot: u8) -> Ns {
        self.rack.bus.arbitration_ns + self.rack.bus.chain_ns * Ns::from(slot.saturating_sub(1))
    }

    /// The plan of an access of a master that splits or does not.
    pub fn plan(&self, access: &Access, splits: bool) -> cycle::Plan {
        let slave = self.slave(access).map(|s| (s, &self.rack.slaves[s as usize]));
        cycle::plan(&self.rack.bus, access, slave, splits)
    }
}
