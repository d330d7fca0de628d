//! Time per step of the hardware as the rack runs it: REDIESTRO with flexible joints and friction, pressed on a board,
//! windows of 5 ms at 10 kHz, samples and probes included. Prints `plant_step ns`, the fastest of the batches.
//!
//!     cargo run --release -p hw_sim --example plant_step              # 200 batches
//!     valgrind --tool=callgrind plant_step 2                          # count instructions instead

use board::{Board, Inputs, Outputs};
use hw_sim::HwSim;
use messages::{AmplifierCommand, Ns};
use std::time::Instant;

/// A control period.
const WINDOW: Ns = 5_000_000;
/// Windows in a batch: half a second.
const WINDOWS: u64 = 100;
const STEPS_PER_WINDOW: u64 = 50;

fn main() -> Result<(), String> {
    let batches: u32 = match std::env::args().nth(1) {
        Some(text) => text.parse().map_err(|error| format!("number of batches: {text}: {error}"))?,
        None => 200,
    };
    let document = scenario::load("table-5-3", &[]).map_err(|error| format!("{error:?}"))?;
    let mut scenario = document.scenario().map_err(|error| format!("{error:?}"))?;
    // pressed 1 mm into the board, so that contact and its friction are in every step
    scenario.surfaces[0].position_m[2] = -0.001;
    let mut sim = HwSim::new(&scenario)?;
    let (mut inputs, mut out) = (Inputs { boot: true, ..Inputs::default() }, Outputs::default());
    sim.step(0, &inputs, &mut out);
    inputs.boot = false;
    let drives = scenario.drives()?;
    let load = sim.state().load;
    let mut fastest = f64::INFINITY;
    for _ in 0..batches {
        let start = Instant::now();
        for _ in 0..WINDOWS {
            inputs.from = inputs.until;
            inputs.until = inputs.from + WINDOW;
            inputs.mail.clear();
            // the arm's weight and a small swing: the amplifiers change at the D/A's instant, off the grid
            let swing = libm::sin(inputs.from as f64 * 3e-9);
            let volts = std::array::from_fn(|i| (load[i] * (1.0 + 0.1 * swing)) / drives.joints[i].amplifier_nm_per_v);
            let command = AmplifierCommand { t: inputs.from + 1_652_345, volts, enabled: 0x7F, brake_released: 0x7F };
            inputs.mail.amplifier.push(command);
            out.clear();
            sim.step(inputs.until, &inputs, &mut out);
        }
        let steps = WINDOWS * STEPS_PER_WINDOW;
        fastest = fastest.min(start.elapsed().as_nanos() as f64 / steps as f64);
        if sim.state().out_of_domain(scenario.plant.runaway_rad_per_s).is_some() {
            return Err("the arm ran away".into());
        }
    }
    println!("plant_step {fastest:8.1}");
    Ok(())
}
