//! One row of the table of latencies: a histogram over the whole run, and one of each second for the interval log.
//!
//! Values wait until their second is over and then go into the histograms together, in their order: one by one, far apart in
//! memory, they would cost several times as much. A row keeps no more than the values of two seconds.

use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2Serializer;
use hdrhistogram::serialization::interval_log::{IntervalLogWriterBuilder, Tag};
use serde::Serialize;
use std::collections::VecDeque;
use std::time::Duration;

/// Longest latency that is told apart, ns; longer ones count as this.
const LONGEST_NS: u64 = 100_000_000_000;
const SECOND: u64 = 1_000_000_000;

/// What a table shows of one path. Times are ns.
#[derive(Clone, Debug, Serialize)]
pub struct LatencyRow {
    /// Path, for example `wake-up hw_sim`.
    pub path: String,
    /// How often.
    pub n: u64,
    /// Least.
    pub min_ns: u64,
    /// Median.
    pub p50_ns: u64,
    /// Quantile 0.9.
    pub p90_ns: u64,
    /// Quantile 0.99.
    pub p99_ns: u64,
    /// Quantile 0.999.
    pub p999_ns: u64,
    /// Quantile 0.9999.
    pub p9999_ns: u64,
    /// Greatest.
    pub max_ns: u64,
    /// How often it came too late or not at all; `None` where nothing can be missed.
    pub missed: Option<u64>,
    /// Median over the median of a pipe of the same run.
    pub p50_to_pipe: Option<f64>,
    /// Value and count of each bucket that is not empty.
    pub histogram: Vec<(u64, u64)>,
    /// Lines of the interval log, with the second that each is of.
    #[serde(skip)]
    pub(crate) log: Vec<(u64, String)>,
}

/// A row under way.
pub struct Recorder {
    path: String,
    n: u64,
    /// How often it came too late or not at all.
    pub missed: Option<u64>,
    /// Values of the seconds that have been settled.
    values: Histogram<u64>,
    /// Values of those that have not, in the order of time.
    unsettled: VecDeque<(u64, Vec<u64>)>,
    spare: Vec<u64>,
    log: Vec<(u64, String)>,
}

/// Digits to which a row tells values apart, and those of one of its seconds.
const DIGITS: u8 = 3;
const DIGITS_OF_SECOND: u8 = 2;

fn histogram(digits: u8) -> Histogram<u64> {
    // bounds and digits are valid constants
    Histogram::new_with_bounds(1, LONGEST_NS, digits).unwrap_or_else(|_| unreachable!())
}

/// An empty histogram of a second, for [`Recorder::settle`].
pub(super) fn of_second() -> Histogram<u64> {
    histogram(DIGITS_OF_SECOND)
}

impl Recorder {
    /// An empty row.
    pub fn new(path: impl Into<String>) -> Recorder {
        Recorder {
            path: path.into(),
            n: 0,
            missed: None,
            values: histogram(DIGITS),
            unsettled: VecDeque::with_capacity(2),
            spare: Vec::new(),
            log: Vec::new(),
        }
    }

    /// An empty row in which values can be missed.
    pub fn counting_misses(path: impl Into<String>) -> Recorder {
        Recorder { missed: Some(0), ..Recorder::new(path) }
    }

    /// One value, taken at `at` ns after the start of the run.
    pub fn record(&mut self, at: u64, ns: u64) {
        self.n += 1;
        let second = at / SECOND;
        match self.unsettled.back_mut() {
            Some((last, values)) if second <= *last => values.push(ns),
            _ => {
                let mut values = std::mem::take(&mut self.spare);
                values.push(ns);
                self.unsettled.push_back((second, values));
            }
        }
    }

    /// One value too late, or none where one was due.
    pub fn miss(&mut self) {
        self.missed = Some(self.missed.unwrap_or(0) + 1);
    }

    /// What it is a row of.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// How many values there are.
    pub fn n(&self) -> u64 {
        self.n
    }

    /// Values of the seconds settled so far, at this quantile, ns.
    pub fn quantile(&self, quantile: f64) -> u64 {
        self.values.value_at_quantile(quantile)
    }

    /// Counts the values of every second but the last one; `of_second` is empty, and is so afterwards.
    pub(super) fn settle(&mut self, of_second: &mut Histogram<u64>) {
        while self.unsettled.len() > 1 {
            self.settle_first(of_second);
        }
    }

    fn settle_first(&mut self, of_second: &mut Histogram<u64>) {
        let Some((second, mut values)) = self.unsettled.pop_front() else { return };
        values.sort_unstable();
        for ns in &values {
            self.values.saturating_record((*ns).max(1));
            of_second.saturating_record((*ns).max(1));
        }
        self.log.extend(self.interval(second, of_second).map(|line| (second, line)));
        of_second.reset();
        values.clear();
        self.spare = values;
    }

    /// The line of the interval log; writing into memory does not fail.
    fn interval(&self, second: u64, of_second: &Histogram<u64>) -> Option<String> {
        let tag = self.path.replace([' ', ','], "_");
        let (mut line, mut serializer) = (Vec::new(), V2Serializer::new());
        IntervalLogWriterBuilder::new()
            .with_max_value_divisor(1e6)
            .begin_log_with(&mut line, &mut serializer)
            .ok()?
            .write_histogram(of_second, Duration::from_secs(second), Duration::from_secs(1), Tag::new(&tag))
            .ok()?;
        let text = String::from_utf8(line).ok()?;
        Some(text.lines().filter(|line| !line.starts_with('#')).collect())
    }

    /// The finished row.
    pub fn finish(mut self) -> LatencyRow {
        let mut of_second = of_second();
        while !self.unsettled.is_empty() {
            self.settle_first(&mut of_second);
        }
        let at = |quantile| self.values.value_at_quantile(quantile);
        LatencyRow {
            n: self.n,
            min_ns: self.values.min(),
            p50_ns: at(0.5),
            p90_ns: at(0.9),
            p99_ns: at(0.99),
            p999_ns: at(0.999),
            p9999_ns: at(0.9999),
            max_ns: self.values.max(),
            missed: self.missed,
            p50_to_pipe: None,
            histogram: self
                .values
                .iter_recorded()
                .map(|bucket| (bucket.value_iterated_to(), bucket.count_at_value()))
                .collect(),
            path: self.path,
            log: self.log,
        }
    }
}

impl LatencyRow {
    /// Value at a quantile, ns, from the buckets.
    pub fn quantile(&self, quantile: f64) -> u64 {
        let wanted = (quantile * self.n as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        for (value, count) in &self.histogram {
            seen += count;
            if seen >= wanted {
                return *value;
            }
        }
        self.max_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdrhistogram::serialization::Deserializer;
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};

    fn thousand() -> Recorder {
        let mut recorder = Recorder::counting_misses("wake-up hw_sim");
        (1..=1000).for_each(|i| recorder.record(i * 3_000_000, i * 1000));
        recorder
    }

    #[test]
    fn a_row_shows_the_quantiles_of_its_values_to_three_digits() {
        let row = thousand().finish();
        assert_eq!((row.n, row.min_ns / 1000, row.missed), (1000, 1, Some(0)));
        for (found, expected) in
            [(row.p50_ns, 500_000), (row.p90_ns, 900_000), (row.p99_ns, 990_000), (row.max_ns, 1_000_000)]
        {
            assert!(found.abs_diff(expected) <= expected / 1000, "{found} instead of {expected}");
        }
        assert_eq!(row.quantile(0.99), row.p99_ns);
        assert_eq!(row.histogram.iter().map(|(_, count)| count).sum::<u64>(), 1000);
    }

    #[test]
    fn a_row_keeps_no_values_of_a_second_that_is_settled() {
        let (mut recorder, mut of_second) = (Recorder::new("step hw_sim"), of_second());
        for i in 0..100_000 {
            recorder.record(i * 1_000_000, i % 1000);
            recorder.settle(&mut of_second);
            assert!(of_second.is_empty() && recorder.unsettled.len() == 1);
        }
        assert!(recorder.unsettled[0].1.capacity() + recorder.spare.capacity() < 4096);
        assert_eq!((recorder.n(), recorder.log.len(), recorder.quantile(1.0)), (100_000, 99, 999));
        assert_eq!(recorder.finish().histogram.iter().map(|(_, count)| count).sum::<u64>(), 100_000);
    }

    #[test]
    fn the_log_of_each_second_reads_back_with_all_its_values() {
        let row = thousand().finish();
        let text: String = row.log.iter().map(|(_, line)| format!("{line}\n")).collect();
        let mut values = 0;
        for entry in IntervalLogIterator::new(text.as_bytes()) {
            let Ok(LogEntry::Interval(interval)) = entry else { panic!("{entry:?}") };
            assert_eq!(interval.tag().map(|tag| tag.as_str().to_owned()), Some("wake-up_hw_sim".into()));
            use base64::Engine as _;
            let bytes = base64::engine::general_purpose::STANDARD.decode(interval.encoded_histogram()).expect("base64");
            let histogram: Histogram<u64> = Deserializer::new().deserialize(&mut bytes.as_slice()).expect("histogram");
            values += histogram.len();
        }
        assert_eq!((values, row.log.len()), (1000, 4));
    }
}
