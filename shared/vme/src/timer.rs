//! Periodic instants in integer nanoseconds.

use crate::Ns;
use serde::{Deserialize, Serialize};

/// Instants `offset + k · period`, k = 0, 1, …
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ticks {
    /// Time between two ticks, above 0.
    pub period_ns: Ns,
    /// The first tick.
    #[serde(default)]
    pub offset_ns: Ns,
}

impl Ticks {
    /// Tick `k`; [`Ns::MAX`] beyond the end of time.
    pub fn at(self, k: u64) -> Ns {
        k.checked_mul(self.period_ns).and_then(|t| t.checked_add(self.offset_ns)).unwrap_or(Ns::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_do_not_drift_and_do_not_overflow() {
        let ticks = Ticks { period_ns: 125_000, offset_ns: 7 };
        assert_eq!(ticks.at(8000 * 3600), 3600 * crate::SECOND + 7);
        assert_eq!(ticks.at(u64::MAX), Ns::MAX);
    }
}
