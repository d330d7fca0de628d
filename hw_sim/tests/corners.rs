//! Nothing blows up at the default rate over the whole range of stiffness, damping and friction that a scenario may name.

mod common;

use common::scenario;
use hw_sim::integrate;
use hw_sim::plant::{Actuation, Plant};
use scenario::{Integrator, Joints, Scenario};

/// Presses the tool down with 60 N from its start and pulls it up again; greatest contact force seen, N.
fn press(scenario: &Scenario, integrator: Integrator) -> f64 {
    let (plant, mut state) = Plant::new(scenario).expect("simulable");
    let jacobian = arm::jacobian(&plant.arm, &state.q);
    let volts = |force: f64| {
        let push = jacobian.tr_mul(&arm::Spatial::new(0.0, 0.0, force, 0.0, 0.0, 0.0));
        std::array::from_fn(|i| (state.load[i] + push[i]) / plant.drives[i].motor_torque(1.0))
    };
    let (down, up) = (volts(-60.0), volts(60.0));
    state.brake.fill(0.0);
    let steps = (0.4 * scenario.plant.rate_hz) as usize;
    let mut greatest: f64 = 0.0;
    for n in 0..steps {
        let actuation = Actuation { volts: if n < steps / 2 { down } else { up }, braked: 0, ..Actuation::SAFE };
        let now = plant.evaluate(&state, &actuation);
        greatest = greatest.max(now.touch.wrench.fixed_rows::<3>(0).norm());
        integrate::step(&plant, integrator, &mut state, &now, &actuation, &now.motor, 1.0 / scenario.plant.rate_hz);
        assert_eq!(state.out_of_domain(3.0), None, "{:?} {integrator:?} step {n}", scenario.surfaces);
    }
    greatest
}

#[test]
fn every_corner_of_the_range_of_surfaces_and_drives_stays_bounded() {
    for joints in [Joints::Flexible, Joints::Rigid] {
        for integrator in [Integrator::SemiImplicit, Integrator::Rk4] {
            for corner in 0..16 {
                let bit = |k: u32, low: f64, high: f64| if corner & (1 << k) == 0 { low } else { high };
                let mut scenario = scenario(&[]);
                scenario.plant.joints = joints;
                scenario.plant.friction_scale = bit(0, 0.0, 10.0);
                let surface = &mut scenario.surfaces[0];
                surface.position_m[2] = 1e-4;
                surface.stiffness_n_per_m = bit(1, 1.0, 1e6);
                surface.hunt_crossley_s_per_m = bit(2, 0.0, 10.0);
                surface.friction = bit(3, 0.0, 2.0);
                let force = press(&scenario, integrator);
                // an impact of 51 kg at what 60 N give it in 0.2 s, on the stiffest surface, is far below
                assert!(force < 5_000.0, "{joints:?} {integrator:?} corner {corner}: {force} N");
            }
        }
    }
}

#[test]
fn the_stiffest_hole_stays_bounded_with_the_peg_pressed_on_its_chamfer() {
    for friction in [0.0, 2.0] {
        let mut scenario = scenario(&[]);
        scenario.surfaces.clear();
        let mut hole = scenario::load("peg-in-hole", &[]).and_then(|document| document.scenario()).expect("valid").holes;
        hole[0].position_m[2] = 1e-4;
        hole[0].stiffness_n_per_m = 1e6;
        hole[0].hunt_crossley_s_per_m = 10.0;
        hole[0].friction = friction;
        scenario.holes = hole;
        scenario.plant.friction_scale = 0.0;
        let force = press(&scenario, Integrator::SemiImplicit);
        assert!((10.0..5_000.0).contains(&force), "{force} N");
    }
}
