//! Things that happened and that a person wants to know.

use crate::Detector;
use bytemuck::{Pod, Zeroable};

/// How bad it is, as in `diagnostic_msgs/DiagnosticStatus`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Severity {
    /// Normal.
    Ok = 0,
    /// Worth a look.
    Warn = 1,
    /// A stop or a failure.
    Error = 2,
}

/// What happened. `a` and `b` of the event carry the figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum EventKind {
    /// Segment `a` begins.
    SegmentStart = 1,
    /// The limit on |Xᵗ − X| begins (`a` = 1) or ceases (`a` = 0) to act, on axis `b`.
    TargetErrorLimit = 2,
    /// Torque saturation of joint `b` begins (`a` = 1) or ceases (`a` = 0).
    TorqueLimit = 3,
    /// Safety state changes from `a` to `b`; [`Event::cause`] says why.
    SafetyState = 4,
    /// The force sensor's tare is taken; `a` = its z force, N.
    Tare = 5,
    /// Command with epoch `a` refused for reason `b`.
    CommandRefused = 6,
    /// The D/A watchdog expired: outputs go to zero.
    WatchdogExpired = 7,
    /// Amplifier of joint `a` tripped.
    AmplifierTrip = 8,
    /// The plant's simulation left its domain; `a` = joint, `b` = value.
    Diverged = 9,
    /// Tool touches the surface; `a` = normal speed, m/s.
    FirstContact = 10,
    /// A bus transfer of job `a` ended in BERR* or time-out, address `b`.
    BusError = 11,
    /// An expected message did not come; `a` = channel sequence number.
    MessageLost = 12,
    /// An axis of the force sensor is saturated; `a` = error word.
    ForceSaturated = 13,
    /// The record cannot be written any more, for the operating system's error number `a`; what follows is not recorded.
    RecordLost = 14,
    /// The release of job `a` of task `b` found the job before still running, and the task was stopped for good.
    OverrunTrip = 15,
    /// Fault `a` of the scenario is injected.
    FaultInjected = 16,
    /// The detector [`Event::cause`] begins to fire; `a` = its figure (axis, joint, address, number).
    Detected = 17,
    /// Board `a` (its number) died unplanned.
    BoardLost = 18,
    /// Board `a` (its number) has been powered up again.
    BoardUp = 19,
}

impl EventKind {
    /// Short name, as records show it.
    pub const fn name(self) -> &'static str {
        match self {
            EventKind::SegmentStart => "segment-start",
            EventKind::TargetErrorLimit => "target-error-limit",
            EventKind::TorqueLimit => "torque-limit",
            EventKind::SafetyState => "safety-state",
            EventKind::Tare => "tare",
            EventKind::CommandRefused => "command-refused",
            EventKind::WatchdogExpired => "watchdog-expired",
            EventKind::AmplifierTrip => "amplifier-trip",
            EventKind::Diverged => "diverged",
            EventKind::FirstContact => "first-contact",
            EventKind::BusError => "bus-error",
            EventKind::MessageLost => "message-lost",
            EventKind::ForceSaturated => "force-saturated",
            EventKind::RecordLost => "record-lost",
            EventKind::OverrunTrip => "overrun-trip",
            EventKind::FaultInjected => "fault-injected",
            EventKind::Detected => "detected",
            EventKind::BoardLost => "board-lost",
            EventKind::BoardUp => "board-up",
        }
    }

    /// The kind of that number.
    pub fn from_number(number: u32) -> Option<EventKind> {
        use EventKind::*;
        [
            SegmentStart,
            TargetErrorLimit,
            TorqueLimit,
            SafetyState,
            Tare,
            CommandRefused,
            WatchdogExpired,
            AmplifierTrip,
            Diverged,
            FirstContact,
            BusError,
            MessageLost,
            ForceSaturated,
            RecordLost,
            OverrunTrip,
            FaultInjected,
            Detected,
            BoardLost,
            BoardUp,
        ]
        .into_iter()
        .find(|kind| *kind as u32 == number)
    }
}

/// One event.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Event {
    /// Instant, ns.
    pub t: u64,
    /// An [`EventKind`] by number.
    pub kind: u32,
    /// A [`Severity`] by number.
    pub severity: u32,
    /// First figure.
    pub a: f64,
    /// Second figure.
    pub b: f64,
    /// A [`Detector`] by number; 0 = none.
    pub cause: u32,
    /// Zero.
    pub reserved: u32,
}

impl Event {
    /// An event of this kind at simulated time `t`.
    pub fn new(t: u64, kind: EventKind, severity: Severity, a: f64, b: f64) -> Event {
        Event { t, kind: kind as u32, severity: severity as u32, a, b, cause: 0, reserved: 0 }
    }

    /// Fault number `fault` of the scenario begins at `t`.
    pub fn injected(t: u64, fault: usize) -> Event {
        Event::new(t, EventKind::FaultInjected, Severity::Warn, fault as f64, 0.0)
    }

    /// The same event, because this detector fired.
    pub fn because(self, cause: Option<Detector>) -> Event {
        Event { cause: cause.map_or(0, |detector| detector as u32), ..self }
    }
}
