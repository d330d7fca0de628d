//! The cards with a master that writes and reads by hand.
#![allow(dead_code)] // every test binary uses a part of it

use board::{Board, Inputs, Outputs};
use bytemuck::Zeroable;
use da_io::DaIo;
use messages::registers::parallel;
use messages::{AmplifierCommand, BusWord, PlantSample, TransferRecord};
use scenario::Scenario;

pub const MS: u64 = 1_000_000;
pub const TASK: u16 = 0;
pub const READ: u8 = 0;
pub const WRITE: u8 = 1;

pub fn scenario() -> Scenario {
    scenario::load("table-5-3", &[]).expect("built in").scenario().expect("valid")
}

/// Cards with a master that writes and reads by hand.
pub struct Bench {
    pub board: DaIo,
    pub inputs: Inputs,
    pub out: Outputs,
    pub da_1: u32,
    pub da_2: u32,
    pub io: u32,
    /// Next window's transfers: instant, address, direction, value, status.
    pub accesses: Vec<(u64, u32, u8, u32, u8)>,
    index: u16,
}

impl Bench {
    pub fn new() -> Bench {
        Bench::of(&scenario())
    }

    /// The cards of this scenario.
    pub fn of(scenario: &Scenario) -> Bench {
        let base = |card| scenario.card_base(card).expect("a card of the rack");
        let mut bench = Bench {
            board: DaIo::new(scenario).expect("a rack with the cards"),
            inputs: Inputs { boot: true, ..Inputs::default() },
            out: Outputs::default(),
            da_1: base("da-1"),
            da_2: base("da-2"),
            io: base("parallel-io"),
            accesses: Vec::new(),
            index: 0,
        };
        bench.board.step(0, &bench.inputs, &mut bench.out);
        bench.inputs.boot = false;
        bench
    }

    pub fn write(&mut self, t: u64, addr: u32, value: u32) {
        self.accesses.push((t, addr, WRITE, value, 0));
    }

    pub fn read(&mut self, t: u64, addr: u32) {
        self.accesses.push((t, addr, READ, 0, 0));
    }

    pub fn signal(&mut self, t: u64, status: u32) {
        self.inputs.mail.plant.push(PlantSample { t, status, ..PlantSample::zeroed() });
    }

    /// One window with what was asked for, words posted in it.
    pub fn window(&mut self, until: u64) -> Vec<AmplifierCommand> {
        self.inputs.transfers.clear();
        for (data_at, addr, dir, value, status) in self.accesses.drain(..) {
            let index = self.index;
            self.index += 1;
            if dir == WRITE {
                self.inputs.mail.words.push(BusWord { t: 0, addr, value, job: 0, task: TASK, index });
            }
            let width = 2;
            self.inputs.transfers.push(TransferRecord {
                data_at,
                addr,
                n: 1,
                task: TASK,
                index,
                dir,
                status,
                width,
                ..TransferRecord::zeroed()
            });
        }
        self.step(until)
    }

    pub fn step(&mut self, until: u64) -> Vec<AmplifierCommand> {
        self.inputs.until = until;
        self.out.clear();
        self.board.step(until, &self.inputs, &mut self.out);
        self.inputs.mail.clear();
        self.inputs.from = until;
        self.inputs.rerun = false;
        self.out.mail.amplifier.clone()
    }

    /// Amplifiers on, brakes off, heartbeat running.
    pub fn powered() -> Bench {
        Bench::new().power_up()
    }

    /// Amplifiers on, brakes off, heartbeat running, from 1 ms on.
    pub fn power_up(mut self) -> Bench {
        let bench = &mut self;
        let io = bench.io;
        bench.write(MS, io + parallel::ENABLE, 0x7F);
        bench.write(MS + 1, io + parallel::BRAKE, 0x7F);
        bench.write(MS + 2, io + parallel::WATCHDOG, 1);
        bench.window(16 * MS + 10);
        self
    }

    pub fn events(&self) -> Vec<u32> {
        self.out.mail.events.iter().map(|event| event.kind).collect()
    }
}
