//! stability: choosing impedances under delay, and when the loop around them is stable.

pub mod fir;
