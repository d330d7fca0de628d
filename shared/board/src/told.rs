//! Tells of what is wrong with messages, for boards that can do no more about it.

use messages::{Defect, Event, EventKind, Severity};
use vme::{MILLISECOND, Ns};

/// A defect that comes again sooner is no news.
const QUIET: Ns = 100 * MILLISECOND;
/// Detectors of messages.
const DETECTORS: usize = 3;

/// Which detectors fired when.
#[derive(Clone, Copy, Debug, Default)]
pub struct Told {
    last: [Option<(u32, Ns)>; DETECTORS],
}

impl Told {
    /// An event for each detector that has not fired of late.
    pub fn tell(&mut self, now: Ns, defects: &[Defect], events: &mut Vec<Event>) {
        for defect in defects {
            let number = defect.detector() as u32;
            let known = |entry: &&mut Option<(u32, Ns)>| entry.is_none_or(|(known, _)| known == number);
            let Some(entry) = self.last.iter_mut().find(known) else { continue };
            if entry.is_none_or(|(_, last)| now > last + QUIET) {
                let event = Event::new(now, EventKind::Detected, Severity::Warn, defect.figure, 0.0);
                events.push(event.because(Some(defect.detector())));
            }
            *entry = Some((number, now));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{BoardId, DefectKind, Detector};

    #[test]
    fn defects_that_go_on_are_told_of_once_a_detector() {
        let defect = |kind| Defect { from: BoardId::ControlComputer, kind, figure: 1.0 };
        let (mut told, mut events) = (Told::default(), Vec::new());
        for now in [0, 50, 100, 150, 300] {
            let defects = [defect(DefectKind::Corrupted), defect(DefectKind::Gap), defect(DefectKind::Repeated)];
            told.tell(now * MILLISECOND, &defects, &mut events);
        }
        let seen: Vec<_> = events.iter().map(|event| (event.t / MILLISECOND, event.cause)).collect();
        let (crc, sequence) = (Detector::Checksum as u32, Detector::Sequence as u32);
        assert_eq!(seen, [(0, crc), (0, sequence), (300, crc), (300, sequence)]);
    }
}
