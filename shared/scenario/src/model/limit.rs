//! Acceptance limits: what the scenario expects of a run.

use serde::{Deserialize, Serialize};

/// A measure that must lie within bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// What is measured.
    pub measure: Measure,
    /// Variants that it applies to; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub variants: Vec<String>,
    /// Segments (by name) that it applies to, each for itself; empty: all that have the measure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub segments: Vec<String>,
    /// Takes the value as a multiple of the same measure of this variant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Least value that passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Greatest value that passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Where the figure comes from.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub source: String,
}

/// What can be measured. Forces are the true contact force along the report's axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Per segment: |mean force of the last second − F_d|, N.
    ForceMeanErrorN,
    /// Per segment: rms of force − F_d over the last second, N.
    ForceRmsErrorN,
    /// Per segment: rms of force − F_d over all of it but its first 2 s, N.
    ForceTrackingErrorN,
    /// Per segment: mean force of the last second, N.
    ForceMeanN,
    /// Per segment: least force, N.
    ForceLeastN,
    /// Per segment: greatest force, N.
    ForcePeakN,
    /// Per segment: 90 % rise time from the first contact, s.
    ForceRiseS,
    /// Per segment: |X − X_d| along the report's axis at its end, m.
    PositionErrorM,
    /// Per segment: the same of X as the controller has it from the encoders, which do not see the joints give, m.
    EncoderPositionErrorM,
    /// Per segment: greatest |X − ideal impedance| along the report's axis, m.
    IdealPositionDeviationM,
    /// Per segment: greatest |Xᵗ − ideal impedance| along the report's axis, m.
    IdealTargetDeviationM,
    /// Per run: first force peak after the first contact, N.
    FirstPeakN,
    /// Per run: greatest |force − ideal impedance's force|, N.
    IdealForceDeviationN,
    /// Per run: number of force segments whose mean force is off by more than half of F_d.
    IncapableSegments,
    /// Per run: number of pairs of force segments whose mean forces are not in the order of their F_d.
    ForceOrderViolations,
    /// Per run: growth of the oscillation of X along the report's axis in the last segment, per period: below 1 it decays.
    EnvelopeGrowth,
    /// Per run: greatest joint torque sent, as a share of its limit.
    TorqueShare,
    /// Per run: greatest joint speed when all commanded motion has ended (last second), rad/s.
    SelfMotionRadPerS,
    /// Per run: least distance of a joint from its limit, rad.
    JointLimitDistanceRad,
    /// Per run: greatest depth of the peg's end under the hole's mouth, m.
    InsertionDepthM,
    /// Per run: greatest contact force across the hole's axis, N.
    LateralForcePeakN,
    /// Per run: share of the time for which somebody kept the bus.
    BusLoad,
    /// Per run: releases lost by tasks whose job before still ran.
    LostReleases,
    /// Per run: longest time from what the force sensor felt to the last D/A's change, s.
    SensorToActuatorS,
}
