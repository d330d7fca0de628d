//! Background traffic: a master that asks for the bus periodically or at random, to load it on purpose.

use crate::Ns;
use crate::program::{Access, Direction, Width};
use crate::requester::ReleasePolicy;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

/// A generator of background traffic. It is a card of its own, or works through an adaptor (the
/// block transfers of a workstation). Requests queue without bound at the master.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Traffic {
    /// Card name.
    pub name: String,
    /// Slot, 1 to 21; not needed where `adaptor` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u8>,
    /// Bus request level, 0 to 3.
    #[serde(default)]
    pub level: u8,
    /// When its requester leaves the bus.
    #[serde(default)]
    pub release: ReleasePolicy,
    /// It works through the adaptor of this name, with its DMA engine.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adaptor: Option<String>,
    /// When requests arrive.
    #[serde(default)]
    pub arrivals: Arrivals,
    /// Time between two requests; with `poisson` its mean.
    pub period_ns: Ns,
    /// First periodic request.
    #[serde(default)]
    pub offset_ns: Ns,
    /// Address modifier.
    pub am: u8,
    /// First address of each request.
    pub addr: u32,
    /// Width of each cycle.
    pub width: Width,
    /// Read or write.
    pub dir: Direction,
    /// Cycles of each request.
    pub n: u32,
    /// Seed of its own stream of random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl Traffic {
    /// What each request asks for.
    pub fn access(&self) -> Access {
        Access { am: self.am, addr: self.addr, width: self.width, dir: self.dir, n: self.n }
    }
}

/// When requests of background traffic arrive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arrivals {
    /// Every period.
    #[default]
    Periodic,
    /// At random, independently of each other.
    Poisson,
}

/// The instants of arrival of one stream of requests.
#[derive(Clone, Debug)]
pub struct ArrivalStream {
    arrivals: Arrivals,
    /// Mean time between two arrivals; need not be whole nanoseconds.
    period: f64,
    offset: Ns,
    count: u64,
    next: Ns,
    random: ChaCha8Rng,
}

impl ArrivalStream {
    /// A stream; `stream` keeps the numbers of several streams of one seed apart.
    pub fn new(arrivals: Arrivals, period: f64, offset: Ns, seed: u64, stream: u64) -> ArrivalStream {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        let mut arrival = ArrivalStream { arrivals, period, offset, count: 0, next: offset, random };
        if arrivals == Arrivals::Poisson {
            arrival.advance();
        }
        arrival
    }

    /// The next arrival.
    pub fn next(&self) -> Ns {
        self.next
    }

    /// Goes on to the arrival after.
    pub fn advance(&mut self) {
        self.next = match self.arrivals {
            Arrivals::Periodic => {
                self.count += 1;
                self.offset.saturating_add((self.count as f64 * self.period + 0.5) as Ns)
            }
            Arrivals::Poisson => self.next.saturating_add(exponential(&mut self.random, self.period)),
        };
    }
}

/// An exponentially distributed time, to the nearest nanosecond.
fn exponential(random: &mut ChaCha8Rng, mean_ns: f64) -> Ns {
    // 53 random bits in (0, 1]
    let u = ((random.next_u64() >> 11) + 1) as f64 * (1.0 / (1u64 << 53) as f64);
    (-libm::log(u) * mean_ns + 0.5) as Ns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poisson_gaps_have_the_mean_and_the_deviation_of_an_exponential() {
        let mut stream = ArrivalStream::new(Arrivals::Poisson, 1000.0, 0, 1, 0);
        let (mut sum, mut squares, n) = (0.0, 0.0, 200_000);
        for _ in 0..n {
            let before = stream.next();
            stream.advance();
            let gap = (stream.next() - before) as f64;
            sum += gap;
            squares += gap * gap;
        }
        let mean = sum / f64::from(n);
        let deviation = (squares / f64::from(n) - mean * mean).sqrt();
        // five standard errors: 1000/√200000 = 2.2 for the mean, about 3.2 for the deviation
        assert!((mean - 1000.0).abs() < 11.0, "{mean}");
        assert!((deviation - 1000.0).abs() < 16.0, "{deviation}");
    }

    #[test]
    fn periodic_arrivals_start_at_the_offset() {
        let mut stream = ArrivalStream::new(Arrivals::Periodic, 10.0, 3, 1, 0);
        assert_eq!(stream.next(), 3);
        stream.advance();
        assert_eq!(stream.next(), 13);
    }
}
