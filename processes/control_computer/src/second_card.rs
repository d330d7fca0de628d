//! The second of two cards: inverse dynamics, safety and D/A at a rate of its own, on what the first card has handed over.
//!
//! It reads encoders and drives' status afresh in every job. Without a block from the first card the drives stay off. A
//! block that does not come in time counts as a value held, so a first card that overruns, or is gone, degrades the arm
//! and then stops it.

use crate::findings::Findings;
use crate::handover::{Ram, Word};
use crate::inverse_dynamics::InverseDynamics;
use crate::output::Output;
use crate::pipeline::{BRAKING, Mode};
use crate::program::{BusProgram, Part};
use crate::safety::State;
use crate::sensors::Sensors;
use arm::{ArmModel, ArmState, JointVector};
use board::Outputs;
use messages::{BusWord, Detector, TransferRecord};
use scenario::Scenario;
use vme::Ns;

/// The second processor card.
pub struct SecondCard {
    task: u16,
    /// Task of the first card and its period.
    first: (u16, Ns),
    program: BusProgram,
    sensors: Sensors,
    /// Seen from the task frame.
    arm: ArmModel,
    inverse: InverseDynamics,
    findings: Findings,
    limits: scenario::Safety,
    period_ns: Ns,
    /// Own clock at the last job.
    last: Option<Ns>,
    output: Output,
    ram: Ram,
    torque: JointVector,
}

impl SecondCard {
    /// The card that runs `task`. The message says what is wrong with rack, arm or drives.
    pub fn new(scenario: &Scenario, first: u16, task: u16) -> Result<SecondCard, String> {
        let program = BusProgram::new(scenario, Part::Torque)?;
        Ok(SecondCard {
            task,
            first: (first, scenario.rack.tasks[usize::from(first)].period_ns),
            sensors: Sensors::new(scenario, program.sensors())?,
            program,
            arm: scenario.controller_arm()?.seen_from(&scenario.task_frame()),
            inverse: InverseDynamics::new(scenario)?,
            findings: Findings::new(),
            limits: scenario.safety.clone(),
            period_ns: scenario.rack.tasks[usize::from(task)].period_ns,
            last: None,
            output: Output::new(scenario)?,
            ram: Ram::new(),
            torque: JointVector::zeros(),
        })
    }

    /// Its dual-ported RAM.
    pub fn ram(&mut self) -> &mut Ram {
        &mut self.ram
    }

    /// Begins in STO, latched, at `t`.
    pub fn latch(&mut self, t: Ns, out: &mut Outputs) {
        self.output.latch(t, out);
    }

    /// Its task.
    pub fn task(&self) -> u16 {
        self.task
    }

    /// Torques sent last (Nm).
    pub fn torque(&self) -> &JointVector {
        &self.torque
    }

    /// Its program up to the decision.
    pub fn program(&self) -> vme::Program {
        self.program.until_decision()
    }

    /// The answer to one of its reads.
    pub fn take(&mut self, word: &BusWord) {
        self.sensors.take(word);
    }

    /// Why words of the job under way that do not come are missing.
    pub fn lost(&mut self, why: Detector) {
        self.sensors.lost(why);
    }

    /// What an access of its task that fails concerns.
    pub fn bus_ends(&mut self) -> (&mut Sensors, &mut Findings) {
        (&mut self.sensors, &mut self.findings)
    }

    /// A transfer made to its RAM by the first card.
    pub fn served(&mut self, transfer: &TransferRecord) {
        let Some([block, state]) = self.program.second else { return };
        if transfer.task != self.first.0 {
            return;
        }
        if transfer.addr == block.addr && !transfer.is_read() {
            self.ram.arrived(transfer.job, transfer.data_at, transfer.is_ok());
        } else if transfer.addr == state.addr && transfer.is_read() && transfer.is_ok() {
            self.ram.read_at(transfer.data_at);
        }
    }

    /// One job at its decision, at `t` of simulated time and `now` of the board's clock.
    pub fn job(&mut self, job: u32, t: Ns, now: Ns, out: &mut Outputs) {
        let since = self.last.map_or(self.period_ns, |last| now.saturating_sub(last).max(1));
        self.last = Some(now);
        let dt = since as f64 * 1e-9;
        self.sensors.read(job, dt);
        let sensed = *self.sensors.sensed();
        let period = self.first.1;
        let (mut missing, mut acknowledge) = (0, false);
        let wanted = self.ram.block().map(|(at, wanted)| {
            // blocks come a period apart, and may be late by half of one
            missing = ((t.saturating_sub(*at) + period / 2) / period).saturating_sub(1) as u32;
            // a request counts once
            acknowledge = std::mem::take(&mut wanted.acknowledge);
            *wanted
        });
        let findings = &mut self.findings;
        findings.begin();
        self.sensors.report(findings);
        self.sensors.report_brakes(now, self.output.brakes(), findings);
        self.inverse.report(&self.limits, findings);
        if let Some(wanted) = &wanted {
            findings.demand(wanted.demand, wanted.cause);
        }
        if missing > 0 {
            let demand = if missing > self.limits.max_held_jobs { State::Stop } else { State::Degraded };
            findings.report(Detector::HandOver, demand, missing.into());
        }
        let state = self.output.decide(t, now, findings, sensed.qd.amax(), acknowledge, out);
        let mode = match (state, &wanted) {
            (State::Off, _) | (_, None) => Mode::Free,
            (State::Stop, _) => Mode::Brake,
            (State::Hold, _) => Mode::Hold,
            _ => Mode::Law,
        };
        let mut torque_limited = 0;
        self.torque = JointVector::zeros();
        if let Some(mut wanted) = wanted.filter(|_| mode != Mode::Free) {
            if mode == Mode::Brake {
                wanted.qdd = sensed.qd * -BRAKING;
            }
            let arm = ArmState::new(&self.arm, &sensed.q, &sensed.qd);
            let tool = arm.tip_motion();
            self.inverse.observe(&arm, &tool, &sensed.qd, &wanted.fe, dt);
            (self.torque, torque_limited) = self.inverse.torque(&arm, &tool, &wanted, mode);
        }
        let torque = (mode != Mode::Free && self.output.carries(now)).then_some(self.torque);
        self.inverse.sent(&sensed.qd, torque);
        let written = self.output.write((self.task, job), (t, now), mode, &self.torque, &self.program, out);
        self.ram.show(written, Word { state, torque_limited, clear: self.output.is_clear() });
    }
}
