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

#[cfg(test)]
mod tests {
    use super::*;

    fn table_5_3() -> Scenario {
        scenario::load("table-5-3", &[])
            .unwrap()
            .scenario()
            .unwrap()
    }

    #[test]
    fn every_segment_becomes_one_command_in_order_without_gaps() {
        let scenario = table_5_3();
        let commands = of(&scenario);
        assert_eq!(commands.len(), scenario.segments.len());
        let mut start = 0;
        for (i, command) in commands.iter().enumerate() {
            assert_eq!((command.epoch, command.segment), (i as u32 + 1, i as u32));
            assert_eq!(command.start, start);
            assert!(command.move_time <= command.end - command.start);
            start = command.end;
        }
        assert_eq!(start, scenario.duration_ns());
    }

    #[test]
    fn forces_and_impedances_keep_their_axes() {
        let scenario = table_5_3();
        for (command, segment) in of(&scenario).iter().zip(scenario.resolved_segments()) {
            assert_eq!(command.force, segment.force);
            assert_eq!(
                (command.mass, command.damping, command.stiffness),
                (segment.mass, segment.damping, segment.stiffness)
            );
            assert_eq!(command.position, segment.position_m);
            for (axis, selected) in command.selection.iter().zip(segment.selection) {
                assert_eq!(*axis, if selected == 1 { 1.0 } else { 0.0 });
            }
        }
    }

    #[test]
    fn orientations_are_unit_quaternions_w_first_of_the_roll_pitch_yaw_angles() {
        let mut scenario = table_5_3();
        let half = core::f64::consts::FRAC_1_SQRT_2;
        for (rpy, expected) in [
            ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
            ([90.0, 0.0, 0.0], [half, half, 0.0, 0.0]),
            ([0.0, 90.0, 0.0], [half, 0.0, half, 0.0]),
            ([0.0, 0.0, -90.0], [half, 0.0, 0.0, -half]),
            // Rz Ry Rx: yaw last
            ([90.0, 0.0, 90.0], [0.5, 0.5, 0.5, 0.5]),
            // 200° is −160°: w ≥ 0
            (
                [0.0, 0.0, 200.0],
                [0.173_648_177_666_930_3, 0.0, 0.0, -0.984_807_753_012_208],
            ),
        ] {
            scenario.segments[0].rpy_deg = Some(rpy);
            let q = of(&scenario)[0].orientation;
            assert!(
                q.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12),
                "{rpy:?}: {q:?}"
            );
        }
    }

    #[test]
    fn times_are_whole_nanoseconds() {
        let mut scenario = table_5_3();
        scenario.segments[0].until_s = 0.1;
        scenario.segments[0].move_s = Some(0.03);
        let command = of(&scenario)[0];
        assert_eq!(
            (command.start, command.end, command.move_time),
            (0, 100_000_000, 30_000_000)
        );
    }
}
