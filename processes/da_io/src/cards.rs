//! Registers and outputs of the three cards, and the safety logic between them, at one instant.
//!
//! At power-up the amplifiers are disabled and the brakes engaged. The logic does not trust the control computer: an
//! amplifier trip, or an output that is not what was written, takes the torque off that axis and engages its brake (STO);
//! an open emergency chain, an expired watchdog and a supply that goes do so on all axes. Each is latched until its cause is
//! gone and [`ACKNOWLEDGE`] is written; then the registers have to be written anew.

use crate::converter::Converter;
use crate::watchdog::Watchdog;
use messages::registers::{da, parallel, parallel::ACKNOWLEDGE};
use messages::{AmplifierCommand, Detector, Event, EventKind, JOINTS, Ns, Severity, drive_status};
use scenario::Scenario;

/// Channels of the two D/A cards; the last one drives nothing.
const CHANNELS: usize = 2 * da::CHANNELS_PER_CARD;
/// Steps of the converter by which an output may differ from what was written.
const READ_BACK_STEPS: f64 = 2.5;
/// One bit per joint.
const ALL: u32 = 0x7F;
/// Safety states of the `safety-state` event: running, torque off.
const RUN: f64 = 0.0;
const STO: f64 = 4.0;

/// A register of this board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Register {
    /// Output code of a D/A channel.
    Code(usize),
    /// Read-back of a D/A channel.
    ReadBack(usize),
    /// Offset on the parallel I/O card.
    Parallel(u32),
}

/// Where the cards sit on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Addresses {
    da: [u32; 2],
    parallel: u32,
}

impl Addresses {
    /// Base addresses of a scenario's rack.
    pub fn new(scenario: &Scenario) -> Result<Addresses, String> {
        let base = |card: &str| {
            scenario
                .card_base(card)
                .ok_or(format!("the rack has no card '{card}'"))
        };
        Ok(Addresses {
            da: [base("da-1")?, base("da-2")?],
            parallel: base("parallel-io")?,
        })
    }

    /// The register at a byte address; `None` where the cards have none.
    pub fn register(&self, addr: u32) -> Option<Register> {
        for (card, base) in self.da.into_iter().enumerate() {
            let channel = |offset: u32| card * da::CHANNELS_PER_CARD + (offset / 4) as usize;
            match addr.wrapping_sub(base) {
                offset @ 0x00..0x10 => return Some(Register::Code(channel(offset))),
                offset @ 0x10..0x20 => {
                    return Some(Register::ReadBack(channel(offset - da::read_back(0))));
                }
                _ => {}
            }
        }
        match addr.wrapping_sub(self.parallel) {
            offset @ 0x00..0x14 => Some(Register::Parallel(offset & !3)),
            _ => None,
        }
    }
}

/// The three cards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cards {
    converter: Converter,
    brake_delay: Ns,
    codes: [u32; CHANNELS],
    /// What the outputs show: the codes, unless a channel is stuck.
    shown: [u32; CHANNELS],
    /// ENABLE register.
    enable: u32,
    /// BRAKE register.
    brake: u32,
    /// Brakes that are released.
    released: u32,
    /// When each brake follows its line.
    brake_due: [Ns; JOINTS],
    watchdog: Watchdog,
    /// Signals of the drives, and with those of the D/A cards and the supply.
    wires: u32,
    input: u32,
    /// Axes with the torque off, latched.
    sto: u32,
    /// What is wrong with the converters and the supply.
    damage: Damage,
    supply: Supply,
    /// Channels whose read-back was wrong when last compared.
    astray: u32,
}

/// The supply of the rack.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Supply {
    Holds,
    /// ACFAIL*: it goes at this instant.
    Fails(Ns),
    /// Gone for good.
    Gone,
}

/// What is wrong with the converters and the supply.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damage {
    /// Bit n: the output of channel n stays where it is.
    pub stuck: u32,
    /// Added to the outputs, V.
    pub offset: [f64; JOINTS],
    /// ACFAIL* is asserted, and for how long the supply still holds, ns.
    pub power_fail: Option<Ns>,
}

impl Cards {
    /// Cards at power-up.
    pub fn new(scenario: &Scenario) -> Result<Cards, String> {
        let converter = Converter::new(scenario.da_io.bits)?;
        Ok(Cards {
            converter,
            brake_delay: scenario::nanoseconds(scenario.da_io.brake_delay_ms * 1e-3),
            codes: [converter.mid_scale(); CHANNELS],
            shown: [converter.mid_scale(); CHANNELS],
            enable: 0,
            brake: 0,
            released: 0,
            brake_due: [Ns::MAX; JOINTS],
            watchdog: Watchdog::new(scenario::nanoseconds(scenario.da_io.watchdog_ms * 1e-3)),
            wires: drive_status::BRAKE_ENGAGED,
            input: drive_status::BRAKE_ENGAGED,
            sto: 0,
            damage: Damage::default(),
            supply: Supply::Holds,
            astray: 0,
        })
    }

    /// Outputs on the wires from `t` on.
    pub fn outputs(&self, t: Ns) -> AmplifierCommand {
        AmplifierCommand {
            t,
            volts: std::array::from_fn(|i| self.volts(i)),
            enabled: self.enable & !self.sto,
            brake_released: self.released,
        }
    }

    /// Output of a joint's channel, V.
    fn volts(&self, n: usize) -> f64 {
        self.converter.volts(self.shown[n]) + self.damage.offset[n]
    }

    /// A channel takes a code, unless it is stuck.
    fn convert(&mut self, n: usize, code: u32) {
        self.codes[n] = code;
        if self.damage.stuck >> n & 1 == 0 {
            self.shown[n] = code;
        }
    }

    /// Something breaks, or is whole again, at `t`.
    pub fn damaged(&mut self, t: Ns, damage: Damage, events: &mut Vec<Event>) {
        self.damage = damage;
        for n in 0..CHANNELS {
            self.convert(n, self.codes[n]);
        }
        if let (Supply::Holds, Some(holds)) = (self.supply, damage.power_fail) {
            self.supply = Supply::Fails(t + holds);
        }
        self.read_back(t, events);
    }

    /// The D/A cards compare what they put out with what was written; an axis astray loses its torque.
    fn read_back(&mut self, t: Ns, events: &mut Vec<Event>) {
        let step = self.converter.volts(1) - self.converter.volts(0);
        let mut astray = 0;
        for n in 0..JOINTS {
            if (self.volts(n) - self.converter.volts(self.codes[n])).abs() > READ_BACK_STEPS * step {
                astray |= 1 << n;
            }
        }
        for n in (0..JOINTS).filter(|n| (astray & !self.astray) >> n & 1 == 1) {
            let event = Event::new(t, EventKind::Detected, Severity::Error, n as f64, 0.0);
            events.push(event.because(Some(Detector::DaReadBack)));
        }
        self.astray = astray;
        self.signals(t, self.wires, events);
    }

    /// Content of a register.
    pub fn read(&self, register: Register) -> u32 {
        match register {
            Register::Code(n) => self.codes[n],
            Register::ReadBack(n) if n < JOINTS => self.converter.code(self.volts(n)),
            Register::ReadBack(n) => self.shown[n],
            Register::Parallel(parallel::INPUT) => self.input,
            Register::Parallel(parallel::ENABLE) => self.enable,
            Register::Parallel(parallel::BRAKE) => self.brake,
            Register::Parallel(parallel::WATCHDOG) => self.watchdog.heartbeat(),
            Register::Parallel(_) => u32::from(self.watchdog.expired()),
        }
    }

    /// A register is written at `t`. While all axes are stopped, the outputs are held in reset and take no value.
    pub fn write(&mut self, t: Ns, register: Register, value: u32, events: &mut Vec<Event>) {
        let reset = self.watchdog.expired() || self.sto == ALL;
        match register {
            Register::Code(n) if !reset => {
                self.convert(n, self.converter.latch(value));
                self.read_back(t, events);
            }
            Register::Parallel(parallel::ENABLE) if !reset => self.enable = value & ALL & !self.sto,
            Register::Parallel(parallel::BRAKE) if !reset => {
                self.drive_brakes(t, value & ALL & !self.sto)
            }
            Register::Parallel(parallel::WATCHDOG) => self.watchdog.beat(t, value),
            Register::Parallel(parallel::WATCHDOG_STATUS) if value == ACKNOWLEDGE => {
                self.acknowledge()
            }
            _ => {}
        }
    }

    /// The brakes' lines change; each brake follows after the delay, unless its line goes back before.
    fn drive_brakes(&mut self, t: Ns, lines: u32) {
        let changed = self.brake ^ lines;
        self.brake = lines;
        for i in 0..JOINTS {
            if changed & (1 << i) != 0 {
                self.brake_due[i] = t + self.brake_delay;
            }
        }
    }

    fn acknowledge(&mut self) {
        if self.supply == Supply::Gone {
            return;
        }
        self.watchdog.acknowledge();
        self.sto = causes(self.input) | self.astray;
    }

    /// Takes the torque off these axes and engages their brakes.
    fn stop(&mut self, t: Ns, axes: u32) {
        self.sto |= axes;
        self.enable &= !axes;
        for n in 0..JOINTS {
            if axes & (1 << n) != 0 {
                self.convert(n, self.converter.mid_scale());
            }
        }
        self.drive_brakes(t, self.brake & !axes);
    }

    /// The drives' signals change.
    pub fn signals(&mut self, t: Ns, wires: u32, events: &mut Vec<Event>) {
        let mut input = wires;
        if self.astray != 0 {
            input |= drive_status::DA_FAULT;
        }
        if self.supply != Supply::Holds {
            input |= drive_status::POWER_FAIL;
        }
        self.wires = wires;
        let risen = input & !self.input;
        self.input = input;
        for i in 0..JOINTS {
            if risen & drive_status::AMPLIFIER_TRIPPED & (1 << i) != 0 {
                events.push(Event::new(
                    t,
                    EventKind::AmplifierTrip,
                    Severity::Error,
                    i as f64,
                    0.0,
                ));
            }
        }
        if risen & drive_status::EMERGENCY_STOP != 0 {
            events.push(Event::new(
                t,
                EventKind::SafetyState,
                Severity::Error,
                RUN,
                STO,
            ));
        }
        let axes = (causes(input) | self.astray) & !self.sto;
        if axes != 0 {
            self.stop(t, axes);
        }
    }

    /// When something happens next without anybody's doing.
    pub fn next_timer(&self) -> Ns {
        let brakes = self.brake_due.iter().copied().min().unwrap_or(Ns::MAX);
        let supply = if let Supply::Fails(at) = self.supply { at } else { Ns::MAX };
        brakes.min(self.watchdog.deadline().unwrap_or(Ns::MAX)).min(supply)
    }

    /// Brakes, watchdog and supply whose time is `t`.
    pub fn timer(&mut self, t: Ns, events: &mut Vec<Event>) {
        for i in 0..JOINTS {
            if self.brake_due[i] == t {
                self.brake_due[i] = Ns::MAX;
                self.released = self.released & !(1 << i) | self.brake & (1 << i);
            }
        }
        if self.supply == Supply::Fails(t) {
            self.supply = Supply::Gone;
            self.stop(t, ALL);
            // brakes without power fall in at once
            (self.released, self.brake_due) = (0, [Ns::MAX; JOINTS]);
        }
        if self.watchdog.deadline() == Some(t) {
            self.watchdog.expire();
            events.push(Event::new(
                t,
                EventKind::WatchdogExpired,
                Severity::Error,
                f64::from(self.watchdog.heartbeat()),
                0.0,
            ));
            self.stop(t, ALL);
        }
    }
}

/// Axes that these signals stop.
fn causes(input: u32) -> u32 {
    match input & drive_status::EMERGENCY_STOP {
        0 => input & drive_status::AMPLIFIER_TRIPPED,
        _ => ALL,
    }
}
