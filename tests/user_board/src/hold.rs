//! Holds the posture of the start.

use crate::registers::Registers;
use arm::drives::DriveData;
use arm::{ArmModel, JointVector};
use board::{Board, Inputs, Ns, Outputs};
use messages::registers::encoder::VELOCITY_LSB;
use messages::{BusWord, JOINTS};
use scenario::Scenario;

/// Bandwidth of each joint, rad/s, critically damped.
const BANDWIDTH: f64 = 8.0;

/// The controller.
pub struct Hold {
    task: u16,
    registers: Registers,
    drives: DriveData,
    weight: JointVector,
    inertia: JointVector,
    /// Counts at the start.
    origin: [i64; JOINTS],
    counter_bits: u32,
    da_bits: u32,
    /// Newest register contents, in the order of the reads.
    words: Vec<u32>,
    told: bool,
}

impl Hold {
    /// Holds the arm of this scenario. The message says what is wrong with rack, arm or drives.
    pub fn new(scenario: &Scenario) -> Result<Hold, String> {
        let arm: ArmModel = scenario.controller_arm()?;
        let drives = scenario.drives()?;
        let posture = scenario.initial_posture()?;
        let mass = arm::crba(&arm, &posture);
        let registers = Registers::new(scenario)?;
        let origin = std::array::from_fn(|i| (posture[i] * drives.joints[i].counts_per_rad()).floor() as i64);
        Ok(Hold {
            task: scenario.task_of("control_computer").ok_or("the rack has no task of the control computer")?,
            weight: arm::gravity_torque(&arm, &posture),
            inertia: JointVector::from_fn(|i, _| mass[(i, i)] + drives.joints[i].rotor_inertia_at_output_kg_m2),
            words: registers.reads.chunks(2).zip(origin).flat_map(|(_, count)| [count as u32, 0]).collect(),
            registers,
            drives,
            origin,
            counter_bits: scenario.encoder_if.counter_bits.into(),
            da_bits: scenario.da_io.bits.into(),
            told: false,
        })
    }

    /// Deviation from the start (rad) and speed (rad/s) of a joint's motor, at the output side.
    fn motion(&self, joint: usize) -> (f64, f64) {
        let per_rad = self.drives.joints[joint].counts_per_rad();
        // the counter wraps; what it has moved since the start does not
        let unused = 64 - self.counter_bits;
        let moved = (i64::from(self.words[2 * joint]) - self.origin[joint]) << unused >> unused;
        let speed = f64::from(self.words[2 * joint + 1] as i32) * VELOCITY_LSB;
        (moved as f64 / per_rad, speed / per_rad)
    }

    /// D/A code of the torque that holds a joint.
    fn code(&self, joint: usize) -> u32 {
        let (deviation, speed) = self.motion(joint);
        let pull = -BANDWIDTH * BANDWIDTH * deviation - 2.0 * BANDWIDTH * speed;
        let torque = self.weight[joint] + self.inertia[joint] * pull;
        let half = f64::from(1 << (self.da_bits - 1));
        let steps = (torque / self.drives.joints[joint].amplifier_nm_per_v / 10.0 * half).round();
        (half + steps).clamp(0.0, 2.0 * half - 1.0) as u32
    }
}

impl Board for Hold {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        if inputs.boot {
            out.programs.push((self.task, self.registers.until_decision()));
        }
        for word in inputs.mail.words.iter().filter(|word| word.task == self.task) {
            if let Some(place) = self.words.get_mut(usize::from(word.index)) {
                *place = word.value;
            }
        }
        let Some(decision) = inputs.decision else { return };
        if !self.told {
            out.rest = Some(self.registers.after_decision());
            self.told = true;
        }
        for (i, addr) in self.registers.writes.iter().enumerate() {
            let value = match i {
                1..=JOINTS => self.code(i - 1),
                // the heartbeat must change from job to job
                8 => decision.job,
                // one bit for each joint
                _ => (1 << JOINTS) - 1,
            };
            let index = (self.registers.reads.len() + i) as u16;
            out.mail.words.push(BusWord { t: 0, addr: *addr, value, job: decision.job, task: self.task, index });
        }
    }
}
