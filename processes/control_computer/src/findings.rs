//! What a job finds wrong: the detectors that fire, and the state that they demand of the arm.
//!
//! Every check reports here and nowhere else; the gravest demand wins, and of equal ones the first. The safety state
//! machine sees the demand alone. A detector that begins to fire is an event.

use crate::safety::State;
use board::Outputs;
use messages::{DETECTORS, Detector, Event, EventKind, Severity};
use vme::Ns;

/// The findings of one job of one card.
#[derive(Clone, Debug)]
pub struct Findings {
    demand: State,
    cause: Option<Detector>,
    /// Bit n: detector number n fires in this job; in the one before.
    firing: u64,
    before: u64,
    /// The same of those that fire between two jobs.
    noticed: u64,
    figures: [f64; DETECTORS.len() + 1],
}

impl Findings {
    /// Nothing found yet.
    pub fn new() -> Findings {
        Findings { demand: State::Run, cause: None, firing: 0, before: 0, noticed: 0, figures: [0.0; DETECTORS.len() + 1] }
    }

    /// A new job begins.
    pub fn begin(&mut self) {
        (self.before, self.firing) = (self.firing | std::mem::take(&mut self.noticed), 0);
        (self.demand, self.cause) = (State::Run, None);
    }

    /// `detector` fires and demands this state; `figure` says where or how much, as its event shows it.
    pub fn report(&mut self, detector: Detector, demand: State, figure: f64) {
        self.demand(demand, Some(detector));
        let bit = 1 << detector as u32;
        if self.firing & bit == 0 {
            self.figures[detector as usize] = figure;
        }
        self.firing |= bit;
    }

    /// `detector` fires between two jobs, at `t`, and demands nothing by itself. Whether that is news: it did not fire in
    /// the job before.
    pub fn notice(&mut self, detector: Detector, figure: f64, t: Ns, out: &mut Outputs) -> bool {
        let bit = 1 << detector as u32;
        let news = (self.firing | self.noticed) & bit == 0;
        self.noticed |= bit;
        if news {
            out.mail.events.push(detected(detector, figure, t));
        }
        news
    }

    /// Another card demands this state, and has told of it itself.
    pub fn demand(&mut self, demand: State, cause: Option<Detector>) {
        if demand > self.demand {
            (self.demand, self.cause) = (demand, cause);
        }
    }

    /// What is demanded, and by which detector.
    pub fn demanded(&self) -> (State, Option<Detector>) {
        (self.demand, self.cause)
    }

    /// An event for each detector that did not fire in the job before.
    pub fn tell(&self, t: Ns, out: &mut Outputs) {
        for detector in DETECTORS {
            if (self.firing & !self.before) >> *detector as u32 & 1 == 1 {
                let figure = self.figures[*detector as usize];
                out.mail.events.push(detected(*detector, figure, t));
            }
        }
    }
}

fn detected(detector: Detector, figure: f64, t: Ns) -> Event {
    Event::new(t, EventKind::Detected, Severity::Warn, figure, 0.0).because(Some(detector))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(findings: &Findings) -> Vec<(u32, f64)> {
        let mut out = Outputs::default();
        findings.tell(7, &mut out);
        out.mail.events.iter().map(|event| (event.cause, event.a)).collect()
    }

    #[test]
    fn the_gravest_demand_wins_and_of_equal_ones_the_first() {
        let mut findings = Findings::new();
        findings.report(Detector::ForceAge, State::Hold, 0.0);
        findings.report(Detector::ForceFrozen, State::Hold, 0.0);
        assert_eq!(findings.demanded(), (State::Hold, Some(Detector::ForceAge)));
        findings.report(Detector::BusError, State::Degraded, 0.0);
        assert_eq!(findings.demanded().0, State::Hold);
        findings.demand(State::Off, Some(Detector::EmergencyStop));
        assert_eq!(findings.demanded(), (State::Off, Some(Detector::EmergencyStop)));
        findings.begin();
        assert_eq!(findings.demanded(), (State::Run, None));
    }

    #[test]
    fn what_is_noticed_between_two_jobs_is_told_at_once_and_not_again_by_the_job() {
        let mut findings = Findings::new();
        for (job, news) in [true, false, false].into_iter().enumerate() {
            let mut out = Outputs::default();
            assert_eq!(findings.notice(Detector::BusError, 3.0, 5, &mut out), news, "{job}");
            assert!(!findings.notice(Detector::BusError, 4.0, 6, &mut out));
            assert_eq!(out.mail.events.len(), usize::from(news));
            findings.begin();
            findings.report(Detector::BusError, State::Degraded, 3.0);
            assert_eq!(told(&findings), []);
        }
        findings.begin();
        findings.begin();
        assert!(findings.notice(Detector::BusError, 3.0, 7, &mut Outputs::default()));
    }

    #[test]
    fn a_detector_is_told_of_once_for_as_long_as_it_fires() {
        let mut findings = Findings::new();
        for (fires, events) in [(true, 1), (true, 0), (false, 0), (true, 1)] {
            findings.begin();
            if fires {
                findings.report(Detector::BusError, State::Degraded, 3.0);
                findings.report(Detector::BusError, State::Degraded, 4.0);
            }
            assert_eq!(told(&findings), vec![(Detector::BusError as u32, 3.0); events]);
        }
    }
}
