//! Bisection: between a value at which the loop is stable and one at which it is not.

use crate::rack_run::{self, INTERRUPTED, Setting};
use miette::miette;
use report::Ended;
use scenario::{Scenario, Variant};
use serde::Serialize;
use std::sync::atomic::Ordering;

/// An envelope that shrinks by less than this a period does not settle: a limit cycle is not stable.
const SETTLES: f64 = 1.0 - 1e-4;

/// What one run showed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// The oscillation decays, or there is none.
    pub stable: bool,
    /// Growth of its envelope per period; none where nothing swings.
    pub growth: Option<f64>,
    /// Periods over which that was taken.
    pub periods: Option<f64>,
}

/// Both ends of the range.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ends {
    /// The smaller value.
    pub from: f64,
    /// What it is.
    pub at_from: Outcome,
    /// The greater value.
    pub to: f64,
    /// What it is.
    pub at_to: Outcome,
}

/// Where stability ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Boundary {
    /// Middle of the last interval.
    pub value: f64,
    /// The last value seen stable.
    pub stable: f64,
    /// The last value seen unstable.
    pub unstable: f64,
    /// Periods over which the envelope was taken in the last run.
    pub periods: Option<f64>,
    /// Runs in all.
    pub runs: u32,
}

/// Runs a scenario and says whether its loop is stable.
pub fn emulate(scenario: &Scenario, variant: &Variant) -> miette::Result<Outcome> {
    let setting = Setting { in_process: true, ..Setting::default() };
    let finished = rack_run::run(scenario, variant, &setting, &mut |_| {}).map_err(|reason| miette!("{reason}"))?;
    if INTERRUPTED.load(Ordering::Relaxed) {
        return Err(miette!("interrupted"));
    }
    let run = &finished.result.run;
    let diverged = match &finished.result.ended {
        Ended::Completed => false,
        Ended::Diverged { .. } => true,
        Ended::Stopped { reason, .. } => return Err(miette!("{reason}")),
    };
    let (growth, periods) = (run.envelope_growth, run.envelope_periods);
    Ok(Outcome { stable: !diverged && growth.is_none_or(|growth| growth < SETTLES), growth, periods })
}

/// The boundary between `from` and `to`, known to the share `tolerance`; none where both ends are on one side of it.
pub fn boundary(
    from: f64,
    to: f64,
    tolerance: f64,
    outcome: &mut dyn FnMut(f64) -> miette::Result<Outcome>,
) -> miette::Result<(Ends, Option<Boundary>)> {
    let ends = Ends { from, at_from: outcome(from)?, to, at_to: outcome(to)? };
    if ends.at_from.stable == ends.at_to.stable {
        return Ok((ends, None));
    }
    let (mut stable, mut unstable) = if ends.at_from.stable { (from, to) } else { (to, from) };
    let (mut runs, mut periods) = (2, None);
    while (stable - unstable).abs() > tolerance * middle(stable, unstable).abs() {
        let value = middle(stable, unstable);
        if value == stable || value == unstable {
            break;
        }
        let seen = outcome(value)?;
        *(if seen.stable { &mut stable } else { &mut unstable }) = value;
        runs += 1;
        periods = seen.periods;
    }
    Ok((ends, Some(Boundary { value: middle(stable, unstable), stable, unstable, periods, runs })))
}

/// Where `reserve` passes 1 between `from` and `to`; none where it does not, or does not exist.
pub fn crossing(
    from: f64,
    to: f64,
    reserve: &dyn Fn(f64) -> miette::Result<Option<f64>>,
) -> miette::Result<Option<f64>> {
    let (Some(mut at_low), Some(mut at_high)) = (reserve(from)?, reserve(to)?) else { return Ok(None) };
    let (mut low, mut high) = (from, to);
    if (at_low > 1.0) == (at_high > 1.0) {
        return Ok(None);
    }
    for _ in 0..16 {
        let value = middle(low, high);
        let Some(at) = reserve(value)? else { return Ok(None) };
        if (at > 1.0) == (at_low > 1.0) {
            (low, at_low) = (value, at);
        } else {
            (high, at_high) = (value, at);
        }
    }
    Ok(Some(low + (high - low) * (at_low - 1.0) / (at_low - at_high)))
}

/// Geometric between numbers of one sign, arithmetic otherwise.
fn middle(a: f64, b: f64) -> f64 {
    if a * b > 0.0 { (a * b).sqrt().copysign(a) } else { 0.5 * (a + b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(stable: bool) -> Outcome {
        Outcome { stable, growth: None, periods: None }
    }

    #[test]
    fn the_boundary_is_found_whichever_end_is_stable() {
        for rising in [true, false] {
            let mut judge = |value: f64| Ok(outcome((value < 3.7) == rising));
            let (_, found) = boundary(1.0, 16.0, 1e-3, &mut judge).expect("runs");
            let found = found.expect("a boundary");
            assert!((found.value / 3.7 - 1.0).abs() < 1e-3, "{found:?}");
            assert!(found.runs < 16, "{found:?}");
        }
        let (ends, none) = boundary(1.0, 2.0, 1e-3, &mut |_| Ok(outcome(true))).expect("runs");
        assert!(none.is_none() && ends.at_to.stable);
    }

    #[test]
    fn a_reserve_of_one_is_where_the_prediction_lies() {
        let found = crossing(1.0, 16.0, &|value| Ok(Some(5.0 / value))).expect("exists");
        assert!((found.expect("inside") - 5.0).abs() < 1e-6);
        assert_eq!(crossing(1.0, 2.0, &|_| Ok(Some(3.0))).expect("exists"), None);
        assert_eq!(crossing(1.0, 2.0, &|_| Ok(None)).expect("exists"), None);
    }
}
