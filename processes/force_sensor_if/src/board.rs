//! The receiver card as a board of the rack: wires and accesses in, register contents and events out.
//!
//! Samples are taken at multiples of 125 µs, the wires interpolated linearly between the arm's steps, and an access at t
//! sees the newest value published at or before t. The filters start as if the first sample had been there for
//! long. A write to an offset takes effect with the next sample; the other registers are read-only. An access
//! that failed on the bus changes nothing and gets no answer. While the wires are silent their last value holds.

use crate::delay::DelayLine;
use crate::faults::Faults;
use crate::filter::Cascade;
use crate::gauges::Gauges;
use crate::registers::{Register, Word};
use crate::{AXES, Counts, SAMPLE_NS};
use board::{Board, Inputs, Mail, Outputs};
use messages::registers::force;
use messages::{BusWord, Event, EventKind, PlantSample, Severity, TransferRecord};
use scenario::{ForceFilter, Scenario, nanoseconds};
use vme::Ns;

/// Writes under way that the card remembers.
const PENDING: usize = 64;

/// Samples without saturation after which the next one is news: 100 ms.
const QUIET_SAMPLES: u64 = 800;

/// The card. It answers the accesses to the rack's slave `force-sensor`.
pub struct ForceSensorIf {
    base: u32,
    size: u32,
    word: Word,
    /// N, then tenths of Nm.
    full_scale: [f64; AXES],
    wires: Wires,
    gauges: Gauges,
    faults: Faults,
    /// Offset registers: added to every sample.
    offset: Counts,
    /// Number of the first sample after power-up.
    first: u64,
    sampler: Option<Sampler>,
    delay: Option<DelayLine>,
    cascade: Cascade,
    /// Values of writes whose transfer has not taken place yet.
    pending: Vec<BusWord>,
}

/// What the card knows of its newest sample.
#[derive(Clone, Copy)]
struct Sampler {
    /// Number of the sample, taken at this many times 125 µs.
    k: u64,
    /// Number of the newest one that has come.
    came: u64,
    value: Counts,
    warnings: u16,
    errors: u16,
    /// Number of the last saturated sample.
    saturated: Option<u64>,
}

impl ForceSensorIf {
    /// The card that the scenario describes. The message says what is wrong with it.
    pub fn new(scenario: &Scenario) -> Result<ForceSensorIf, String> {
        let sensor = &scenario.force_sensor_if;
        let slave = (scenario
            .rack
            .slaves
            .iter()
            .find(|slave| slave.name == "force-sensor"))
        .ok_or("the rack has no slave `force-sensor`")?;
        let delay = match sensor.filter {
            ForceFilter::Cascade(_) => None,
            ForceFilter::DelayMs(ms) => Some(DelayLine::new(nanoseconds(ms / 1000.0))),
        };
        let (n, tenths_nm) = (sensor.full_scale_n, 10.0 * sensor.full_scale_nm);
        Ok(ForceSensorIf {
            base: slave.base,
            size: slave.size,
            word: Word::for_counts(sensor.full_scale_counts),
            full_scale: [n, n, n, tenths_nm, tenths_nm, tenths_nm],
            wires: Wires::default(),
            gauges: Gauges::new(scenario),
            faults: Faults::new(scenario),
            offset: [0.0; AXES],
            first: 0,
            sampler: None,
            delay,
            cascade: Cascade::settled([0.0; AXES]),
            pending: Vec::with_capacity(PENDING),
        })
    }

    /// Takes every sample due up to `until`.
    fn sample_until(&mut self, until: Ns, plant: &[PlantSample], events: &mut Vec<Event>) {
        loop {
            let k = self.sampler.map_or(self.first, |newest| newest.k + 1);
            if k * SAMPLE_NS > until {
                return;
            }
            let t = k * SAMPLE_NS;
            let Some(wrench) = self.wires.at(t, plant) else {
                return;
            };
            self.faults.advance(t, |fault, from| {
                events.push(Event::injected(from, fault));
            });
            if let Some(newest) = self.sampler.as_mut().filter(|_| self.faults.dropped()) {
                newest.k = k;
                continue;
            }
            if self.sampler.is_none() {
                self.cascade = Cascade::settled(self.gauges.quiet(&wrench));
            }
            let felt = self.faults.felt(t, wrench);
            let raw = self.faults.sent(self.gauges.sample(&felt));
            let (raw, age) = self.faults.delayed(raw);
            let came = k.saturating_sub(age);
            if let Some(newest) = self.sampler.as_mut().filter(|newest| age > 0 && came <= newest.came) {
                newest.k = k;
                continue;
            }
            let value = sum(&raw, &self.offset);
            self.cascade.push(k, value);
            if let Some(delay) = &mut self.delay {
                delay.push(k, value);
            }
            let mut errors = self.gauges.saturated(&raw);
            let mut saturated = self.sampler.and_then(|before| before.saturated);
            if errors != 0 {
                if saturated.is_none_or(|before| k - before > QUIET_SAMPLES) {
                    events.push(Event::new(
                        t,
                        EventKind::ForceSaturated,
                        Severity::Warn,
                        errors.into(),
                        0.0,
                    ));
                }
                saturated = Some(k);
            }
            if self.faults.open() {
                errors |= force::ERROR_SENSOR_CHANGE;
            }
            let warnings = self.gauges.near_saturation(&raw);
            self.sampler = Some(Sampler {
                k,
                came,
                value,
                warnings,
                errors,
                saturated,
            });
        }
    }

    /// Content of a register at `t`, in a word of the card's width.
    fn content(&mut self, register: Register, t: Ns, plant: &[PlantSample]) -> u32 {
        let Some(newest) = self.sampler else { return 0 };
        match register {
            Register::FullScale(axis) => self.word.signed(self.full_scale[axis]),
            Register::Offset(axis) => self.word.signed(self.offset[axis]),
            Register::Filter(0, axis) => {
                let value = match &self.delay {
                    None => newest.value,
                    Some(delay) => {
                        let now = self.wires.at(t, plant).map_or(newest.value, |wrench| {
                            sum(&self.gauges.quiet(&wrench), &self.offset)
                        });
                        delay.value(t, now)
                    }
                };
                self.word.signed(value[axis])
            }
            Register::Filter(n, axis) => self.word.signed(self.cascade.output(n)[axis]),
            Register::Counter(0) => {
                let k = self
                    .delay
                    .as_ref()
                    .map_or(newest.came, |delay| delay.counter(t));
                u32::from(k as u16)
            }
            Register::Counter(n) => u32::from((newest.came >> (2 * n)) as u16),
            Register::Warnings => newest.warnings.into(),
            Register::Errors => newest.errors.into(),
            Register::Other => 0,
        }
    }

    fn write(&mut self, register: Register, value: u32) {
        if let Register::Offset(axis) = register {
            self.offset[axis] = self.word.number(value);
        }
    }

    /// Remembers the values on their way to this card.
    fn post(&mut self, mail: &Mail) {
        for word in &mail.words {
            if word.addr.wrapping_sub(self.base) < self.size {
                if self.pending.len() == PENDING {
                    // its transfer never came: the master stopped half-way
                    self.pending.remove(0);
                }
                self.pending.push(*word);
            }
        }
    }

    /// The posted value of one cycle of a write.
    fn take(&mut self, transfer: &TransferRecord, addr: u32) -> Option<u32> {
        let place = self.pending.iter().position(|word| {
            (word.task, word.job, word.index, word.addr)
                == (transfer.task, transfer.job, transfer.index, addr)
        })?;
        Some(self.pending.remove(place).value)
    }

    fn transfer(&mut self, transfer: &TransferRecord, plant: &[PlantSample], out: &mut Mail) {
        for addr in transfer.cycles() {
            let register = self.word.register(addr.wrapping_sub(self.base));
            if transfer.is_read() {
                if transfer.is_ok() {
                    let value = self.content(register, transfer.data_at, plant);
                    let TransferRecord {
                        data_at: t,
                        job,
                        task,
                        index,
                        ..
                    } = *transfer;
                    out.words.push(BusWord {
                        t,
                        addr,
                        value,
                        job,
                        task,
                        index,
                    });
                }
            } else if let Some(value) = self.take(transfer, addr)
                && transfer.is_ok()
            {
                self.write(register, value);
            }
        }
    }
}

impl Board for ForceSensorIf {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        let plant = inputs.mail.plant.as_slice();
        if self.sampler.is_none() {
            // powered up, perhaps in the middle of a run
            self.first = inputs.from.div_ceil(SAMPLE_NS);
        }
        self.wires.rewind();
        self.post(&inputs.mail);
        for transfer in &inputs.transfers {
            // no transfer of a window takes place after it
            let data_at = transfer.data_at.min(inputs.until);
            self.sample_until(data_at, plant, &mut out.mail.events);
            self.transfer(&TransferRecord { data_at, ..*transfer }, plant, &mut out.mail);
        }
        self.sample_until(inputs.until, plant, &mut out.mail.events);
        self.wires.keep(plant);
    }
}

fn sum(a: &Counts, b: &Counts) -> Counts {
    core::array::from_fn(|axis| a[axis] + b[axis])
}

/// The wrench on the wires within a window. Asked for in the order of time.
#[derive(Default)]
struct Wires {
    /// First of the window's samples that is not before the last instant asked for.
    next: usize,
    /// What the wires carried at the end of the window before.
    held: Option<[f64; AXES]>,
}

impl Wires {
    fn rewind(&mut self) {
        self.next = 0;
    }

    fn keep(&mut self, plant: &[PlantSample]) {
        self.held = plant.last().map(|sample| sample.wrench).or(self.held);
    }

    /// The wrench at `t`, N and Nm; `None` before anything was on the wires.
    fn at(&mut self, t: Ns, plant: &[PlantSample]) -> Option<[f64; AXES]> {
        while self.next < plant.len() && plant[self.next].t < t {
            self.next += 1;
        }
        let (before, after) = (
            self.next.checked_sub(1).and_then(|i| plant.get(i)),
            plant.get(self.next),
        );
        match (before, after) {
            (Some(a), Some(b)) if a.t <= t && t < b.t => {
                let share = (t - a.t) as f64 / (b.t - a.t) as f64;
                Some(core::array::from_fn(|i| {
                    a.wrench[i] + share * (b.wrench[i] - a.wrench[i])
                }))
            }
            (_, Some(b)) => Some(b.wrench),
            (Some(a), None) => Some(a.wrench),
            (None, None) => self.held,
        }
    }
}

/// Bits of the error word that saturation can set are the map's.
const _: () = assert!(force::ERROR_SATURATED == (1 << AXES) - 1);
