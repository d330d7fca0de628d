//! The control computer of the rack: two processor cards that run the augmented hybrid impedance control (AHIC) of Patel
//! and Shadpey, *Control of Redundant Robot Manipulators*, chapters 5 and 6, as one job a period on one of them, or as two
//! tasks at rates of their own that meet in dual-ported RAM.
//!
//! | file | subject |
//! |---|---|
//! | `pipeline` | one job: Figure 5.18 from F_e and X to torques |
//! | `law` | TG → AHIC → ERC → RR |
//! | `trajectory` | TG: segments, X_d |
//! | `ahic`, `target` | Ẍᵗ, and Xᵗ integrated from it |
//! | `erc` | error reference controller |
//! | `redundancy`, `joint_limits`, `cholesky` | RR and its additional task |
//! | `inverse_dynamics` | torques, friction feed-forward, saturation |
//! | `tool`, `frame` | F_e from the sensor's wrench; the task frame |
//! | `sensors`, `program`, `board` | registers, bus programs, the board |
//! | `second_card`, `handover` | inverse dynamics, safety and D/A on the second card; what it is handed |
//! | `output` | safety state and torques to the drives |
//! | `commands` | what is refused |
//! | `clocks` | clocks that drift apart |
//! | `force_noise`, `disturbance` | how noisy the force is; torques that nothing accounts for |
//! | `findings`, `safety` | what a job finds wrong, and what stops the arm |

mod ahic;
mod board;
mod cholesky;
mod clocks;
mod commands;
mod disturbance;
mod erc;
mod findings;
mod force_noise;
mod frame;
mod handover;
mod inverse_dynamics;
mod joint_limits;
mod law;
mod output;
mod pipeline;
mod program;
mod redundancy;
mod safety;
mod second_card;
mod sensors;
mod target;
mod tool;
mod trajectory;

pub use ahic::Impedance;
pub use board::ControlComputer;
pub use commands::Refusal;
pub use frame::Motion;
pub use handover::Wanted;
pub use law::Decided;
pub use pipeline::{BRAKING, Job, Mode, Pipeline};
pub use safety::State;
pub use sensors::Sensed;
pub use tool::Contact;
pub use trajectory::{QUEUE, Segment, Trajectory};
