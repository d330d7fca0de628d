//! Checks the workstation's commands before they touch the arm.
//!
//! A command is judged once: epochs rise by one, so a repeated, stale or missing command shows. One that asks for something
//! impossible is refused with a [`Refusal`] and nothing changes.

use crate::ahic::Impedance;
use crate::frame::rotation_of_wxyz;
use crate::trajectory::{LINE_PEAK, QUINTIC_PEAK, Segment};
use arm::{Pose, Spatial};
use messages::{Command, Detector, PathKind};
use nalgebra::Vector3;

/// Why a command was refused. The numbers appear in the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[repr(u32)]
pub enum Refusal {
    /// Not a kind of command.
    #[error("the kind is none that is known")]
    Kind = 1,
    /// Not the epoch after the last one.
    #[error("the epoch is not the one after the last")]
    Epoch = 2,
    /// Not a kind of path.
    #[error("the path is none that is known")]
    Path = 3,
    /// Not-a-number or infinite.
    #[error("a value is not finite")]
    NotFinite = 4,
    /// A target mass of zero or less.
    #[error("a target mass is not positive")]
    Mass = 5,
    /// Damping or stiffness below zero.
    #[error("a damping or stiffness is negative")]
    Impedance = 6,
    /// A selection other than 0 or 1.
    #[error("a selection is neither 0 nor 1")]
    Selection = 7,
    /// A quaternion that is no rotation.
    #[error("the orientation is not a unit quaternion")]
    Orientation = 8,
    /// Ends before it starts, moves longer than it lasts, or starts before the segment ahead of it.
    #[error("the times are out of order")]
    Times = 9,
    /// No room in the queue.
    #[error("too many segments wait")]
    QueueFull = 10,
    /// The desired position would jump too far.
    #[error("the desired position would jump further than safety.max_command_step_m")]
    Step = 12,
    /// The desired position would move too fast.
    #[error("the desired position would move faster than safety.max_command_speed_m_per_s")]
    Speed = 13,
    /// The safety state does not allow it.
    #[error("the safety state does not allow it")]
    State = 11,
}

impl Refusal {
    /// What sees it.
    pub fn detector(self) -> Detector {
        if self == Refusal::Epoch { Detector::CommandEpoch } else { Detector::CommandCheck }
    }
}

/// Refuses a segment that would let the desired position jump too far from `from`, or move too fast.
pub fn check_motion(segment: &Segment, from: &Vector3<f64>, limits: &scenario::Safety) -> Result<(), Refusal> {
    let way = (segment.target.p - from).norm();
    let peak = match segment.path {
        PathKind::Hold => return Ok(()),
        PathKind::Step if way > limits.max_command_step_m => return Err(Refusal::Step),
        PathKind::Step => return Ok(()),
        PathKind::PointToPoint => QUINTIC_PEAK,
        PathKind::Line => LINE_PEAK,
    };
    if peak * way > limits.max_command_speed_m_per_s * segment.move_time as f64 * 1e-9 {
        return Err(Refusal::Speed);
    }
    Ok(())
}

/// The segment that a [`Command`] of kind `Segment` describes.
pub fn segment(command: &Command) -> Result<Segment, Refusal> {
    let path = [PathKind::Hold, PathKind::PointToPoint, PathKind::Line, PathKind::Step]
        .into_iter()
        .find(|path| *path as u32 == command.path)
        .ok_or(Refusal::Path)?;
    let six = [command.selection, command.mass, command.damping, command.stiffness, command.force];
    let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
    if !(six.iter().all(|values| finite(values)) && finite(&command.position) && finite(&command.orientation)) {
        return Err(Refusal::NotFinite);
    }
    if command.mass.iter().any(|&m| m <= 0.0) {
        return Err(Refusal::Mass);
    }
    if command.damping.iter().chain(&command.stiffness).any(|&value| value < 0.0) {
        return Err(Refusal::Impedance);
    }
    if command.selection.iter().any(|&s| s != 0.0 && s != 1.0) {
        return Err(Refusal::Selection);
    }
    let norm2: f64 = command.orientation.iter().map(|c| c * c).sum();
    if (norm2 - 1.0).abs() > 1e-6 {
        return Err(Refusal::Orientation);
    }
    if command.end <= command.start || command.move_time > command.end - command.start {
        return Err(Refusal::Times);
    }
    Ok(Segment {
        index: command.segment,
        start: command.start,
        move_time: command.move_time,
        path,
        target: Pose { p: Vector3::from(command.position), r: rotation_of_wxyz(command.orientation) },
        impedance: Impedance {
            selection: Spatial::from(command.selection),
            mass: Spatial::from(command.mass),
            damping: Spatial::from(command.damping),
            stiffness: Spatial::from(command.stiffness),
            force: Spatial::from(command.force),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::CommandKind;

    fn command() -> Command {
        Command {
            epoch: 1,
            kind: CommandKind::Segment as u32,
            segment: 3,
            path: PathKind::Line as u32,
            start: 1_000,
            end: 3_000,
            move_time: 2_000,
            position: [0.1, 0.2, 0.3],
            orientation: [0.8, 0.0, 0.6, 0.0],
            selection: [1.0, 1.0, 0.0, 1.0, 1.0, 1.0],
            mass: [257.0; 6],
            damping: [1100.0; 6],
            stiffness: [0.0; 6],
            force: [0.0, 0.0, 20.0, 0.0, 0.0, 0.0],
        }
    }

    #[test]
    fn a_sound_command_becomes_its_segment() {
        let segment = segment(&command()).unwrap();
        assert_eq!((segment.index, segment.start, segment.move_time), (3, 1_000, 2_000));
        assert_eq!(segment.path, PathKind::Line);
        assert_eq!(segment.impedance.force[2], 20.0);
        // a turn about y by 2·acos 0.8
        let turn = arm::rotation::log(&segment.target.r);
        assert!((turn - Vector3::new(0.0, 2.0 * libm::acos(0.8), 0.0)).amax() < 1e-12);
    }

    #[test]
    fn every_impossible_command_is_refused_for_its_reason() {
        type Spoil = fn(&mut Command);
        let cases: [(Spoil, Refusal); 14] = [
            (|c| c.path = 4, Refusal::Path),
            (|c| c.position[1] = f64::NAN, Refusal::NotFinite),
            (|c| c.orientation[0] = f64::INFINITY, Refusal::NotFinite),
            (|c| c.selection[0] = f64::NAN, Refusal::NotFinite),
            (|c| c.mass[5] = f64::NAN, Refusal::NotFinite),
            (|c| c.force[0] = f64::NEG_INFINITY, Refusal::NotFinite),
            (|c| c.mass[2] = 0.0, Refusal::Mass),
            (|c| c.mass[2] = -1.0, Refusal::Mass),
            (|c| c.damping[0] = -1e-9, Refusal::Impedance),
            (|c| c.stiffness[3] = -5.0, Refusal::Impedance),
            (|c| c.selection[4] = 0.5, Refusal::Selection),
            (|c| c.orientation = [0.0; 4], Refusal::Orientation),
            (|c| c.end = c.start, Refusal::Times),
            (|c| c.move_time = 2_001, Refusal::Times),
        ];
        for (spoil, reason) in cases {
            let mut command = command();
            spoil(&mut command);
            assert_eq!(segment(&command), Err(reason));
        }
    }
}
