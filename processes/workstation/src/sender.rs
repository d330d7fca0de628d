//! Which command goes out at which poll: every one in order, once, unless it got lost.
//!
//! A command is due when its segment starts within the horizon. The control computer's state block says which epoch was
//! accepted last; what is still missing there after [`PATIENCE`] polls is sent again under the same epoch (the receiver
//! knows a repetition by it). After [`SENDINGS`] times a command is given up and the next ones take their turn.

use messages::Command;
use vme::Ns;

/// Polls that show a command as not accepted before it is .
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
            let done =
                self.commands[..self.sent].partition_point(|command| command.epoch <= accepted);
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

    fn settle(&mut self, settled: usize) {
        (self.settled, self.polls, self.sendings) = (settled, 0, 1);
    }
}
