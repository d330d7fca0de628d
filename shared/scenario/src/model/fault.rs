//! `[[fault]]`: what goes wrong in the rack, where and when.

use serde::{Deserialize, Serialize};

/// A fault that is put into the rack on purpose. Every draw is from the scenario's seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What it befalls: `force_sensor`, `joint-1` to `joint-7`, `bus`, `workstation`, `power`, or a board, slave, master,
    /// interrupter, adaptor or task by its name, as the kind says.
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

macro_rules! fault_kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal;)*) => {
        /// Kinds of faults; what each befalls stands first.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        pub enum FaultKind {
            $($(#[$doc])* #[serde(rename = $name)] $kind,)*
        }

        impl FaultKind {
            /// All kinds.
            pub const ALL: &[FaultKind] = &[$(FaultKind::$kind,)*];

            /// Its name in a scenario.
            pub const fn name(self) -> &'static str {
                match self { $(FaultKind::$kind => $name,)* }
            }
        }
    };
}

fault_kinds! {
    /// Force sensor: `amount` is added (N, Nm). In contact it cannot be seen below `safety.max_force_residual_n` less what
    /// friction hides.
    Bias = "bias";
    /// Force sensor: an error that grows by `amount` a second (N/s, Nm/s).
    Drift = "drift";
    /// Force sensor: every sample repeats the one before the fault; the receiver's counter goes on.
    Stuck = "stuck";
    /// Force sensor: white Gaussian noise of standard deviation `amount` (N, Nm) on top.
    Noise = "noise";
    /// Force sensor: one sample in which `amount` (N, Nm) is added.
    Spike = "spike";
    /// Force sensor: the bridges read full scale.
    Saturation = "saturation";
    /// Force sensor: no samples come; the receiver's counter stands.
    Dropout = "dropout";
    /// Force sensor: samples come `amount` ms late. Board: its messages over the bus do.
    Delay = "delay";
    /// Force sensor: the cable is open, samples read zero and the error word says that the sensor has changed. Joint: the
    /// encoder's lines are open, its count stands and its status says so.
    WireBreak = "wire-break";
    /// Joint: the encoder loses `amount` counts, once. Fewer than `safety.max_count_jump_rad` show when the motor passes its
    /// next index mark, and not before.
    LostCounts = "lost-counts";
    /// Joint: the encoder's A and B tracks change at once, `amount` times, each one an error of two counts.
    QuadratureError = "quadrature-error";
    /// Joint: the encoder's counter wraps at `amount` bits instead of its width.
    Wrap = "wrap";
    /// Joint: the encoder's index pulses do not come. It shows once the motor has turned one and a quarter times.
    IndexLoss = "index-loss";
    /// Joint: the D/A output stays where it is. It shows once the output should be elsewhere, by 2.5 steps of the converter.
    DaStuck = "da-stuck";
    /// Joint: `amount` (V) is added to the D/A output. Less than 2.5 steps of the converter cannot be seen.
    DaOffset = "da-offset";
    /// Joint: the amplifier trips.
    AmplifierTrip = "amplifier-trip";
    /// Joint: the brake, engaged, holds `amount` times its torque (0: nothing). It shows when it slips.
    BrakeSlip = "brake-slip";
    /// Joint: the brake does not release, or falls in.
    BrakeStuck = "brake-stuck";
    /// Board: its messages come up to `amount` ms late, at random.
    Jitter = "jitter";
    /// Board: its messages get lost, each with probability `amount` (0: every one).
    Drop = "drop";
    /// Board: its messages come twice. Each access that carries one takes place twice, as if the master had missed the end
    /// of the first: it costs bus time, the second copy is discarded.
    Duplicate = "duplicate";
    /// Board: every second message comes after the one that follows it.
    Reorder = "reorder";
    /// Board: `amount` bits of each of its messages are flipped.
    BitFlip = "bit-flip";
    /// Slave: it does not answer; accesses end in BERR*.
    NoSlave = "no-slave";
    /// Master: the arbiter does not hear it; its requests end in the access timer.
    Starvation = "starvation";
    /// Bus: nobody is granted.
    StuckBus = "stuck-bus";
    /// Interrupter: its events raise nothing; after two in a row the handler's card goes on by polling.
    LostInterrupt = "lost-interrupt";
    /// Adaptor: its cable is out.
    CableOut = "cable-out";
    /// Board: its process is killed (SIGKILL).
    Crash = "crash";
    /// Board: its process is stopped (SIGSTOP).
    Hang = "hang";
    /// Task: one job takes `amount` ms longer.
    Overrun = "overrun";
    /// Task: its execution times are multiplied by `amount`.
    Slow = "slow";
    /// Interface card or control computer: its clock gains `amount` parts per million. Its stamps and the ticks of its
    /// timers and interrupters go by it, and so do the times between edges from which an encoder card finds speeds: one
    /// that is fast shows them too low. The force sensor's sampling keeps pace.
    ClockDrift = "clock-drift";
    /// Workstation: its program ends; no more polls, no more commands.
    Gone = "gone";
    /// Workstation: its newest command is sent again.
    StaleCommand = "stale-command";
    /// Workstation: a command with a target `amount` m away at once. One within the limits cannot be told from a meant one.
    WrongCommand = "wrong-command";
    /// Power: ACFAIL*; the supply holds for `amount` ms more, at least 4.
    PowerFail = "power-fail";
}

fn certain() -> f64 {
    1.0
}

fn all_axes() -> Vec<u8> {
    (0..6).collect()
}
