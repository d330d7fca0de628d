//! A channel over the bus with planned faults, at its readers in this process: each message goes its way to every reader,
//! which checks it. It is the same for messages of this process and of others.

use crate::Tampering;
use crate::exchange::{append, seal};
use crate::frame::Frame;
use crate::receiver::Receiver;
use crate::tamper::Way;
use board::routes::{ROUTES, Route};
use board::{BoardId, Mail};
use messages::{Defect, Header, Ns};

/// One channel and its readers here.
pub(crate) struct Tampered {
    index: usize,
    /// Number of the next message sent here.
    seq: u32,
    ends: Vec<(BoardId, Way, Receiver)>,
}

impl Tampered {
    /// The route of that index to these readers, which has carried so many messages before.
    pub fn new(index: usize, readers: &[BoardId], tampering: &Tampering, carried: u32) -> Tampered {
        let from = ROUTES[index].from;
        let first = (carried == 0).then_some(0);
        let end = |to: &BoardId| (*to, tampering.way(from, *to), Receiver::new(from, tampering.max_age, first));
        Tampered { index, seq: carried, ends: readers.iter().map(end).collect() }
    }

    /// Index of its route.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Its route.
    pub fn route(&self) -> &'static Route {
        &ROUTES[self.index]
    }

    /// Seals and sends what a board of this process has to say at `now`.
    pub fn send(&mut self, now: Ns, mail: &Mail) {
        let Tampered { index, seq, ends } = self;
        let mut header = || {
            let header = Header { t: now, seq: *seq, crc: 0, wall_ns: 0 };
            *seq = seq.wrapping_add(1);
            header
        };
        seal(ROUTES[*index].kind, mail, &mut header, &mut |frame| {
            ends.iter_mut().for_each(|(_, way, _)| way.send(frame.clone()));
        });
    }

    /// A sealed message of another process.
    pub fn take(&mut self, frame: Frame) {
        self.ends.iter_mut().for_each(|(_, way, _)| way.send(frame.clone()));
    }

    /// A reader starts again.
    pub fn renew(&mut self, reader: BoardId) {
        for (_, way, receiver) in self.ends.iter_mut().filter(|(to, ..)| *to == reader) {
            way.clear();
            receiver.renew();
        }
    }

    /// What has come to a reader by `now`.
    pub fn check(&mut self, to: BoardId, now: Ns, inbox: &mut Mail, defects: &mut Vec<Defect>) {
        let kind = self.route().kind;
        for (_, way, receiver) in self.ends.iter_mut().filter(|(reader, ..)| *reader == to) {
            while let Some(message) = way.next(now) {
                if receiver.check(&message.frame, message.took, |defect| defects.push(defect)) {
                    append(kind, &message.frame.payload, inbox);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Domain, Exchange, Inboxes, Tamper, TamperKind, Tampering};
    use board::{BoardId, Mail};
    use messages::{BOARDS, BusWord, Defect};

    /// Words and defects at the control computer of 50 messages of the encoder cards, 5 ms apart.
    fn come(here: &mut Exchange, there: &mut Option<Exchange>) -> (Vec<BusWord>, Vec<Defect>) {
        let (mut at_a, mut at_b, mut defects) = (Inboxes::default(), Inboxes::default(), Vec::new());
        let to = BoardId::ControlComputer;
        for job in 0..50 {
            let now = 5_000_000 * u64::from(job);
            let mut mail = Mail::default();
            mail.words.push(BusWord { t: now, addr: 4, value: job, job, task: 0, index: 0 });
            here.deliver(BoardId::EncoderIf, now, &mail, &mut at_a).expect("deliver");
            match there {
                Some(there) => {
                    there.fetch(to, 0, &mut at_b, None).expect("fetch");
                    there.check(to, now, &mut at_b, &mut defects);
                }
                None => here.check(to, now, &mut at_b, &mut defects),
            }
        }
        (std::mem::take(&mut at_b[to as usize].words), defects)
    }

    #[test]
    fn the_same_befalls_messages_inside_a_process_and_between_two() {
        let from = BoardId::EncoderIf;
        let kinds = [TamperKind::Drop(0.2), TamperKind::BitFlip(2), TamperKind::Jitter(9_000_000), TamperKind::Reorder];
        let faults = (0..).zip(kinds).map(|(number, kind)| Tamper {
            number,
            from,
            kind,
            holds: vec![(20_000_000 * number as u64, 20_000_000 * number as u64 + 60_000_000)],
        });
        let tampering = Tampering { seed: 5, max_age: 1_000_000, faults: faults.collect() };
        let mut alone = Exchange::open(&BOARDS, None, |_| 0, &tampering).expect("local");
        let expected = come(&mut alone, &mut None);
        assert!(expected.0.len() < 50 && expected.1.len() > 10, "{expected:?}");

        let folder = tempfile::tempdir().expect("folder");
        let prefix = format!("m{}x_", std::process::id());
        let process_of = |board: BoardId| usize::from(board != from);
        {
            let domain = Domain::join(folder.path(), &prefix, "a").expect("domain");
            let mut a = Exchange::open(&[from], Some(&domain), process_of, &tampering).expect("open");
            let others: Vec<BoardId> = BOARDS.into_iter().filter(|board| *board != from).collect();
            let b = Exchange::open(&others, Some(&domain), process_of, &tampering).expect("open");
            assert_eq!(come(&mut a, &mut Some(b)), expected);
        }
        assert!(crate::remove_leftovers(&prefix).is_empty());
    }
}
