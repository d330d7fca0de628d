//! What travels between the boards of the rack: payloads and their header, nothing else.
//!
//! Every payload is plain old data (`bytemuck::Pod`): any bit pattern is a valid value, there is no
//! pointer in it, so it may lie in shared memory and a corrupted one is a wrong number, never
//! undefined behaviour.

mod account;
mod board_id;
mod bus;
mod command;
mod control;
mod defect;
mod detector;
mod event;
mod grant;
mod header;
mod plant;
pub mod registers;
mod span;
mod telemetry;

pub use account::{BUCKETS, FIRST_BUCKET_NS, MasterUse, PARTS, SensorPath};
pub use board_id::{BOARDS, BoardId};
pub use bus::{BusWord, TransferRecord};
pub use command::{Command, CommandKind, PathKind};
pub use control::{ControlProbe, limits};
pub use defect::{Defect, DefectKind};
pub use detector::{DETECTORS, Detector};
pub use event::{Event, EventKind, Severity};
pub use grant::{Grant, NOBODY, OpRecord, Reply, flags};
pub use header::{Header, Kind};
pub use plant::{AmplifierCommand, PlantProbe, PlantSample, drive_status};
pub use span::{Span, SpanKind};
pub use telemetry::Telemetry;
pub use vme::Ns;

/// Version of everything in this crate; channels of different versions never meet.
pub const PROTOCOL: u32 = 3;
/// Number of joints of the arm.
pub const JOINTS: usize = 7;
