//! Faults that no board carries out: those of messages, clocks, bus and processors.

use board::BoardId;
use channels::{Tamper, TamperKind, Tampering};
use messages::{Event, Ns};
use scenario::{ClockDrift, Fault, FaultKind, Occurrence, Scenario, Site, nanoseconds};

/// The planned faults of messages over the bus.
pub(crate) fn tampering(scenario: &Scenario) -> Tampering {
    let occurrences = scenario.occurrences();
    let max_age = nanoseconds(scenario.safety.max_message_age_ms * 1e-3);
    let faults = scenario.faults.iter().enumerate().filter_map(|(number, fault)| {
        let Ok(Site::Messages(from)) = scenario.fault_site(number) else { return None };
        let holds = occurrences.iter().filter(|occurrence| occurrence.fault == number);
        Some(Tamper { number, from, kind: kind_of(fault)?, holds: holds.map(|held| (held.from, held.until)).collect() })
    });
    Tampering { seed: scenario.seed, max_age, faults: faults.collect() }
}

fn kind_of(fault: &Fault) -> Option<TamperKind> {
    let time = nanoseconds(fault.amount * 1e-3);
    Some(match fault.kind {
        FaultKind::Delay => TamperKind::Delay(time),
        FaultKind::Jitter => TamperKind::Jitter(time),
        FaultKind::Drop if fault.amount == 0.0 => TamperKind::Drop(1.0),
        FaultKind::Drop => TamperKind::Drop(fault.amount),
        FaultKind::Duplicate => TamperKind::Duplicate,
        FaultKind::Reorder => TamperKind::Reorder,
        FaultKind::BitFlip => TamperKind::BitFlip(fault.amount as u32),
        _ => return None,
    })
}

/// Begins of the faults that the chassis tells of, because no board can.
pub(crate) struct Injections {
    /// When, and which fault, in the order of time.
    begins: Vec<(Ns, usize)>,
    told: usize,
}

impl Injections {
    /// Those of a scenario.
    pub fn new(scenario: &Scenario) -> Injections {
        let told_here = |occurrence: &Occurrence| match scenario.fault_site(occurrence.fault) {
            Ok(Site::Messages(_) | Site::Timing(_)) => true,
            Ok(Site::Board(_)) => scenario.faults[occurrence.fault].kind == FaultKind::ClockDrift,
            _ => false,
        };
        let occurrences = scenario.occurrences().into_iter().filter(told_here);
        let mut begins: Vec<_> = occurrences.map(|occurrence| (occurrence.from, occurrence.fault)).collect();
        begins.sort_unstable();
        Injections { begins, told: 0 }
    }

    /// Tells of those that begin before `until` and have not been told of.
    pub fn tell(&mut self, until: Ns, events: &mut Vec<Event>) {
        while let Some((at, fault)) = self.begins.get(self.told).filter(|(at, _)| *at < until) {
            events.push(Event::injected(*at, *fault));
            self.told += 1;
        }
    }
}

/// The boards' own clocks, each as far off simulated time as planned.
#[derive(Default)]
pub(crate) struct Clocks {
    drifts: Vec<ClockDrift>,
}

impl Clocks {
    /// Those of a scenario.
    pub fn new(scenario: &Scenario) -> Clocks {
        Clocks { drifts: scenario.clock_drifts() }
    }

    /// What the board's clock shows at simulated time `t`.
    pub fn show(&self, board: BoardId, t: Ns) -> Ns {
        let of_board = self.drifts.iter().filter(|drift| drift.board == board && drift.from < t);
        let gained: i64 =
            of_board.map(|drift| ((t.min(drift.until) - drift.from) as f64 * drift.gain).round() as i64).sum();
        t.saturating_add_signed(gained)
    }

    /// Whether any clock is off at some time.
    pub fn are_right(&self) -> bool {
        self.drifts.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scenario(faults: &str) -> Scenario {
        let text = format!("fault=[{faults}]");
        scenario::load("table-5-3", &[text]).expect("document").scenario().expect("scenario")
    }

    #[test]
    fn a_drifting_clock_gains_while_the_fault_holds_and_keeps_what_it_has_gained() {
        let drift =
            r#"{ target = "control_computer", kind = "clock-drift", start_s = 1.0, duration_s = 2.0, amount = 100.0 }"#;
        let clocks = Clocks::new(&scenario(drift));
        let shown = [0.5, 1.0, 2.0, 3.0, 4.0].map(|s| {
            let t = nanoseconds(s);
            clocks.show(BoardId::ControlComputer, t) as i64 - t as i64
        });
        assert_eq!(shown, [0, 0, 100_000, 200_000, 200_000]);
        assert_eq!(clocks.show(BoardId::EncoderIf, nanoseconds(4.0)), nanoseconds(4.0));
    }

    #[test]
    fn each_begin_that_is_the_chassis_to_tell_of_is_told_once_in_its_window() {
        let drop =
            r#"{ target = "encoder_if", kind = "drop", start_s = 0.5, duration_s = 0.1, every_s = 1.0, amount = 1.0 }"#;
        let bias = r#"{ target = "force_sensor", kind = "bias", start_s = 0.1, amount = 1.0 }"#;
        let mut injections = Injections::new(&scenario(&format!("{bias}, {drop}")));
        let mut told = |until| {
            let mut events = Vec::new();
            injections.tell(nanoseconds(until), &mut events);
            events.iter().map(|event| (event.t, event.a)).collect::<Vec<_>>()
        };
        assert_eq!(told(0.5), []);
        assert_eq!(told(0.6), [(nanoseconds(0.5), 1.0)]);
        assert_eq!(told(2.6), [(nanoseconds(1.5), 1.0), (nanoseconds(2.5), 1.0)]);
    }
}
