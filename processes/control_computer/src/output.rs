//! The end of the pipeline: safety state, what the drives are told, and the words that the D/A cards get.
//!
//! It runs on the card that writes the D/A converters: the only one, or the second of two.

use crate::findings::Findings;
use crate::pipeline::Mode;
use crate::program::{BusProgram, Rest};
use crate::safety::{Safety, State};
use arm::JointVector;
use board::Outputs;
use messages::{Detector, Event, EventKind, JOINTS, Severity};
use scenario::Scenario;
use vme::{MILLISECOND, Ns};

/// Time in which released brakes let go, and the arm settles on its motors.
const BRAKES_LET_GO: Ns = 200 * MILLISECOND;

/// What has been asked of all brakes, and since when, own clock. Brakes are released with the drives on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brakes {
    /// To hold.
    Engaged {
        /// Since this instant, ns.
        since: Ns,
    },
    /// To let go.
    Released {
        /// Since this instant, ns.
        since: Ns,
    },
}

impl Brakes {
    /// Since when, ns.
    pub fn since(self) -> Ns {
        match self {
            Brakes::Engaged { since } | Brakes::Released { since } => since,
        }
    }
}

/// Safety, amplifiers and converters.
pub struct Output {
    safety: Safety,
    converters: Converters,
    /// What the last job did after its decision.
    rest: Option<Rest>,
    brakes: Brakes,
    finite: bool,
    /// The stop can be acknowledged.
    clear: bool,
}

/// D/A converters: from torque to code.
struct Converters {
    nm_per_v: JointVector,
    bits: u32,
}

impl Converters {
    /// Offset binary over ±10 V.
    fn code(&self, joint: usize, torque: f64) -> u32 {
        let half = 2f64.powi(self.bits as i32 - 1);
        let steps = (torque / self.nm_per_v[joint] / 10.0 * half).round();
        (steps + half).clamp(0.0, 2.0 * half - 1.0) as u32
    }
}

impl Output {
    /// Running, nothing told yet. The message says what is wrong with the drives.
    pub fn new(scenario: &Scenario) -> Result<Output, String> {
        let nm_per_v = scenario.drives()?.each(|drive| drive.amplifier_nm_per_v);
        Ok(Output {
            safety: Safety::new(&scenario.safety),
            converters: Converters { nm_per_v, bits: scenario.da_io.bits.into() },
            rest: None,
            brakes: Brakes::Engaged { since: 0 },
            finite: true,
            clear: false,
        })
    }

    /// The state after a job at `t` of simulated time and `now` of the board's clock, with the joints' greatest speed in
    /// rad/s; whether the torques are numbers is known here.
    pub fn decide(
        &mut self,
        t: Ns,
        now: Ns,
        findings: &mut Findings,
        speed: f64,
        acknowledge: bool,
        out: &mut Outputs,
    ) -> State {
        if !self.finite {
            findings.report(Detector::NotFinite, State::Off, 0.0);
        }
        findings.tell(t, out);
        let before = self.safety.state();
        let (demand, cause) = findings.demanded();
        let state = self.safety.decide(now, demand, speed, acknowledge);
        self.clear = self.safety.is_clear(demand, speed);
        // only an acknowledgement leads out of a stop
        let cause = if before >= State::Hold && state <= State::Degraded { Some(Detector::Operator) } else { cause };
        if state != before {
            let severity = match state {
                State::Run => Severity::Ok,
                State::Degraded | State::Hold => Severity::Warn,
                State::Stop | State::Off => Severity::Error,
            };
            let (from, to) = (f64::from(before as u32), f64::from(state as u32));
            out.mail.events.push(Event::new(t, EventKind::SafetyState, severity, from, to).because(cause));
        }
        state
    }

    /// Begins in STO, latched, at `t`.
    pub fn latch(&mut self, t: Ns, out: &mut Outputs) {
        self.safety.latch();
        let (from, to) = (f64::from(State::Run as u32), f64::from(State::Off as u32));
        let event = Event::new(t, EventKind::SafetyState, Severity::Error, from, to);
        out.mail.events.push(event.because(Some(Detector::Heartbeat)));
    }

    /// Whether the last job's state is a stop that can be acknowledged.
    pub fn is_clear(&self) -> bool {
        self.clear
    }

    /// What has been asked of the brakes.
    pub fn brakes(&self) -> Brakes {
        self.brakes
    }

    /// Whether the arm rests on its motors alone at `now`.
    pub fn carries(&self, now: Ns) -> bool {
        matches!(self.brakes, Brakes::Released { since } if now > since + BRAKES_LET_GO)
    }

    /// Tells the drives, with these torques; returns when the job will have computed.
    pub fn write(
        &mut self,
        (task, job): (u16, u32),
        (t, now): (Ns, Ns),
        mode: Mode,
        torque: &JointVector,
        program: &BusProgram,
        out: &mut Outputs,
    ) -> Ns {
        self.finite = torque.iter().all(|torque| torque.is_finite());
        self.brakes = match (mode, self.brakes) {
            (Mode::Free, Brakes::Released { .. }) => Brakes::Engaged { since: now },
            (Mode::Law | Mode::Hold | Mode::Brake, Brakes::Engaged { .. }) => Brakes::Released { since: now },
            (_, unchanged) => unchanged,
        };
        let rest = match self.rest {
            _ if mode == Mode::Free || !self.finite => Rest::Stop,
            None => Rest::Start,
            Some(Rest::Stop) => Rest::Resume,
            Some(_) => Rest::Run,
        };
        let codes: [u32; JOINTS] = std::array::from_fn(|joint| {
            let torque = if rest == Rest::Stop { 0.0 } else { torque[joint] };
            self.converters.code(joint, torque)
        });
        if self.rest != Some(rest) {
            out.rest = Some(program.after_decision(rest));
            self.rest = Some(rest);
        }
        program.words(rest, task, job, &codes, &mut out.mail.words);
        t + program.execution_ns(rest)
    }
}
