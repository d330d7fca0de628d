//! Peg in hole.

use serde::{Deserialize, Serialize};

/// A chamfered hole, and the peg at the tool point that is to go into it. The peg is a cylinder about the tool's z axis
/// whose end face is centred on the tool point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hole {
    /// Name.
    pub name: String,
    /// Centre of the mouth, in the task frame.
    pub position_m: [f64; 3],
    /// Tilt of the hole's axis about x and y of the task frame; 0: it points along z.
    #[serde(default)]
    pub tilt_deg: [f64; 2],
    /// Radius of the bore.
    pub bore_radius_m: f64,
    /// Width of the 45° chamfer: the mouth's radius is the bore's plus this, and the bore begins this deep.
    #[serde(default)]
    pub chamfer_m: f64,
    /// Depth of the floor under the mouth.
    pub depth_m: f64,
    /// Radius of the peg.
    pub peg_radius_m: f64,
    /// How far the peg's side reaches back from its end.
    pub peg_length_m: f64,
    /// Stiffness of one of the 24 points of the peg's rim and of the bore's lip each.
    pub stiffness_n_per_m: f64,
    /// Hunt–Crossley damping factor, as of a surface.
    #[serde(default)]
    pub hunt_crossley_s_per_m: f64,
    /// Coulomb friction coefficient μ.
    #[serde(default)]
    pub friction: f64,
}

impl Hole {
    /// Points around the peg's rim, and as many around the bore's lip.
    pub const SAMPLES: usize = 24;
    /// Points that may touch.
    pub const POINTS: usize = 2 * Hole::SAMPLES;
}
