//! Where two processor cards meet: the first writes what the law wants into the second's dual-ported RAM, the second
//! leaves its state there for the first to read.
//!
//! Both are accesses over the bus and count from their own instants: a block is valid once its last longword is in, a state
//! word shows what the second card had written by then. A block whose transfer fails is lost; the second card sees its age.

use crate::safety::State;
use arm::{DOF, JointVector, Spatial};
use messages::Detector;
use vme::Ns;

/// What the law wants of the torques, and what the first card knows that safety must hear of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// q̈ᵗ (rad/s²).
    pub qdd: JointVector,
    /// Joint speeds of Ẋᵗ, for friction (rad/s).
    pub target_speed: JointVector,
    /// F_e (N, Nm).
    pub fe: Spatial,
    /// State that the first card's findings demand.
    pub demand: State,
    /// Which of them.
    pub cause: Option<Detector>,
    /// The workstation acknowledges a stop.
    pub acknowledge: bool,
}

/// Longwords of the block: the numbers as doubles; number of the job, demand, cause and acknowledgement in one each.
pub const LONGWORDS: u32 = 2 * (DOF + DOF + 6) as u32 + 4;

/// What the second card says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// Safety state.
    pub state: State,
    /// Joints whose torque was cut, a bit each.
    pub torque_limited: u32,
    /// The stop can be acknowledged.
    pub clear: bool,
}

/// The second card's dual-ported RAM.
#[derive(Clone, Debug)]
pub struct Ram {
    /// Block on its way, and the job that sent it.
    posted: Option<(u32, Wanted)>,
    /// Newest block, and when it was whole.
    block: Option<(Ns, Wanted)>,
    /// State words of the last two jobs and when each is written: the older one shows until then.
    words: [(Ns, Word); 2],
    /// State word as the first card read it last.
    read: Word,
}

impl Ram {
    /// No block yet, running.
    pub fn new() -> Ram {
        let word = Word { state: State::Run, torque_limited: 0, clear: false };
        Ram { posted: None, block: None, words: [(0, word); 2], read: word }
    }

    /// The first card sends a block in this job.
    pub fn post(&mut self, job: u32, wanted: Wanted) {
        self.posted = Some((job, wanted));
    }

    /// The transfer of the job's block has ended.
    pub fn arrived(&mut self, job: u32, at: Ns, ok: bool) {
        if let Some((_, wanted)) = self.posted.take_if(|(posted, _)| *posted == job)
            && ok
        {
            self.block = Some((at, wanted));
        }
    }

    /// The newest block and when it was whole.
    pub fn block(&mut self) -> Option<&mut (Ns, Wanted)> {
        self.block.as_mut()
    }

    /// The second card will write this word at that instant.
    pub fn show(&mut self, written: Ns, word: Word) {
        self.words = [self.words[1], (written, word)];
    }

    /// The first card reads the state word at this instant.
    pub fn read_at(&mut self, at: Ns) {
        let [(_, older), (written, newer)] = self.words;
        self.read = if written <= at { newer } else { older };
    }

    /// What the first card read last.
    pub fn read(&self) -> Word {
        self.read
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(qdd: f64) -> Wanted {
        Wanted {
            qdd: JointVector::repeat(qdd),
            target_speed: JointVector::zeros(),
            fe: Spatial::zeros(),
            demand: State::Run,
            cause: None,
            acknowledge: false,
        }
    }

    #[test]
    fn a_block_counts_from_the_end_of_its_transfer_and_a_failed_one_never() {
        let mut ram = Ram::new();
        ram.post(3, wanted(1.0));
        assert!(ram.block().is_none());
        ram.arrived(2, 400, true);
        assert!(ram.block().is_none(), "another job's transfer");
        ram.arrived(3, 500, true);
        assert_eq!(ram.block(), Some(&mut (500, wanted(1.0))));
        ram.post(4, wanted(2.0));
        ram.arrived(4, 900, false);
        assert_eq!(ram.block(), Some(&mut (500, wanted(1.0))));
    }

    #[test]
    fn a_state_word_shows_from_the_instant_at_which_it_is_written() {
        let mut ram = Ram::new();
        ram.show(1_000, Word { state: State::Off, torque_limited: 5, clear: true });
        ram.read_at(999);
        assert_eq!(ram.read().state, State::Run);
        ram.read_at(1_000);
        assert_eq!(ram.read(), Word { state: State::Off, torque_limited: 5, clear: true });
    }
}
