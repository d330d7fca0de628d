//! Made-up runs of Table 5-3: a mass on an impedance with a constant force error, sampled like a rack's probes.

#![allow(dead_code)] // each test file uses its part

use bytemuck::Zeroable;
use messages::{ControlProbe, PlantProbe};
use report::{Ended, Ledger, Trace, VariantResult};
use scenario::{Scenario, Variant};
use vme::{Access, Direction, Origin, Status, Transfer, Width};

const PERIOD_S: f64 = 0.005;

/// The scenario and its variants.
pub fn table_5_3() -> Vec<(Variant, Scenario)> {
    scenario::load("table-5-3", &[]).unwrap().variants().unwrap()
}

/// A run along z whose force is off by `error_n` (it never touches where the error is NaN), cut at `until_s`.
pub fn trace(scenario: &Scenario, error_n: f64, until_s: f64) -> Trace {
    let mut trace = Trace::default();
    let (mut x, mut v) = (0.0, 0.0);
    let steps = 100;
    for k in 0..=(until_s / PERIOD_S).round() as u64 {
        let t = k as f64 * PERIOD_S;
        let touched = !error_n.is_nan();
        let force = |x: f64| {
            if touched { (10_000.0 * (x - 0.005)).max(0.0) } else { 0.0 }
        };
        let at = (t * 1e9).round() as u64;
        let mut plant = PlantProbe { t: at, ..PlantProbe::zeroed() };
        plant.contact[2] = force(x);
        plant.position[2] = if touched { x } else { 1e-4 * t };
        plant.q = scenario.arm.posture_deg.map(f64::to_radians);
        plant.qd = [0.1 * v; 7];
        trace.plant.push(plant);
        let mut control = ControlProbe { t: at, job: k as u32, ..ControlProbe::zeroed() };
        control.xt[2] = x + 0.0005;
        control.torque = std::array::from_fn(|i| 20.0 + (1.0 + i as f64) * force(x) * 0.1);
        trace.control.push(control);
        let segments = scenario.resolved_segments();
        let Some(segment) = segments.iter().find(|segment| t < segment.end_s) else {
            continue;
        };
        let h = PERIOD_S / f64::from(steps);
        for _ in 0..steps {
            let (s, m, b, k) =
                (f64::from(segment.selection[2]), segment.mass[2], segment.damping[2], segment.stiffness[2]);
            let wanted = segment.force[2] + if touched { error_n } else { 0.0 };
            v += h / m * ((1.0 - s) * wanted - b * v - s * k * x - force(x));
            x += h * v;
        }
    }
    trace
}

/// Reads and writes as a control job makes them.
pub fn ledger(scenario: &Scenario) -> Ledger {
    let mut ledger = Ledger::new(scenario);
    for job in 0..1000 {
        for (i, card) in scenario.rack.slaves.iter().enumerate() {
            let dir = if card.board == "da_io" { Direction::Write } else { Direction::Read };
            ledger.push(&Transfer {
                task: 0,
                job,
                index: i as u16,
                access: Access { am: card.am, addr: card.base, width: Width::D32, dir, n: 1 },
                slave: Some(i as u16),
                requested: 0,
                granted: 300,
                data_at: 700,
                done: 785 + u64::from(job % 7) * 40 + card.read_ns,
                status: Status::Ok,
                origin: Origin::Program,
                master: 0,
                held_ns: 485,
                posted: false,
                attempt: 0,
            });
        }
    }
    ledger
}

/// The result of a made-up run that was completed.
pub fn result(variant: &Variant, scenario: &Scenario, error_n: f64) -> VariantResult {
    let trace = trace(scenario, error_n, 13.0);
    VariantResult::new(scenario, variant, &trace, &ledger(scenario), Ended::Completed, 13.0).unwrap()
}
