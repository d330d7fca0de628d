//! Registers and outputs of the three cards, and the safety logic between them, at one instant.
//!
//! At power-up the amplifiers are disabled and the brakes engaged. The logic does not trust the control computer: an
//! amplifier trip takes the torque off that axis and engages its brake (STO), an open emergency chain and an expired
//! watchdog do so on all axes. Each is latched until its cause is gone and [`ACKNOWLEDGE`] is written; then the registers
//! have to be written anew.

use crate::converter::Converter;
use crate::watchdog::Watchdog;
use messages::registers::{da, parallel, parallel::ACKNOWLEDGE};
use messages::{AmplifierCommand, Event, EventKind, JOINTS, Ns, Severity, drive_status};
use scenario::Scenario;

/// Channels of the two D/A cards; the last one drives nothing.
const CHANNELS: usize = 2 * da::CHANNELS_PER_CARD;
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
    /// ENABLE register.
    enable: u32,
    /// BRAKE register.
    brake: u32,
    /// Brakes that are released.
    released: u32,
    /// When each brake follows its line.
    brake_due: [Ns; JOINTS],
    watchdog: Watchdog,
    /// Signals of the drives.
    input: u32,
    /// Axes with the torque off, latched.
    sto: u32,
}

impl Cards {
    /// Cards at power-up.
    pub fn new(scenario: &Scenario) -> Result<Cards, String> {
        let converter = Converter::new(scenario.da_io.bits)?;
        Ok(Cards {
            converter,
            brake_delay: scenario::nanoseconds(scenario.da_io.brake_delay_ms * 1e-3),
            codes: [converter.mid_scale(); CHANNELS],
            enable: 0,
            brake: 0,
            released: 0,
            brake_due: [Ns::MAX; JOINTS],
            watchdog: Watchdog::new(scenario::nanoseconds(scenario.da_io.watchdog_ms * 1e-3)),
            input: drive_status::BRAKE_ENGAGED,
            sto: 0,
        })
    }

    /// Outputs on the wires from `t` on.
    pub fn outputs(&self, t: Ns) -> AmplifierCommand {
        AmplifierCommand {
            t,
            volts: std::array::from_fn(|i| self.converter.volts(self.codes[i])),
            enabled: self.enable & !self.sto,
            brake_released: self.released,
        }
    }

    /// Content of a register.
    pub fn read(&self, register: Register) -> u32 {
        match register {
            Register::Code(n) | Register::ReadBack(n) => self.codes[n],
            Register::Parallel(parallel::INPUT) => self.input,
            Register::Parallel(parallel::ENABLE) => self.enable,
            Register::Parallel(parallel::BRAKE) => self.brake,
            Register::Parallel(parallel::WATCHDOG) => self.watchdog.heartbeat(),
            Register::Parallel(_) => u32::from(self.watchdog.expired()),
        }
    }

    /// A register is written at `t`. While all axes are stopped, the outputs are held in reset and take no value.
    pub fn write(&mut self, t: Ns, register: Register, value: u32) {
        let reset = self.watchdog.expired() || self.sto == ALL;
        match register {
            Register::Code(n) if !reset => self.codes[n] = self.converter.latch(value),
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
        self.watchdog.acknowledge();
        self.sto = causes(self.input);
    }

    /// Takes the torque off these axes and engages their brakes.
    fn stop(&mut self, t: Ns, axes: u32) {
        self.sto |= axes;
        self.enable &= !axes;
        for n in 0..JOINTS {
            if axes & (1 << n) != 0 {
                self.codes[n] = self.converter.mid_scale();
            }
        }
        self.drive_brakes(t, self.brake & !axes);
    }

    /// The drives' signals change.
    pub fn signals(&mut self, t: Ns, input: u32, events: &mut Vec<Event>) {
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
        let axes = causes(input) & !self.sto;
        if axes != 0 {
            self.stop(t, axes);
        }
    }

    /// When something happens next without anybody's doing.
    pub fn next_timer(&self) -> Ns {
        let brakes = self.brake_due.iter().copied().min().unwrap_or(Ns::MAX);
        brakes.min(self.watchdog.deadline().unwrap_or(Ns::MAX))
    }

    /// Brakes and watchdog whose time is `t`.
    pub fn timer(&mut self, t: Ns, events: &mut Vec<Event>) {
        for i in 0..JOINTS {
            if self.brake_due[i] == t {
                self.brake_due[i] = Ns::MAX;
                self.released = self.released & !(1 << i) | self.brake & (1 << i);
            }
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
