//! Rates of the arbiter and of the timing plane on this machine: `cargo bench -p vme`. Prints, asserts nothing.

use std::hint::black_box;
use std::time::Instant;
use vme::arbiter::Mode;
use vme::queueing::{Offered, simulate};
use vme::rack::{Rack, Slave, Task};
use vme::traffic::Arrivals;
use vme::{Access, Direction, Ns, Op, Stop, Timing, Transfer, Width};

const PERIOD: Ns = 5_000_000;

fn main() {
    for (mode, load) in [(Mode::Pri, [0.1, 0.3, 0.3, 0.2]), (Mode::Rrs, [0.2; 4]), (Mode::Sgl, [0.2; 4])] {
        let transfers = 10_000_000;
        let offered = Offered { mode, service_ns: 1_000, load, arrivals: Arrivals::Poisson, transfers, seed: 1 };
        let start = Instant::now();
        black_box(simulate(&offered).map(|observed| observed.simulated_ns).unwrap_or_default());
        let rate = transfers as f64 / start.elapsed().as_secs_f64();
        println!("arbiter {mode:?}: {:.1} M transfers/s", rate / 1e6);
    }
    nominal_window();
}

/// The nominal control window: 17 reads, a decision, 8 writes; a copy run ahead, as the chassis does.
fn nominal_window() {
    let access = |addr, dir| Op::Access(Access { am: 0x3D, addr, width: Width::D16, dir, n: 1 });
    let mut reads = vec![Op::Exec(20_000)];
    reads.extend((0..17).map(|i| access(0x10_0000 + 2 * i, Direction::Read)));
    reads.push(Op::Decide);
    let mut rest = vec![Op::Exec(500_000)];
    rest.extend((0..8).map(|i| access(0x30_0000 + 2 * i, Direction::Write)));
    let slaves = (0..9u8)
        .map(|i| Slave {
            name: format!("card-{i}"),
            slot: 3 + i,
            am: 0x3D,
            base: 0x10_0000 + 0x4_0000 * u32::from(i),
            size: 0x1000,
            read_ns: 350,
            write_ns: 400,
            ..Slave::default()
        })
        .collect();
    let tasks = ["control", "console"]
        .iter()
        .map(|name| Task {
            name: (*name).into(),
            processor: format!("cpu-{name}"),
            period_ns: if *name == "control" { PERIOD } else { 20 * PERIOD },
            ..Task::default()
        })
        .collect();
    let rack = Rack { slaves, tasks, ..Rack::default() };
    let mut timing = match Timing::new(rack) {
        Ok(timing) => timing,
        Err(error) => return println!("nominal rack: {error}"),
    };
    timing.set_program(0, &reads);
    let windows = 200_000u64;
    let (mut ahead, mut transfers) = (timing.clone(), Vec::<Transfer>::new());
    let mut moved = 0;
    let start = Instant::now();
    for _ in 0..windows {
        ahead.clone_from(&timing);
        transfers.clear();
        if let Stop::Decision { task, .. } = ahead.advance(Ns::MAX, &mut transfers) {
            ahead.resume(task, &rest);
        }
        std::mem::swap(&mut timing, &mut ahead);
        moved += transfers.len();
    }
    let each = start.elapsed().as_secs_f64() / windows as f64;
    println!("nominal window: {:.2} µs with its copy, {:.1} transfers", each * 1e6, moved as f64 / windows as f64);
}
