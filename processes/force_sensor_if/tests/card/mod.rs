//! The receiver card on a test bench: a wrench as a function of time on its wires, accesses at chosen instants.

#![allow(dead_code)] // every test binary uses a part of it

use board::{Board, Inputs, Outputs};
use force_sensor_if::ForceSensorIf;
use messages::{BusWord, Event, PlantSample, TransferRecord};
use scenario::Scenario;
use vme::Ns;

/// Steps of the arm on the wires.
pub const PLANT_STEP: Ns = 100_000;
pub const MS: Ns = 1_000_000;

/// Table 5-3 with these overrides.
pub fn scenario(overrides: &[&str]) -> Scenario {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    scenario::load("table-5-3", &overrides)
        .unwrap_or_else(|error| panic!("{error:?}"))
        .scenario()
        .unwrap()
}

/// One access: instant, byte offset in the card, and the value where it is a write.
#[derive(Clone, Copy)]
pub struct Access {
    pub t: Ns,
    pub offset: u32,
    pub write: Option<u32>,
    pub status: u8,
}

pub fn read(t: Ns, offset: u32) -> Access {
    Access {
        t,
        offset,
        write: None,
        status: 0,
    }
}

pub fn write(t: Ns, offset: u32, value: i16) -> Access {
    Access {
        t,
        offset,
        write: Some(u32::from(value as u16)),
        status: 0,
    }
}

pub struct Bench<W> {
    pub board: ForceSensorIf,
    pub events: Vec<Event>,
    wrench: W,
    base: u32,
    width: u8,
    now: Ns,
    job: u32,
    inputs: Inputs,
    out: Outputs,
}

impl<W: Fn(f64) -> [f64; 6]> Bench<W> {
    /// The card of the scenario after its first step, with `wrench(seconds)` on its wires.
    pub fn new(scenario: &Scenario, wrench: W) -> Self {
        let mut bench = Bench {
            board: ForceSensorIf::new(scenario).unwrap(),
            events: Vec::new(),
            wrench,
            base: scenario.card_base("force-sensor").unwrap(),
            width: 1,
            now: 0,
            job: 0,
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

    /// Accesses are longwords from now on.
    pub fn longwords(mut self) -> Self {
        self.width = 2;
        self
    }

    fn signal(&self, t: Ns) -> PlantSample {
        let wrench = (self.wrench)(t as f64 * 1e-9);
        PlantSample {
            t,
            wrench,
            ..bytemuck::Zeroable::zeroed()
        }
    }

    /// One window up to `until` with these accesses; returns the words read.
    pub fn window(&mut self, until: Ns, accesses: &[Access]) -> &[BusWord] {
        self.job += 1;
        self.inputs.mail.clear();
        self.inputs.transfers.clear();
        (self.inputs.from, self.inputs.until) = (self.now, until);
        let steps = self.now / PLANT_STEP + 1..until.div_ceil(PLANT_STEP);
        let times = std::iter::once(self.now).chain(steps.map(|step| step * PLANT_STEP));
        for t in times.chain((until > self.now).then_some(until)) {
            let sample = self.signal(t);
            self.inputs.mail.plant.push(sample);
        }
        for (index, access) in (0..).zip(accesses) {
            let addr = self.base + access.offset;
            if let Some(value) = access.write {
                self.inputs.mail.words.push(BusWord {
                    t: 0,
                    addr,
                    value,
                    job: self.job,
                    task: 0,
                    index,
                });
            }
            self.inputs.transfers.push(TransferRecord {
                data_at: access.t,
                addr,
                n: 1,
                job: self.job,
                index,
                width: self.width,
                dir: u8::from(access.write.is_some()),
                status: access.status,
                ..bytemuck::Zeroable::zeroed()
            });
        }
        self.out.clear();
        self.board.step(until, &self.inputs, &mut self.out);
        self.events.extend(&self.out.mail.events);
        self.now = until;
        &self.out.mail.words
    }

    /// Runs on to `t` in windows of 5 ms.
    pub fn run(&mut self, t: Ns) {
        while self.now < t {
            self.window(t.min(self.now + 5 * MS), &[]);
        }
    }

    /// Runs to `t` and reads one register there.
    pub fn read(&mut self, t: Ns, offset: u32) -> u32 {
        self.run(t);
        self.window(t, &[read(t, offset)])[0].value
    }

    /// Runs to `t` and reads one signed word there.
    pub fn read_signed(&mut self, t: Ns, offset: u32) -> f64 {
        f64::from(self.read(t, offset) as u16 as i16)
    }
}
