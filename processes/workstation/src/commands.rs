//! Segments of the scenario as command blocks: poses in the task frame, orientations as unit quaternions (w, x, y, z)
//! with w ≥ 0, times in nanoseconds, epochs from 1 in the order of the segments.

use arm::rotation;
use messages::{Command, CommandKind, PathKind};
use scenario::{Path, ResolvedSegment, Scenario, nanoseconds, rpy_deg};

/// One command per segment.
pub fn of(scenario: &Scenario) -> Vec<Command> {
    scenario
        .resolved_segments()
        .iter()
        .zip(0..)
        .map(|(segment, i)| command(i, segment))
        .collect()
}

fn command(i: u32, segment: &ResolvedSegment) -> Command {
    let q = rotation::quaternion(&rpy_deg(segment.rpy_deg));
    Command {
        epoch: i + 1,
        kind: CommandKind::Segment as u32,
        segment: i,
        path: match segment.path {
            Path::Hold => PathKind::Hold,
            Path::PointToPoint => PathKind::PointToPoint,
            Path::Line => PathKind::Line,
            Path::Step => PathKind::Step,
        } as u32,
        start: nanoseconds(segment.start_s),
        end: nanoseconds(segment.end_s),
        move_time: nanoseconds(segment.move_s),
        position: segment.position_m,
        orientation: if q.w < 0.0 {
            [-q.w, -q.x, -q.y, -q.z]
        } else {
            [q.w, q.x, q.y, q.z]
        },
        selection: segment.selection.map(f64::from),
        mass: segment.mass,
        damping: segment.damping,
        stiffness: segment.stiffness,
        force: segment.force,
    }
}
