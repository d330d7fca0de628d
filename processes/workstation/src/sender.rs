//! Which command goes out at which poll: every one in order, once, unless it got lost.
//!
//! A command is due when its segment starts within the horizon. The control computer's state block says which epoch was
//! accepted last; what is still missing there after [`PATIENCE`] polls is sent again under the same epoch (the receiver
//! knows a repetition by it). After [`SENDINGS`] times a command is given up and the next ones take their turn.
//!
//! After a stop nothing of what was sent counts any longer: commands then go on with the epoch behind the one accepted last,
//! whoever accepted it. So they do where the console is started again: the plan alone does not tell how far the task is, nor
//! how much later than planned.

use messages::{Command, CommandKind, PathKind};
use vme::Ns;

/// Polls that show a command as not accepted before it is sent again.
pub const PATIENCE: u32 = 3;

/// How often a command is sent at most.
pub const SENDINGS: u32 = 4;

/// What to do at a poll.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Poll {
    /// First and last + 1 of the commands to send.
    pub send: (usize, usize),
    /// Epoch of a command that is given up now.
    pub given_up: Option<u32>,
}

/// Progress through the commands.
#[derive(Clone, Debug)]
pub struct Sender {
    /// One per segment of the task, as planned.
    plan: Vec<Command>,
    commands: Vec<Command>,
    horizon: Ns,
    /// Commands that need no more care: accepted or given up.
    settled: usize,
    /// Commands sent at least once.
    sent: usize,
    /// Polls since the oldest open command was sent, that showed it as not accepted.
    polls: u32,
    /// How often that command was sent.
    sendings: u32,
}

impl Sender {
    /// Sends these commands, each when its segment starts within `horizon`.
    pub fn new(commands: Vec<Command>, horizon: Ns) -> Sender {
        Sender {
            plan: commands.clone(),
            commands,
            horizon,
            settled: 0,
            sent: 0,
            polls: 0,
            sendings: 0,
        }
    }

    /// The commands, in order.
    pub fn commands(&self) -> &[Command] {
        &self.commands
    }

    /// A poll at `now` found `accepted` as the epoch accepted last; `None` where the state block did not come.
    pub fn poll(&mut self, now: Ns, accepted: Option<u32>) -> Poll {
        let mut poll = Poll::default();
        if let Some(accepted) = accepted {
            let done = self.commands.partition_point(|command| command.epoch <= accepted);
            // whoever has sent them
            self.sent = self.sent.max(done);
            if done > self.settled {
                self.settle(done);
            } else if self.settled < self.sent {
                self.polls += 1;
            }
        }
        let mut first = self.sent;
        if self.polls >= PATIENCE {
            if self.sendings >= SENDINGS {
                poll.given_up = Some(self.commands[self.settled].epoch);
                self.settle(self.settled + 1);
            } else {
                first = self.settled;
                self.sendings += 1;
                self.polls = 0;
            }
        }
        let idle = self.settled == self.sent;
        self.sent += self.commands[self.sent..]
            .iter()
            .take_while(|c| c.start <= now + self.horizon)
            .count();
        if idle && self.sent > self.settled {
            (self.polls, self.sendings) = (0, 1);
        }
        poll.send = (first, self.sent);
        poll
    }

    /// Acknowledges a stop, with the next poll; epoch `accepted` was accepted last.
    pub fn acknowledge(&mut self, accepted: u32) {
        let acknowledge = CommandKind::Acknowledge as u32;
        let Some(model) = self.plan.first() else { return };
        self.begin_anew(vec![Command { epoch: accepted.wrapping_add(1), kind: acknowledge, start: 0, ..*model }]);
    }

    /// Has the task go on with this segment from `start` on: it and those behind it last as long as planned.
    pub fn go_on_with(&mut self, segment: u32, start: Ns, accepted: u32) {
        let commands = self.moved(segment, start, accepted);
        self.begin_anew(commands);
    }

    /// Has the task go on behind this segment, which starts at `start` and has been accepted with epoch `accepted`.
    pub fn go_on_behind(&mut self, segment: u32, start: Ns, accepted: u32) {
        let mut commands = self.moved(segment, start, accepted.wrapping_sub(1));
        commands.drain(..commands.len().min(1));
        self.begin_anew(commands);
    }

    /// The commands from this segment on, which starts at `start`, with the epochs behind `accepted`.
    fn moved(&self, segment: u32, start: Ns, accepted: u32) -> Vec<Command> {
        let left = self.plan.iter().skip_while(|command| command.segment != segment);
        let planned = left.clone().next().map_or(0, |first| first.start);
        let moved = |t: Ns| start.saturating_add(t - planned);
        let again = |(further, command): (u32, &Command)| Command {
            epoch: accepted.wrapping_add(further),
            start: moved(command.start),
            end: moved(command.end),
            ..*command
        };
        (1..).zip(left).map(again).collect()
    }

    fn begin_anew(&mut self, commands: Vec<Command>) {
        self.commands = commands;
        (self.settled, self.sent, self.polls, self.sendings) = (0, 0, 0, 0);
    }

    /// The newest command sent so far.
    pub fn newest_sent(&self) -> Option<Command> {
        self.sent.checked_sub(1).map(|last| self.commands[last])
    }

    /// Sends a command that nobody meant, as the next one: the tool is to jump by `step` (m) into the surface at once, where
    /// the newest segment sent put it. Those that follow it count on from it.
    pub fn interpose(&mut self, now: Ns, step: f64) {
        let Some(model) = self.newest_sent().or(self.commands.first().copied()) else { return };
        let kind = CommandKind::Segment as u32;
        let mut wrong = Command { kind, path: PathKind::Step as u32, start: now, end: now + 1_000_000_000, move_time: 0, ..model };
        wrong.position[2] += step;
        wrong.epoch = match self.commands.get(self.sent) {
            Some(next) => next.epoch,
            None => model.epoch.wrapping_add(1),
        };
        self.commands.insert(self.sent, wrong);
        self.commands[self.sent + 1..].iter_mut().for_each(|command| command.epoch = command.epoch.wrapping_add(1));
    }

    fn settle(&mut self, settled: usize) {
        (self.settled, self.polls, self.sendings) = (settled, 0, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Ns = 1_000_000_000;

    /// Commands whose segments start at these seconds.
    fn commands(starts: &[u64]) -> Vec<Command> {
        (1..)
            .zip(starts)
            .map(|(epoch, start)| Command {
                epoch,
                start: start * SECOND,
                ..bytemuck::Zeroable::zeroed()
            })
            .collect()
    }

    #[test]
    fn after_a_stop_the_epochs_go_on_behind_the_one_accepted_last_and_the_times_from_the_new_start() {
        let mut plan = commands(&[0, 3, 7]);
        (0..).zip(&mut plan).for_each(|(i, command)| {
            (command.segment, command.end) = (i, command.start + 2 * SECOND);
        });
        let mut sender = Sender::new(plan, 2 * SECOND);
        sender.poll(4 * SECOND, Some(0));
        sender.acknowledge(2);
        let Poll { send: (first, end), .. } = sender.poll(9 * SECOND, Some(2));
        let sent: Vec<_> = sender.commands()[first..end].iter().map(|sent| (sent.epoch, sent.kind)).collect();
        assert_eq!(sent, [(3, CommandKind::Acknowledge as u32)]);
        sender.go_on_with(1, 10 * SECOND, 3);
        let times: Vec<_> = sender.commands().iter().map(|again| (again.epoch, again.start, again.end)).collect();
        assert_eq!(times, [(4, 10 * SECOND, 12 * SECOND), (5, 14 * SECOND, 16 * SECOND)]);
        assert_eq!(sender.poll(9 * SECOND, Some(3)).send, (0, 1));
        assert_eq!(sender.poll(12 * SECOND, Some(4)).send, (1, 2));
    }

    #[test]
    fn a_console_that_is_started_again_goes_on_behind_the_last_segment_known_however_late_that_is() {
        let mut plan = commands(&[0, 3, 7]);
        (0..).zip(&mut plan).for_each(|(i, command)| {
            (command.segment, command.end) = (i, command.start + 2 * SECOND);
        });
        let mut sender = Sender::new(plan, 2 * SECOND);
        // the second segment, five seconds late, with the epoch that it has after a stop
        sender.go_on_behind(1, 8 * SECOND, 6);
        let times: Vec<_> = sender.commands().iter().map(|again| (again.epoch, again.start, again.end)).collect();
        assert_eq!(times, [(7, 12 * SECOND, 14 * SECOND)]);
        assert_eq!(sender.poll(9 * SECOND, Some(6)).send, (0, 0));
        assert_eq!(sender.poll(10 * SECOND, Some(6)).send, (0, 1));
        for (segment, start) in [(2, 7 * SECOND), (9, 1), (u32::MAX, Ns::MAX)] {
            sender.go_on_behind(segment, start, 7);
            assert_eq!(sender.commands(), [], "nothing is behind segment {segment}");
        }
    }

    #[test]
    fn an_epoch_at_the_end_of_its_range_breaks_nothing() {
        let mut sender = Sender::new(commands(&[0, 3, 7]), 2 * SECOND);
        for accepted in [u32::MAX, u32::MAX - 1] {
            sender.go_on_behind(0, Ns::MAX, accepted);
            sender.acknowledge(accepted);
            sender.go_on_with(0, SECOND, accepted);
            for t in 0..20 {
                sender.poll(t * SECOND, Some(accepted));
            }
            sender.interpose(20 * SECOND, 0.1);
        }
    }

    fn nothing() -> Poll {
        Poll {
            send: (0, 0),
            given_up: None,
        }
    }

    #[test]
    fn a_command_is_sent_once_when_its_segment_comes_within_the_horizon() {
        let mut sender = Sender::new(commands(&[0, 3, 3, 9]), 2 * SECOND);
        let mut sent = Vec::new();
        for second in 0..12 {
            let accepted = sent.len() as u32;
            let Poll {
                send: (first, end),
                given_up,
            } = sender.poll(second * SECOND, Some(accepted));
            assert_eq!(given_up, None);
            sent.extend((first..end).map(|i| (second, sender.commands()[i].epoch)));
        }
        assert_eq!(sent, [(0, 1), (1, 2), (1, 3), (7, 4)]);
    }

    #[test]
    fn a_command_not_accepted_is_sent_again_with_all_that_followed_it_and_then_given_up() {
        let mut sender = Sender::new(commands(&[0, 0, 0]), SECOND);
        let mut sendings = Vec::new();
        let mut given_up = None;
        for poll in 0..30 {
            // the second never arrives
            let Poll {
                send: (first, end),
                given_up: lost,
            } = sender.poll(poll, Some(if poll == 0 { 0 } else { 1 }));
            sendings.extend((first..end).map(|i| (poll, sender.commands()[i].epoch)));
            if lost.is_some() {
                given_up = Some((poll, lost));
                break;
            }
        }
        assert_eq!(
            sendings,
            [
                (0, 1),
                (0, 2),
                (0, 3),
                (4, 2),
                (4, 3),
                (7, 2),
                (7, 3),
                (10, 2),
                (10, 3)
            ]
        );
        assert_eq!(given_up, Some((13, Some(2))));
    }

    #[test]
    fn after_a_command_is_given_up_the_next_ones_are_cared_for() {
        let mut sender = Sender::new(commands(&[0, 0, 5]), SECOND);
        let mut lost = Vec::new();
        for poll in 0..100 {
            lost.extend(sender.poll(poll, Some(0)).given_up);
        }
        assert_eq!(lost, [1, 2]);
        assert_eq!(sender.poll(6 * SECOND, Some(0)).send, (2, 3));
    }

    #[test]
    fn a_late_acceptance_ends_the_repetition() {
        let mut sender = Sender::new(commands(&[0]), SECOND);
        assert_eq!(sender.poll(0, Some(0)).send, (0, 1));
        for _ in 0..2 {
            assert_eq!(sender.poll(1, Some(0)).send, (1, 1));
        }
        assert_eq!(sender.poll(2, Some(0)).send, (0, 1));
        for _ in 0..20 {
            assert_eq!(
                sender.poll(3, Some(1)),
                Poll {
                    send: (1, 1),
                    given_up: None
                }
            );
        }
    }

    #[test]
    fn polls_without_a_state_block_do_not_count() {
        let mut sender = Sender::new(commands(&[0]), SECOND);
        sender.poll(0, None);
        for _ in 0..50 {
            assert_eq!(
                sender.poll(1, None),
                Poll {
                    send: (1, 1),
                    given_up: None
                }
            );
        }
    }

    #[test]
    fn a_scenario_without_segments_sends_nothing() {
        let mut sender = Sender::new(Vec::new(), SECOND);
        assert_eq!(sender.poll(0, Some(0)), nothing());
    }
}
