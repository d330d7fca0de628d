//! The safety state machine: run, degraded, SS2 hold, SS1 stop, STO (stop categories of IEC 61800-5-2).
//!
//! Decided once a job, from what the job saw; the gravest wins. STO latches until it is acknowledged with its cause gone.
//! da_io has a stop of its own that does not trust this one.

use messages::drive_status;
use scenario::nanoseconds;
use vme::Ns;

/// State of the control computer, numbered as telemetry shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum State {
    /// The law governs.
    Run = 0,
    /// The law governs on a value held from an earlier job.
    Degraded = 1,
    /// SS2: decelerated to a hold; the law holds the pose.
    Hold = 2,
    /// SS1: the joints are braked by their motors, then STO.
    Stop = 3,
    /// STO: amplifiers off, brakes on, latched.
    Off = 4,
}

/// Joint speed below which SS1 has done its work (rad/s).
const AT_REST: f64 = 5e-3;

/// What a job saw that concerns safety.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signs {
    /// Bits of [`drive_status`], as the parallel I/O card shows them.
    pub drive_status: u32,
    /// Jobs in a row in which some value did not come, the worst value's.
    pub held_jobs: u32,
    /// Jobs in a row in which the force sample was too old.
    pub old_force_jobs: u32,
    /// Jobs in a row in which all force words were those of the job before.
    pub same_force_jobs: u32,
    /// Largest joint speed (rad/s).
    pub speed: f64,
    /// The torques of the last job were numbers.
    pub finite: bool,
    /// The workstation asked for a hold.
    pub hold: bool,
    /// The workstation acknowledged a stop.
    pub acknowledge: bool,
}

/// The state and how long it has lasted.
#[derive(Clone, Debug)]
pub struct Safety {
    limits: scenario::Safety,
    state: State,
    since: Ns,
}

impl Safety {
    /// Running.
    pub fn new(limits: &scenario::Safety) -> Safety {
        Safety { limits: limits.clone(), state: State::Run, since: 0 }
    }

    /// State now.
    pub fn state(&self) -> State {
        self.state
    }

    /// The state after a job at `now` that saw `signs`.
    pub fn decide(&mut self, now: Ns, signs: &Signs) -> State {
        const TRIP: u32 = drive_status::AMPLIFIER_TRIPPED | drive_status::EMERGENCY_STOP;
        let limits = &self.limits;
        let blind = signs.held_jobs > limits.max_held_jobs || signs.old_force_jobs > limits.max_old_force_jobs;
        let frozen = limits.max_same_force_jobs > 0 && signs.same_force_jobs > limits.max_same_force_jobs;
        let next = if signs.drive_status & TRIP != 0 || !signs.finite {
            State::Off
        } else {
            match self.state {
                State::Off if signs.acknowledge => State::Run,
                State::Off => State::Off,
                State::Stop if signs.speed < AT_REST || now >= self.since + nanoseconds(limits.stop_time_ms * 1e-3) => {
                    State::Off
                }
                State::Stop => State::Stop,
                _ if blind => State::Stop,
                State::Hold if !signs.acknowledge => State::Hold,
                _ if signs.hold || signs.old_force_jobs > 0 || frozen => State::Hold,
                _ if signs.held_jobs > 0 => State::Degraded,
                _ => State::Run,
            }
        };
        if next != self.state {
            (self.state, self.since) = (next, now);
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FINE: Signs = Signs {
        drive_status: 0,
        held_jobs: 0,
        old_force_jobs: 0,
        same_force_jobs: 0,
        speed: 1.0,
        finite: true,
        hold: false,
        acknowledge: false,
    };

    fn safety() -> Safety {
        Safety::new(&scenario::Safety { max_same_force_jobs: 10, ..Default::default() })
    }

    #[test]
    fn a_force_that_is_too_old_or_frozen_is_held_on_and_a_blind_one_stops() {
        assert_eq!(safety().decide(1, &Signs { old_force_jobs: 1, ..FINE }), State::Hold);
        assert_eq!(safety().decide(1, &Signs { old_force_jobs: 21, ..FINE }), State::Stop);
        assert_eq!(safety().decide(1, &Signs { same_force_jobs: 10, ..FINE }), State::Run);
        assert_eq!(safety().decide(1, &Signs { same_force_jobs: 11, ..FINE }), State::Hold);
        let mut any_number = Safety::new(&scenario::Safety::default());
        assert_eq!(any_number.decide(1, &Signs { same_force_jobs: 1000, ..FINE }), State::Run);
    }

    #[test]
    fn a_trip_or_an_emergency_stop_takes_the_torque_off_from_any_state_until_acknowledged() {
        for bit in [1, 1 << 6, drive_status::EMERGENCY_STOP] {
            let trip = Signs { drive_status: bit, ..FINE };
            for before in [FINE, Signs { hold: true, ..FINE }, Signs { held_jobs: 9, ..FINE }] {
                let mut safety = safety();
                safety.decide(1, &before);
                assert_eq!(safety.decide(2, &trip), State::Off);
                assert_eq!(safety.decide(3, &FINE), State::Off);
                let too_early = Signs { acknowledge: true, ..trip };
                assert_eq!(safety.decide(4, &too_early), State::Off);
                let in_time = Signs { acknowledge: true, ..FINE };
                assert_eq!(safety.decide(5, &in_time), State::Run);
            }
        }
    }

    #[test]
    fn a_limit_switch_and_an_engaged_brake_are_no_trip() {
        let signs = Signs { drive_status: drive_status::LIMIT_SWITCH | drive_status::BRAKE_ENGAGED, ..FINE };
        assert_eq!(safety().decide(1, &signs), State::Run);
    }

    #[test]
    fn a_missing_value_degrades_then_stops_and_the_stop_ends_in_torque_off() {
        let mut safety = safety();
        let held = |jobs| Signs { held_jobs: jobs, ..FINE };
        for jobs in 1..=3 {
            assert_eq!(safety.decide(u64::from(jobs), &held(jobs)), State::Degraded);
        }
        assert_eq!(safety.decide(4, &FINE), State::Run);
        assert_eq!(safety.decide(5, &held(3 + 1)), State::Stop);
        assert_eq!(safety.decide(6, &FINE), State::Stop, "SS1 is not left");
        let mut slow = safety.clone();
        assert_eq!(slow.decide(7, &Signs { speed: 1e-3, ..FINE }), State::Off);
        assert_eq!(safety.decide(5 + 200_000_000, &FINE), State::Off);
    }

    #[test]
    fn a_hold_stays_until_acknowledged() {
        let mut safety = safety();
        assert_eq!(safety.decide(1, &Signs { hold: true, ..FINE }), State::Hold);
        assert_eq!(safety.decide(2, &FINE), State::Hold);
        let acknowledged = Signs { acknowledge: true, ..FINE };
        assert_eq!(safety.decide(3, &acknowledged), State::Run);
    }

    #[test]
    fn torques_that_are_no_numbers_take_the_torque_off() {
        let signs = Signs { finite: false, ..FINE };
        assert_eq!(safety().decide(1, &signs), State::Off);
    }
}
