//! A scenario's hardware alone, driven by hand.
#![allow(dead_code)]

use board::{Board, Inputs, Ns, Outputs};
use hw_sim::HwSim;
use messages::AmplifierCommand;
use scenario::Scenario;

/// The built-in scenario `table-5-3` with these overrides, first variant.
pub fn scenario(overrides: &[&str]) -> Scenario {
    let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
    scenario::load("table-5-3", &overrides).expect("valid").scenario().expect("valid")
}

/// Hardware with its mail.
pub struct Bench {
    pub sim: HwSim,
    pub inputs: Inputs,
    pub out: Outputs,
    pub t: Ns,
}

impl Bench {
    /// After its boot step.
    pub fn new(scenario: &Scenario) -> Bench {
        let mut bench = Bench {
            sim: HwSim::new(scenario).expect("simulable"),
            inputs: Inputs::default(),
            out: Outputs::default(),
            t: 0,
        };
        bench.inputs.boot = true;
        bench.sim.step(0, &bench.inputs, &mut bench.out);
        bench.inputs.boot = false;
        bench
    }

    /// One window; its outputs are in `out`.
    pub fn window(&mut self, until: Ns, commands: &[AmplifierCommand]) {
        self.inputs.from = self.t;
        self.inputs.until = until;
        self.inputs.mail.clear();
        self.inputs.mail.amplifier.extend_from_slice(commands);
        self.out.clear();
        self.sim.step(until, &self.inputs, &mut self.out);
        self.t = self.out.early.unwrap_or(until);
    }

    /// Windows of 5 ms.
    pub fn run(&mut self, seconds: f64) {
        let end = self.t + (seconds * 1e9) as Ns;
        while self.t < end {
            self.window((self.t + 5_000_000).min(end), &[]);
        }
    }
}

/// All amplifiers enabled, all brakes released.
pub fn free(t: Ns, volts: [f64; 7]) -> AmplifierCommand {
    AmplifierCommand { t, volts, enabled: 0x7F, brake_released: 0x7F }
}
