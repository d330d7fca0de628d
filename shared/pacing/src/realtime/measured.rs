//! What a process has measured on the wall clock, on its way to the report: a file in the run folder.

use crate::RunError;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Wall-clock times of one path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// What was measured, for example `wake-up hw_sim`.
    pub path: String,
    /// How often.
    pub n: u64,
    /// How often it was too late for its modelled time.
    pub late: u64,
    /// Least, ns.
    pub min_ns: u64,
    /// Median, ns.
    pub p50_ns: u64,
    /// 99 of 100 are at most this long, ns.
    pub p99_ns: u64,
    /// Greatest, ns.
    pub max_ns: u64,
}

impl Measured {
    /// Sums a histogram of nanoseconds up.
    pub(crate) fn of(path: String, late: u64, times: &Histogram<u64>) -> Measured {
        Measured {
            path,
            n: times.len(),
            late,
            min_ns: times.min(),
            p50_ns: times.value_at_quantile(0.5),
            p99_ns: times.value_at_quantile(0.99),
            max_ns: times.max(),
        }
    }
}

#[derive(Serialize, Deserialize)]
struct File {
    path: Vec<Measured>,
}

/// Leaves the measurements of a process in the run folder.
pub(crate) fn write(path: &Path, measured: Vec<Measured>) -> Result<(), RunError> {
    let failed = |reason: String| RunError::Folder { path: path.display().to_string(), reason };
    let text = toml::to_string(&File { path: measured }).map_err(|error| failed(error.to_string()))?;
    std::fs::write(path, text).map_err(|error| failed(error.to_string()))
}

/// Reads them.
pub(crate) fn read(path: &Path) -> Result<Vec<Measured>, RunError> {
    let failed = |reason: String| RunError::Folder { path: path.display().to_string(), reason };
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    toml::from_str::<File>(&text).map(|file| file.path).map_err(|error| failed(error.to_string()))
}
