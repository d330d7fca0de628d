//! stability: choosing impedances under delay (§6.2.1), and when the loop around them is stable.

mod bound;
pub mod cascade;
pub mod fir;
mod impedance;
pub mod margins;
mod sampled_wall;

pub use bound::{Bound, effective_delay};
pub use impedance::{Impedance, response_time, stiffness_for_error};
pub use sampled_wall::SampledWall;
