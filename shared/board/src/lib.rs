//! One board, one library, three ways to run it: a board is a plain object that knows no process,
//! channel or clock. Whoever hosts it (chassis or process, lock step or real time) fills [`Inputs`],
//! calls [`Board::step`] and carries [`Outputs`] away.
//!
//! [`routes`] says which board hears which; it is the wiring of Figure 6.1.

#![warn(missing_docs)]

mod mail;
pub mod routes;
mod told;

pub use mail::Mail;
pub use told::Told;
pub use messages::BoardId;
pub use vme::{Ns, Op, Program};

use messages::{Defect, TransferRecord};

/// A board of the rack (or the arm, or a user's program in the place of one).
pub trait Board: Send {
    /// Carries the board from `inputs.from` to `inputs.until`.
    ///
    /// `now` is the board's own clock at the end of the window, ns; it may drift against simulated
    /// time. The step uses nothing but its inputs and its own state, and neither allocates, locks nor
    /// calls the operating system.
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs);
}

/// What a board knows in a step.
#[derive(Debug, Default)]
pub struct Inputs {
    /// Start of the window, ns.
    pub from: Ns,
    /// End of the window, ns.
    pub until: Ns,
    /// First step: the board shows its initial state and its tasks' programs.
    pub boot: bool,
    /// The window that the board has just run is run again, shorter: its step starts from the state
    /// that it had at `from`. Only boards ahead of the plant (`da_io`) see it.
    pub rerun: bool,
    /// The run ends with this step: write out what is pending.
    pub finish: bool,
    /// Boards keep time by themselves and wait for nobody, as in real time: a message that is missing may still be on its way.
    pub free_running: bool,
    /// A task of this board stands at its decision point at `until`.
    pub decision: Option<Decision>,
    /// Bus transfers made *to* this board in the window, and those of its own tasks that failed, in the order of `data_at`.
    pub transfers: Vec<TransferRecord>,
    /// What other boards sent since the last step.
    pub mail: Mail,
    /// What was wrong with messages that came since the last step.
    pub defects: Vec<Defect>,
}

/// A task at its decision point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decision {
    /// Index of the task in the rack description.
    pub task: u16,
    /// Its activation number.
    pub job: u32,
}

/// What a board answers.
#[derive(Debug, Default)]
pub struct Outputs {
    /// What it sends to other boards.
    pub mail: Mail,
    /// New programs of this board's tasks, each from the task's next release on.
    pub programs: Vec<(u16, Program)>,
    /// Rest of the job that stands at its decision point; `None` = as in the last job.
    pub rest: Option<Program>,
    /// The plant stopped here, before the end of the window.
    pub early: Option<Ns>,
}

impl Outputs {
    /// Empties everything and keeps the memory.
    pub fn clear(&mut self) {
        self.mail.clear();
        self.programs.clear();
        self.rest = None;
        self.early = None;
    }
}
