//! The lines and counters of the seven channels: what is wrong with them, and what the cards see of it.
//!
//! Sound channels count what the shafts do and latch each index mark. The cards check themselves: an illegal change of A
//! and B, the level of the differential lines, and the counts from one index mark to the next.

use crate::counter::IndexLatch;
use crate::history::PerJoint;
use messages::JOINTS;
use messages::registers::encoder::{STATUS_INDEX, STATUS_LEVEL, STATUS_QUADRATURE};
use scenario::{FaultKind, Progress, Scenario, Schedule, Site};
use vme::Ns;

/// Turns without an index mark after which it is missed.
const MISSED_TURNS: f64 = 1.25;
/// Counts by which an illegal change of both tracks is wrong.
const ILLEGAL_COUNTS: f64 = 2.0;

/// All channels.
#[derive(Clone, Debug)]
pub struct Channels {
    schedule: Schedule,
    progress: Progress,
    channels: [Channel; JOINTS],
}

#[derive(Clone, Copy, Debug)]
struct Channel {
    counts_per_turn: f64,
    index: IndexLatch,
    /// Counts that the counter lacks.
    lost: f64,
    /// Of these at the last index mark that the card has seen.
    lost_at_mark: f64,
    /// Shaft angle at that mark, or where the shaft first was, counts.
    mark: Option<f64>,
    /// Content of the latch, counts.
    latched: f64,
    newest: f64,
    /// The shaft's angle when a wire came off.
    open_at: Option<f64>,
    status: u32,
}

impl Channels {
    /// The channels of this scenario, with so many counts in a turn of their shafts.
    pub fn new(scenario: &Scenario, counts_per_turn: PerJoint) -> Channels {
        let channel = |counts_per_turn| Channel {
            counts_per_turn,
            index: IndexLatch::new(counts_per_turn),
            lost: 0.0,
            lost_at_mark: 0.0,
            mark: None,
            latched: 0.0,
            newest: 0.0,
            open_at: None,
            status: 0,
        };
        Channels {
            schedule: Schedule::new(scenario, |site| matches!(site, Site::Encoder(_))),
            progress: Progress::default(),
            channels: counts_per_turn.map(channel),
        }
    }

    /// When a fault begins or ends next.
    pub fn next_fault(&self) -> Ns {
        self.schedule.next_change(&self.progress)
    }

    /// Lets the faults begin and end that do so up to `t`; `begins` is told the scenario's number of each that begins.
    pub fn advance(&mut self, t: Ns, mut begins: impl FnMut(usize, Ns)) {
        let Self { schedule, progress, channels } = self;
        schedule.advance(progress, t, |place, from| {
            let entry = &schedule.entries()[place];
            if let Site::Encoder(joint) = entry.site {
                let channel = &mut channels[joint];
                match entry.fault.kind {
                    FaultKind::LostCounts => channel.lost += entry.fault.amount.round(),
                    FaultKind::QuadratureError => {
                        channel.lost += ILLEGAL_COUNTS * entry.fault.amount.round();
                        channel.status |= STATUS_QUADRATURE;
                    }
                    _ => {}
                }
            }
            begins(entry.number, from);
        });
        for joint in 0..JOINTS {
            let open = self.holds(joint, FaultKind::WireBreak);
            let channel = &mut self.channels[joint];
            channel.open_at = open.then(|| channel.open_at.unwrap_or(channel.newest));
        }
    }

    fn holds(&self, joint: usize, kind: FaultKind) -> bool {
        let mut holding = self.schedule.holding(&self.progress);
        holding.any(|(_, entry)| entry.site == Site::Encoder(joint) && entry.fault.kind == kind)
    }

    /// Takes in the shafts' next angles, in counts.
    pub fn follow(&mut self, positions: &PerJoint) {
        let blind = |joint| self.holds(joint, FaultKind::IndexLoss) || self.is_open(joint);
        let blind: [bool; JOINTS] =
            if self.schedule.entries().is_empty() { [false; JOINTS] } else { core::array::from_fn(blind) };
        for ((channel, position), blind) in self.channels.iter_mut().zip(positions).zip(blind) {
            channel.follow(*position, blind);
        }
    }

    /// What the counter of a joint has counted when its shaft stands at `position`, counts.
    pub fn counted(&self, joint: usize, position: f64) -> f64 {
        let channel = &self.channels[joint];
        channel.open_at.unwrap_or(position) - channel.lost
    }

    /// Whether a wire of the joint's encoder is off.
    pub fn is_open(&self, joint: usize) -> bool {
        self.channels[joint].open_at.is_some()
    }

    /// Width at which the joint's counter wraps, where `bits` is that of a sound one.
    pub fn bits(&self, joint: usize, bits: u8) -> u8 {
        let wraps = self.schedule.holding(&self.progress).find(|(_, entry)| {
            entry.site == Site::Encoder(joint) && entry.fault.kind == FaultKind::Wrap
        });
        wraps.map_or(bits, |(_, entry)| (entry.fault.amount as u8).clamp(1, bits))
    }

    /// Count at the last index mark.
    pub fn latched(&self, joint: usize) -> f64 {
        self.channels[joint].latched
    }

    /// Status of a channel.
    pub fn status(&self, joint: usize) -> u32 {
        self.channels[joint].status | if self.is_open(joint) { STATUS_LEVEL } else { 0 }
    }

    /// Status of a channel, with what is latched cleared.
    pub fn take_status(&mut self, joint: usize) -> u32 {
        let status = self.status(joint);
        self.channels[joint].status = 0;
        status
    }
}

impl Channel {
    fn follow(&mut self, position: f64, blind: bool) {
        self.newest = position;
        let before = self.index.latched();
        self.index.follow(position);
        let mark = *self.mark.get_or_insert(position);
        if self.index.latched() != before && !blind {
            if self.lost != self.lost_at_mark {
                self.status |= STATUS_INDEX;
            }
            self.mark = Some(self.index.latched());
            self.lost_at_mark = self.lost;
            self.latched = self.index.latched() - self.lost;
        } else if (position - mark).abs() > MISSED_TURNS * self.counts_per_turn {
            self.status |= STATUS_INDEX;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first joint's channel under one fault from the start.
    fn channels(kind: &str, amount: f64) -> Channels {
        let fault = format!("fault=[{{ target='joint-1', kind='{kind}', start_s=0.0, amount={amount:?} }}]");
        let scenario = scenario::load("table-5-3", &[fault]).unwrap().scenario().unwrap();
        Channels::new(&scenario, [4000.0; JOINTS])
    }

    /// Turns the shafts by so many counts.
    fn turn(channels: &mut Channels, from: f64, counts: f64) {
        for step in 0..=100 {
            channels.follow(&[from + counts * f64::from(step) / 100.0; JOINTS]);
        }
    }

    #[test]
    fn a_sound_channel_that_turns_both_ways_reports_nothing() {
        let mut channels = channels("wire-break", 0.0);
        turn(&mut channels, 100.0, 20_000.0);
        turn(&mut channels, 20_100.0, -30_000.0);
        assert_eq!((0..JOINTS).map(|joint| channels.status(joint)).sum::<u32>(), 0);
        assert_eq!(channels.latched(0), -8_000.0);
    }

    #[test]
    fn lost_counts_show_at_the_next_index_mark_and_not_before() {
        let mut channels = channels("lost-counts", 30.0);
        turn(&mut channels, 100.0, 10.0);
        channels.advance(1, |_, _| {});
        assert_eq!(channels.counted(0, 110.0), 80.0);
        turn(&mut channels, 110.0, 3_800.0);
        assert_eq!(channels.status(0), 0);
        turn(&mut channels, 3_910.0, 200.0);
        assert_eq!((channels.status(0), channels.latched(0)), (STATUS_INDEX, 3_970.0));
        assert_eq!((channels.take_status(0), channels.status(0), channels.status(1)), (STATUS_INDEX, 0, 0));
        turn(&mut channels, 4_110.0, 9_000.0);
        assert_eq!(channels.status(0), 0, "told once");
    }

    #[test]
    fn an_index_that_does_not_come_is_missed_after_a_turn_and_a_quarter() {
        let mut channels = channels("index-loss", 0.0);
        channels.advance(1, |_, _| {});
        turn(&mut channels, 100.0, 4_900.0);
        assert_eq!(channels.status(0), 0);
        turn(&mut channels, 5_000.0, 200.0);
        assert_eq!((channels.status(0), channels.status(1)), (STATUS_INDEX, 0));
    }

    #[test]
    fn both_tracks_at_once_and_an_open_wire_show_at_once() {
        let mut illegal = channels("quadrature-error", 3.0);
        illegal.advance(1, |_, _| {});
        assert_eq!((illegal.take_status(0), illegal.status(0)), (STATUS_QUADRATURE, 0));
        assert_eq!(illegal.counted(0, 50.0), 44.0);
        let mut open = channels("wire-break", 0.0);
        open.follow(&[70.0; JOINTS]);
        open.advance(1, |_, _| {});
        assert_eq!((open.take_status(0), open.status(0)), (STATUS_LEVEL, STATUS_LEVEL));
        assert_eq!(open.counted(0, 500.0), 70.0);
    }

    #[test]
    fn a_counter_may_wrap_too_early() {
        let mut channels = channels("wrap", 10.0);
        assert_eq!(channels.bits(0, 24), 24);
        channels.advance(1, |_, _| {});
        assert_eq!((channels.bits(0, 24), channels.bits(1, 24)), (10, 24));
    }
}
