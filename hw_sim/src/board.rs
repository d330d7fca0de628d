//! The plant on the rack's time: steps on a fixed grid, actuation at its exact instants, samples for the wires.
//!
//! The committed state moves only to points of the grid and to instants at which brakes or faults act. Motor torques that
//! change within a step act in it from their instants on, as their mean over the step: behind flexible joints nothing but
//! the rotors feels them at once. Where a step cannot take them so, they split it too. What is asked for at any other
//! instant (the end of a window) is found by a trial step that is thrown away, so the motion does not depend on where
//! windows are cut. A closing limit switch or a tripping amplifier ends the window there. A runaway freezes the arm: the
//! last good values are repeated with [`drive_status::DIVERGED`] set.

use crate::energy;
use crate::faults::Faults;
use crate::integrate;
use crate::plant::{Actuation, Evaluation, Plant};
use crate::state::State;
use arm::{DOF, FrozenArm, JointVector, Pose, rotation};
use board::{Board, Inputs, Outputs};
use messages::{AmplifierCommand, Event, EventKind, Ns, PlantProbe, PlantSample, Severity, drive_status};
use nalgebra::Vector3;
use scenario::{Integrator, Joints, Scenario};

/// Most amplifier commands that may wait for their time; of more, which only outputs gone wrong send, the oldest are lost.
const PENDING: usize = 256;

/// The hardware of the rack.
pub struct HwSim {
    plant: Plant,
    task_frame: Pose,
    integrator: Integrator,
    /// A step takes motor torques that change within it.
    takes_changes: bool,
    /// Distance of the grid's points, ns.
    grid: Ns,
    /// The arm about which semi-implicit Euler evaluates, and how long it is held (ns): from one multiple of it to the next.
    arm: FrozenArm,
    frozen: Ns,
    runaway: f64,
    /// Instant of `state`.
    t: Ns,
    state: State,
    /// What the cards command, and what the drives make of it.
    commanded: Actuation,
    actuation: Actuation,
    faults: Faults,
    /// A fault has begun or ended since the last actuation.
    broken: bool,
    /// Forces in `state` under `actuation`, where `known`.
    now: Evaluation,
    known: bool,
    /// Commands whose time has not come.
    pending: Vec<AmplifierCommand>,
    status: u32,
    touched: bool,
    last_sample: PlantSample,
    last_probe: PlantProbe,
}

impl HwSim {
    /// The hardware of a scenario, at rest on its brakes. The message says what cannot be simulated.
    pub fn new(scenario: &Scenario) -> Result<HwSim, String> {
        let (plant, state) = Plant::new(scenario)?;
        let integrator = scenario.plant.integrator;
        let arm = plant.frozen(&state, 0.0);
        let now = plant.evaluate_about(&arm, &state, &Actuation::SAFE);
        let grid = scenario::nanoseconds(1.0 / scenario.plant.rate_hz);
        let mut sim = HwSim {
            takes_changes: plant.joints == Joints::Flexible && integrator == Integrator::SemiImplicit,
            arm,
            frozen: grid * Ns::from(scenario.plant.frozen_steps),
            plant,
            task_frame: scenario.task_frame(),
            integrator,
            grid,
            runaway: scenario.plant.runaway_rad_per_s,
            t: 0,
            state,
            commanded: Actuation::SAFE,
            actuation: Actuation::SAFE,
            faults: Faults::new(scenario),
            broken: false,
            now,
            known: true,
            pending: Vec::with_capacity(PENDING),
            status: 0,
            touched: false,
            last_sample: bytemuck::Zeroable::zeroed(),
            last_probe: bytemuck::Zeroable::zeroed(),
        };
        sim.status = sim.switches();
        Ok(sim)
    }

    /// True state at the last committed instant; after a runaway, the one that left its domain.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Makes `now` the forces in the committed state.
    fn evaluate(&mut self) {
        if !self.known {
            self.now = self.forces(&self.state, &self.actuation);
            self.known = true;
        }
    }

    fn forces(&self, state: &State, actuation: &Actuation) -> Evaluation {
        match self.integrator {
            Integrator::SemiImplicit => self.plant.evaluate_about(&self.arm, state, actuation),
            Integrator::Rk4 => self.plant.evaluate(state, actuation),
        }
    }

    /// Limit switches, emergency chain and brake contacts in the committed state. The switches sit in the chain.
    fn switches(&self) -> u32 {
        let (lower, upper) = (self.plant.arm.lower_limits(), self.plant.arm.upper_limits());
        let mut status = self.actuation.braked << 16 | self.faults.tripped();
        for i in 0..DOF {
            if self.state.q[i] < lower[i] || self.state.q[i] > upper[i] {
                status |= (1 << (8 + i)) | drive_status::EMERGENCY_STOP;
            }
        }
        status
    }

    /// What the drives make of a command.
    fn actuation_of(&self, command: &AmplifierCommand) -> Actuation {
        self.faults.spoil(Actuation::from_command(command))
    }

    /// Commands that wait for a time before `until`.
    fn waiting(&self, until: Ns) -> &[AmplifierCommand] {
        let due = self.pending.iter().take_while(|command| command.t < until).count();
        &self.pending[..due]
    }

    /// Applies the commands whose time is before `until`.
    fn actuate(&mut self, until: Ns) {
        let due = self.waiting(until).len();
        if let Some(last) = self.pending[..due].last() {
            self.commanded = Actuation::from_command(last);
        }
        let broken = std::mem::take(&mut self.broken);
        if due == 0 && !broken {
            return;
        }
        let before = self.actuation;
        self.actuation = self.faults.spoil(self.commanded);
        if self.actuation != before {
            for i in 0..DOF {
                // an engaging brake starts without deflection
                if self.actuation.braked & !before.braked & (1 << i) != 0 {
                    self.state.brake[i] = 0.0;
                }
            }
            self.known = false;
            self.status = self.switches();
        }
        self.pending.drain(..due);
    }

    /// Where the next step ends: at the grid's next point, or before it where something acts that a step cannot take.
    fn next_stop(&self) -> Ns {
        let stop = ((self.t / self.grid + 1) * self.grid).min(self.faults.next_change());
        let splits = |command: &&AmplifierCommand| {
            !self.takes_changes || !self.actuation_of(command).brakes_like(&self.actuation)
        };
        self.waiting(stop).iter().find(splits).map_or(stop, |command| command.t)
    }

    /// Motor torques (Nm) in the step to `until`: their mean, each from its command's instant on.
    fn motor_until(&self, until: Ns) -> JointVector {
        let (mut mean, mut motor) = (self.now.motor, self.now.motor);
        for command in self.waiting(until) {
            let next = self.plant.drives.motor_torques(&self.actuation_of(command));
            mean += (next - motor) * (seconds(until - command.t) / seconds(until - self.t));
            motor = next;
        }
        mean
    }

    /// Lets the drives' faults begin and end that do so up to now.
    fn break_down(&mut self, out: &mut Outputs) {
        let changed = self.faults.advance(self.t, |fault, from| {
            out.mail.events.push(Event::injected(from, fault));
        });
        if changed {
            self.broken = true;
            self.status = self.switches();
        }
    }

    /// Carries the committed state to `t`. False where it leaves its domain; then nothing asks for it again.
    fn commit(&mut self, t: Ns, out: &mut Outputs) -> bool {
        self.evaluate();
        let (motor, h) = (self.motor_until(t), seconds(t - self.t));
        integrate::step(&self.plant, self.integrator, &mut self.state, &self.now, &self.actuation, &motor, h);
        self.t = t;
        self.known = false;
        self.actuate(t);
        if let Some((joint, value)) = self.state.out_of_domain(self.runaway) {
            self.status |= drive_status::DIVERGED;
            let value = if value.is_finite() { value } else { f64::MAX };
            out.mail.events.push(Event::new(t, EventKind::Diverged, Severity::Error, joint as f64, value));
            return false;
        }
        if self.integrator == Integrator::SemiImplicit && t % self.frozen == 0 {
            self.arm = self.plant.frozen(&self.state, seconds(self.frozen - self.grid));
        }
        self.status = self.switches();
        true
    }

    /// Puts the committed state on the wires.
    fn sample(&mut self, out: &mut Outputs) {
        self.evaluate();
        let touch = &self.now.touch;
        if !self.touched && touch.penetration > 0.0 {
            self.touched = true;
            out.mail.events.push(Event::new(self.t, EventKind::FirstContact, Severity::Ok, touch.normal_speed, 0.0));
        }
        self.last_sample = self.sample_of(self.t, &self.state, &self.now);
        out.mail.plant.push(self.last_sample);
    }

    fn sample_of(&self, t: Ns, state: &State, now: &Evaluation) -> PlantSample {
        let shaft = |v: &JointVector| v.component_mul(&self.plant.drives.gear_ratio).into();
        PlantSample {
            t,
            wrench: self.plant.sensor.wrench(now),
            theta: shaft(&state.theta),
            theta_dot: shaft(&state.theta_dot),
            status: self.status,
            reserved: 0,
        }
    }

    fn probe_of(&self, t: Ns, state: &State, now: &Evaluation) -> PlantProbe {
        let frame = &self.task_frame;
        let in_task = |v: Vector3<f64>| frame.r.tr_mul(&v);
        let position = in_task(now.pose.p - frame.p);
        let q = rotation::quaternion(&(frame.r.transpose() * now.pose.r));
        let sign = if q[3] < 0.0 { -1.0 } else { 1.0 };
        let wrench = &now.touch.wrench;
        let force = in_task(Vector3::new(wrench[0], wrench[1], wrench[2]));
        let moment = in_task(Vector3::new(wrench[3], wrench[4], wrench[5]));
        PlantProbe {
            t,
            q: state.q.into(),
            qd: state.qd.into(),
            theta: state.theta.into(),
            theta_dot: state.theta_dot.into(),
            motor_torque: now.motor.into(),
            spring_torque: now.transmitted.into(),
            friction_torque: now.loss.friction.into(),
            position: position.into(),
            orientation: [q[3] * sign, q[0] * sign, q[1] * sign, q[2] * sign],
            contact: [force.x, force.y, force.z, moment.x, moment.y, moment.z],
            // nothing to touch is a gap too wide to matter, but a finite number
            penetration: now.touch.penetration.max(-1e3),
            energy: energy::mechanical(&self.plant, state),
            status: self.status,
            reserved: 0,
        }
    }

    /// Probe, and where the committed state is older, sample, at the end of the window.
    fn finish_window(&mut self, until: Ns, out: &mut Outputs) {
        self.evaluate();
        if self.t == until {
            self.last_probe = self.probe_of(until, &self.state, &self.now);
        } else {
            let (mut state, motor, h) = (self.state, self.motor_until(until), seconds(until - self.t));
            integrate::step(&self.plant, self.integrator, &mut state, &self.now, &self.actuation, &motor, h);
            let actuation = self.waiting(until).last().map_or(self.actuation, |last| self.actuation_of(last));
            let now = self.forces(&state, &actuation);
            if state.out_of_domain(self.runaway).is_some() {
                // the next step of the grid will find it too and say so
                return self.repeat(until, out);
            }
            if self.last_sample.t < until {
                self.last_sample = self.sample_of(until, &state, &now);
                out.mail.plant.push(self.last_sample);
            }
            self.last_probe = self.probe_of(until, &state, &now);
        }
        out.mail.plant_probe.push(self.last_probe);
    }

    /// Stands still, for good.
    fn freeze(&mut self, until: Ns, out: &mut Outputs) {
        self.t = until;
        self.repeat(until, out);
    }

    /// Repeats the last good values.
    fn repeat(&mut self, until: Ns, out: &mut Outputs) {
        self.last_sample.status = self.status;
        self.last_probe.status = self.status;
        if self.last_sample.t < until {
            self.last_sample.t = until;
            out.mail.plant.push(self.last_sample);
        }
        self.last_probe.t = until;
        out.mail.plant_probe.push(self.last_probe);
    }
}

impl Board for HwSim {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        // one that comes late acts at once, and none before those before it
        let mut from = self.pending.last().map_or(inputs.from, |command| command.t.max(inputs.from));
        for command in &inputs.mail.amplifier {
            from = from.max(command.t);
            self.pending.push(AmplifierCommand { t: from, ..*command });
        }
        self.pending.drain(..self.pending.len().saturating_sub(PENDING));
        if inputs.boot {
            self.actuate(1);
            self.sample(out);
            self.finish_window(inputs.until, out);
            return;
        }
        out.mail.plant.push(PlantSample { t: inputs.from, status: self.status, ..self.last_sample });
        if self.status & drive_status::DIVERGED != 0 {
            return self.freeze(inputs.until, out);
        }
        self.break_down(out);
        loop {
            self.actuate(self.t + 1);
            let next = self.next_stop();
            let on_grid = next % self.grid == 0;
            // what acts at the window's very end is the next one's
            if next > inputs.until || next == inputs.until && !on_grid {
                break;
            }
            let switches = self.status;
            if !self.commit(next, out) {
                return self.freeze(inputs.until, out);
            }
            self.break_down(out);
            let closed = self.status & !switches & (drive_status::LIMIT_SWITCH | drive_status::AMPLIFIER_TRIPPED) != 0;
            if on_grid || closed {
                self.sample(out);
            }
            if closed && next < inputs.until {
                // what was to come is said again, knowing of this
                self.pending.clear();
                self.finish_window(next, out);
                out.early = Some(next);
                return;
            }
            if next == inputs.until {
                break;
            }
        }
        self.finish_window(inputs.until, out);
    }
}

fn seconds(ns: Ns) -> f64 {
    ns as f64 * 1e-9
}
