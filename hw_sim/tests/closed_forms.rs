//! Contact and drives against closed forms, on the one-axis arm.

mod common;

use common::scenario;
use hw_sim::drive::Drive;
use hw_sim::drives::Drives;
use hw_sim::integrate;
use hw_sim::plant::{Actuation, Plant};
use hw_sim::state::State;
use scenario::{Integrator, Joints, Robot};

const MASS: f64 = 10.0;
const STEP: f64 = 1e-4;

/// A mass moving along base z (−task z) above a surface at q = 0.
fn slide(stiffness: f64, hunt_crossley: f64) -> (Plant, State) {
    let mut scenario = scenario(&[]);
    scenario.arm.robot = Robot::Slide;
    scenario.arm.slide_mass_kg = MASS;
    scenario.arm.start_position_m = [0.0, 0.0, 0.9];
    scenario.plant.joints = Joints::Rigid;
    scenario.surfaces[0].position_m = [-0.6, 0.0, 0.9];
    scenario.surfaces[0].stiffness_n_per_m = stiffness;
    scenario.surfaces[0].hunt_crossley_s_per_m = hunt_crossley;
    let (plant, mut state) = Plant::new(&scenario).expect("simulable");
    state.brake.fill(0.0);
    (plant, state)
}

fn push(force: f64) -> Actuation {
    Actuation { volts: [force / 1e4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], braked: 0, ..Actuation::SAFE }
}

/// Steps until `stop`, at most 20 s; the time taken.
fn run(
    plant: &Plant,
    integrator: Integrator,
    state: &mut State,
    actuation: &Actuation,
    h: f64,
    stop: impl Fn(&State, f64) -> bool,
) -> f64 {
    let mut n = 0.0;
    while !stop(state, n * h) && n * h < 20.0 {
        let now = plant.evaluate(state, actuation);
        integrate::step(plant, integrator, state, &now, actuation, &now.motor, h);
        n += 1.0;
    }
    n * h
}

/// Speed after a bounce at `v`.
fn bounce(plant: &Plant, integrator: Integrator, h: f64, v: f64) -> (f64, f64) {
    let mut state = State::at_rest(arm::JointVector::zeros());
    state.q[0] = 1e-12;
    state.qd[0] = -v;
    state.theta_dot[0] = -v;
    let t = run(plant, integrator, &mut state, &push(0.0), h, |s, t| t > h && s.q[0] > 0.0);
    (state.qd[0], t)
}

#[test]
fn at_rest_the_penetration_is_force_over_stiffness() {
    for integrator in [Integrator::SemiImplicit, Integrator::Rk4] {
        for stiffness in [1e3, 1e4, 1e6] {
            // 0.7 of critical damping at that depth
            let (plant, mut state) = slide(stiffness, 1.4 * (stiffness * MASS).sqrt() / (1.5 * 50.0));
            run(&plant, integrator, &mut state, &push(-50.0), STEP, |_, t| t > 3.0);
            assert!(
                (-state.q[0] * stiffness - 50.0).abs() < 1e-3,
                "{integrator:?}, k {stiffness}: {} N",
                -state.q[0] * stiffness
            );
        }
    }
}

#[test]
fn a_bounce_on_a_spring_returns_all_energy_after_half_a_period() {
    for integrator in [Integrator::SemiImplicit, Integrator::Rk4] {
        let (plant, _) = slide(1e4, 0.0);
        let (v, t) = bounce(&plant, integrator, STEP, 0.2);
        let half_period = std::f64::consts::PI * (MASS / 1e4).sqrt();
        assert!((v - 0.2).abs() < 1e-4 && (t - half_period).abs() < 2.0 * STEP, "{integrator:?}: {v} m/s after {t} s");
    }
}

#[test]
fn the_restitution_of_a_hunt_crossley_bounce_is_that_of_its_first_integral() {
    // m v dv = −k x (1 + 1.5 c v) dx: F(v) = v/d − ln(1 + d v)/d², d = 1.5 c, is the same at entry and exit
    for (c, v) in [(0.2, 0.2_f64), (1.0, 0.3), (10.0, 0.5)] {
        let d = 1.5 * c;
        let integral = |v: f64| v / d - libm::log(1.0 + d * v) / (d * d);
        let (mut low, mut high) = (0.0, v.min(0.999_999 / d));
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if integral(-middle) < integral(v) { low = middle } else { high = middle }
        }
        let (plant, _) = slide(1e4, c);
        for (integrator, tolerance) in [(Integrator::SemiImplicit, 5e-3), (Integrator::Rk4, 1e-3)] {
            let (out, _) = bounce(&plant, integrator, STEP, v);
            assert!((out - low).abs() < tolerance * v, "{integrator:?}, c {c}: {out} m/s, expected {low}");
            assert!(out < v);
        }
    }
}

#[test]
fn nothing_blows_up_at_the_stiffest_surface_and_strongest_damper_of_a_scenario() {
    for integrator in [Integrator::SemiImplicit, Integrator::Rk4] {
        for c in [0.0, 1.0, 1000.0] {
            let (plant, _) = slide(1e6, c);
            for v in [0.01, 0.1, 1.0, 5.0] {
                let (out, _) = bounce(&plant, integrator, STEP, v);
                assert!(out.is_finite() && out <= 1.01 * v, "{integrator:?}, c {c}, {v} m/s: {out}");
            }
        }
    }
}

#[test]
fn motor_and_link_swing_against_each_other_at_the_two_mass_frequency() {
    let (mut plant, _) = slide(1e3, 0.0);
    plant.contacts.clear();
    plant.joints = Joints::Flexible;
    let mut data = arm::drives::DriveData::rediestro().joints[0].clone();
    data.damping_ratio = 0.0;
    let slide_drive = Drive::new(&data, 0.0, false, 1.0);
    plant.drives = Drives::new(std::array::from_fn(|i| if i == 0 { slide_drive } else { plant.drives[i] }));
    let (k, rotor) = (data.stiffness_nm_per_rad, data.rotor_inertia_at_output_kg_m2);
    let omega = (k * (1.0 / rotor + 1.0 / MASS)).sqrt();
    for (integrator, tolerance) in [(Integrator::SemiImplicit, 1e-4), (Integrator::Rk4, 1e-6)] {
        let mut state = State::at_rest(arm::JointVector::zeros());
        state.theta[0] = 1e-3;
        // the deflection's 40th downward zero lies at 39.25 periods
        let (mut crossings, mut t, mut before, mut at) = (0, 0.0, 1e-3, 0.0);
        while crossings < 40 {
            let now = plant.evaluate(&state, &push(0.0));
            integrate::step(&plant, integrator, &mut state, &now, &push(0.0), &now.motor, STEP);
            let deflection = state.theta[0] - state.q[0];
            if before > 0.0 && deflection <= 0.0 {
                crossings += 1;
                at = t + STEP * before / (before - deflection);
            }
            (before, t) = (deflection, t + STEP);
        }
        let expected = 39.25 * std::f64::consts::TAU / omega;
        assert!((at / expected - 1.0).abs() < tolerance, "{integrator:?}: {at} s, expected {expected}");
    }
}

#[test]
fn a_very_stiff_transmission_moves_like_a_rigid_one() {
    let motion = |joints: Joints| {
        let mut scenario = scenario(&["plant.friction_scale=0.0", "plant.kinematic_error=false"]);
        scenario.plant.joints = joints;
        let (mut plant, mut state) = Plant::new(&scenario).expect("simulable");
        if joints == Joints::Flexible {
            let mut data = scenario.drives().expect("built in");
            for joint in &mut data.joints {
                joint.stiffness_nm_per_rad *= 300.0;
                joint.damping_ratio = 0.3;
            }
            plant.drives = Drives::new(std::array::from_fn(|i| Drive::new(&data.joints[i], 0.0, false, 1.0)));
            state = plant.braked_at_rest(state.q);
        }
        state.brake.fill(0.0);
        // the drives let go and joint 4 pushes
        let actuation = Actuation { volts: [0.0, -1.0, 0.0, 6.0, 0.0, 0.0, 0.0], braked: 0, ..Actuation::SAFE };
        run(&plant, Integrator::Rk4, &mut state, &actuation, 1e-5, |_, t| t >= 0.1);
        state.q
    };
    let start = scenario(&[]).initial_posture().expect("reachable");
    let (flexible, rigid) = (motion(Joints::Flexible), motion(Joints::Rigid));
    let (difference, way) = ((flexible - rigid).amax(), (rigid - start).amax());
    assert!(way > 0.02 && difference < 0.01 * way, "{difference} rad of {way}");
}

#[test]
fn slow_friction_reaches_30_percent_of_the_gravity_torque_at_the_table_top() {
    let scenario = scenario(&["plant.kinematic_error=false"]);
    let (plant, state) = Plant::new(&scenario).expect("simulable");
    let data = scenario.drives().expect("built in");
    for direction in [1.0, -1.0] {
        let mut sliding = state;
        sliding.theta_dot.fill(direction * 0.05);
        sliding.qd.fill(direction * 0.05);
        // long on the way: the bristles are fully bent
        sliding.presliding.fill(direction);
        let now = plant.evaluate(&sliding, &Actuation { volts: [0.0; 7], braked: 0, ..Actuation::SAFE });
        let shares: Vec<f64> = (0..7)
            .filter(|&i| state.load[i].abs() >= 15.0)
            .map(|i| {
                (now.loss.friction[i] * direction - data.joints[i].viscous_nms_per_rad * 0.05) / state.load[i].abs()
            })
            .collect();
        let most = shares.iter().copied().fold(0.0, f64::max);
        assert!(shares.len() == 4 && (0.28..0.32).contains(&most), "{shares:?}");
    }
}

#[test]
fn the_arm_pressed_on_the_stiffest_surface_comes_to_rest_at_the_force_that_the_motors_ask_for() {
    for (joints, rate) in [("flexible", 10_000.0), ("rigid", 10_000.0), ("flexible", 2_000.0)] {
        let scenario = scenario(&[
            &format!("plant.joints={joints}"),
            &format!("plant.rate_hz={rate:?}"),
            "plant.friction_scale=0.2",
            "surface.0.stiffness_n_per_m=1e6",
            "surface.0.hunt_crossley_s_per_m=1.0",
        ]);
        let (plant, mut state) = Plant::new(&scenario).expect("simulable");
        let jacobian = arm::jacobian(&plant.arm, &state.q);
        let push = jacobian.tr_mul(&arm::Spatial::new(0.0, 0.0, -60.0, 0.0, 0.0, 0.0));
        let volts = std::array::from_fn(|i| (state.load[i] + push[i]) / plant.drives[i].motor_torque(1.0));
        state.brake.fill(0.0);
        let actuation = Actuation { volts, braked: 0, ..Actuation::SAFE };
        run(&plant, Integrator::SemiImplicit, &mut state, &actuation, 1.0 / rate, |s, t| {
            assert!(s.out_of_domain(2.0).is_none(), "{joints} at {rate} Hz: {s:?}");
            t >= 4.0
        });
        let force = -plant.evaluate(&state, &actuation).touch.wrench[2];
        // friction of the joints keeps some of it
        assert!((force - 60.0).abs() < 20.0, "{joints} at {rate} Hz: {force} N");
    }
}
