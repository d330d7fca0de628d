//! The process of `force_sensor_if`.

use std::process::ExitCode;

fn main() -> ExitCode {
    pacing::serve(&|_, context| {
        Ok(Box::new(force_sensor_if::ForceSensorIf::new(
            &context.scenario,
        )?))
    })
}
