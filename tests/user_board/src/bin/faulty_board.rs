//! Boards that a rack has to cope with: `faulty_board HOW` works for a hundred jobs and then does as its first argument
//! says: `sleeps`, `spins`, `leaves`, `panics`, or `cuts` the window as only the arm may.

use board::{Board, Inputs, Ns, Outputs};
use std::process::ExitCode;
use std::time::Duration;
use user_board::Hold;

struct Faulty {
    hold: Hold,
    how: String,
}

impl Board for Faulty {
    fn step(&mut self, now: Ns, inputs: &Inputs, out: &mut Outputs) {
        self.hold.step(now, inputs, out);
        if inputs.decision.is_some_and(|decision| decision.job >= 100) {
            match self.how.as_str() {
                "sleeps" => std::thread::sleep(Duration::MAX),
                "spins" => loop {
                    std::hint::spin_loop();
                },
                "leaves" => std::process::exit(7),
                "cuts" => out.early = Some(inputs.from),
                how => panic!("{how}"),
            }
        }
    }
}

fn main() -> ExitCode {
    let how = std::env::args().nth(1).unwrap_or_default();
    pacing::serve(&|_, context| Ok(Box::new(Faulty { hold: Hold::new(&context.scenario)?, how: how.clone() })))
}
