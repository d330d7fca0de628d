//! The scenario as data. Keys carry their unit as a suffix; every key that has a sensible value has a
//! default, stated at the field. Poses and wrenches of segments and surfaces are in the task frame C:
//! fixed in the world, z **into** the surface, moments about the tool point.

mod controller;
mod fault;
mod hole;
mod interfaces;
mod limit;
mod plant;
mod safety;
mod segment;

pub use controller::{Controller, JointLimitTask, Scheme, SecondCard};
pub use fault::{Fault, FaultKind};
pub use hole::Hole;
pub use interfaces::{DaIo, EncoderIf, ForceSensorIf, ForceFilter, VelocitySource};
pub use limit::{Limit, Measure};
pub use plant::{Arm, Robot, Integrator, Joints, MismatchConfig, Plant, Surface, TaskFrame, ToolModel};
pub use safety::Safety;
pub use segment::{Impedance, Path, Segment, ResolvedSegment};

use serde::{Deserialize, Serialize};

/// A scenario: the whole rack, what it does and what is expected of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// One line that says what the scenario shows.
    pub title: String,
    /// What a reader should know about it.
    #[serde(default)]
    pub description: String,
    /// Seed of every random stream.
    #[serde(default = "one")]
    pub seed: u64,
    /// Simulated length; default: the end of the last segment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// The arm, as the plant and the controller know it.
    #[serde(default)]
    pub arm: Arm,
    /// Task frame C.
    #[serde(default)]
    pub task_frame: TaskFrame,
    /// Physics of the hardware process.
    #[serde(default)]
    pub plant: Plant,
    /// Surfaces that the tool may touch.
    #[serde(default, rename = "surface")]
    pub surfaces: Vec<Surface>,
    /// A hole for the peg that the tool then carries.
    #[serde(default, rename = "hole", skip_serializing_if = "Vec::is_empty")]
    pub holes: Vec<Hole>,
    /// Force-sensor receiver card.
    #[serde(default)]
    pub force_sensor_if: ForceSensorIf,
    /// Encoder cards.
    #[serde(default)]
    pub encoder_if: EncoderIf,
    /// D/A and parallel I/O cards.
    #[serde(default)]
    pub da_io: DaIo,
    /// Control law.
    #[serde(default)]
    pub controller: Controller,
    /// What the control computer takes for a fault.
    #[serde(default)]
    pub safety: Safety,
    /// Impedance of a segment that does not state its own.
    #[serde(default)]
    pub impedance: Impedance,
    /// What the arm does, one after the other.
    #[serde(rename = "segment")]
    pub segments: Vec<Segment>,
    /// Bus, cards and tasks; default: Figure 6.1.
    #[serde(default = "crate::builtin::figure_6_1")]
    pub rack: vme::rack::Rack,
    /// What goes wrong.
    #[serde(default, rename = "fault", skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Operating-system processes and the boards in them; default: one per board, recorder and workstation included.
    #[serde(default = "one_process_per_board", rename = "process")]
    pub processes: Vec<Process>,
    /// Wall-clock pacing.
    #[serde(default)]
    pub realtime: Realtime,
    /// Named sets of overrides; a run executes every one. Default: one variant `nominal` without overrides.
    #[serde(default, rename = "variant", skip_serializing_if = "Vec::is_empty")]
    pub variants: Vec<Variant>,
    /// Acceptance limits.
    #[serde(default, rename = "limit", skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<Limit>,
    /// What the report shows beyond the variants.
    #[serde(default)]
    pub report: Report,
}

/// A named set of overrides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    /// Name: file names and `--variant` use it.
    pub name: String,
    /// Key paths and their values, as `--set` takes them.
    #[serde(default)]
    pub set: toml::Table,
    /// A surface that is never touched is a result here, not a failure.
    #[serde(default)]
    pub may_miss_surface: bool,
    /// A diverging simulation is a result here, not a failure.
    #[serde(default)]
    pub may_diverge: bool,
}

/// One operating-system process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Process {
    /// Name in the process list.
    pub name: String,
    /// Boards hosted. The process `chassis` is the command itself; boards placed there run in it.
    pub boards: Vec<String>,
    /// A user's program in the place of the built-in one, with its arguments.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
    /// Its SCHED_FIFO priority in real time, 1–99; 0 = time sharing; default: `realtime.priority`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub priority: Option<u8>,
    /// Processors that it may run on in real time; default: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cpus: Vec<usize>,
    /// Simulated time from power-up to work, after a crash or hang (ms).
    #[serde(default = "boot_ms")]
    pub boot_ms: f64,
    /// How often it is started again where it dies or stalls unplanned; default: once for a process of workstation and
    /// bus_analyzer alone, never (the run ends) for any other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart: Option<Restart>,
}

impl Default for Process {
    fn default() -> Self {
        Process {
            name: String::new(),
            boards: Vec::new(),
            command: Vec::new(),
            priority: None,
            cpus: Vec::new(),
            boot_ms: boot_ms(),
            restart: None,
        }
    }
}

fn boot_ms() -> f64 {
    500.0
}

/// How often a process that dies unplanned is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// Not at all.
    Never,
    /// The first time only.
    Once,
    /// Every time.
    Always,
}

/// Wall-clock pacing (`--pacing realtime`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Realtime {
    /// Wall time from one stage of the signal path (D/A, arm, interfaces, control, workstation, recorder) to the next;
    /// default: a tenth of the shortest task period.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_us: Option<u64>,
    /// SCHED_FIFO priority of the processes, 1–99; 0 = time sharing. A process may state its own.
    pub priority: u8,
    /// Lock all memory.
    pub lock_memory: bool,
    /// Refuse to run without a right that the machine refuses.
    pub strict: bool,
    /// Measure when boards act and how long messages take.
    pub measure: bool,
    /// What must hold of the latencies measured.
    #[serde(rename = "limit", skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<LatencyLimit>,
}

/// A limit on a measured latency.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LatencyLimit {
    /// Path as the table of measured latencies names it, for example `wake-up control_computer`.
    pub path: String,
    /// Part of the values that the limit holds for, 0 to 1; 1 = all.
    #[serde(default = "all")]
    pub quantile: f64,
    /// Greatest latency that passes, µs.
    pub max_us: f64,
}

fn all() -> f64 {
    1.0
}

impl Default for Realtime {
    fn default() -> Self {
        Realtime { stage_us: None, priority: 50, lock_memory: true, strict: false, measure: true, limits: Vec::new() }
    }
}

/// What the report shows beyond the variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Report {
    /// Axis of the task frame whose force is drawn and tabled: 0 = x, 1 = y, 2 = z.
    pub force_axis: usize,
    /// Draw the ideal one-axis impedance beside the variants.
    pub ideal: bool,
    /// Runs beyond the variants, summed up in a table.
    #[serde(skip_serializing_if = "Vec::is_empty", rename = "sweep")]
    pub sweeps: Vec<ReportSweep>,
}

impl Default for Report {
    fn default() -> Self {
        Report { force_axis: 2, ideal: true, sweeps: Vec::new() }
    }
}

/// A key varied over values, for some variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportSweep {
    /// Key path.
    pub key: String,
    /// Values.
    pub values: Vec<f64>,
    /// A second key, varied with the first: the report draws where the limits hold.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Across>,
    /// Variants that it is applied to.
    pub variants: Vec<String>,
}

/// The second key of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Across {
    /// Key path.
    pub key: String,
    /// Values.
    pub values: Vec<f64>,
}

fn one() -> u64 {
    1
}

fn one_process_per_board() -> Vec<Process> {
    ["hw_sim", "da_io", "force_sensor_if", "encoder_if", "control_computer", "workstation", "bus_analyzer"]
        .into_iter()
        .map(|board| Process { name: board.into(), boards: vec![board.into()], ..Process::default() })
        .collect()
}
