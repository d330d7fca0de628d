//! `[[fault]]`: what goes wrong in the rack, where and when.

use serde::{Deserialize, Serialize};

/// A fault that is put into the rack on purpose. Every draw is from the scenario's seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What it befalls: `force_sensor`, `bus`, or a slave, board, interrupter, adaptor or task of the rack by its name.
    pub target: String,
    /// What is wrong.
    pub kind: FaultKind,
    /// When it begins (s).
    pub start_s: f64,
    /// How long it lasts (s); default: to the end of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// It begins again after every such time (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every_s: Option<f64>,
    /// It begins again at random, on average so long after it ended (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_time_between_s: Option<f64>,
    /// Each time that it might begin, it does so with this probability.
    #[serde(default = "certain")]
    pub probability: f64,
    /// Axes of the force sensor concerned (0–5: force x y z, moment x y z); default: all.
    #[serde(default = "all_axes")]
    pub axes: Vec<u8>,
    /// How much, in the unit that its kind states.
    #[serde(default)]
    pub amount: f64,
}

/// Kinds of faults, by the class of their target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// Force sensor: `amount` is added (N, Nm).
    Bias,
    /// Force sensor: an error that grows by `amount` a second (N/s, Nm/s).
    Drift,
    /// Force sensor: every sample repeats the one before the fault; the receiver's counter goes on.
    Stuck,
    /// Force sensor: white Gaussian noise of standard deviation `amount` (N, Nm) on top.
    Noise,
    /// Force sensor: one sample in which `amount` (N, Nm) is added.
    Spike,
    /// Force sensor: the bridges read full scale.
    Saturation,
    /// Force sensor: no samples come; the receiver's counter stands.
    Dropout,
    /// Force sensor: the cable is open: samples read zero and the error word says that the sensor has changed.
    WireBreak,
    /// Slave: it does not answer; accesses end in BERR*.
    NoSlave,
    /// Board: the arbiter does not hear it; its requests end in the access timer.
    Starvation,
    /// Bus: nobody is granted.
    StuckBus,
    /// Interrupter: its events raise nothing.
    LostInterrupt,
    /// Adaptor: its cable is out.
    CableOut,
    /// Task: its execution times are multiplied by `amount`.
    Slow,
}

impl FaultKind {
    /// Its name in a scenario.
    pub const fn name(self) -> &'static str {
        use FaultKind::*;
        match self {
            Bias => "bias",
            Drift => "drift",
            Stuck => "stuck",
            Noise => "noise",
            Spike => "spike",
            Saturation => "saturation",
            Dropout => "dropout",
            WireBreak => "wire-break",
            NoSlave => "no-slave",
            Starvation => "starvation",
            StuckBus => "stuck-bus",
            LostInterrupt => "lost-interrupt",
            CableOut => "cable-out",
            Slow => "slow",
        }
    }

    /// Whether it is a fault of the force sensor's signal.
    pub fn is_of_force_sensor(self) -> bool {
        use FaultKind::*;
        matches!(self, Bias | Drift | Stuck | Noise | Spike | Saturation | Dropout | WireBreak)
    }
}

fn certain() -> f64 {
    1.0
}

fn all_axes() -> Vec<u8> {
    (0..6).collect()
}
