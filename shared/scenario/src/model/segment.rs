//! Segments: what the workstation commands, one after the other.

use super::Scenario;
use serde::{Deserialize, Serialize};

/// One segment of the task. What it does not state comes from the scenario's `[impedance]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Name in tables.
    pub name: String,
    /// Simulated time at which it ends; it starts where the one before ends.
    pub until_s: f64,
    /// How X_d moves.
    #[serde(default)]
    pub path: Path,
    /// Target of the tool point in the task frame; default: where X_d is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 3]>,
    /// Target orientation, roll-pitch-yaw in the task frame; default: as X_d is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rpy_deg: Option<[f64; 3]>,
    /// Time in which the path is run; default: the whole segment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub move_s: Option<f64>,
    /// Diagonal of S, x y z then rotations: 1 = impedance (position) axis, 0 = force axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<[u8; 6]>,
    /// M_d of the translations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<[f64; 3]>,
    /// B_d of the translations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_ns_per_m: Option<[f64; 3]>,
    /// K_d of the translations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_n_per_m: Option<[f64; 3]>,
    /// M_d of the rotations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotational_mass_kg_m2: Option<[f64; 3]>,
    /// B_d of the rotations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotational_damping_nms_per_rad: Option<[f64; 3]>,
    /// K_d of the rotations.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotational_stiffness_nm_per_rad: Option<[f64; 3]>,
    /// Desired force F_d: what the tool exerts on the environment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Desired moment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment_nm: Option<[f64; 3]>,
}

/// How the desired pose X_d moves in a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Path {
    /// X_d stays where it is.
    #[default]
    Hold,
    /// Quintic time law, zero speed and acceleration at both ends.
    PointToPoint,
    /// Constant speed along the line with quintic blends.
    Line,
    /// X_d jumps to the target.
    Step,
}

/// Default impedance and forces of the segments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Impedance {
    /// Diagonal of S.
    pub selection: [u8; 6],
    /// M_d of the translations.
    pub mass_kg: [f64; 3],
    /// B_d of the translations.
    pub damping_ns_per_m: [f64; 3],
    /// K_d of the translations.
    pub stiffness_n_per_m: [f64; 3],
    /// M_d of the rotations.
    pub rotational_mass_kg_m2: [f64; 3],
    /// B_d of the rotations.
    pub rotational_damping_nms_per_rad: [f64; 3],
    /// K_d of the rotations.
    pub rotational_stiffness_nm_per_rad: [f64; 3],
    /// Desired force F_d.
    pub force_n: [f64; 3],
    /// Desired moment.
    pub moment_nm: [f64; 3],
}

impl Default for Impedance {
    /// The position axes of §6.2.1.2 for the translations; the rotations alike (ζ 1, T_n 2 s).
    fn default() -> Self {
        Impedance {
            selection: [1; 6],
            mass_kg: [257.0; 3],
            damping_ns_per_m: [1100.0; 3],
            stiffness_n_per_m: [1100.0; 3],
            rotational_mass_kg_m2: [10.0; 3],
            rotational_damping_nms_per_rad: [63.0; 3],
            rotational_stiffness_nm_per_rad: [100.0; 3],
            force_n: [0.0; 3],
            moment_nm: [0.0; 3],
        }
    }
}

/// A segment with every value stated.
#[derive(Clone, Debug, PartialEq)]
pub struct ResolvedSegment {
    /// Name in tables.
    pub name: String,
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// How X_d moves.
    pub path: Path,
    /// Time in which the path is run, s.
    pub move_s: f64,
    /// Target of the tool point in the task frame, m.
    pub position_m: [f64; 3],
    /// Target orientation, roll-pitch-yaw in the task frame.
    pub rpy_deg: [f64; 3],
    /// Diagonal of S.
    pub selection: [u8; 6],
    /// Diagonal of M_d.
    pub mass: [f64; 6],
    /// Diagonal of B_d.
    pub damping: [f64; 6],
    /// Diagonal of K_d.
    pub stiffness: [f64; 6],
    /// F_d.
    pub force: [f64; 6],
}

impl Scenario {
    /// The segments with defaults filled in and targets carried over.
    pub fn resolved_segments(&self) -> Vec<ResolvedSegment> {
        let mut start_s = 0.0;
        let mut position_m = self.arm.start_position_m;
        let mut rpy_deg = self.arm.start_rpy_deg;
        let default = &self.impedance;
        self.segments
            .iter()
            .map(|segment| {
                position_m = segment.position_m.unwrap_or(position_m);
                rpy_deg = segment.rpy_deg.unwrap_or(rpy_deg);
                let resolved = ResolvedSegment {
                    name: segment.name.clone(),
                    start_s,
                    end_s: segment.until_s,
                    path: segment.path,
                    move_s: segment.move_s.unwrap_or(segment.until_s - start_s),
                    position_m,
                    rpy_deg,
                    selection: segment.selection.unwrap_or(default.selection),
                    mass: six(segment.mass_kg, default.mass_kg, segment.rotational_mass_kg_m2, default.rotational_mass_kg_m2),
                    damping: six(
                        segment.damping_ns_per_m,
                        default.damping_ns_per_m,
                        segment.rotational_damping_nms_per_rad,
                        default.rotational_damping_nms_per_rad,
                    ),
                    stiffness: six(
                        segment.stiffness_n_per_m,
                        default.stiffness_n_per_m,
                        segment.rotational_stiffness_nm_per_rad,
                        default.rotational_stiffness_nm_per_rad,
                    ),
                    force: six(segment.force_n, default.force_n, segment.moment_nm, default.moment_nm),
                };
                start_s = segment.until_s;
                resolved
            })
            .collect()
    }

    /// Simulated length of the run, s.
    pub fn duration(&self) -> f64 {
        self.duration_s.unwrap_or_else(|| self.segments.last().map_or(0.0, |segment| segment.until_s))
    }
}

fn six(linear: Option<[f64; 3]>, linear_default: [f64; 3], angular: Option<[f64; 3]>, angular_default: [f64; 3]) -> [f64; 6] {
    let [a, b, c] = linear.unwrap_or(linear_default);
    let [d, e, f] = angular.unwrap_or(angular_default);
    [a, b, c, d, e, f]
}
