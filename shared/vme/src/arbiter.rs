//! The arbiter in slot 1: which requester gets the bus next.
//!
//! Requesters are known by bus request level (BR0*–BR3*) and slot. The arbiter chooses a level; the
//! bus grant daisy chain of that level then stops at the requester nearest to slot 1. Used as it
//! stands by the timing plane and by the queueing simulation ([`crate::queueing`]).

use serde::{Deserialize, Serialize};

/// Bus request levels, BR3* the highest.
pub const LEVELS: usize = 4;
/// Slots of a full-size chassis; slot 1 holds the system controller.
pub const SLOTS: u8 = 21;

/// How the arbiter chooses among the levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Priority: BR3* first; BCLR* asks a lower owner to leave.
    #[default]
    #[serde(rename = "PRI")]
    Pri,
    /// Round-robin select: the level below the last granted one first.
    #[serde(rename = "RRS")]
    Rrs,
    /// Single level: BR3* only, so the daisy chain alone decides.
    #[serde(rename = "SGL")]
    Sgl,
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Mode::Pri => "PRI",
            Mode::Rrs => "RRS",
            Mode::Sgl => "SGL",
        })
    }
}

/// A requester, as the arbiter and the daisy chain see it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Bus request level, 0 to 3.
    pub level: u8,
    /// Slot, 1 to 21.
    pub slot: u8,
}

/// The request lines and the arbiter's memory.
#[derive(Clone, Debug)]
pub struct Arbiter {
    mode: Mode,
    /// For each level the slots that drive its BR* line, as bits.
    requests: [u32; LEVELS],
    /// Level of the last grant (round robin starts below it).
    last: u8,
}

impl Arbiter {
    /// No requests; the first round starts at BR3*.
    pub fn new(mode: Mode) -> Arbiter {
        Arbiter { mode, requests: [0; LEVELS], last: 0 }
    }

    /// The requester drives its BR* line.
    pub fn request(&mut self, place: Place) {
        self.requests[place.level as usize] |= 1 << place.slot;
    }

    /// The requester lets go of its BR* line without a grant.
    pub fn withdraw(&mut self, place: Place) {
        self.requests[place.level as usize] &= !(1 << place.slot);
    }

    /// Whether this requester drives its BR* line.
    pub fn requests(&self, place: Place) -> bool {
        self.requests[place.level as usize] & (1 << place.slot) != 0
    }

    /// Whether any requester other than this one drives a BR* line.
    pub fn requested_by_others(&self, place: Place) -> bool {
        let mut lines = self.requests;
        lines[place.level as usize] &= !(1 << place.slot);
        lines != [0; LEVELS]
    }

    /// BCLR*: the owner of this level is asked to leave for a higher one (PRI only).
    pub fn bclr(&self, owner: Place) -> bool {
        self.mode == Mode::Pri && self.requests[owner.level as usize + 1..].iter().any(|&slots| slots != 0)
    }

    /// BG*: grants the bus, if anybody wants it; its BR* line is released.
    pub fn grant(&mut self) -> Option<Place> {
        let level = match self.mode {
            Mode::Pri => (0..LEVELS).rev().find(|&level| self.requests[level] != 0)?,
            Mode::Rrs => (1..=LEVELS)
                .map(|step| (self.last as usize + LEVELS - step) % LEVELS)
                .find(|&level| self.requests[level] != 0)?,
            Mode::Sgl => Some(LEVELS - 1).filter(|&level| self.requests[level] != 0)?,
        };
        let place = Place { level: level as u8, slot: self.requests[level].trailing_zeros() as u8 };
        self.last = place.level;
        self.withdraw(place);
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(mode: Mode, wanted: &[(u8, u8)]) -> Vec<(u8, u8)> {
        let mut arbiter = Arbiter::new(mode);
        for &(level, slot) in wanted {
            arbiter.request(Place { level, slot });
        }
        std::iter::from_fn(|| arbiter.grant()).map(|place| (place.level, place.slot)).collect()
    }

    #[test]
    fn pri_grants_by_level_and_then_by_slot() {
        let order = places(Mode::Pri, &[(0, 2), (3, 9), (1, 4), (3, 5)]);
        assert_eq!(order, [(3, 5), (3, 9), (1, 4), (0, 2)]);
    }

    #[test]
    fn sgl_hears_br3_alone() {
        assert_eq!(places(Mode::Sgl, &[(2, 1), (3, 7), (3, 3)]), [(3, 3), (3, 7)]);
    }

    #[test]
    fn rrs_goes_down_from_the_level_granted_last() {
        let mut arbiter = Arbiter::new(Mode::Rrs);
        let all = [3, 2, 1, 0].map(|level| Place { level, slot: level + 2 });
        all.iter().for_each(|&place| arbiter.request(place));
        let mut levels = Vec::new();
        for _ in 0..8 {
            let place = arbiter.grant().unwrap();
            levels.push(place.level);
            arbiter.request(place);
        }
        assert_eq!(levels, [3, 2, 1, 0, 3, 2, 1, 0]);
    }

    #[test]
    fn a_greedy_near_slot_starves_a_far_one_of_the_same_level_in_every_mode() {
        for mode in [Mode::Pri, Mode::Rrs, Mode::Sgl] {
            let mut arbiter = Arbiter::new(mode);
            let (near, far) = (Place { level: 3, slot: 2 }, Place { level: 3, slot: 9 });
            arbiter.request(far);
            for _ in 0..100 {
                arbiter.request(near);
                assert_eq!(arbiter.grant(), Some(near));
            }
            assert!(arbiter.requests(far));
        }
    }

    #[test]
    fn bclr_is_driven_for_higher_levels_in_pri_only() {
        let owner = Place { level: 1, slot: 4 };
        for (mode, level, expected) in
            [(Mode::Pri, 2, true), (Mode::Pri, 1, false), (Mode::Pri, 0, false), (Mode::Rrs, 3, false)]
        {
            let mut arbiter = Arbiter::new(mode);
            arbiter.request(Place { level, slot: 3 });
            assert_eq!(arbiter.bclr(owner), expected, "{mode:?} {level}");
            assert!(arbiter.requested_by_others(owner));
        }
    }
}
