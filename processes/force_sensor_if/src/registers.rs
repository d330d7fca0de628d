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
