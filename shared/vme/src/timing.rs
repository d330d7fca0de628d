//! The timing plane: resolves the tasks' programs into transfers with exact times.
//!
//! It depends on programs and statuses, never on data values. Data change timing only at decision
//! points ([`Op::Decide`]): [`Timing::advance`] stops there, and the board that runs the task says
//! with [`Timing::resume`] how the job goes on. `Timing` is pure and cheap to clone: the chassis runs
//! a copy ahead and drops it when the plant cuts a window short.

use crate::program::{Access, Direction, Op, Program, Status, Transfer};
use crate::rack::Rack;
use crate::Ns;

/// Why [`Timing::advance`] stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The limit was reached.
    Limit,
    /// A task's block of reads is complete; its board decides now.
    Decision {
        /// Index of the task.
        task: u16,
        /// Its activation number.
        job: u32,
    },
}

/// Bus, processors and tasks, at one instant.
#[derive(Clone, Debug)]
pub struct Timing {
    rack: Rack,
    now: Ns,
    tasks: Vec<TaskState>,
}

#[derive(Clone, Debug)]
struct TaskState {
    program: Program,
    /// What follows the decision of the running job.
    rest: Program,
    job: u32,
    index: u16,
    pc: usize,
    decided: bool,
    step: Step,
    /// Time of the next event of this task.
    at: Ns,
}

#[derive(Clone, Copy, Debug)]
enum Step {
    /// Waits for its release at `at`.
    Idle,
    /// Takes up the operation at `pc` at `at`.
    Ready,
    /// The slave answers (or the bus timer expires) at `at`.
    OnBus(Transfer),
    /// Waits for [`Timing::resume`].
    Deciding,
}

impl Timing {
    /// A rack at time 0, with empty programs; see [`Timing::set_program`].
    pub fn new(rack: Rack) -> Timing {
        let tasks = rack
            .tasks
            .iter()
            .map(|task| TaskState {
                program: Program::new(),
                rest: Program::new(),
                job: 0,
                index: 0,
                pc: 0,
                decided: false,
                step: Step::Idle,
                at: task.offset_ns,
            })
            .collect();
        Timing { rack, now: 0, tasks }
    }

    /// Simulated time reached.
    pub fn now(&self) -> Ns {
        self.now
    }

    /// What the task does in each job from its next release on.
    pub fn set_program(&mut self, task: u16, program: &[Op]) {
        let task = &mut self.tasks[task as usize];
        task.program.clear();
        task.program.extend_from_slice(program);
    }

    /// How the job that stands at its decision point goes on.
    pub fn resume(&mut self, task: u16, rest: &[Op]) {
        let task = &mut self.tasks[task as usize];
        debug_assert!(matches!(task.step, Step::Deciding));
        task.rest.clear();
        task.rest.extend_from_slice(rest);
        task.pc = 0;
        task.decided = true;
        task.step = Step::Ready;
        task.at = self.now;
    }

    /// Runs to the next decision point, or to `limit` if that comes first (events at `limit` are left
    /// for later). Pushes every transfer whose data moved on the way, in the order of `data_at`.
    pub fn advance(&mut self, limit: Ns, transfers: &mut Vec<Transfer>) -> Stop {
        loop {
            let next = (0..self.tasks.len())
                .filter(|&i| !matches!(self.tasks[i].step, Step::Deciding))
                .min_by_key(|&i| (self.tasks[i].at, i));
            let Some(i) = next.filter(|&i| self.tasks[i].at < limit) else {
                self.now = limit;
                return Stop::Limit;
            };
            self.now = self.tasks[i].at;
            if self.event(i, transfers) {
                return Stop::Decision { task: i as u16, job: self.tasks[i].job };
            }
        }
    }

    /// Carries out the next event of task `i`; true where it is a decision point.
    fn event(&mut self, i: usize, transfers: &mut Vec<Transfer>) -> bool {
        let task = &mut self.tasks[i];
        match task.step {
            Step::Deciding => {}
            Step::Idle => {
                task.pc = 0;
                task.index = 0;
                task.decided = false;
                task.step = Step::Ready;
            }
            Step::OnBus(transfer) => {
                transfers.push(transfer);
                let stall = match transfer.access.dir {
                    Direction::Read => self.rack.bus.read_stall_ns,
                    Direction::Write => 0,
                };
                task.at = transfer.done + stall;
                task.step = Step::Ready;
            }
            Step::Ready => {
                let ops = if task.decided { &task.rest } else { &task.program };
                let op = ops.get(task.pc).copied();
                task.pc += 1;
                match op {
                    Some(Op::Exec(ns)) => task.at += ns,
                    Some(Op::Access(access)) => {
                        let transfer = transfer(&self.rack, i as u16, task.job, task.index, access, task.at);
                        task.index += 1;
                        task.at = transfer.data_at;
                        task.step = Step::OnBus(transfer);
                    }
                    Some(Op::Raise(_)) => {}
                    Some(Op::Decide) => {
                        task.step = Step::Deciding;
                        return true;
                    }
                    None => {
                        // a release that passed while the job still ran is skipped
                        let spec = &self.rack.tasks[i];
                        let periods = (task.at.saturating_sub(spec.offset_ns)) / spec.period_ns + 1;
                        task.at = spec.offset_ns + periods * spec.period_ns;
                        task.job = periods as u32;
                        task.step = Step::Idle;
                    }
                }
            }
        }
        false
    }
}

/// The transfer with this rack's constant latencies.
fn transfer(rack: &Rack, task: u16, job: u32, index: u16, access: Access, requested: Ns) -> Transfer {
    let slave = rack.slaves.iter().position(|slave| {
        slave.am == access.am && access.addr >= slave.base && access.addr - slave.base < slave.size
    });
    let granted = requested + rack.bus.arbitration_ns;
    let answer = match slave.map(|s| &rack.slaves[s]) {
        Some(slave) => match access.dir {
            Direction::Read => slave.read_ns,
            Direction::Write => slave.write_ns,
        },
        None => rack.bus.bus_timer_ns,
    };
    let cycle = rack.bus.address_ns + answer;
    let n = Ns::from(access.n.max(1));
    let data_at = granted + n * cycle + (n - 1) * rack.bus.handshake_ns;
    Transfer {
        task,
        job,
        index,
        access,
        slave: slave.map(|s| s as u16),
        requested,
        granted,
        data_at,
        done: data_at + rack.bus.handshake_ns,
        status: if slave.is_some() { Status::Ok } else { Status::BusError },
    }
}
