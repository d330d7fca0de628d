//! From the campaign to the single faults: everything that is left to chance, from the seed.
//!
//! Every fault has a random stream of its own, told by kind, phase and number, so that neither the order of the runs nor
//! the other faults of the campaign move it.

use super::judge::control_period_ms;
use super::plan::{Kind, Plan};
use board::Ns;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use scenario::{Fault, FaultKind, Scenario, nanoseconds};

/// Streams of the runs' seeds; those of the faults are lower.
const SEEDS: u64 = 1 << 62;

/// One fault of the campaign.
#[derive(Clone, Debug)]
pub struct Draw {
    /// Number of its kind in the campaign.
    pub kind: usize,
    /// Number of its phase.
    pub phase: usize,
    /// Seed of its run.
    pub seed: u64,
    /// The faults of its run; the last one is the one that is judged.
    pub faults: Vec<Fault>,
    /// When it is put in.
    pub at: Ns,
    /// When its run ends at the latest.
    pub end: Ns,
}

impl Draw {
    /// The fault that is judged.
    pub fn fault(&self) -> &Fault {
        &self.faults[self.faults.len() - 1]
    }

    /// The scenario of its run.
    pub fn scenario(&self, base: &Scenario) -> Scenario {
        with_faults(base, self.seed, &self.faults)
    }

    /// The scenario of its twin: everything but the fault that is judged.
    pub fn twin(&self, base: &Scenario) -> Scenario {
        with_faults(base, self.seed, &self.faults[..self.faults.len() - 1])
    }

    /// Whether the fault is a signal to a real process.
    pub fn needs_processes(&self) -> bool {
        matches!(self.fault().kind, FaultKind::Crash | FaultKind::Hang)
    }
}

fn with_faults(base: &Scenario, seed: u64, faults: &[Fault]) -> Scenario {
    Scenario { seed, faults: faults.to_vec(), ..base.clone() }
}

fn phases<'a>(plan: &'a Plan, kind: &'a Kind) -> impl Iterator<Item = usize> + 'a {
    let wanted = |name: &String| kind.phases.as_ref().is_none_or(|names| names.contains(name));
    (0..plan.phases.len()).filter(move |phase| wanted(&plan.phases[*phase].name))
}

/// Uniform in [0, 1).
fn uniform(rng: &mut ChaCha8Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// The random stream of that number.
fn stream(seed: u64, number: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number);
    rng
}

/// Seed of the run of that number.
pub fn run_seed(seed: u64, number: u64) -> u64 {
    // a scenario's seed is written as a signed number
    stream(seed, SEEDS + number).next_u64() >> 1
}

/// Every fault of the campaign, in the order of kinds, phases and numbers.
pub fn draws(plan: &Plan, base: &Scenario, seed: u64) -> Vec<Draw> {
    let mut draws = Vec::new();
    for (number, kind) in plan.kinds.iter().enumerate() {
        for phase in phases(plan, kind) {
            for repeat in 0..kind.repeats.unwrap_or(plan.repeats) {
                draws.push(draw(plan, base, seed, (number, phase, repeat)));
            }
        }
    }
    draws
}

fn draw(plan: &Plan, base: &Scenario, seed: u64, (number, phase, repeat): (usize, usize, usize)) -> Draw {
    let kind = &plan.kinds[number];
    let known = FaultKind::ALL.iter().position(|known| *known == kind.kind).unwrap_or(0);
    let mut rng = stream(seed, (known as u64) << 40 | (phase as u64) << 20 | repeat as u64);
    let span = &plan.phases[phase];
    let mut start_s = span.from_s + (span.until_s - span.from_s) * uniform(&mut rng);
    if let Some([least, most]) = kind.in_period_ms {
        let period_s = 1e-3 * control_period_ms(base);
        let released = (span.from_s / period_s).ceil() + ((start_s - span.from_s) / period_s).floor();
        start_s = released * period_s + 1e-3 * (least + (most - least) * uniform(&mut rng));
    }
    let target = kind.targets[(uniform(&mut rng) * kind.targets.len() as f64) as usize].clone();
    let size = kind.amount[0] + (kind.amount[1] - kind.amount[0]) * uniform(&mut rng);
    let negative = uniform(&mut rng) < 0.5 && kind.either_sign;
    let fault = |kind: FaultKind, target: String, start_s: f64, amount: f64| Fault {
        target,
        kind,
        start_s,
        duration_s: None,
        every_s: None,
        mean_time_between_s: None,
        probability: 1.0,
        axes: (0..6).collect(),
        amount,
    };
    let mut faults: Vec<Fault> = kind
        .before
        .iter()
        .map(|before| fault(before.kind, before.target.clone(), start_s - before.lead_s, before.amount))
        .collect();
    let axes = kind.axes.clone().unwrap_or_else(|| (0..6).collect());
    let amount = if negative { -size } else { size };
    faults.push(Fault { duration_s: kind.duration_s, axes, ..fault(kind.kind, target, start_s, amount) });
    let at = nanoseconds(start_s);
    let end = (at + nanoseconds(kind.watch_s.unwrap_or(plan.watch_s))).min(base.duration_ns());
    Draw { kind: number, phase, seed: run_seed(seed, (repeat % plan.twins) as u64), faults, at, end }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(change: impl FnOnce(&mut Plan), seed: u64) -> Vec<Draw> {
        let document = scenario::load("campaign", &[]).expect("built-in scenario");
        let mut plan = Plan::load(None, &document).expect("built-in campaign");
        change(&mut plan);
        draws(&plan, &document.scenario().expect("built-in scenario"), seed)
    }

    #[test]
    fn a_fault_is_the_same_whatever_else_the_campaign_has() {
        let whole = all(|_| {}, 7);
        let part = all(|plan| plan.keep(&["stuck".into(), "drop".into()]).expect("they are there"), 7);
        assert!(part.len() >= 2);
        for draw in &part {
            let same = whole.iter().find(|other| other.fault() == draw.fault()).expect("the same fault");
            assert_eq!((same.seed, same.at, same.end), (draw.seed, draw.at, draw.end));
        }
        let other = all(|plan| plan.keep(&["stuck".into()]).expect("it is there"), 8);
        assert!(other.iter().all(|draw| whole.iter().all(|known| known.fault() != draw.fault())));
    }

    #[test]
    fn faults_lie_in_their_phase_and_have_amounts_within_their_range() {
        let document = scenario::load("campaign", &[]).expect("built-in scenario");
        let plan = Plan::load(None, &document).expect("built-in campaign");
        for draw in draws(&plan, &document.scenario().expect("built-in scenario"), 1) {
            let kind = &plan.kinds[draw.kind];
            let phase = &plan.phases[draw.phase];
            // a place in the control period may lie a little behind the phase's end
            let end = nanoseconds(phase.until_s) + kind.in_period_ms.map_or(0, |_| 5_000_000);
            assert!((nanoseconds(phase.from_s)..=end).contains(&draw.at), "{draw:?}");
            assert!((kind.amount[0]..=kind.amount[1]).contains(&draw.fault().amount.abs()), "{draw:?}");
            assert!(kind.targets.contains(&draw.fault().target));
        }
    }
}
