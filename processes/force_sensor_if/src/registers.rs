//! The dual-ported RAM: which word of the map of [`messages::registers::force`] an address is, and how a number becomes
//! the content of a word.
//!
//! A card with up to 2¹⁵ counts at full scale has 16-bit words. Beyond, it is an idealised card for comparison with
//! theory: 32-bit words, every byte offset of the map doubled. Words outside the map read as zero.

use crate::AXES;
use messages::registers::force;

/// Counts at full scale up to which a card has 16-bit words.
const WIDEST_16_BIT: f64 = 32768.0;

/// A word of the card. Axes count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Full scale of an axis: N, or tenths of Nm.
    FullScale(usize),
    /// Offset of an axis in counts, added to its samples.
    Offset(usize),
    /// Value of an axis behind a filter, 0–6.
    Filter(usize, usize),
    /// Sample counter of a filter, 0–6.
    Counter(usize),
    /// Axes near saturation.
    Warnings,
    /// Error bits.
    Errors,
    /// Not used by this card.
    Other,
}

/// Width of the card's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Word {
    /// As the real card has them.
    Bits16,
    /// Idealised card.
    Bits32,
}

impl Word {
    /// Width that holds so many counts at full scale.
    pub fn for_counts(full_scale_counts: f64) -> Word {
        if full_scale_counts > WIDEST_16_BIT {
            Word::Bits32
        } else {
            Word::Bits16
        }
    }

    /// The register at a byte offset from the card's base.
    pub fn register(self, offset: u32) -> Register {
        match self {
            Word::Bits16 => register(offset),
            Word::Bits32 => register(offset / 2),
        }
    }

    /// A signed number as a word: rounded, saturating.
    pub fn signed(self, number: f64) -> u32 {
        match self {
            Word::Bits16 => u32::from(number.round() as i16 as u16),
            Word::Bits32 => number.round() as i32 as u32,
        }
    }

    /// The signed number in a word.
    pub fn number(self, value: u32) -> f64 {
        match self {
            Word::Bits16 => f64::from(value as u16 as i16),
            Word::Bits32 => f64::from(value as i32),
        }
    }
}

/// The register at a byte offset of the map with 16-bit words.
fn register(offset: u32) -> Register {
    let axis_of = |first: u32| {
        let axis = (offset.wrapping_sub(first) / 2) as usize;
        (offset >= first && axis < AXES).then_some(axis)
    };
    if let Some(axis) = axis_of(force::FULL_SCALE) {
        return Register::FullScale(axis);
    }
    if let Some(axis) = axis_of(force::OFFSET) {
        return Register::Offset(axis);
    }
    for n in 0..=6 {
        if let Some(axis) = axis_of(force::filter(n)) {
            return Register::Filter(n as usize, axis);
        }
        if offset == force::counter(n) {
            return Register::Counter(n as usize);
        }
    }
    match offset {
        force::WARNINGS => Register::Warnings,
        force::ERRORS => Register::Errors,
        _ => Register::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_is_that_of_the_receivers_manual() {
        // word numbers: filters from 0x90 in steps of 8, counters 0xE8 to 0xED and 0xEF, warnings 0xF0, errors 0xF1
        let word = |number: u32| Word::Bits16.register(2 * number);
        assert_eq!(word(0x80), Register::FullScale(0));
        assert_eq!(word(0x8D), Register::Offset(5));
        assert_eq!(word(0x92), Register::Filter(0, 2));
        assert_eq!(word(0xB5), Register::Filter(4, 5));
        assert_eq!(word(0xEF), Register::Counter(0));
        assert_eq!(word(0xE8), Register::Counter(1));
        assert_eq!(word(0xED), Register::Counter(6));
        assert_eq!(word(0xF0), Register::Warnings);
        assert_eq!(word(0xF1), Register::Errors);
        for other in [0, 0x86, 0x8E, 0x96, 0xC6, 0xEE, 0xF2] {
            assert_eq!(word(other), Register::Other, "{other:#x}");
        }
    }

    #[test]
    fn a_32_bit_card_has_the_same_map_at_twice_the_offsets() {
        for offset in (0..0x200).step_by(2) {
            assert_eq!(
                Word::Bits32.register(2 * offset),
                Word::Bits16.register(offset)
            );
        }
        assert_eq!(Word::for_counts(32768.0), Word::Bits16);
        assert_eq!(Word::for_counts(1e9), Word::Bits32);
    }

    #[test]
    fn words_round_and_saturate_and_keep_their_sign() {
        for (number, word) in [
            (1.4, 1),
            (-1.6, 0xFFFE),
            (1e9, 0x7FFF),
            (-1e9, 0x8000),
            (-32768.0, 0x8000),
        ] {
            assert_eq!(Word::Bits16.signed(number), word, "{number}");
        }
        assert_eq!(Word::Bits32.signed(-1e9), -1_000_000_000_i32 as u32);
        assert_eq!(Word::Bits16.number(0xFFFE), -2.0);
        assert_eq!(Word::Bits32.number(0xFFFF_FFFE), -2.0);
    }
}
