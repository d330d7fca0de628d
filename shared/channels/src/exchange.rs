//! The mail of one process: what its boards send goes to the boards beside them and to other processes.

use crate::domain::{DOWN_WORD, REBORN_WORD};
use crate::frame::Frame;
use crate::page::Page;
use crate::tampered::Tampered;
use crate::{ChannelError, Domain, Port, Sender, Tampering, wall_ns};
use board::routes::{ROUTES, Route};
use board::{BoardId, Mail};
use messages::*;
use std::fmt::Debug;
use std::sync::atomic::Ordering;

/// Mail that waits for each board, by [`BoardId`] number.
pub type Inboxes = [Mail; BOARDS.len()];

/// Messages that a reader may leave unread: the recorder lags by up to 64 windows, masters by the windows between two decisions.
const BUFFER: usize = 160;
/// Elements of a message that is allocated beforehand; longer ones allocate once.
const LENGTH: usize = 64;

/// All channels of one process.
#[derive(Default)]
pub struct Exchange {
    local: Vec<(Route, Vec<BoardId>)>,
    /// By index of their route.
    outlets: Vec<(usize, Box<dyn Outlet>)>,
    inlets: Vec<(usize, Box<dyn Inlet>)>,
    /// Channels with planned faults, at their readers here.
    tampered: Vec<Tampered>,
    /// How many messages each route has carried to other processes, and how many of them each inlet has seen: a look at
    /// the number is cheaper than one into an empty channel.
    tally: Option<Page>,
    seen: Vec<u32>,
    /// Boards that are down, as the outlets know them.
    down: u32,
    /// Messages say when they were sent on the wall clock.
    stamped: bool,
}

trait Outlet {
    /// Sends at simulated time `now`, `wall_ns` on the wall clock.
    fn send(&mut self, now: Ns, mail: &Mail, wall_ns: u64) -> Result<(), ChannelError>;
    /// Messages sent so far.
    fn sent(&self) -> u32;
    /// Messages need not reach these boards, a bit each, and only these.
    fn expect_all_but(&mut self, down: u32);
}

trait Inlet {
    fn readers(&self) -> &[BoardId];
    /// Takes up to so many messages; `arrived` hears each one's header.
    fn receive(
        &mut self,
        messages: u32,
        inboxes: &mut Inboxes,
        arrived: &mut dyn FnMut(&Header),
    ) -> Result<(), ChannelError>;
    /// Throws away what is there, and takes the next message whatever its number.
    fn renew(&mut self) -> Result<(), ChannelError>;
    /// Takes up to so many sealed messages as they are.
    fn receive_sealed(
        &mut self,
        messages: u32,
        tampered: &mut Tampered,
        arrived: &mut dyn FnMut(&Header),
    ) -> Result<(), ChannelError>;
}

/// A kind of payload: where it lies in a [`Mail`].
pub(crate) trait Payload: bytemuck::Pod + Debug {
    fn of(mail: &Mail) -> &[Self];
    fn of_mut(mail: &mut Mail) -> &mut Vec<Self>;
    fn newest(&self) -> u64;
}

macro_rules! payloads {
    ($($kind:ident $payload:ident $field:ident $time:ident;)*) => {
        $(impl Payload for $payload {
            fn of(mail: &Mail) -> &[Self] { &mail.$field }
            fn of_mut(mail: &mut Mail) -> &mut Vec<Self> { &mut mail.$field }
            fn newest(&self) -> u64 { self.$time }
        })*

        fn open_outlet(kind: Kind, domain: &Domain, name: &str, readers: Vec<BoardId>, processes: usize, carried: u32, sealed: bool) -> Result<Box<dyn Outlet>, ChannelError> {
            Ok(match kind { $(Kind::$kind => Box::new(TypedOutlet::<$payload>::open(domain, name, readers, processes, carried, sealed)?),)* })
        }

        fn open_inlet(kind: Kind, domain: &Domain, name: &str, readers: Vec<BoardId>, processes: usize, carried: u32) -> Result<Box<dyn Inlet>, ChannelError> {
            Ok(match kind { $(Kind::$kind => Box::new(TypedInlet::<$payload>::open(domain, name, readers, processes, carried)?),)* })
        }

        fn copy(kind: Kind, from: &Mail, to: &mut Mail) {
            match kind { $(Kind::$kind => to.$field.extend_from_slice(&from.$field),)* }
        }

        /// Hands each message that this mail makes to `take`, sealed.
        pub(crate) fn seal(kind: Kind, mail: &Mail, header: &mut dyn FnMut() -> Header, take: &mut dyn FnMut(Frame)) {
            match kind { $(Kind::$kind => mail.$field.chunks(LENGTH).for_each(|part| take(Frame::sealed(header(), part))),)* }
        }

        /// The elements of a message's payload, byte for byte.
        pub(crate) fn append(kind: Kind, payload: &[u8], to: &mut Mail) {
            match kind { $(Kind::$kind => {
                let elements = payload.chunks_exact(size_of::<$payload>());
                to.$field.extend(elements.map(bytemuck::pod_read_unaligned::<$payload>));
            })* }
        }
    };
}

payloads! {
    Amplifier AmplifierCommand amplifier t;
    Plant PlantSample plant t;
    Words BusWord words t;
    Commands Command commands start;
    Telemetry Telemetry telemetry t;
    PlantProbe PlantProbe plant_probe t;
    ControlProbe ControlProbe control_probe t;
    Events Event events t;
    Transfers TransferRecord transfers data_at;
    Masters MasterUse masters t;
    Paths SensorPath paths t;
}

struct TypedOutlet<T: Payload> {
    sender: Sender<T, Header>,
    seq: u32,
    readers: Vec<BoardId>,
    sealed: bool,
}

impl<T: Payload> TypedOutlet<T> {
    /// `carried`: messages that the channel has carried before.
    fn open(
        domain: &Domain,
        name: &str,
        readers: Vec<BoardId>,
        processes: usize,
        carried: u32,
        sealed: bool,
    ) -> Result<Self, ChannelError> {
        let sender = Sender::open(domain, name, processes, BUFFER, LENGTH)?;
        Ok(TypedOutlet { sender, seq: carried, readers, sealed })
    }
}

impl<T: Payload> Outlet for TypedOutlet<T> {
    fn send(&mut self, now: Ns, mail: &Mail, wall_ns: u64) -> Result<(), ChannelError> {
        for payload in T::of(mail).chunks(LENGTH) {
            let t = if self.sealed { now } else { payload.last().map_or(0, Payload::newest) };
            let mut header = Header { t, seq: self.seq, crc: 0, wall_ns };
            if self.sealed {
                header = Frame::sealed(header, payload).header;
            }
            self.sender.send(&header, payload)?;
            self.seq = self.seq.wrapping_add(1);
        }
        Ok(())
    }

    fn sent(&self) -> u32 {
        self.seq
    }

    fn expect_all_but(&mut self, down: u32) {
        let up = self.readers.iter().filter(|reader| down >> **reader as u32 & 1 == 0);
        self.sender.expect_readers(up.count());
    }
}

struct TypedInlet<T: Payload> {
    port: Port<T, Header>,
    /// Number of the next message, where it is known.
    expected: Option<u32>,
    readers: Vec<BoardId>,
}

impl<T: Payload> TypedInlet<T> {
    /// `carried`: messages that the channel has carried before. The first one that is seen then counts as the one expected.
    fn open(
        domain: &Domain,
        name: &str,
        readers: Vec<BoardId>,
        processes: usize,
        carried: u32,
    ) -> Result<Self, ChannelError> {
        let expected = (carried == 0).then_some(0);
        Ok(TypedInlet { port: Port::open(domain, name, processes, BUFFER)?, expected, readers })
    }
}

impl<T: Payload> Inlet for TypedInlet<T> {
    fn readers(&self) -> &[BoardId] {
        &self.readers
    }

    fn receive(
        &mut self,
        messages: u32,
        inboxes: &mut Inboxes,
        arrived: &mut dyn FnMut(&Header),
    ) -> Result<(), ChannelError> {
        let Self { port, expected, readers } = self;
        let mut gap = None;
        // an end that was opened late has missed the first ones
        port.receive_up_to(messages, |header, payload| {
            arrived(header);
            if let Some(expected) = expected.filter(|expected| *expected != header.seq) {
                gap = Some((expected, header.seq));
            }
            *expected = Some(header.seq.wrapping_add(1));
            let (first, others) = readers.split_at(1);
            let inbox = T::of_mut(&mut inboxes[first[0] as usize]);
            let start = inbox.len();
            inbox.extend(payload);
            for other in others {
                let (from, to) = two(inboxes, first[0] as usize, *other as usize);
                T::of_mut(to).extend_from_slice(&T::of(from)[start..]);
            }
        })?;
        match gap {
            Some((expected, found)) => Err(ChannelError::Lost { channel: port.name().to_owned(), expected, found }),
            None => Ok(()),
        }
    }

    fn renew(&mut self) -> Result<(), ChannelError> {
        self.expected = None;
        self.port.receive_up_to(u32::MAX, |_, _| {})
    }

    fn receive_sealed(
        &mut self,
        messages: u32,
        tampered: &mut Tampered,
        arrived: &mut dyn FnMut(&Header),
    ) -> Result<(), ChannelError> {
        self.port.receive_up_to(messages, |header, payload| {
            arrived(header);
            let payload = payload.flat_map(bytemuck::bytes_of).copied().collect();
            tampered.take(Frame { header: *header, payload });
        })
    }
}

fn two(inboxes: &mut Inboxes, a: usize, b: usize) -> (&Mail, &mut Mail) {
    if a < b {
        let (left, right) = inboxes.split_at_mut(b);
        (&left[a], &mut right[0])
    } else {
        let (left, right) = inboxes.split_at_mut(a);
        (&right[0], &mut left[b])
    }
}

impl Exchange {
    /// The channels of a process that hosts the boards `here`; `process_of` gives every board's process by number.
    /// Without a domain every board must be here. Channels over the bus that `tampering` touches are sealed and checked.
    pub fn open(
        here: &[BoardId],
        domain: Option<&Domain>,
        process_of: impl Fn(BoardId) -> usize,
        tampering: &Tampering,
    ) -> Result<Exchange, ChannelError> {
        let mut exchange = Exchange { tally: domain.map(|domain| domain.tally.clone()), ..Exchange::default() };
        for (index, route) in ROUTES.iter().enumerate() {
            let readers: Vec<BoardId> = route.to.iter().copied().filter(|reader| here.contains(reader)).collect();
            let away: Vec<BoardId> =
                route.to.iter().copied().filter(|reader| process_of(*reader) != process_of(route.from)).collect();
            let mut processes: Vec<usize> = away.iter().map(|reader| process_of(*reader)).collect();
            processes.sort_unstable();
            processes.dedup();
            let name = format!("{}/{:?}", route.from.name(), route.kind).to_lowercase();
            // not 0 in a process that is started again
            let carried = domain.map_or(0, |domain| domain.tally.word(index).load(Ordering::SeqCst));
            let sealed = route.is_bus() && tampering.touches(route.from);
            if sealed && !readers.is_empty() {
                exchange.tampered.push(Tampered::new(index, &readers, tampering, carried));
            }
            if here.contains(&route.from) {
                if let (Some(domain), false) = (domain, processes.is_empty()) {
                    // one reader board stands for each process
                    let mut ends = away.clone();
                    ends.dedup_by_key(|board| process_of(*board));
                    exchange
                        .outlets
                        .push((index, open_outlet(route.kind, domain, &name, ends, processes.len(), carried, sealed)?));
                }
                if !readers.is_empty() && !sealed {
                    exchange.local.push((*route, readers));
                }
            } else if let (Some(domain), false) = (domain, readers.is_empty()) {
                exchange.inlets.push((index, open_inlet(route.kind, domain, &name, readers, processes.len(), carried)?));
                exchange.seen.push(carried);
            }
        }
        Ok(exchange)
    }

    /// Carries what `from` sent at simulated time `now` to the boards beside it and to other processes.
    pub fn deliver(&mut self, from: BoardId, now: Ns, mail: &Mail, inboxes: &mut Inboxes) -> Result<(), ChannelError> {
        for (route, readers) in self.local.iter().filter(|(route, _)| route.from == from) {
            for reader in readers {
                copy(route.kind, mail, &mut inboxes[*reader as usize]);
            }
        }
        for tampered in self.tampered.iter_mut().filter(|tampered| tampered.route().from == from) {
            tampered.send(now, mail);
        }
        if let Some(tally) = &self.tally {
            let down = tally.word(DOWN_WORD).load(Ordering::SeqCst);
            if down != self.down {
                self.down = down;
                self.outlets.iter_mut().for_each(|(_, outlet)| outlet.expect_all_but(down));
            }
        }
        let wall_ns = if self.stamped { wall_ns() } else { 0 };
        for (route, outlet) in self.outlets.iter_mut().filter(|(route, _)| ROUTES[*route].from == from) {
            let before = outlet.sent();
            outlet.send(now, mail, wall_ns)?;
            let sent = outlet.sent().wrapping_sub(before);
            if let Some(tally) = self.tally.as_ref().filter(|_| sent > 0) {
                tally.word(*route).fetch_add(sent, Ordering::SeqCst);
            }
        }
        Ok(())
    }

    /// Takes in what other processes sent to `to`, which has acted up to `stepped_to`. Where transport is measured, `hops`
    /// gets each message; what is not newer than `stepped_to` has come late.
    pub fn fetch(
        &mut self,
        to: BoardId,
        stepped_to: Ns,
        inboxes: &mut Inboxes,
        mut hops: Option<&mut Vec<Span>>,
    ) -> Result<(), ChannelError> {
        let Self { inlets, tally, seen, tampered, .. } = self;
        let before = hops.as_ref().map_or(0, |hops| hops.len());
        let inlets = inlets.iter_mut().zip(seen).filter(|((_, inlet), _)| inlet.readers().contains(&to));
        for ((route, inlet), seen) in inlets {
            let carried = tally.as_ref().map_or(0, |tally| tally.word(*route).load(Ordering::SeqCst));
            let news = carried.wrapping_sub(std::mem::replace(seen, carried));
            let reborn = tally.as_ref().map_or(0, |tally| tally.word(REBORN_WORD).load(Ordering::SeqCst));
            let reborn = reborn >> ROUTES[*route].from as u32 & 1 == 1;
            if news == 0 && !reborn {
                continue;
            }
            // a sender that died may have sent one message that it has not counted
            let most = if reborn { u32::MAX } else { news };
            let mut arrived = |header: &Header| {
                if let Some(hops) = &mut hops {
                    hops.push(Span {
                        t: header.t,
                        begin: header.wall_ns,
                        number: header.seq.into(),
                        channel: *route as u32,
                        // time 0: content whose time only the bus decides
                        late: (header.t != 0 && header.t <= stepped_to).into(),
                        ..Span::new(SpanKind::Hop, to)
                    });
                }
            };
            let received = match tampered.iter_mut().find(|tampered| tampered.index() == *route) {
                Some(tampered) => inlet.receive_sealed(most, tampered, &mut arrived),
                None => inlet.receive(most, inboxes, &mut arrived),
            };
            match received {
                Err(ChannelError::Lost { .. }) if reborn => {}
                received => received?,
            }
        }
        if let Some(hops) = hops.filter(|hops| hops.len() > before) {
            let end = wall_ns();
            hops[before..].iter_mut().for_each(|hop| hop.end = end);
        }
        Ok(())
    }

    /// Hands `to` the messages with planned faults that have come to it by `now`, and what is wrong with them.
    pub fn check(&mut self, to: BoardId, now: Ns, inboxes: &mut Inboxes, defects: &mut Vec<Defect>) {
        for tampered in &mut self.tampered {
            tampered.check(to, now, &mut inboxes[to as usize], defects);
        }
    }

    /// That board starts again: what was on its way to it is lost, unless a board beside it that is not down waits for it too.
    pub fn renew(&mut self, board: BoardId) -> Result<(), ChannelError> {
        self.tampered.iter_mut().for_each(|tampered| tampered.renew(board));
        let Some(tally) = &self.tally else { return Ok(()) };
        let down = tally.word(DOWN_WORD).load(Ordering::SeqCst);
        let is_down = |reader: &BoardId| down >> *reader as u32 & 1 == 1;
        for ((route, inlet), seen) in self.inlets.iter_mut().zip(&mut self.seen) {
            if inlet.readers().contains(&board) && inlet.readers().iter().all(is_down) {
                *seen = tally.word(*route).load(Ordering::SeqCst);
                inlet.renew()?;
            }
        }
        Ok(())
    }

    /// Whether messages say from now on when they were sent on the wall clock.
    pub fn stamp(&mut self, stamped: bool) {
        self.stamped = stamped;
    }

    /// How many messages have been sent to other processes, a channel each.
    pub fn sent(&self) -> impl Iterator<Item = Span> {
        self.outlets.iter().map(|(route, outlet)| Span {
            number: outlet.sent().into(),
            channel: *route as u32,
            ..Span::new(SpanKind::Sent, ROUTES[*route].from)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use board::BoardId::*;

    fn mail_with_command() -> Mail {
        let mut mail = Mail::default();
        mail.amplifier.push(AmplifierCommand { t: 7, volts: [1.5; JOINTS], enabled: 127, brake_released: 127 });
        mail
    }

    #[test]
    fn boards_in_one_process_need_no_domain() {
        let mut exchange = Exchange::open(&BOARDS, None, |_| 0, &Tampering::default()).expect("local");
        let mut inboxes = Inboxes::default();
        exchange.deliver(DaIo, 9, &mail_with_command(), &mut inboxes).expect("deliver");
        assert_eq!(inboxes[HwSim as usize].amplifier, mail_with_command().amplifier);
        assert!(inboxes[EncoderIf as usize].amplifier.is_empty());
    }

    #[test]
    fn the_same_mail_arrives_over_shared_memory_and_inside_a_process() {
        let folder = tempfile::tempdir().expect("folder");
        let prefix = format!("t{}x_", std::process::id());
        let process_of = |board: BoardId| usize::from(board == DaIo || board == EncoderIf);
        {
            let domain = Domain::join(folder.path(), &prefix, "a").expect("domain");
            let other = Domain::join(folder.path(), &prefix, "b").expect("domain");
            let mut a =
                Exchange::open(&[DaIo, EncoderIf], Some(&domain), process_of, &Tampering::default()).expect("open");
            let here: Vec<BoardId> = BOARDS.into_iter().filter(|board| process_of(*board) == 0).collect();
            let mut b = Exchange::open(&here, Some(&other), process_of, &Tampering::default()).expect("open");
            let (mut at_a, mut at_b) = (Inboxes::default(), Inboxes::default());
            a.deliver(DaIo, 9, &mail_with_command(), &mut at_a).expect("deliver");
            let mut hops = Vec::new();
            b.fetch(HwSim, 0, &mut at_b, Some(&mut hops)).expect("fetch");
            assert_eq!(at_b[HwSim as usize].amplifier, mail_with_command().amplifier);
            assert_eq!((hops.len(), hops[0].begin), (1, 0), "no message is stamped unasked");
            let mut mail = Mail::default();
            // one message more than fits a sample's preallocated length
            mail.plant.resize(LENGTH + 1, bytemuck::Zeroable::zeroed());
            b.deliver(HwSim, 9, &mail, &mut at_b).expect("deliver");
            a.fetch(EncoderIf, 0, &mut at_a, None).expect("fetch");
            assert_eq!(at_a[EncoderIf as usize].plant.len(), LENGTH + 1);
            assert_eq!(at_a[DaIo as usize].plant.len(), LENGTH + 1);
            assert_eq!(at_b[ForceSensorIf as usize].plant.len(), LENGTH + 1);
        }
        assert!(crate::remove_leftovers(&prefix).is_empty());
    }

    #[test]
    fn what_comes_for_a_time_that_its_reader_has_passed_is_late() {
        let folder = tempfile::tempdir().expect("folder");
        let prefix = format!("l{}x_", std::process::id());
        let process_of = |board: BoardId| usize::from(board == DaIo);
        {
            let domain = Domain::join(folder.path(), &prefix, "a").expect("domain");
            let mut a = Exchange::open(&[DaIo], Some(&domain), process_of, &Tampering::default()).expect("open");
            let mut b = Exchange::open(&[HwSim], Some(&domain), process_of, &Tampering::default()).expect("open");
            let mut inboxes = Inboxes::default();
            a.stamp(true);
            // the command is of time 7
            for (stepped_to, late, seq) in [(6, 0, 0), (7, 1, 1), (8, 1, 2)] {
                let before = wall_ns();
                a.deliver(DaIo, 9, &mail_with_command(), &mut inboxes).expect("deliver");
                let mut hops = Vec::new();
                b.fetch(HwSim, stepped_to, &mut inboxes, Some(&mut hops)).expect("fetch");
                assert_eq!(hops.len(), 1);
                assert_eq!((hops[0].late, hops[0].number, hops[0].t), (late, seq, 7));
                assert!(before <= hops[0].begin && hops[0].begin <= hops[0].end);
            }
            let sent: Vec<Span> =
                a.sent().filter(|span| ROUTES[span.channel as usize].kind == Kind::Amplifier).collect();
            assert_eq!(sent[0].number, 3);
        }
        assert!(crate::remove_leftovers(&prefix).is_empty());
    }
}
