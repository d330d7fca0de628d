//! Time of one control step (forward kinematics, J, J̇q̇, AHIC, ERC, RR, inverse dynamics), in contact at the table-top
//! posture: `cargo run --release -p control_computer --example control_step`.

use control_computer::{Mode, Pipeline, Sensed};
use std::error::Error;
use std::time::Instant;

const STEPS: u32 = 1_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let scenario = scenario::load("table-5-3", &[])?.scenario()?;
    let mut pipeline = Pipeline::new(&scenario)?;
    let mut sensed = Sensed {
        q: scenario.initial_posture()?,
        qd: arm::JointVector::zeros(),
        wrench: arm::Spatial::new(0.0, 0.0, 20.0, 0.0, 0.0, 0.0),
    };
    let mut sum = 0.0;
    for round in 0..5 {
        let begin = Instant::now();
        for step in 0..STEPS {
            // a slightly different state each time, so that nothing can be taken out of the loop
            sensed.qd[0] = 1e-9 * f64::from(step);
            sum += pipeline.step(u64::from(step), 1e-6, &sensed, Mode::Law).torque[0];
        }
        let ns = begin.elapsed().as_nanos() as f64 / f64::from(STEPS);
        println!("round {round}: {ns:.0} ns a control step");
    }
    println!("(checksum {sum})");
    Ok(())
}
