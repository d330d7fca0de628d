//! Ranks the integrators: energy drift without losses, error against a fine reference, time per step, with contact and
//! friction on and off. Semi-implicit Euler comes with the number of steps for which the arm is frozen. The default (10 kHz,
//! 10 steps) follows from it: in contact 0.13 N and 13 µm, a mere lead of half a step; of these 1 % because the arm is frozen
//! (7 % in free motion), which is a third of the time, and no more of the energy drifts. Beyond 10 steps there is little left
//! to win. Runge–Kutta, at more than ten times the cost, is for references and closed forms.
//! `cargo run --release -p hw_sim --example integrators`

use arm::FrozenArm;
use arm::drives::DriveData;
use hw_sim::contact::Contact;
use hw_sim::drive::Drive;
use hw_sim::drives::Drives;
use hw_sim::energy;
use hw_sim::integrate;
use hw_sim::plant::{Actuation, Evaluation, Plant};
use hw_sim::state::State;
use scenario::{Integrator, Scenario};
use std::time::Instant;

/// What is switched on.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    friction: f64,
    contact: bool,
}

const CASES: [Case; 4] = [
    Case { name: "free", friction: 0.0, contact: false },
    Case { name: "friction", friction: 1.0, contact: false },
    Case { name: "contact", friction: 0.0, contact: true },
    Case { name: "contact and friction", friction: 1.0, contact: true },
];

/// Integrator, and for how many steps the arm is frozen.
#[derive(Clone, Copy)]
struct Scheme {
    integrator: Integrator,
    frozen_steps: usize,
}

const SCHEMES: [Scheme; 6] = [Scheme::euler(1), Scheme::euler(2), Scheme::euler(5), Scheme::euler(10), Scheme::euler(20), Scheme::RK4];

impl Scheme {
    const RK4: Scheme = Scheme { integrator: Integrator::Rk4, frozen_steps: 1 };

    const fn euler(frozen_steps: usize) -> Scheme {
        Scheme { integrator: Integrator::SemiImplicit, frozen_steps }
    }

    fn name(&self) -> String {
        match self.integrator {
            Integrator::Rk4 => "rk4".into(),
            Integrator::SemiImplicit => format!("semi-implicit {}", self.frozen_steps),
        }
    }

    /// The evaluation with which step `n` begins.
    fn evaluate(
        &self,
        plant: &Plant,
        state: &State,
        actuation: &Actuation,
        arm: &mut Option<FrozenArm>,
        n: usize,
        h: f64,
    ) -> Evaluation {
        if n % self.frozen_steps == 0 {
            *arm = None;
        }
        let span = (self.frozen_steps - 1) as f64 * h;
        plant.evaluate_about(arm.get_or_insert_with(|| plant.frozen(state, span)), state, actuation)
    }
}

/// Simulated time, s.
const SPAN: f64 = 0.3;

fn main() -> Result<(), String> {
    let document = scenario::load("table-5-3", &[]).map_err(|error| format!("{error:?}"))?;
    let scenario = document.scenario().map_err(|error| format!("{error:?}"))?;
    println!("tool pushed into a 10 kN/m surface from 5 mm above it, {SPAN} s; errors against Runge-Kutta at 200 kHz");
    println!(
        "{:<22}{:<15}{:>9}{:>14}{:>14}{:>14}{:>10}",
        "case", "integrator", "rate kHz", "tool err um", "force err N", "energy mJ", "ns/step"
    );
    for case in CASES {
        let reference = simulate(&scenario, case, Scheme::RK4, 200_000.0)?;
        for scheme in SCHEMES {
            for rate in [2_000.0, 4_000.0, 10_000.0, 20_000.0] {
                let run = simulate(&scenario, case, scheme, rate)?;
                let error = |f: fn(&Track) -> f64| {
                    run.samples.iter().zip(&reference.samples).map(|(a, b)| (f(a) - f(b)).abs()).fold(0.0, f64::max)
                };
                // the quietest of ten runs
                let mut ns = run.ns_per_step;
                for _ in 0..9 {
                    ns = ns.min(simulate(&scenario, case, scheme, rate)?.ns_per_step);
                }
                let energy =
                    drift(&scenario, case, scheme, rate)?.map_or("-".into(), |joule| format!("{:.4}", 1e3 * joule));
                println!(
                    "{:<22}{:<15}{:>9}{:>14.4}{:>14.5}{:>14}{:>10.0}",
                    case.name,
                    scheme.name(),
                    rate / 1e3,
                    1e6 * error(|s| s.height),
                    error(|s| s.force),
                    energy,
                    ns
                );
            }
        }
    }
    Ok(())
}

/// Height of the tool (m) and contact force (N), every 0.5 ms.
struct Track {
    height: f64,
    force: f64,
}

struct Run {
    samples: Vec<Track>,
    ns_per_step: f64,
}

fn build(scenario: &Scenario, case: Case, lossless: bool) -> Result<(Plant, State), String> {
    let mut scenario = scenario.clone();
    scenario.plant.friction_scale = case.friction;
    if !case.contact {
        scenario.surfaces.clear();
    }
    let (mut plant, mut state) = Plant::new(&scenario)?;
    if lossless {
        let mut data: DriveData = scenario.drives()?;
        for joint in &mut data.joints {
            joint.damping_ratio = 0.0;
        }
        plant.drives = Drives::new(std::array::from_fn(|i| {
            Drive::new(&data.joints[i], 0.0, true, data.joints[i].rotor_inertia_at_output_kg_m2)
        }));
        for contact in &mut plant.contacts {
            if let Contact::Plane(plane) = contact {
                plane.material.friction = 0.0;
            }
        }
    }
    state.brake.fill(0.0);
    Ok((plant, state))
}

/// The motors carry the arm's weight and push the tool down with 60 N.
fn pushing(plant: &Plant, state: &State) -> Actuation {
    let jacobian = arm::jacobian(&plant.arm, &state.q);
    let push = jacobian.tr_mul(&arm::Spatial::new(0.0, 0.0, -60.0, 0.0, 0.0, 0.0));
    let volts = std::array::from_fn(|i| (state.load[i] + push[i]) / (plant.drives[i].motor_torque(1.0)));
    Actuation { volts, braked: 0, ..Actuation::SAFE }
}

fn simulate(scenario: &Scenario, case: Case, scheme: Scheme, rate: f64) -> Result<Run, String> {
    let (plant, mut state) = build(scenario, case, false)?;
    let actuation = pushing(&plant, &state);
    let (h, every) = (1.0 / rate, (rate / 2000.0) as usize);
    let steps = (SPAN * rate) as usize;
    let mut samples = Vec::with_capacity(steps / every + 1);
    let mut arm = None;
    let start = Instant::now();
    for n in 0..steps {
        let now = scheme.evaluate(&plant, &state, &actuation, &mut arm, n, h);
        if n % every == 0 {
            samples.push(Track { height: now.pose.p.z, force: now.touch.wrench[2] });
        }
        integrate::step(&plant, scheme.integrator, &mut state, &now, &actuation, &now.motor, h);
    }
    Ok(Run { samples, ns_per_step: start.elapsed().as_nanos() as f64 / steps as f64 })
}

/// Greatest change of the total energy (arm, rotors, springs, surface, and work done by the constant motor torques) of the
/// lossless system, J; none where friction takes energy.
fn drift(scenario: &Scenario, case: Case, scheme: Scheme, rate: f64) -> Result<Option<f64>, String> {
    if case.friction > 0.0 {
        return Ok(None);
    }
    let (plant, mut state) = build(scenario, case, true)?;
    let actuation = pushing(&plant, &state);
    let total = |state: &State| {
        let now = plant.evaluate(state, &actuation);
        let penetration = now.touch.penetration.max(0.0);
        let surface =
            plant.contacts.iter().map(|contact| 0.5 * contact.material().stiffness * penetration * penetration);
        energy::mechanical(&plant, state) + surface.sum::<f64>() - now.motor.dot(&state.theta)
    };
    let start = total(&state);
    let mut worst: f64 = 0.0;
    let mut arm = None;
    for n in 0..(SPAN * rate) as usize {
        let now = scheme.evaluate(&plant, &state, &actuation, &mut arm, n, 1.0 / rate);
        integrate::step(&plant, scheme.integrator, &mut state, &now, &actuation, &now.motor, 1.0 / rate);
        worst = worst.max((total(&state) - start).abs());
    }
    Ok(Some(worst))
}
