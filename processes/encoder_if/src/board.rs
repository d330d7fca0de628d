//! The four encoder cards as a board of the rack.
//!
//! A register has the content of the exact instant of the access, or of a stated delay before it. A write to a
//! status register clears it, whatever the value; other writes change nothing. Channels without a joint and addresses
//! without a register read as zero. An access that failed on the bus gets no answer.

use crate::counter;
use crate::faults::Channels;
use crate::history::{History, counts_per_turn};
use crate::velocity::{self, TIMER_NS};
use board::{Board, Inputs, Outputs};
use messages::registers::encoder;
use messages::{BoardId, BusWord, Event, JOINTS, TransferRecord};
use scenario::{ClockDrift, Scenario, VelocitySource, nanoseconds};
use vme::Ns;

/// Number of cards.
const CARDS: usize = JOINTS.div_ceil(encoder::CHANNELS_PER_CARD);

/// The cards. They answer the accesses to the rack's slaves `encoder-1` to `encoder-4`.
pub struct EncoderIf {
    /// Base address and size of each card.
    cards: [(u32, u32); CARDS],
    counter_bits: u8,
    velocity: VelocitySource,
    window: Ns,
    delay: Ns,
    history: History,
    channels: Channels,
    /// The channels have followed the shafts up to here.
    followed: f64,
    /// When the cards' clock is off.
    drifts: Vec<ClockDrift>,
}

impl EncoderIf {
    /// The cards that the scenario describes. The message says what is wrong with them.
    pub fn new(scenario: &Scenario) -> Result<EncoderIf, String> {
        let config = &scenario.encoder_if;
        let drives = scenario.drives()?;
        let mut cards = [(0, 0); CARDS];
        for (k, card) in cards.iter_mut().enumerate() {
            let name = format!("encoder-{}", k + 1);
            let slave = (scenario.rack.slaves.iter().find(|slave| slave.name == name))
                .ok_or_else(|| format!("the rack has no slave `{name}`"))?;
            *card = (slave.base, slave.size);
        }
        let delay = nanoseconds(config.delay_ms / 1e3);
        Ok(EncoderIf {
            cards,
            counter_bits: config.counter_bits,
            velocity: config.velocity,
            window: nanoseconds(config.velocity_window_us / 1e6),
            delay,
            history: History::new(&drives, delay + TIMER_NS, scenario.plant.rate_hz),
            channels: Channels::new(scenario, core::array::from_fn(|i| counts_per_turn(&drives, i))),
            followed: f64::NEG_INFINITY,
            drifts: scenario.clock_drifts().into_iter().filter(|drift| drift.board == BoardId::EncoderIf).collect(),
        })
    }

    /// How fast the cards' clock goes at `t`.
    fn clock_rate(&self, t: Ns) -> f64 {
        let holding = self.drifts.iter().filter(|drift| (drift.from..drift.until).contains(&t));
        1.0 + holding.map(|drift| drift.gain).sum::<f64>()
    }

    /// Card and register offset behind an address.
    fn card(&self, addr: u32) -> Option<(usize, u32)> {
        (self.cards.iter().enumerate())
            .map(|(card, (base, size))| (card, addr.wrapping_sub(*base), *size))
            .find_map(|(card, offset, size)| (offset < size).then_some((card, offset)))
    }

    /// Joint and register offset behind an address.
    fn channel(&self, addr: u32) -> Option<(usize, u32)> {
        let (card, offset) = self.card(addr)?;
        let channel = (offset / encoder::CHANNEL) as usize;
        let joint = card * encoder::CHANNELS_PER_CARD + channel;
        (channel < encoder::CHANNELS_PER_CARD && joint < JOINTS)
            .then_some((joint, offset % encoder::CHANNEL))
    }

    /// Content of a register at `t`.
    fn content(&mut self, addr: u32, t: Ns) -> u32 {
        if let Some((card, encoder::CARD_STATUS)) = self.card(addr) {
            self.follow(self.delayed(t));
            let first = card * encoder::CHANNELS_PER_CARD;
            let joints = first..(first + encoder::CHANNELS_PER_CARD).min(JOINTS);
            return joints.rev().fold(0, |word, joint| word << 8 | self.channels.take_status(joint));
        }
        let Some((joint, register)) = self.channel(addr) else {
            return 0;
        };
        let rate = self.clock_rate(t);
        let t = self.delayed(t);
        match register {
            encoder::COUNT => {
                let bits = self.channels.bits(joint, self.counter_bits);
                counter::register(self.channels.counted(joint, self.history.position(joint, t)), bits) as u32
            }
            encoder::VELOCITY if self.channels.is_open(joint) => 0,
            encoder::VELOCITY => {
                let speed = match self.velocity {
                    // edges are timed by the cards' clock: one that is fast finds them further apart
                    VelocitySource::EdgeTime => {
                        let window = (self.window as f64 / rate).min(TIMER_NS as f64);
                        velocity::edge_time(&self.history, joint, t, window) / rate
                    }
                    VelocitySource::Tachometer => self.history.speed(joint, t),
                };
                (speed / encoder::VELOCITY_LSB).round() as i32 as u32
            }
            encoder::STATUS => {
                self.follow(t);
                self.channels.status(joint)
            }
            encoder::INDEX => {
                self.follow(t);
                counter::register(self.channels.latched(joint), self.counter_bits) as u32
            }
            _ => 0,
        }
    }

    fn write(&mut self, addr: u32) {
        if let Some((joint, encoder::STATUS)) = self.channel(addr) {
            self.channels.take_status(joint);
        }
    }

    /// Lets the channels see the shafts up to `t`.
    fn follow(&mut self, t: f64) {
        if self.history.is_empty() {
            return;
        }
        for i in self.history.until(self.followed)..self.history.until(t) {
            if let Some(sample) = self.history.sample(i) {
                self.channels.follow(&sample.position);
            }
        }
        self.channels.follow(&self.history.positions(t));
        self.followed = t;
    }

    /// Lets the faults begin and end that do so up to `t`.
    fn advance_faults(&mut self, t: Ns, events: &mut Vec<Event>) {
        if self.channels.next_fault() <= t {
            self.follow(self.delayed(t));
            self.channels.advance(t, |fault, from| {
                events.push(Event::injected(from, fault));
            });
        }
    }

    fn delayed(&self, t: Ns) -> f64 {
        t as f64 - self.delay as f64
    }
}

impl Board for EncoderIf {
    fn step(&mut self, _now: Ns, inputs: &Inputs, out: &mut Outputs) {
        for sample in &inputs.mail.plant {
            self.history.push(sample);
        }
        for transfer in inputs.transfers.iter().filter(|transfer| transfer.is_ok()) {
            let TransferRecord { data_at, job, task, index, .. } = *transfer;
            // no transfer of a window takes place after it
            let t = data_at.min(inputs.until);
            self.advance_faults(t, &mut out.mail.events);
            for addr in transfer.cycles() {
                if transfer.is_read() {
                    let value = self.content(addr, t);
                    out.mail.words.push(BusWord {
                        t,
                        addr,
                        value,
                        job,
                        task,
                        index,
                    });
                } else {
                    self.write(addr);
                }
            }
        }
        self.advance_faults(inputs.until, &mut out.mail.events);
        self.follow(self.delayed(inputs.until));
        self.history.forget(inputs.until);
    }
}
