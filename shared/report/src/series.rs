//! A quantity over time, linear between its samples.

/// Samples in the order of time, s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Instants, s, rising.
    pub t: Vec<f64>,
    /// Values.
    pub y: Vec<f64>,
}

impl Series {
    /// Appends a sample; one at the instant of the last replaces it.
    pub fn push(&mut self, t: f64, y: f64) {
        if self.t.last() == Some(&t) {
            self.t.pop();
            self.y.pop();
        }
        self.t.push(t);
        self.y.push(y);
    }

    /// Value at `t`, the first or last one beyond the ends; `None` of an empty series.
    pub fn at(&self, t: f64) -> Option<f64> {
        let after = self.t.partition_point(|&sample| sample <= t);
        match (after.checked_sub(1), self.t.get(after)) {
            (None, None) => None,
            (None, Some(_)) => self.y.first().copied(),
            (Some(i), None) => Some(self.y[i]),
            (Some(i), Some(&next)) => {
                let share = (t - self.t[i]) / (next - self.t[i]);
                Some(self.y[i] + share * (self.y[i + 1] - self.y[i]))
            }
        }
    }

    /// The last value before `t`: of a quantity that may jump there.
    pub fn before(&self, t: f64) -> Option<f64> {
        self.y.get(self.t.partition_point(|&sample| sample < t).checked_sub(1)?).copied()
    }

    /// Samples from `from` to `until`, both ends interpolated.
    pub fn within(&self, from: f64, until: f64) -> impl Iterator<Item = (f64, f64)> {
        let inner = self.t.partition_point(|&t| t <= from)..self.t.partition_point(|&t| t < until);
        let end = |t| self.at(t).map(|y| (t, y));
        let inner = inner.start..inner.end.max(inner.start);
        end(from).into_iter().chain(inner.map(|i| (self.t[i], self.y[i]))).chain(end(until))
    }

    /// Mean of f(value) over time from `from` to `until`.
    pub fn mean_of(&self, from: f64, until: f64, f: impl Fn(f64) -> f64) -> Option<f64> {
        let mut last: Option<(f64, f64)> = None;
        let mut integral = 0.0;
        for (t, y) in self.within(from, until) {
            let y = f(y);
            if let Some((t0, y0)) = last {
                integral += 0.5 * (y0 + y) * (t - t0);
            }
            last = Some((t, y));
        }
        (last.is_some() && until > from).then(|| integral / (until - from))
    }

    /// Greatest f(time, value) from `from` to `until`.
    pub fn greatest(&self, from: f64, until: f64, f: impl Fn(f64, f64) -> Option<f64>) -> Option<f64> {
        self.within(from, until).filter_map(|(t, y)| f(t, y)).reduce(f64::max)
    }

    /// First instant from `from` to `until` at which the value passes `level`, coming from its other side.
    pub fn crossing(&self, from: f64, until: f64, level: f64) -> Option<f64> {
        let mut last: Option<(f64, f64)> = None;
        for (t, y) in self.within(from, until) {
            if let Some((t0, y0)) = last
                && (y0 < level) != (y < level)
            {
                return Some(t0 + (level - y0) / (y - y0) * (t - t0));
            }
            last = Some((t, y));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Series {
        Series { t: vec![0.0, 1.0, 3.0], y: vec![0.0, 1.0, 3.0] }
    }

    #[test]
    fn values_between_samples_lie_on_the_line() {
        assert_eq!(ramp().at(2.0), Some(2.0));
        assert_eq!((ramp().at(-1.0), ramp().at(9.0)), (Some(0.0), Some(3.0)));
        assert_eq!(Series::default().at(0.0), None);
        assert_eq!((ramp().before(3.0), ramp().before(3.1), ramp().before(0.0)), (Some(1.0), Some(3.0), None));
    }

    #[test]
    fn the_mean_weighs_by_time_and_not_by_samples() {
        assert_eq!(ramp().mean_of(0.5, 2.5, |y| y), Some(1.5));
        assert_eq!(ramp().mean_of(0.0, 3.0, |y| y), Some(1.5));
    }

    #[test]
    fn a_level_is_crossed_where_the_line_meets_it() {
        assert_eq!(ramp().crossing(0.0, 3.0, 2.5), Some(2.5));
        assert_eq!(ramp().crossing(0.0, 2.0, 2.5), None);
    }
}
