//! Reads the processor clocks of a rack's processes while stretches with and without measuring take turns.

use board::Ns;
use pacing::{Realtime, processor_ns};
use report::latency::{Compared, MeasuringCost, Stretch};
use scenario::Scenario;
use vme::MILLISECOND;

/// Length of a stretch, simulated time: long beside what a reading or a single disturbance costs.
const STRETCH: Ns = 200 * MILLISECOND;
/// So long after its begin a stretch counts: windows are told ahead, and what was measured before is told behind.
const SETTLED: Ns = 40 * MILLISECOND;
/// Boards on the way of a control cycle.
const ON_THE_WAY: [&str; 4] = ["hw_sim", "force_sensor_if", "control_computer", "da_io"];

/// Collects the stretches of one run.
pub struct CostMeter {
    processes: Vec<(Compared, u32)>,
    period_ns: f64,
    /// The stretch under way: its number, and when and with which clocks it began to count.
    begun: Option<(u64, Ns, Vec<u64>)>,
    stretches: Vec<Stretch>,
}

impl CostMeter {
    /// For a rack that has been powered up, whose control task has that period.
    pub fn new(scenario: &Scenario, rack: &Realtime<'_>, period_ns: Ns) -> CostMeter {
        let hosts = |name: &str| scenario.processes.iter().find(|process| process.name == name);
        let of = |name: &str, pid| {
            let on_the_way = hosts(name)
                .is_some_and(|process| process.boards.iter().any(|board| ON_THE_WAY.contains(&board.as_str())));
            (Compared { name: name.to_owned(), on_the_way }, pid)
        };
        let chassis = of("chassis", std::process::id());
        let processes = [chassis].into_iter().chain(rack.pids().map(|(name, pid)| of(name, pid))).collect();
        CostMeter { processes, period_ns: period_ns as f64, begun: None, stretches: Vec::new() }
    }

    /// Whether what is done from `from` on is measured: with, without, without, with, and so on.
    pub fn measures(from: Ns) -> bool {
        matches!(from / STRETCH % 4, 0 | 3)
    }

    /// The windows up to `until` are over.
    pub fn window(&mut self, until: Ns) {
        let stretch = until / STRETCH;
        if let Some((begun, since, before)) = self.begun.take_if(|(begun, ..)| *begun != stretch) {
            let cycles = (until - since) as f64 / self.period_ns;
            let used = self.clocks().into_iter().zip(before);
            let per_cycle_ns = used.map(|(now, before)| now.saturating_sub(before) as f64 / cycles).collect();
            self.stretches.push(Stretch { measured: CostMeter::measures(begun * STRETCH), per_cycle_ns });
        }
        if self.begun.is_none() && until % STRETCH >= SETTLED {
            self.begun = Some((stretch, until, self.clocks()));
        }
    }

    fn clocks(&self) -> Vec<u64> {
        self.processes.iter().map(|(_, pid)| processor_ns(*pid).unwrap_or(0)).collect()
    }

    /// What the run has shown; `None` where it was too short.
    pub fn finish(self) -> Option<MeasuringCost> {
        let processes: Vec<Compared> = self.processes.into_iter().map(|(process, _)| process).collect();
        MeasuringCost::of(&processes, &self.stretches, STRETCH as f64 * 1e-9, self.period_ns)
    }
}
