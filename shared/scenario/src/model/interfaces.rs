//! Interface cards: force-sensor receiver, encoders, D/A and parallel I/O.

use serde::{Deserialize, Serialize};

/// Force-sensor receiver card (JR3 class, 8 kHz).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ForceSensorIf {
    /// Which output the control computer reads.
    pub filter: ForceFilter,
    /// Full scale of the forces.
    pub full_scale_n: f64,
    /// Full scale of the moments.
    pub full_scale_nm: f64,
    /// Counts at full scale.
    pub full_scale_counts: f64,
    /// Standard deviation of the noise of one 8 kHz sample, forces.
    pub noise_n: f64,
    /// Standard deviation of the noise of one 8 kHz sample, moments.
    pub noise_nm: f64,
    /// Zero offset of the gauges at power-up, forces.
    pub offset_n: [f64; 3],
    /// Zero offset of the gauges at power-up, moments.
    pub offset_nm: [f64; 3],
}

impl Default for ForceSensorIf {
    fn default() -> Self {
        ForceSensorIf {
            filter: ForceFilter::Cascade(0),
            full_scale_n: 400.0,
            full_scale_nm: 40.0,
            full_scale_counts: 16384.0,
            noise_n: 0.0,
            noise_nm: 0.0,
            offset_n: [0.0; 3],
            offset_nm: [0.0; 3],
        }
    }
}

/// Output of the receiver that is read: `{ cascade = 4 }` (filters 0–6: none, 500, 125, 31.25, 7.8125, 1.953, 0.488 Hz)
/// or `{ delay_ms = 128.0 }`, a pure delay in the place of filter 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ForceFilter {
    /// Output of this filter.
    Cascade(u8),
    /// Unfiltered, but this much later.
    DelayMs(f64),
}

/// Four encoder cards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EncoderIf {
    /// Width of the counters.
    pub counter_bits: u8,
    /// Velocity estimator of the card.
    pub velocity: VelocitySource,
    /// Window of the estimator.
    pub velocity_window_us: f64,
    /// Position and speed are this much late (a slow serial link); 0 = none.
    pub delay_ms: f64,
}

/// Where the velocity register gets its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocitySource {
    /// Counts over the time between the edges that bound the window (M/T method).
    EdgeTime,
    /// The shaft's true speed (a tachometer), for checks.
    Tachometer,
}

impl Default for EncoderIf {
    fn default() -> Self {
        EncoderIf { counter_bits: 24, velocity: VelocitySource::EdgeTime, velocity_window_us: 1000.0, delay_ms: 0.0 }
    }
}

/// Two D/A cards and the parallel I/O card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DaIo {
    /// Resolution of the D/A converters over ±10 V.
    pub bits: u8,
    /// Output watchdog: outputs go to zero when the heartbeat stands still this long; 0 = off.
    pub watchdog_ms: f64,
    /// Time from the parallel I/O output to the brake's action.
    pub brake_delay_ms: f64,
}

impl Default for DaIo {
    fn default() -> Self {
        DaIo { bits: 12, watchdog_ms: 20.0, brake_delay_ms: 15.0 }
    }
}
