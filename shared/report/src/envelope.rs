//! Whether an oscillation grows or decays: its envelope, from swing to swing.
//!
//! A swing is the difference of two extremes in a row, so that the value about which the oscillation takes place does not
//! matter. A turn back by less than a thousandth of the range of the first twentieth is ripple (quantisation) and no
//! extreme. The first swings, in which other modes still die out, do not count; nor does what comes once the swings are
//! twenty times as large (saturation). The growth is that of the straight line through the logarithms of up to 40 swings,
//! 20 periods. A motion without three such swings does not oscillate.

use crate::series::Series;

/// Swings in which other modes die out.
const SETTLING: usize = 3;
/// Most swings that count: 20 periods.
const MOST: usize = 40;
/// Fewer say nothing.
const LEAST: usize = 3;
/// Part of the time over whose range a turn is measured, and the share of it that is an extreme.
const OPENING: f64 = 0.05;
const SMALLEST: f64 = 1e-3;
/// Where the swings become too large to count, as a multiple of the first.
const LARGEST: f64 = 20.0;

/// An oscillation's envelope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Envelope {
    /// Factor per period: above 1 the oscillation grows.
    pub growth: f64,
    /// Periods over which it was taken.
    pub periods: f64,
}

impl Envelope {
    /// Of `series` from `from` to `until` (s); `None` where nothing oscillates.
    pub fn of(series: &Series, from: f64, until: f64) -> Option<Envelope> {
        let extremes = extremes(series, from, until);
        let swings: Vec<f64> = extremes.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        let first = *swings.get(SETTLING)?;
        let logs: Vec<f64> = swings[SETTLING..]
            .iter()
            .take(MOST)
            .take_while(|swing| **swing <= LARGEST * first)
            .map(|swing| libm::log(*swing))
            .collect();
        if logs.len() < LEAST {
            return None;
        }
        Some(Envelope { growth: libm::exp(2.0 * slope(&logs)), periods: 0.5 * logs.len() as f64 })
    }
}

/// Values at the turning points: of the samples between two turns the highest or lowest, and the top of the parabola
/// through it and its neighbours.
fn extremes(series: &Series, from: f64, until: f64) -> Vec<f64> {
    let inside = series.t.partition_point(|&t| t < from)..series.t.partition_point(|&t| t <= until);
    let (t, y) = (&series.t[inside.clone()], &series.y[inside]);
    let opening = t.partition_point(|&t| t <= from + OPENING * (until - from));
    let (low, high) = y[..opening].iter().fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(*y), high.max(*y)));
    let ripple = SMALLEST * (high - low);
    let mut found = Vec::new();
    // the extreme since the last turn, and the way towards it: up 1, down -1, unknown 0
    let (mut top, mut way) = (0, 0.0);
    for i in 1..y.len() {
        let beyond = y[i] - y[top];
        if way == 0.0 {
            if beyond.abs() > ripple {
                (top, way) = (i, beyond.signum());
            }
        } else if beyond * way > 0.0 {
            top = i;
        } else if -beyond * way > ripple {
            found.push(vertex(t, y, top));
            (top, way) = (i, -way);
        }
    }
    found
}

/// Value of the parabola through sample `i` and its neighbours where it turns.
fn vertex(t: &[f64], y: &[f64], i: usize) -> f64 {
    if i == 0 || i + 1 >= t.len() {
        return y[i];
    }
    let (a, b) = ((y[i] - y[i - 1]) / (t[i] - t[i - 1]), (y[i + 1] - y[i]) / (t[i + 1] - t[i]));
    // divided differences: y = y_i + a (t − t_i) + c (t − t_i)(t − t_{i−1})
    let c = (b - a) / (t[i + 1] - t[i - 1]);
    if c == 0.0 {
        return y[i];
    }
    let at = 0.5 * (t[i] + t[i - 1] - a / c);
    y[i] + (at - t[i]) * (a + c * (at - t[i - 1]))
}

/// Slope of the straight line of least squares through values one apart.
fn slope(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let moment: f64 = values.iter().enumerate().map(|(i, value)| (i as f64 - middle) * value).sum();
    moment * 12.0 / (n * (n * n - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// offset + e^{σt} cos ωt, sampled every 5 ms.
    fn oscillation(sigma: f64, omega: f64, seconds: f64) -> Series {
        let t: Vec<f64> = (0..(seconds / 5e-3) as usize).map(|i| i as f64 * 5e-3).collect();
        let y = t.iter().map(|t| 0.9 + 1e-3 * libm::exp(sigma * t) * libm::cos(omega * t)).collect();
        Series { t, y }
    }

    #[test]
    fn growth_per_period_is_that_of_the_exponential() {
        for (sigma, omega) in [(0.0, 20.0), (0.01, 20.0), (-0.2, 20.0), (0.1, 7.0), (-1.0, 30.0)] {
            let envelope = Envelope::of(&oscillation(sigma, omega, 20.0), 0.5, 20.0).unwrap();
            let expected = libm::exp(sigma * std::f64::consts::TAU / omega);
            assert!((envelope.growth - expected).abs() < 2e-4, "{sigma} {omega}: {envelope:?}, expected {expected}");
            assert!(envelope.periods <= 20.0);
        }
    }

    #[test]
    fn neither_decay_to_the_last_count_nor_saturation_hides_what_came_before() {
        let round =
            |series: Series| Series { y: series.y.iter().map(|y| (y * 1e7).round() * 1e-7).collect(), ..series };
        let decayed = Envelope::of(&round(oscillation(-3.0, 30.0, 20.0)), 0.0, 20.0).unwrap();
        assert!(decayed.growth < 0.6, "{decayed:?}");
        let mut grown = oscillation(2.0, 20.0, 20.0);
        grown.y.iter_mut().for_each(|y| *y = y.clamp(0.4, 1.4));
        assert!(Envelope::of(&grown, 0.0, 20.0).unwrap().growth > 1.5);
    }

    #[test]
    fn a_motion_that_does_not_swing_has_no_envelope() {
        let t: Vec<f64> = (0..1000).map(|i| f64::from(i) * 5e-3).collect();
        let settled = |ripple: f64| {
            let y = t.iter().map(|t| libm::exp(-t) + ripple * libm::sin(200.0 * t)).collect();
            Envelope::of(&Series { t: t.clone(), y }, 0.0, 5.0)
        };
        assert_eq!((settled(0.0), settled(5e-5)), (None, None));
        assert_eq!(Envelope::of(&Series::default(), 0.0, 5.0), None);
    }
}
