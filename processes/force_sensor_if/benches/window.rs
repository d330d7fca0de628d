//! Time of one 5 ms window of the card (40 samples, 8 reads), without and with noise: prints `name ns/window`.
//!
//!     cargo bench -p force_sensor_if

#[path = "../tests/card/mod.rs"]
mod card;

use card::{PLANT_STEP, scenario};
use messages::registers::force;
use messages::{PlantSample, TransferRecord};
use std::hint::black_box;
use std::time::Instant;

const WINDOW: u64 = 5_000_000;
const WINDOWS: u64 = 2600;

fn main() {
    for (name, noise) in [
        ("quiet", "force_sensor_if.noise_n=0"),
        ("noise", "force_sensor_if.noise_n=0.5"),
    ] {
        let scenario = scenario(&[noise]);
        let base = scenario.card_base("force-sensor").unwrap();
        let mut best = f64::INFINITY;
        for _ in 0..7 {
            let mut card = force_sensor_if::ForceSensorIf::new(&scenario).unwrap();
            let (mut inputs, mut out) = (board::Inputs::default(), board::Outputs::default());
            let mut busy = 0;
            for window in 0..WINDOWS {
                (inputs.from, inputs.until) = (window * WINDOW, (window + 1) * WINDOW);
                inputs.mail.plant.clear();
                for step in 0..=WINDOW / PLANT_STEP {
                    let t = inputs.from + step * PLANT_STEP;
                    let wrench = [(t % 1_000_003) as f64 * 1e-4; 6];
                    inputs.mail.plant.push(PlantSample {
                        t,
                        wrench,
                        ..bytemuck::Zeroable::zeroed()
                    });
                }
                inputs.transfers.clear();
                for index in 0..8 {
                    inputs.transfers.push(TransferRecord {
                        data_at: inputs.from + 150_000 + u64::from(index) * 1500,
                        addr: base + force::filter(4) + 2 * u32::from(index),
                        n: 1,
                        index,
                        width: 1,
                        ..bytemuck::Zeroable::zeroed()
                    });
                }
                out.clear();
                let start = Instant::now();
                board::Board::step(&mut card, 0, black_box(&inputs), &mut out);
                busy += start.elapsed().as_nanos() as u64;
                black_box(&out);
            }
            best = best.min(busy as f64 / WINDOWS as f64);
        }
        println!("{name:8} {best:8.0} ns/window");
    }
}
