//! The operator at the console: sees the arm stopped, waits until it could move again, acknowledges, and has the task go on.
//!
//! The control computer says whether a stop could be acknowledged (its cause gone, the arm at rest). Once it has said so at
//! every poll for as long as the operator waits, the operator acknowledges; an acknowledgement that comes to nothing is
//! given again after another wait. When the arm is under control again, the task goes on with the segment that was
//! interrupted.

use messages::Telemetry;
use vme::Ns;

/// What to do at a poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Send what is due.
    Carry,
    /// The arm is stopped: send no segment.
    Wait,
    /// Acknowledge the stop.
    Acknowledge,
    /// The arm is under control again: have the task go on with this segment.
    GoOn(u32),
}

/// What the operator remembers.
#[derive(Clone, Debug)]
pub struct Operator {
    /// How long the operator waits; none = for ever.
    patience: Option<Ns>,
    /// The arm was stopped at the last poll.
    stopped: bool,
    /// Since when the stop could be acknowledged.
    clear_since: Option<Ns>,
    /// The segment that began last.
    segment: u32,
}

impl Operator {
    /// One who waits for so long.
    pub fn new(patience: Option<Ns>) -> Operator {
        Operator { patience, stopped: false, clear_since: None, segment: 0 }
    }

    /// A poll at `now` found this state block; none where it did not come.
    pub fn look(&mut self, now: Ns, block: Option<&Telemetry>) -> Act {
        let Some(block) = block else {
            self.clear_since = None;
            return if self.stopped { Act::Wait } else { Act::Carry };
        };
        if block.segment != u32::MAX {
            self.segment = block.segment;
        }
        if !block.is_stopped() {
            self.clear_since = None;
            return if std::mem::take(&mut self.stopped) { Act::GoOn(self.segment) } else { Act::Carry };
        }
        self.stopped = true;
        let since = match block.is_clear() {
            true => *self.clear_since.get_or_insert(now),
            false => {
                self.clear_since = None;
                return Act::Wait;
            }
        };
        if self.patience.is_some_and(|patience| now - since >= patience) {
            self.clear_since = None;
            return Act::Acknowledge;
        }
        Act::Wait
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STO: u32 = 4;
    const CLEAR: u32 = STO | Telemetry::CLEAR;

    fn block(segment: u32, state: u32) -> Option<Telemetry> {
        Some(Telemetry { segment, state, ..bytemuck::Zeroable::zeroed() })
    }

    fn look(operator: &mut Operator, polls: &[Option<Telemetry>]) -> Vec<Act> {
        (0..).zip(polls).map(|(now, block)| operator.look(now, block.as_ref())).collect()
    }

    #[test]
    fn a_stop_is_acknowledged_once_it_has_been_clear_for_the_whole_wait_and_the_interrupted_segment_begins_again() {
        let polls = [
            block(2, 0),
            block(2, STO),
            block(2, CLEAR),
            block(2, STO),
            block(2, CLEAR),
            block(2, CLEAR),
            block(2, CLEAR),
            block(2, 0),
            block(2, 0),
        ];
        use Act::*;
        let acts = [Carry, Wait, Wait, Wait, Wait, Wait, Acknowledge, GoOn(2), Carry];
        assert_eq!(look(&mut Operator::new(Some(2)), &polls), acts);
    }

    #[test]
    fn an_acknowledgement_that_comes_to_nothing_is_given_again_after_another_wait() {
        let acts = look(&mut Operator::new(Some(1)), &[block(0, CLEAR); 5]);
        use Act::*;
        assert_eq!(acts, [Wait, Acknowledge, Wait, Acknowledge, Wait]);
    }

    #[test]
    fn nobody_acknowledges_unless_asked_to_nor_while_the_state_block_does_not_come() {
        assert_eq!(look(&mut Operator::new(None), &[block(0, CLEAR); 9]), [Act::Wait; 9]);
        let polls = [block(0, CLEAR), None, block(0, CLEAR), None, block(0, CLEAR)];
        assert_eq!(look(&mut Operator::new(Some(1)), &polls), [Act::Wait; 5]);
    }

    #[test]
    fn a_new_control_computer_knows_no_segment_and_the_one_seen_before_begins_again() {
        let polls = [block(3, 0), None, block(u32::MAX, STO), block(u32::MAX, 0)];
        use Act::*;
        assert_eq!(look(&mut Operator::new(Some(0)), &polls), [Carry, Carry, Wait, GoOn(3)]);
    }
}
