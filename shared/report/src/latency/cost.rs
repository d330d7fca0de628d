//! What measuring costs: processor time in stretches of one run with measuring, each beside one without.
//!
//! Two stretches that follow each other are a pair, now the one with measuring first, now the other, so that what changes
//! slowly (the arm's state, the machine's clock) stands on both sides alike. The figure is the median of the pairs'
//! differences; its interval is that of order statistics, for which no distribution needs to be assumed. The mean stands
//! beside it: it shows what costs much, but seldom.

use serde::Serialize;

/// Standard deviations of a normal distribution within which 95 % lie.
const NORMAL_95: f64 = 1.96;

/// Processor time in one stretch of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Whether it was measured.
    pub measured: bool,
    /// Processor time of each process per control cycle, ns.
    pub per_cycle_ns: Vec<f64>,
}

/// A process whose processor time is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Name.
    pub name: String,
    /// It hosts a board on the way from the arm to the D/A: what its step takes longer, the cycle takes longer.
    pub on_the_way: bool,
}

/// Processor time per control cycle, ns, measuring and not measuring.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CostRow {
    /// Process, or what is summed.
    pub process: String,
    /// Median with measuring.
    pub with_ns: f64,
    /// Median without.
    pub without_ns: f64,
    /// Median of the pairs' differences.
    pub difference_ns: f64,
    /// 95 % interval of that median.
    pub interval_ns: [f64; 2],
    /// Mean of the differences.
    pub mean_ns: f64,
}

/// Processor time of the rack's processes, measuring and not measuring.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuringCost {
    /// Pairs of stretches.
    pub pairs: usize,
    /// Length of a stretch, s.
    pub stretch_s: f64,
    /// Each process.
    pub processes: Vec<CostRow>,
    /// The processes on the way from the arm to the D/A: what a cycle takes longer.
    pub on_the_way: CostRow,
    /// All of them.
    pub all: CostRow,
    /// What all of them cost, as part of a cycle's period.
    pub of_period: f64,
    /// 95 % interval of that.
    pub of_period_interval: [f64; 2],
}

impl MeasuringCost {
    /// Compares stretches in the order of time; `None` where there is no pair.
    pub fn of(processes: &[Compared], stretches: &[Stretch], stretch_s: f64, period_ns: f64) -> Option<MeasuringCost> {
        let of_pair = stretches.chunks(2).filter_map(|pair| match pair {
            // the guard is asked in both orders
            [with, without] | [without, with] if with.measured && !without.measured => Some([with, without]),
            _ => None,
        });
        let pairs: Vec<[&Stretch; 2]> = of_pair.collect();
        if pairs.is_empty() {
            return None;
        }
        let row = |name: &str, counts: &dyn Fn(usize) -> bool| {
            let sum = |stretch: &Stretch| {
                (0..).zip(&stretch.per_cycle_ns).filter(|(i, _)| counts(*i)).map(|(_, ns)| ns).sum::<f64>()
            };
            let sums: Vec<[f64; 2]> = pairs.iter().map(|[with, without]| [sum(with), sum(without)]).collect();
            let sorted = |values: &mut dyn Iterator<Item = f64>| {
                let mut values: Vec<f64> = values.collect();
                values.sort_by(f64::total_cmp);
                values
            };
            let differences = sorted(&mut sums.iter().map(|[with, without]| with - without));
            CostRow {
                process: name.to_owned(),
                with_ns: median(&sorted(&mut sums.iter().map(|[with, _]| *with))),
                without_ns: median(&sorted(&mut sums.iter().map(|[_, without]| *without))),
                difference_ns: median(&differences),
                interval_ns: interval(&differences),
                mean_ns: differences.iter().sum::<f64>() / differences.len() as f64,
            }
        };
        let all = row("all", &|_| true);
        Some(MeasuringCost {
            pairs: pairs.len(),
            stretch_s,
            processes: (0..).zip(processes).map(|(i, process)| row(&process.name, &|other| other == i)).collect(),
            on_the_way: row("those on the way from arm to D/A", &|i| processes[i].on_the_way),
            of_period: all.difference_ns / period_ns,
            of_period_interval: all.interval_ns.map(|ns| ns / period_ns),
            all,
        })
    }

    /// Every row.
    pub(super) fn rows(&self) -> impl Iterator<Item = &CostRow> {
        self.processes.iter().chain([&self.on_the_way, &self.all])
    }

    /// What is compared, and what comes of it.
    pub(super) fn remark(&self) -> String {
        let percent = |part: f64| format!("{:.2}", part * 100.0);
        let [low, high] = self.of_period_interval.map(percent);
        format!(
            "measuring costs {} % of a cycle's period (95 % interval {low} to {high}): processor time of all processes with \
             it less that without, the median of {} pairs of stretches of {:.1} s in one run; a cycle's way through the \
             boards grows by {:.1} µs",
            percent(self.of_period),
            self.pairs,
            self.stretch_s,
            self.on_the_way.difference_ns * 1e-3
        )
    }
}

/// Median of sorted values.
fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

/// 95 % interval of the median that sorted values were drawn about: at least so many of them lie on each side of it. All
/// of them where there are few.
fn interval(sorted: &[f64]) -> [f64; 2] {
    let n = sorted.len();
    let beyond = (0.5 * (n as f64 - NORMAL_95 * (n as f64).sqrt())).floor().max(1.0) as usize - 1;
    [sorted[beyond], sorted[n - 1 - beyond]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared() -> [Compared; 2] {
        [("hw_sim", true), ("chassis", false)].map(|(name, on_the_way)| Compared { name: name.into(), on_the_way })
    }

    /// With and without in turn, as a run has them; time goes by 10 ns slower from stretch to stretch.
    fn stretches(n: usize) -> Vec<Stretch> {
        let of = |i: usize| {
            let measured = matches!(i % 4, 0 | 3);
            let drift = 10.0 * i as f64;
            let cost = if measured { [200.0, 5_000.0] } else { [0.0, 0.0] };
            Stretch { measured, per_cycle_ns: vec![50_000.0 + cost[0] + drift, 300_000.0 + cost[1] + drift] }
        };
        (0..n).map(of).collect()
    }

    #[test]
    fn what_measuring_adds_is_found_beside_a_drift() {
        let cost = MeasuringCost::of(&compared(), &stretches(80), 0.2, 1e6).expect("pairs");
        assert_eq!(cost.pairs, 40);
        assert!((cost.all.difference_ns - 5_200.0).abs() < 1e-6 && (cost.all.mean_ns - 5_200.0).abs() < 1e-6);
        assert!((cost.on_the_way.difference_ns - 200.0).abs() < 1e-6, "{cost:?}");
        assert!((cost.of_period - 0.0052).abs() < 1e-9);
        let [low, high] = cost.all.interval_ns;
        assert!(low <= cost.all.difference_ns && cost.all.difference_ns <= high && high - low < 41.0, "{cost:?}");
        assert_eq!(MeasuringCost::of(&compared(), &stretches(1), 0.2, 1e6).map(|cost| cost.pairs), None);
    }

    #[test]
    fn a_disturbance_of_a_few_stretches_moves_the_mean_and_not_the_median() {
        let mut stretches = stretches(80);
        stretches[20].per_cycle_ns[1] += 1e6;
        let cost = MeasuringCost::of(&compared(), &stretches, 0.2, 1e6).expect("pairs");
        assert!((cost.all.difference_ns - 5_200.0).abs() < 25.0, "{cost:?}");
        assert!((cost.all.mean_ns - 5_200.0 - 1e6 / 40.0).abs() < 25.0, "{cost:?}");
    }

    #[test]
    fn the_interval_is_that_of_the_sign_test() {
        // for n = 100 the 40th smallest and largest bound the median with 96.5 %, for 10 the outermost with 99.8 %
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!((median(&values), interval(&values)), (50.5, [40.0, 61.0]));
        assert_eq!((interval(&values[..10]), interval(&values[..3])), ([1.0, 10.0], [1.0, 3.0]));
    }
}
