//! Cost of recording one window of 5 ms: `cargo run --release -p bus_analyzer --example recording_cost [FILE]`.
//!
//! It makes up the messages of a 13 s run (31 transfers a window) and times the board's steps; the last record stays in FILE.

use board::{Board, Inputs, Outputs};
use bus_analyzer::BusAnalyzer;
use bytemuck::Zeroable;
use messages::{ControlProbe, Event, EventKind, PlantProbe, Severity, TransferRecord};
use std::time::Instant;

const TOML: &str = "title = \"made up\"\n";
const WINDOWS: u64 = 2600;

fn window(k: u64) -> Inputs {
    let until = k * 5_000_000;
    let mut inputs = Inputs {
        from: until.saturating_sub(5_000_000),
        until,
        boot: k == 0,
        finish: k + 1 == WINDOWS,
        ..Inputs::default()
    };
    let value = |i: usize| ((k as usize * 31 + i) as f64).sqrt();
    let mut plant = PlantProbe {
        t: until,
        ..PlantProbe::zeroed()
    };
    for (i, joints) in [
        &mut plant.q,
        &mut plant.qd,
        &mut plant.theta,
        &mut plant.motor_torque,
    ]
    .into_iter()
    .enumerate()
    {
        *joints = std::array::from_fn(|j| value(7 * i + j));
    }
    let mut control = ControlProbe {
        t: until,
        job: k as u32,
        ..ControlProbe::zeroed()
    };
    for (i, joints) in [
        &mut control.q,
        &mut control.qd,
        &mut control.qdd,
        &mut control.torque,
    ]
    .into_iter()
    .enumerate()
    {
        *joints = std::array::from_fn(|j| value(100 + 7 * i + j));
    }
    control.fe = std::array::from_fn(value);
    inputs.mail.plant_probe.push(plant);
    inputs.mail.control_probe.push(control);
    if k.is_multiple_of(600) {
        inputs.mail.events.push(Event::new(
            until,
            EventKind::SegmentStart,
            Severity::Ok,
            (k / 600) as f64,
            0.0,
        ));
    }
    for i in 0..31 {
        let at = inputs.from + 1135 * i;
        inputs.mail.transfers.push(TransferRecord {
            requested: at,
            granted: at + 300,
            data_at: at + 735,
            done: at + 835,
            addr: 0x20_0000 + 4 * i as u32,
            job: k as u32,
            index: i as u16,
            ..TransferRecord::zeroed()
        });
    }
    inputs
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = scenario::load("table-5-3", &[])?.scenario()?;
    let file = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "/dev/null".into());
    let windows: Vec<_> = (0..WINDOWS).map(window).collect();
    let cost = |name: &str, mut analyzer: BusAnalyzer| {
        let mut out = Outputs::default();
        let start = Instant::now();
        for inputs in &windows {
            analyzer.step(inputs.until, inputs, &mut out);
        }
        let each = start.elapsed().as_secs_f64() * 1e6 / windows.len() as f64;
        println!("{name:<24} {each:6.2} µs a window");
    };
    for _ in 0..3 {
        cost(
            "record",
            BusAnalyzer::new(&scenario, Some(file.as_ref()), TOML)?,
        );
        cost(
            "digest",
            BusAnalyzer::new(&scenario, None, "")?.with_digest(),
        );
        cost(
            "record and digest",
            BusAnalyzer::new(&scenario, Some(file.as_ref()), TOML)?.with_digest(),
        );
        cost("neither", BusAnalyzer::new(&scenario, None, "")?);
    }
    Ok(())
}
