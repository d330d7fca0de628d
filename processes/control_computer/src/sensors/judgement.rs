//! What the registers of a job say is wrong, and which state of the arm that demands.

use super::Sensors;
use crate::findings::Findings;
use crate::output::Brakes;
use crate::safety::State;
use messages::registers::encoder;
use messages::{Detector, JOINTS, drive_status};
use scenario::nanoseconds;
use vme::Ns;

impl Sensors {
    /// What the registers of the last job say is wrong.
    pub fn report(&self, findings: &mut Findings) {
        let limits = &self.limits;
        if self.status & drive_status::EMERGENCY_STOP != 0 {
            findings.report(Detector::EmergencyStop, State::Off, 0.0);
        }
        let tripped = self.status & drive_status::AMPLIFIER_TRIPPED;
        if tripped != 0 {
            // the I/O card has taken the torque off that axis
            findings.report(Detector::AmplifierTrip, State::Stop, tripped.trailing_zeros().into());
        }
        if self.status & drive_status::DA_FAULT != 0 {
            findings.report(Detector::DaReadBack, State::Off, 0.0);
        }
        if self.status & drive_status::POWER_FAIL != 0 {
            findings.report(Detector::PowerFail, State::Stop, 0.0);
        }
        for joint in 0..JOINTS {
            let (card, channel) = (joint / encoder::CHANNELS_PER_CARD, joint % encoder::CHANNELS_PER_CARD);
            let status = self.cards[card] >> (8 * channel);
            for (bit, detector, demand) in [
                (encoder::STATUS_LEVEL, Detector::EncoderLevel, State::Off),
                (encoder::STATUS_QUADRATURE, Detector::EncoderQuadrature, State::Stop),
                (encoder::STATUS_INDEX, Detector::EncoderIndex, State::Stop),
            ] {
                if status & bit != 0 {
                    findings.report(detector, demand, joint as f64);
                }
            }
        }
        for &index in &self.registers {
            let held = self.held[index];
            if held > 0 {
                let detector = self.why_held[index];
                let stop = if detector == Detector::ForceSlew { State::Hold } else { State::Stop };
                // a card that did not answer was asked twice; without a grant nothing gets through
                let bus = matches!(detector, Detector::BusError | Detector::AccessTimer);
                let demand = if bus || held > limits.max_held_jobs { stop } else { State::Degraded };
                findings.report(detector, demand, index as f64);
            }
        }
        if self.late_jobs > 0 {
            let demand = if self.late_jobs > limits.max_held_jobs { State::Hold } else { State::Degraded };
            findings.report(Detector::MessageAge, demand, self.late_jobs.into());
        }
        if self.old_force_jobs > 0 {
            let demand = if self.old_force_jobs > limits.max_old_force_jobs { State::Stop } else { State::Hold };
            findings.report(Detector::ForceAge, demand, self.old_force_jobs.into());
        }
        if limits.max_same_force_jobs > 0 && self.same_force_jobs > limits.max_same_force_jobs {
            findings.report(Detector::ForceFrozen, State::Hold, self.same_force_jobs.into());
        }
        let noise = self.noise.deviation_n();
        if limits.max_force_noise_n > 0.0 && noise > limits.max_force_noise_n {
            findings.report(Detector::ForceVariance, State::Hold, noise);
        }
    }

    /// What the brakes' contacts say against what has been asked of the brakes, given the time to do it.
    pub fn report_brakes(&self, now: Ns, brakes: Brakes, findings: &mut Findings) {
        let engaged = (self.status & drive_status::BRAKE_ENGAGED) >> 16;
        for joint in (0..JOINTS).filter(|joint| engaged >> joint & 1 == 1) {
            let wrong = match brakes {
                Brakes::Released { .. } => true,
                Brakes::Engaged { .. } => self.sensed.qd[joint].abs() > self.limits.max_braked_speed_rad_per_s,
            };
            if wrong && now > brakes.since() + nanoseconds(self.limits.max_brake_time_ms * 1e-3) {
                findings.report(Detector::BrakeMotion, State::Off, joint as f64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{all, demanded, give, scenario, word};
    use super::*;
    use crate::program::{CARDS, COUNTS, STATUS};

    #[test]
    fn what_the_cards_and_drives_signal_is_demanded_as_their_kind_asks() {
        for (index, value, demand, detector) in [
            (STATUS, 1 << 3, State::Stop, Detector::AmplifierTrip),
            (STATUS, drive_status::DA_FAULT, State::Off, Detector::DaReadBack),
            (STATUS, drive_status::POWER_FAIL, State::Stop, Detector::PowerFail),
            (STATUS, drive_status::EMERGENCY_STOP, State::Off, Detector::EmergencyStop),
            (CARDS + 1, encoder::STATUS_LEVEL << 8, State::Off, Detector::EncoderLevel),
            (CARDS, encoder::STATUS_QUADRATURE, State::Stop, Detector::EncoderQuadrature),
            (CARDS + 3, encoder::STATUS_INDEX, State::Stop, Detector::EncoderIndex),
        ] {
            let mut sensors = all(&scenario(&[]));
            let counts = sensors.counts;
            give(&mut sensors, 0, counts, 0);
            sensors.take(&word(0, index, value, 0));
            sensors.read(0, 5e-3);
            assert_eq!(demanded(&sensors), (demand, Some(detector)));
        }
    }

    #[test]
    fn a_joint_that_moves_on_its_brake_or_stays_on_it_takes_the_torque_off() {
        let mut sensors = all(&scenario(&[]));
        let counts = sensors.counts;
        let after_70_ms = |sensors: &Sensors, brakes| {
            let mut findings = Findings::new();
            sensors.report_brakes(70_000_000, brakes, &mut findings);
            findings.demanded().0
        };
        give(&mut sensors, 0, counts, 0);
        sensors.take(&word(0, STATUS, 1 << (16 + 2), 0));
        sensors.read(0, 5e-3);
        assert_eq!(after_70_ms(&sensors, Brakes::Engaged { since: 0 }), State::Run, "at rest");
        assert_eq!(after_70_ms(&sensors, Brakes::Released { since: 20_000_000 }), State::Run, "not yet");
        assert_eq!(after_70_ms(&sensors, Brakes::Released { since: 5_000_000 }), State::Off, "stuck");
        let speed = 0.03 * sensors.counts_per_rad[2] / encoder::VELOCITY_LSB;
        give(&mut sensors, 1, counts, 0);
        sensors.take(&word(1, STATUS, 1 << (16 + 2), 0));
        sensors.take(&word(1, COUNTS + 5, speed as u32, 0));
        sensors.read(1, 5e-3);
        assert_eq!(after_70_ms(&sensors, Brakes::Engaged { since: 20_000_000 }), State::Run, "not yet");
        assert_eq!(after_70_ms(&sensors, Brakes::Engaged { since: 5_000_000 }), State::Off, "slips");
    }
}
