//! What the drives see of da_io while it is down: hardware of its own goes on where its processor does not.
//!
//! A card that has crashed drives nothing: amplifiers are off, and brakes without power fall in. One that hangs keeps its
//! outputs until the output watchdog, which no processor serves, takes the torque off and drops the brakes' lines.

use board::Ns;
use messages::registers::parallel;
use messages::{AmplifierCommand, Event, EventKind, JOINTS, PlantProbe, Severity, TransferRecord};
use scenario::{Scenario, nanoseconds};

const ALL: u32 = (1 << JOINTS) - 1;
/// Bit of the first joint's brake in the drives' status.
const BRAKES: u32 = 16;

/// The lines to the drives, as far as the chassis sees them.
pub(crate) struct Lines {
    /// Address of the heartbeat register, where the rack has one.
    heartbeat: Option<u32>,
    /// Timeout of the output watchdog, ns; 0 = off.
    timeout: Ns,
    brake_delay: Ns,
    last_beat: Option<Ns>,
    /// Bit i: brake of joint i is released.
    released: u32,
}

impl Lines {
    pub fn new(scenario: &Scenario) -> Lines {
        Lines {
            heartbeat: scenario.card_base("parallel-io").map(|base| base + parallel::WATCHDOG),
            timeout: nanoseconds(scenario.da_io.watchdog_ms * 1e-3),
            brake_delay: nanoseconds(scenario.da_io.brake_delay_ms * 1e-3),
            last_beat: None,
            released: 0,
        }
    }

    /// Takes in the transfers that were made to da_io.
    pub fn transfers(&mut self, transfers: &[TransferRecord]) {
        let beats = transfers.iter().filter(|transfer| !transfer.is_read() && transfer.is_ok());
        let last = beats.filter(|transfer| Some(transfer.addr) == self.heartbeat).next_back();
        self.last_beat = last.map(|transfer| transfer.data_at).or(self.last_beat);
    }

    /// Takes in how the arm is.
    pub fn probe(&mut self, probe: &PlantProbe) {
        self.released = !(probe.status >> BRAKES) & ALL;
    }

    /// da_io crashes or hangs at `now`: what its lines do from then on.
    pub fn da_io_is_gone(
        &mut self,
        now: Ns,
        hang: bool,
        commands: &mut Vec<AmplifierCommand>,
        events: &mut Vec<Event>,
    ) {
        let off = |t, brake_released| AmplifierCommand { t, volts: [0.0; JOINTS], enabled: 0, brake_released };
        if !hang {
            commands.push(off(now, 0));
        } else if let Some(expires) = self.last_beat.filter(|_| self.timeout > 0).map(|beat| beat + self.timeout)
            && expires > now
        {
            commands.extend([off(expires, self.released), off(expires + self.brake_delay, 0)]);
            events.push(Event::new(expires, EventKind::WatchdogExpired, Severity::Error, 0.0, 0.0));
        }
        self.last_beat = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Ns = 1_000_000;

    fn lines() -> (Lines, TransferRecord) {
        let scenario = scenario::load("table-5-3", &[]).expect("built-in").scenario().expect("built-in");
        let mut lines = Lines::new(&scenario);
        lines.probe(&bytemuck::Zeroable::zeroed());
        let addr = lines.heartbeat.expect("card");
        let beat = TransferRecord { addr, data_at: 100 * MS, dir: 1, ..bytemuck::Zeroable::zeroed() };
        (lines, beat)
    }

    #[test]
    fn a_card_that_crashes_takes_the_torque_off_and_lets_the_brakes_fall_in_at_once() {
        let (mut lines, beat) = lines();
        lines.transfers(&[beat]);
        let (mut commands, mut events) = (Vec::new(), Vec::new());
        lines.da_io_is_gone(103 * MS, false, &mut commands, &mut events);
        assert_eq!(commands, [AmplifierCommand { t: 103 * MS, volts: [0.0; JOINTS], enabled: 0, brake_released: 0 }]);
        assert!(events.is_empty());
    }

    #[test]
    fn a_card_that_hangs_holds_its_outputs_until_the_watchdog_and_the_brakes_follow_after_their_delay() {
        let (mut lines, beat) = lines();
        lines.transfers(&[beat]);
        let (mut commands, mut events) = (Vec::new(), Vec::new());
        lines.da_io_is_gone(103 * MS, true, &mut commands, &mut events);
        let seen: Vec<_> =
            commands.iter().map(|command| (command.t, command.enabled, command.brake_released)).collect();
        assert_eq!(seen, [(120 * MS, 0, ALL), (135 * MS, 0, 0)]);
        assert_eq!((events[0].t, events[0].kind), (120 * MS, EventKind::WatchdogExpired as u32));
    }

    #[test]
    fn a_card_that_hangs_with_its_watchdog_expired_stays_as_it_is() {
        let (mut lines, beat) = lines();
        lines.transfers(&[beat]);
        let (mut commands, mut events) = (Vec::new(), Vec::new());
        lines.da_io_is_gone(121 * MS, true, &mut commands, &mut events);
        assert!(commands.is_empty() && events.is_empty());
    }
}
