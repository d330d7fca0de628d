//! Processor cards and their execution times.
//!
//! A card runs its tasks by fixed priority with preemption; a bus access stalls it (busy, not
//! suspended), an interrupt is served between operations. [`Preset`] holds execution times of the
//! control pipeline's stages by name: estimates from flop counts at the rates of such cards
//! (68030 + 68882 at 33 MHz: 0.2–0.4 MFLOPS; 7-joint recursive Newton–Euler 4–6 ms with a generic
//! program, 1–1.5 ms with customised symbolic code), to be changed in the scenario at will.

use crate::Ns;
use crate::requester::ReleasePolicy;
use serde::{Deserialize, Serialize};

/// A processor card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Processor {
    /// Card name, for example `cpu-1`.
    pub name: String,
    /// Slot, 1 to 21; not needed where `adaptor` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u8>,
    /// Bus request level, 0 to 3.
    #[serde(default = "highest")]
    pub level: u8,
    /// When its requester leaves the bus.
    #[serde(default)]
    pub release: ReleasePolicy,
    /// Time to load another task's context (68030: 112–140 µs, A).
    #[serde(default)]
    pub switch_ns: Ns,
    /// Interrupt acknowledge to the released task (9–12 µs, 2–8 µs on a fast host, A).
    #[serde(default = "interrupt_ns")]
    pub interrupt_ns: Ns,
    /// IRQ levels that it handles. Levels that no card claims go to the first card.
    #[serde(default)]
    pub handles: Vec<u8>,
    /// Writes go through a buffer of one: the processor goes on after this time, and a BERR* arrives
    /// late, as an interrupt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub posted_write_ns: Option<Ns>,
    /// Wide or misaligned accesses are split into cycles that the slave can answer.
    #[serde(default)]
    pub splits_width: bool,
    /// A workstation's processor: it reaches this bus through the adaptor of this name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptor: Option<String>,
}

fn highest() -> u8 {
    3
}
fn interrupt_ns() -> Ns {
    10_000
}

impl Processor {
    /// A card with every default, in the lowest free slot.
    pub fn new(name: &str) -> Processor {
        Processor {
            name: name.into(),
            slot: None,
            level: highest(),
            release: ReleasePolicy::OnRequest,
            switch_ns: 0,
            interrupt_ns: interrupt_ns(),
            handles: Vec::new(),
            posted_write_ns: None,
            splits_width: false,
            adaptor: None,
        }
    }
}

/// Execution times of a kind of processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// 68030 + 68882, dynamics by a generic recursive Newton–Euler program.
    #[serde(rename = "68030-generic")]
    M68030Generic,
    /// 68030 + 68882, dynamics by customised symbolic code.
    #[serde(rename = "68030-customised")]
    M68030Customised,
    /// A present-day board.
    Modern,
}

/// Execution times of the control pipeline's stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExecutionTimes {
    /// Trajectory generator.
    pub trajectory_ns: Ns,
    /// Forward kinematics, Jacobian and its rate.
    pub kinematics_ns: Ns,
    /// Augmented hybrid impedance control.
    pub ahic_ns: Ns,
    /// Error reference controller.
    pub erc_ns: Ns,
    /// Redundancy resolution with a 7×7 factorisation.
    pub redundancy_ns: Ns,
    /// Inverse dynamics.
    pub inverse_dynamics_ns: Ns,
    /// Limits and plausibility.
    pub safety_ns: Ns,
    /// Context switch.
    pub switch_ns: Ns,
    /// Interrupt acknowledge to handler.
    pub interrupt_ns: Ns,
}

impl Preset {
    /// The table of this preset.
    pub const fn times(self) -> ExecutionTimes {
        let m68030 = ExecutionTimes {
            trajectory_ns: 150_000,
            kinematics_ns: 600_000,
            ahic_ns: 350_000,
            erc_ns: 350_000,
            redundancy_ns: 1_300_000,
            inverse_dynamics_ns: 4_500_000,
            safety_ns: 100_000,
            switch_ns: 120_000,
            interrupt_ns: 10_000,
        };
        match self {
            Preset::M68030Generic => m68030,
            Preset::M68030Customised => ExecutionTimes { inverse_dynamics_ns: 1_200_000, ..m68030 },
            Preset::Modern => ExecutionTimes {
                trajectory_ns: 200,
                kinematics_ns: 400,
                ahic_ns: 200,
                erc_ns: 200,
                redundancy_ns: 800,
                inverse_dynamics_ns: 400,
                safety_ns: 100,
                switch_ns: 2_000,
                interrupt_ns: 4_000,
            },
        }
    }
}

impl ExecutionTimes {
    /// All stages of the pipeline on one card, one after the other.
    pub const fn pipeline_ns(&self) -> Ns {
        self.law_ns() + self.torque_ns()
    }

    /// Trajectory to redundancy resolution: what the first of two cards runs.
    pub const fn law_ns(&self) -> Ns {
        self.trajectory_ns + self.kinematics_ns + self.ahic_ns + self.erc_ns + self.redundancy_ns
    }

    /// Inverse dynamics and safety: what the second of two cards runs.
    pub const fn torque_ns(&self) -> Ns {
        self.inverse_dynamics_ns + self.safety_ns
    }

    /// From the release to the first operation of a job: context switch, and the interrupt that causes it.
    pub const fn entry_ns(&self) -> Ns {
        self.switch_ns + self.interrupt_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Ns = 5_000_000;

    #[test]
    fn generic_dynamics_overrun_5_ms_on_one_68030_and_customised_ones_fit() {
        assert!(Preset::M68030Generic.times().pipeline_ns() > PERIOD);
        assert!(Preset::M68030Customised.times().pipeline_ns() < PERIOD);
    }

    #[test]
    fn generic_dynamics_fit_when_two_68030_share_the_pipeline() {
        let times = Preset::M68030Generic.times();
        assert!(times.torque_ns() < PERIOD && times.law_ns() < PERIOD);
        assert_eq!(times.law_ns() + times.torque_ns(), times.pipeline_ns());
    }
}
