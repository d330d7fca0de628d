//! Choosing impedances under delay, and when the loop around them is stable.
//!
//! | to know | look at |
//! |---|---|
//! | m, b, k for a wanted response, rescaling (6.2.6), (6.2.10)–(6.2.12), (6.2.15), (6.2.16) | [`Impedance`] |
//! | the four bounds: published (6.2.9), full Routh, exact delay, only the force delayed | [`Bound`] |
//! | gain, phase and delay margins | [`margins`] |
//! | all of that for one impedance | [`judge`] |
//! | the force sensor's low-pass cascade: taps; delay, response and bound | [`fir`]; [`cascade`] |
//! | the sampled spring wall | [`SampledWall`] |
//!
//! Pure functions of `f64` in SI units, trigonometry from `libm`: the same bits on every machine. They
//! take positive, finite arguments and do not check them; what comes from a user is checked where
//! it comes in. Every bound is tested against characteristic roots counted by the argument
//! principle, and the exact ones against the delay equation integrated in time.

mod bound;
pub mod cascade;
pub mod fir;
mod impedance;
mod judgement;
pub mod margins;
mod sampled_wall;

pub use bound::{Bound, effective_delay};
pub use impedance::{Impedance, response_time, stiffness_for_error};
pub use judgement::{BoundJudgement, Judgement, Verdict, judge};
pub use sampled_wall::SampledWall;
