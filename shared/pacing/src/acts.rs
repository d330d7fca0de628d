//! Stamps of the acts that make a control cycle, each taken where the board acts: what the arm showed, when it was read,
//! when the control computer decided, when the D/A took the answer.
//!
//! Only for measuring: without it a host keeps none of this. In simulated time the wall stamps are 0.

use board::routes::ROUTES;
use board::{BoardId, Inputs, Ns, Outputs};
use messages::{Grant, Kind, Span, SpanKind};
use std::collections::VecDeque;

/// Messages of the arm that a reading may still go back to.
const KEPT: usize = 64;

/// The acts of one process's boards.
#[derive(Default)]
pub(crate) struct Acts {
    /// Acts since they were last taken.
    pub spans: Vec<Span>,
    /// Newest sample of each message of the arm, and when it was sent.
    shown: VecDeque<(Ns, u64)>,
    /// The newest sample seen here.
    newest: Ns,
}

impl Acts {
    /// The spans from that one on are of messages that have just come.
    pub fn came(&mut self, first: usize) {
        for i in first..self.spans.len() {
            let hop = self.spans[i];
            if ROUTES[hop.channel as usize].kind == Kind::Plant {
                self.shown(hop.t, hop.begin);
            }
        }
    }

    /// The arm has sent its samples up to `t`.
    fn shown(&mut self, t: Ns, sent: u64) {
        if self.shown.len() == KEPT {
            self.shown.pop_front();
        }
        self.shown.push_back((t, sent));
    }

    /// A board has acted from `begin` to `end` on the wall clock.
    pub fn stepped(&mut self, board: BoardId, grant: &Grant, inputs: &Inputs, outputs: &Outputs, begin: u64, end: u64) {
        let span = |kind| Span { window: grant.window, begin, end, ..Span::new(kind, board) };
        match board {
            BoardId::HwSim => {
                if let Some(newest) = outputs.mail.plant.last() {
                    self.shown(newest.t, end);
                }
            }
            BoardId::ForceSensorIf => {
                let mut job = None;
                for word in &outputs.mail.words {
                    // a job's first reading is its oldest
                    if job.replace((word.task, word.job)) == Some((word.task, word.job)) {
                        continue;
                    }
                    let at_or_before = inputs.mail.plant.iter().rev().map(|sample| sample.t).find(|t| *t <= word.t);
                    let origin = at_or_before.unwrap_or(self.newest);
                    let sent = self.shown.iter().find(|(newest, _)| *newest >= origin).map_or(begin, |(_, sent)| *sent);
                    let number = word.job.into();
                    self.spans.push(Span { t: word.t, origin, number, begin: sent, ..span(SpanKind::Read) });
                }
                self.newest = inputs.mail.plant.last().map_or(self.newest, |sample| sample.t);
            }
            BoardId::ControlComputer => {
                let probes = outputs.mail.control_probe.iter();
                let decisions =
                    probes.map(|probe| Span { t: probe.t, number: probe.job.into(), ..span(SpanKind::Decision) });
                self.spans.extend(decisions);
            }
            BoardId::DaIo => {
                let writes = inputs.transfers.iter().filter(|transfer| !transfer.is_read() && transfer.is_ok());
                for write in writes {
                    let number = write.job.into();
                    let output = Span { t: write.data_at, number, ..span(SpanKind::Output) };
                    match self.spans.last_mut() {
                        // of a job's writes the last one counts
                        Some(last)
                            if last.kind == output.kind && last.number == number && last.window == output.window =>
                        {
                            *last = output;
                        }
                        _ => self.spans.push(output),
                    }
                }
            }
            _ => {}
        }
    }
}
