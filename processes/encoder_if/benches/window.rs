//! Time of one 5 ms window of the cards (50 steps of the arm, 14 reads), at rest and in motion: prints `name ns/window`.
//!
//!     cargo bench -p encoder_if

#[path = "../tests/cards/mod.rs"]
mod cards;

use cards::{PLANT_STEP, scenario};
use messages::registers::encoder;
use messages::{PlantSample, TransferRecord};
use std::hint::black_box;
use std::time::Instant;

const WINDOW: u64 = 5_000_000;
const WINDOWS: u64 = 2600;

fn main() {
    let scenario = scenario(&[]);
    for (name, rad_per_s) in [("rest", 0.0), ("creep", 1.0), ("motion", 100.0)] {
        let mut best = f64::INFINITY;
        for _ in 0..7 {
            let mut cards = encoder_if::EncoderIf::new(&scenario).unwrap();
            let (mut inputs, mut out) = (board::Inputs::default(), board::Outputs::default());
            let mut busy = 0;
            for window in 0..WINDOWS {
                (inputs.from, inputs.until) = (window * WINDOW, (window + 1) * WINDOW);
                inputs.mail.plant.clear();
                for step in 0..=WINDOW / PLANT_STEP {
                    let t = inputs.from + step * PLANT_STEP;
                    let theta = [rad_per_s * t as f64 * 1e-9 + 0.1; 7];
                    inputs.mail.plant.push(PlantSample {
                        t,
                        theta,
                        ..bytemuck::Zeroable::zeroed()
                    });
                }
                inputs.transfers.clear();
                for index in 0..14_u16 {
                    let (joint, register) = (
                        u32::from(index % 7),
                        [encoder::COUNT, encoder::VELOCITY][usize::from(index / 7)],
                    );
                    let card = scenario
                        .card_base(&format!("encoder-{}", joint / 2 + 1))
                        .unwrap();
                    inputs.transfers.push(TransferRecord {
                        data_at: inputs.from + 150_000 + u64::from(index) * 1500,
                        addr: card + encoder::CHANNEL * (joint % 2) + register,
                        n: 1,
                        index,
                        width: 2,
                        ..bytemuck::Zeroable::zeroed()
                    });
                }
                out.clear();
                let start = Instant::now();
                board::Board::step(&mut cards, 0, black_box(&inputs), &mut out);
                busy += start.elapsed().as_nanos() as u64;
                black_box(&out);
            }
            best = best.min(busy as f64 / WINDOWS as f64);
        }
        println!("{name:8} {best:8.0} ns/window");
    }
}
