//! Whether a rack description makes sense; an error names both parties.
//!
//! [`Rack::checked`] fills in what may be left out (cards that only a task names) and refuses what no
//! chassis could hold. [`Rack::check_program`] refuses a program whose accesses the boards cannot
//! answer, or that cannot fit its period even alone on the bus, unless the task says what an overrun does.

use crate::Ns;
use crate::arbiter::{LEVELS, Mode, SLOTS};
use crate::cycle::{self, Misfit};
use crate::processor::Processor;
use crate::program::{Access, Direction, Op, Width};
use crate::rack::{Rack, Release, Slave, Task};

/// A job that lasts longer overruns by no policy: it is a mistake.
const MOST_PERIODS: u64 = 1000;

/// What is wrong with a rack or a program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum RackError {
    #[error("cards `{first}` and `{second}` both sit in slot {slot}")]
    SlotTaken { slot: u8, first: String, second: String },
    #[error("card `{card}` claims slot {slot}; slots go from 1 to {SLOTS}")]
    SlotOutOfRange { card: String, slot: u8 },
    #[error("card `{card}` sits in slot {first} by one entry and in slot {second} by another")]
    CardInTwoSlots { card: String, first: u8, second: u8 },
    #[error("no free slot is left for card `{card}`")]
    NoFreeSlot { card: String },
    #[error("card `{card}` has no slot, and no adaptor to work through")]
    SlotMissing { card: String },
    #[error("two entries are both called `{name}`: {first} and {second}")]
    NameTaken { name: String, first: &'static str, second: &'static str },
    #[error("master `{master}` requests the bus at level {level}; {expected}")]
    LevelOutOfRange { master: String, level: u8, expected: &'static str },
    #[error("interrupter `{interrupter}` uses IRQ{level}*; levels go from 1 to 7")]
    IrqOutOfRange { interrupter: String, level: u8 },
    #[error("processors `{first}` and `{second}` both handle IRQ{level}*")]
    LevelHandledTwice { level: u8, first: String, second: String },
    #[error("windows of `{first}` ({first_base:#x}) and `{second}` ({second_base:#x}) overlap in A{bits}")]
    WindowsOverlap { bits: u32, first: String, first_base: u32, second: String, second_base: u32 },
    #[error("window of `{card}` at {base:#x} with {size:#x} bytes does not fit in A{bits}")]
    WindowTooLarge { card: String, base: u32, size: u32, bits: u32 },
    #[error("`{party}` uses address modifier {am:#04x}, which is no A16, A24 or A32 data code")]
    UnknownModifier { party: String, am: u8 },
    #[error("`{party}` names the {kind} `{name}`, which the rack does not have")]
    Unknown { party: String, kind: &'static str, name: String },
    #[error("interrupter `{interrupter}` is polled by task `{task}` and also used by `{other}`")]
    EventTakenTwice { interrupter: String, task: String, other: String },
    #[error("`{party}`: {what} must not be 0")]
    Zero { party: String, what: &'static str },
    #[error("adaptor `{adaptor}` carries both `{first}` and `{second}`; one processor at most")]
    AdaptorShared { adaptor: String, first: String, second: String },
    #[error("`{master}` makes a {width:?} access at {addr:#x} to `{slave}`, which is {slave_width:?}")]
    TooWide { master: String, width: Width, addr: u32, slave: String, slave_width: Width },
    #[error("`{master}` makes a {width:?} access to `{slave}` at {addr:#x}, which is no multiple of {}", width.bytes())]
    Misaligned { master: String, width: Width, addr: u32, slave: String },
    #[error("`{master}` accesses {addr:#x} with modifier {am:#04x}, where no board of the rack answers")]
    NoSlave { master: String, addr: u32, am: u8 },
    #[error("`{master}` accesses {addr:#x}, which adaptor `{adaptor}` does not map")]
    NotMapped { master: String, adaptor: String, addr: u32 },
    #[error("`{master}` transfers {n} cycles from {addr:#x}, beyond the window of `{slave}`")]
    BeyondWindow { master: String, addr: u32, n: u32, slave: String },
    #[error(
        "program of task `{task}` needs {need_ns} ns on `{processor}`, its period is {period_ns} ns; a task that is to overrun says what comes of it (overrun = \"skip\", \"late\" or \"trip\")"
    )]
    ProgramTooLong { task: String, processor: String, need_ns: Ns, period_ns: Ns },
    #[error(
        "task `{task}` never ends: at {at_ns} ns of simulated time it, or what it causes, releases it again in no time; give its jobs execution time, or `{processor}` an interrupt_ns above 0"
    )]
    Endless { task: String, processor: String, at_ns: Ns },
    #[error("the rack has {n} {what}, {limit} at most are modelled")]
    TooMany { what: &'static str, n: usize, limit: usize },
}

impl Rack {
    /// The rack with every card in its slot, or what is wrong with it.
    pub fn checked(mut self) -> Result<Rack, RackError> {
        let limit = u16::MAX as usize - 1;
        for (what, n, limit) in [
            ("slaves", self.slaves.len(), limit),
            ("tasks", self.tasks.len(), limit),
            ("interrupters", self.interrupters.len(), 64),
        ] {
            if n > limit {
                return Err(RackError::TooMany { what, n, limit });
            }
        }
        self.place_cards()?;
        self.check_masters()?;
        self.check_windows()?;
        self.check_tasks()?;
        self.check_interrupters()?;
        Ok(self)
    }

    /// The card in each slot by name, 0 unused.
    pub fn slots(&self) -> Result<[Option<String>; SLOTS as usize + 1], RackError> {
        let mut slots = [const { None }; SLOTS as usize + 1];
        let mut seat = |card: &str, slot: u8| -> Result<(), RackError> {
            if !(1..=SLOTS).contains(&slot) {
                return Err(RackError::SlotOutOfRange { card: card.into(), slot });
            }
            if let Some(first) = slots.iter().position(|s: &Option<String>| s.as_deref() == Some(card)) {
                let (card, first) = (card.into(), first as u8);
                return if first == slot {
                    Ok(())
                } else {
                    Err(RackError::CardInTwoSlots { card, first, second: slot })
                };
            }
            match &slots[slot as usize] {
                Some(first) => Err(RackError::SlotTaken { slot, first: first.clone(), second: card.into() }),
                None => {
                    slots[slot as usize] = Some(card.into());
                    Ok(())
                }
            }
        };
        for processor in &self.processors {
            processor.slot.map_or(Ok(()), |slot| seat(&processor.name, slot))?;
        }
        for adaptor in &self.adaptors {
            seat(&adaptor.name, adaptor.slot)?;
        }
        for traffic in &self.traffic {
            traffic.slot.map_or(Ok(()), |slot| seat(&traffic.name, slot))?;
        }
        for slave in &self.slaves {
            seat(slave.card(), slave.slot)?;
        }
        Ok(slots)
    }

    /// Describes the cards that only tasks name, and puts processors without a slot into a free one
    /// (or the one of their own slave window).
    fn place_cards(&mut self) -> Result<(), RackError> {
        for task in &self.tasks {
            if !self.processors.iter().any(|p| p.name == task.processor) {
                self.processors.push(Processor::new(&task.processor));
            }
        }
        for i in 0..self.processors.len() {
            let processor = &self.processors[i];
            if processor.slot.is_some() || processor.adaptor.is_some() {
                continue;
            }
            let slots = self.slots()?;
            let name = Some(processor.name.as_str());
            let own = (1..slots.len()).find(|&slot| slots[slot].as_deref() == name);
            let free = own.or_else(|| (1..slots.len()).find(|&slot| slots[slot].is_none()));
            let Some(slot) = free else {
                return Err(RackError::NoFreeSlot { card: processor.name.clone() });
            };
            self.processors[i].slot = Some(slot as u8);
        }
        self.slots().map(|_| ())
    }

    fn check_masters(&self) -> Result<(), RackError> {
        let mut names: Vec<(&str, &'static str)> = Vec::new();
        let masters = (self.processors.iter().map(|p| (&p.name, "processor", p.level)))
            .chain(self.adaptors.iter().map(|a| (&a.name, "adaptor", a.level)))
            .chain(self.traffic.iter().map(|t| (&t.name, "traffic", t.level)));
        for (name, kind, level) in masters {
            if let Some(&(_, first)) = names.iter().find(|(other, _)| other == name) {
                return Err(RackError::NameTaken { name: name.clone(), first, second: kind });
            }
            names.push((name, kind));
            if usize::from(level) >= LEVELS {
                let expected = "levels go from 0 to 3";
                return Err(RackError::LevelOutOfRange { master: name.clone(), level, expected });
            }
        }
        if self.bus.arbiter == Mode::Sgl {
            let direct = (self.processors.iter().filter(|p| p.adaptor.is_none()).map(|p| (&p.name, p.level)))
                .chain(self.adaptors.iter().map(|a| (&a.name, a.level)))
                .chain(self.traffic.iter().filter(|t| t.adaptor.is_none()).map(|t| (&t.name, t.level)));
            for (name, level) in direct {
                if usize::from(level) != LEVELS - 1 {
                    let expected = "the SGL arbiter hears level 3 only";
                    return Err(RackError::LevelOutOfRange { master: name.clone(), level, expected });
                }
            }
        }
        let known = |party: &str, adaptor: &Option<String>| match adaptor {
            Some(name) if !self.adaptors.iter().any(|a| a.name == *name) => {
                Err(RackError::Unknown { party: party.into(), kind: "adaptor", name: name.clone() })
            }
            _ => Ok(()),
        };
        for (i, processor) in self.processors.iter().enumerate() {
            known(&processor.name, &processor.adaptor)?;
            for other in &self.processors[..i] {
                if let (Some(adaptor), true) = (&processor.adaptor, processor.adaptor == other.adaptor) {
                    return Err(RackError::AdaptorShared {
                        adaptor: adaptor.clone(),
                        first: other.name.clone(),
                        second: processor.name.clone(),
                    });
                }
                if let Some(&level) = processor.handles.iter().find(|level| other.handles.contains(level)) {
                    return Err(RackError::LevelHandledTwice {
                        level,
                        first: other.name.clone(),
                        second: processor.name.clone(),
                    });
                }
            }
        }
        for adaptor in &self.adaptors {
            if adaptor.dma_bytes_per_s == 0 {
                return Err(RackError::Zero { party: adaptor.name.clone(), what: "dma_bytes_per_s" });
            }
        }
        for traffic in &self.traffic {
            known(&traffic.name, &traffic.adaptor)?;
            if traffic.adaptor.is_none() && traffic.slot.is_none() {
                return Err(RackError::SlotMissing { card: traffic.name.clone() });
            }
            if traffic.period_ns == 0 {
                return Err(RackError::Zero { party: traffic.name.clone(), what: "period_ns" });
            }
            let access = traffic.access();
            let carrier = traffic.adaptor.as_ref().unwrap_or(&traffic.name);
            self.check_map(&traffic.name, traffic.adaptor.as_deref(), &access)?;
            self.check_access(carrier, false, &access)?;
        }
        Ok(())
    }

    fn check_windows(&self) -> Result<(), RackError> {
        let bits = |slave: &Slave| cycle::address_bits(slave.am);
        for (i, slave) in self.slaves.iter().enumerate() {
            let Some(own) = bits(slave) else {
                return Err(RackError::UnknownModifier { party: slave.name.clone(), am: slave.am });
            };
            if slave.size == 0 {
                return Err(RackError::Zero { party: slave.name.clone(), what: "size" });
            }
            let end = u64::from(slave.base) + u64::from(slave.size);
            if end > 1 << own {
                let (card, base, size) = (slave.name.clone(), slave.base, slave.size);
                return Err(RackError::WindowTooLarge { card, base, size, bits: own });
            }
            for other in &self.slaves[..i] {
                let other_end = u64::from(other.base) + u64::from(other.size);
                if bits(other) == Some(own) && u64::from(other.base) < end && u64::from(slave.base) < other_end {
                    return Err(RackError::WindowsOverlap {
                        bits: own,
                        first: other.name.clone(),
                        first_base: other.base,
                        second: slave.name.clone(),
                        second_base: slave.base,
                    });
                }
            }
            if let Some(name) = slave.adaptor.as_ref().filter(|n| !self.adaptors.iter().any(|a| a.name == **n)) {
                return Err(RackError::Unknown { party: slave.name.clone(), kind: "adaptor", name: name.clone() });
            }
            if let Some(name) = slave.monitor.as_ref().filter(|n| !self.interrupters.iter().any(|i| i.name == **n)) {
                return Err(RackError::Unknown { party: slave.name.clone(), kind: "interrupter", name: name.clone() });
            }
        }
        Ok(())
    }

    fn check_tasks(&self) -> Result<(), RackError> {
        for (i, task) in self.tasks.iter().enumerate() {
            if self.tasks[..i].iter().any(|other| other.name == task.name) {
                return Err(RackError::NameTaken { name: task.name.clone(), first: "task", second: "task" });
            }
            if task.period_ns == 0 {
                return Err(RackError::Zero { party: task.name.clone(), what: "period_ns" });
            }
            let source = match &task.release {
                Release::Timer => None,
                Release::Interrupt(name) => Some(name),
                Release::Poll(poll) => {
                    let access = Access { am: poll.am, addr: poll.addr, width: poll.width, dir: Direction::Read, n: 1 };
                    self.check_access(&task.name, self.processor_of(task).is_some_and(|p| p.splits_width), &access)?;
                    Some(&poll.interrupter)
                }
            };
            if let Some(name) = source.filter(|name| !self.interrupters.iter().any(|i| i.name == **name)) {
                return Err(RackError::Unknown { party: task.name.clone(), kind: "interrupter", name: name.clone() });
            }
            for other in &self.tasks[..i] {
                let pair = [(&task.release, other), (&other.release, task)];
                let taken = pair.into_iter().find_map(|(release, second)| match (release, &second.release) {
                    (Release::Poll(poll), Release::Interrupt(name)) if poll.interrupter == *name => Some(name),
                    (Release::Poll(poll), Release::Poll(b)) if poll.interrupter == b.interrupter => {
                        Some(&b.interrupter)
                    }
                    _ => None,
                });
                if let Some(name) = taken {
                    let (task, other) = (task.name.clone(), other.name.clone());
                    return Err(RackError::EventTakenTwice { interrupter: name.clone(), task, other });
                }
            }
        }
        Ok(())
    }

    fn check_interrupters(&self) -> Result<(), RackError> {
        let slots = self.slots()?;
        for (i, interrupter) in self.interrupters.iter().enumerate() {
            let name = || interrupter.name.clone();
            if self.interrupters[..i].iter().any(|other| other.name == interrupter.name) {
                return Err(RackError::NameTaken { name: name(), first: "interrupter", second: "interrupter" });
            }
            if !(1..=7).contains(&interrupter.level) {
                return Err(RackError::IrqOutOfRange { interrupter: name(), level: interrupter.level });
            }
            let card = Some(interrupter.card.as_str());
            let local = interrupter.local && !self.processors.iter().any(|p| Some(p.name.as_str()) == card);
            if local || !slots.iter().any(|slot| slot.as_deref() == card) {
                let kind = if interrupter.local { "processor card" } else { "card" };
                return Err(RackError::Unknown { party: name(), kind, name: interrupter.card.clone() });
            }
            if interrupter.ticks.is_some_and(|ticks| ticks.period_ns == 0) {
                return Err(RackError::Zero { party: name(), what: "ticks.period_ns" });
            }
        }
        let handlers = self.processors.iter().any(|p| p.adaptor.is_none());
        match self.interrupters.iter().find(|i| !i.local) {
            Some(interrupter) if !handlers => Err(RackError::Unknown {
                party: interrupter.name.clone(),
                kind: "processor card",
                name: "(any, to handle it)".into(),
            }),
            _ => Ok(()),
        }
    }

    fn processor_of(&self, task: &Task) -> Option<&Processor> {
        self.processors.iter().find(|p| p.name == task.processor)
    }

    /// Whether the adaptor that carries this access maps where it goes.
    fn check_map(&self, master: &str, adaptor: Option<&str>, access: &Access) -> Result<(), RackError> {
        let adaptor = adaptor.and_then(|name| self.adaptors.iter().find(|a| a.name == name));
        match adaptor.filter(|adaptor| !adaptor.reaches(access)) {
            None => Ok(()),
            Some(adaptor) => {
                let (master, adaptor) = (master.to_owned(), adaptor.name.clone());
                Err(RackError::NotMapped { master, adaptor, addr: access.addr })
            }
        }
    }

    /// Whether the boards can answer this access of `master`.
    pub fn check_access(&self, master: &str, splits: bool, access: &Access) -> Result<(), RackError> {
        let master = || master.to_owned();
        if cycle::address_bits(access.am).is_none() {
            return Err(RackError::UnknownModifier { party: master(), am: access.am });
        }
        if access.is_address_only() {
            return Ok(());
        }
        let Some(slave) = self.slaves.iter().find(|slave| slave.answers(access)) else {
            return Err(RackError::NoSlave { master: master(), addr: access.addr, am: access.am });
        };
        let (width, addr, name) = (access.width, access.addr, slave.name.clone());
        match cycle::fit(access, slave) {
            Some(Misfit::TooWide) if !splits => {
                Err(RackError::TooWide { master: master(), width, addr, slave: name, slave_width: slave.width })
            }
            Some(Misfit::Misaligned) if !splits => {
                Err(RackError::Misaligned { master: master(), width, addr, slave: name })
            }
            Some(Misfit::NoSlave) => Err(RackError::BeyondWindow { master: master(), addr, n: access.n, slave: name }),
            _ => Ok(()),
        }
    }

    /// Whether a job of these operations (before and after its decision) can be carried out at all:
    /// boards answer each access, and alone on the bus it ends within its period, or, where the task says what an overrun
    /// does, within [`MOST_PERIODS`] of them.
    pub fn check_program(&self, task: usize, ops: &[Op]) -> Result<(), RackError> {
        let spec = &self.tasks[task];
        let processor = self.processor_of(spec);
        let splits = processor.is_some_and(|p| p.splits_width);
        let mut need_ns: Ns = 0;
        for op in ops {
            match op {
                Op::Exec(ns) => need_ns = need_ns.saturating_add(*ns),
                Op::Access(access) => {
                    self.check_access(&spec.name, splits, access)?;
                    self.check_map(&spec.name, processor.and_then(|p| p.adaptor.as_deref()), access)?;
                    let slave = self.slaves.iter().enumerate().find(|(_, slave)| slave.answers(access));
                    let plan = cycle::plan(&self.bus, access, slave.map(|(i, slave)| (i as u16, slave)), splits);
                    let stall = if access.dir == Direction::Read { self.bus.read_stall_ns } else { 0 };
                    let cycles: Ns = plan.bursts(&self.bus, access.addr, 0).map(|burst| burst.done_ns).sum();
                    need_ns = need_ns.saturating_add(cycles + stall);
                }
                Op::Raise(level) if !(1..=7).contains(level) => {
                    return Err(RackError::IrqOutOfRange { interrupter: spec.name.clone(), level: *level });
                }
                Op::Raise(_) | Op::Decide => {}
            }
        }
        let periods = if spec.overrun.is_some() { MOST_PERIODS } else { 1 };
        if need_ns > spec.period_ns.saturating_mul(periods) {
            let (task, processor) = (spec.name.clone(), spec.processor.clone());
            return Err(RackError::ProgramTooLong { task, processor, need_ns, period_ns: spec.period_ns });
        }
        Ok(())
    }
}
