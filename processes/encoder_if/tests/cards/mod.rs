//! The encoder cards on a test bench: shafts that turn as a function of time, accesses at chosen instants.

#![allow(dead_code)] // every test binary uses a part of it

use board::{Board, Inputs, Outputs};
use core::f64::consts::TAU;
use encoder_if::EncoderIf;
use messages::registers::encoder;
use messages::{BusWord, PlantSample, TransferRecord};
use scenario::Scenario;
use vme::Ns;

/// Steps of the arm on the wires.
pub const PLANT_STEP: Ns = 100_000;
pub const MS: Ns = 1_000_000;
/// Counts per turn of REDIESTRO's encoders.
pub const TURN: f64 = 4000.0;

/// Table 5-3 with these overrides.
pub fn scenario(overrides: &[&str]) -> Scenario {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    scenario::load("table-5-3", &overrides)
        .unwrap_or_else(|error| panic!("{error:?}"))
        .scenario()
        .unwrap()
}

pub struct Bench<P> {
    board: EncoderIf,
    /// Angle of every shaft in counts, from seconds.
    position: P,
    bases: [u32; 4],
    now: Ns,
    inputs: Inputs,
    out: Outputs,
}

impl<P: Fn(f64) -> f64> Bench<P> {
    /// The cards of the scenario after their first step, all shafts at `position(seconds)` counts.
    pub fn new(scenario: &Scenario, position: P) -> Self {
        let bases = [1, 2, 3, 4].map(|k| scenario.card_base(&format!("encoder-{k}")).unwrap());
        let mut bench = Bench {
            board: EncoderIf::new(scenario).unwrap(),
            position,
            bases,
            now: 0,
            inputs: Inputs {
                boot: true,
                ..Inputs::default()
            },
            out: Outputs::default(),
        };
        bench.window(0, &[]);
        bench.inputs.boot = false;
        bench
    }

    pub fn addr(&self, joint: usize, register: u32) -> u32 {
        self.bases[joint / 2] + encoder::CHANNEL * (joint % 2) as u32 + register
    }

    fn signal(&self, t: Ns) -> PlantSample {
        let at = |ns: f64| (self.position)(ns * 1e-9) / TURN * TAU;
        let t0 = t as f64;
        PlantSample {
            t,
            theta: [at(t0); 7],
            theta_dot: [(at(t0 + 50.0) - at(t0 - 50.0)) / 100e-9; 7],
            ..bytemuck::Zeroable::zeroed()
        }
    }

    /// One window up to `until` with accesses (instant, address, write); returns the words read.
    pub fn window(&mut self, until: Ns, accesses: &[(Ns, u32, bool)]) -> &[BusWord] {
        self.inputs.mail.clear();
        self.inputs.transfers.clear();
        (self.inputs.from, self.inputs.until) = (self.now, until);
        let steps = self.now / PLANT_STEP + 1..until.div_ceil(PLANT_STEP);
        let times = std::iter::once(self.now).chain(steps.map(|step| step * PLANT_STEP));
        for t in times.chain((until > self.now).then_some(until)) {
            let sample = self.signal(t);
            self.inputs.mail.plant.push(sample);
        }
        for (index, (data_at, addr, write)) in (0..).zip(accesses) {
            self.inputs.transfers.push(TransferRecord {
                data_at: *data_at,
                addr: *addr,
                n: 1,
                index,
                width: 2,
                dir: u8::from(*write),
                ..bytemuck::Zeroable::zeroed()
            });
        }
        self.out.clear();
        self.board.step(until, &self.inputs, &mut self.out);
        self.now = until;
        &self.out.mail.words
    }

    /// Runs to `t` and reads one register of a joint there.
    pub fn read(&mut self, t: Ns, joint: usize, register: u32) -> i32 {
        while self.now < t {
            self.window(t.min(self.now + 5 * MS), &[]);
        }
        let addr = self.addr(joint, register);
        self.window(t, &[(t, addr, false)])[0].value as i32
    }

    /// Runs to `t` and reads the speed of joint 1 there, counts/s.
    pub fn speed(&mut self, t: Ns) -> f64 {
        f64::from(self.read(t, 0, encoder::VELOCITY)) * encoder::VELOCITY_LSB
    }
}
