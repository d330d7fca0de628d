//! The safety state machine: run, degraded, SS2 hold, SS1 stop, STO (stop categories of IEC 61800-5-2).
//!
//! Decided once a job, from what the job's [`crate::findings`] demand. Hold and STO latch until they are acknowledged with
//! their cause gone and the arm at rest. da_io has a stop of its own that does not trust this one.

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

/// Joint speed below which the arm is at rest: SS1 has done its work, and a stop can be acknowledged (rad/s).
const AT_REST: f64 = 5e-3;

/// The state and how long it has lasted.
#[derive(Clone, Debug)]
pub struct Safety {
    stop_time: Ns,
    state: State,
    since: Ns,
}

impl Safety {
    /// Running.
    pub fn new(limits: &scenario::Safety) -> Safety {
        Safety { stop_time: nanoseconds(limits.stop_time_ms * 1e-3), state: State::Run, since: 0 }
    }

    /// Begins in STO, latched: a computer that is powered up again does not move the arm unasked.
    pub fn latch(&mut self) {
        self.state = State::Off;
    }

    /// State now.
    pub fn state(&self) -> State {
        self.state
    }

    /// Whether an acknowledgement would end the stop, under this demand and at this speed.
    pub fn is_clear(&self, demand: State, speed: f64) -> bool {
        matches!(self.state, State::Hold | State::Off) && demand <= State::Degraded && speed < AT_REST
    }

    /// The state after a job at `now` whose findings demand `demand`, with the joints' greatest speed in rad/s.
    pub fn decide(&mut self, now: Ns, demand: State, speed: f64, acknowledge: bool) -> State {
        use State::*;
        let next = match (self.state, demand) {
            (_, Off) => Off,
            _ if acknowledge && self.is_clear(demand, speed) => demand,
            (Off, _) => Off,
            (Stop, _) if speed < AT_REST || now >= self.since + self.stop_time => Off,
            (Stop, _) | (_, Stop) => Stop,
            (Hold, _) => Hold,
            (Run | Degraded, _) => demand,
        };
        if next != self.state {
            (self.state, self.since) = (next, now);
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::State::*;
    use super::*;

    const MOVING: f64 = 1.0;
    const RESTING: f64 = 1e-3;

    fn safety() -> Safety {
        Safety::new(&scenario::Safety::default())
    }

    #[test]
    fn off_is_taken_from_any_state_and_left_only_acknowledged_with_its_cause_gone() {
        for before in [Run, Degraded, Hold, Stop] {
            let mut safety = safety();
            safety.decide(1, before, MOVING, false);
            assert_eq!(safety.decide(2, Off, MOVING, false), Off);
            assert_eq!(safety.decide(3, Run, MOVING, false), Off);
            assert_eq!(safety.decide(4, Off, RESTING, true), Off);
            assert_eq!(safety.decide(5, Stop, RESTING, true), Off);
            assert_eq!(safety.decide(6, Run, MOVING, true), Off, "an arm that moves");
            assert!(safety.is_clear(Run, RESTING) && !safety.is_clear(Run, MOVING) && !safety.is_clear(Hold, RESTING));
            assert_eq!(safety.decide(7, Run, RESTING, true), Run);
            assert!(!safety.is_clear(Run, RESTING), "nothing to acknowledge");
        }
    }

    #[test]
    fn a_stop_is_not_left_and_ends_in_torque_off_at_rest_or_after_its_time() {
        let mut safety = safety();
        assert_eq!(safety.decide(1, Degraded, MOVING, false), Degraded);
        assert_eq!(safety.decide(4, Run, MOVING, false), Run);
        assert_eq!(safety.decide(5, Stop, MOVING, false), Stop);
        assert_eq!(safety.decide(6, Run, MOVING, true), Stop);
        let mut slow = safety.clone();
        assert_eq!(slow.decide(7, Run, RESTING, false), Off);
        assert_eq!(safety.decide(5 + 200_000_000, Run, MOVING, false), Off);
    }

    #[test]
    fn a_hold_stays_until_acknowledged_and_can_become_a_stop() {
        let mut safety = safety();
        assert_eq!(safety.decide(1, Hold, MOVING, false), Hold);
        assert_eq!(safety.decide(2, Run, MOVING, false), Hold);
        assert_eq!(safety.decide(3, Hold, RESTING, true), Hold);
        assert_eq!(safety.decide(4, Run, RESTING, true), Run);
        safety.decide(5, Hold, MOVING, false);
        assert_eq!(safety.decide(6, Stop, RESTING, true), Stop);
    }
}
