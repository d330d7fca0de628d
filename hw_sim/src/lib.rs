//! The hardware: arm, drives, contact and strain gauges. Physics, not a board; its wires end at the interface cards.
//!
//! | file | subject |
//! |---|---|
//! | `board` | windows, samples on the wires, limit switches, the end of a runaway |
//! | `plant` | forces and accelerations in one state |
//! | `drive`, `friction` | amplifier, rotor, brake, transmission; sticking and sliding |
//! | `drives` | all joints', two at a time |
//! | `contact` | what the tool touches |
//! | `sensor` | what the strain gauges feel |
//! | `integrate` | from one instant to the next |
//! | `energy` | the balance |

mod board;
pub mod contact;
pub mod drive;
pub mod drives;
pub mod energy;
mod faults;
pub mod friction;
pub mod integrate;
pub mod plant;
pub mod sensor;
pub mod state;

pub use board::HwSim;
