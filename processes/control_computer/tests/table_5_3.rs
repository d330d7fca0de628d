//! The pipeline against an ideal arm (rigid, no friction, no noise, no delay) and a spring wall: Table 5-3 of the book.
//! Expected: the ideal one-axis impedance, which a throw-away simulation reached within a newton.

use arm::{ArmModel, ArmState, JointVector, Spatial};
use control_computer::{Impedance, Mode, Pipeline, Segment, Sensed};
use messages::PathKind;
use nalgebra::Vector3;
use scenario::{Path, Scenario};
use vme::Ns;

/// Control period of the rack of Figure 6.1.
const PERIOD: Ns = 5_000_000;
/// Step of the plant's integration.
const PLANT_STEP: Ns = 125_000;

struct Run {
    /// Control period, ns.
    period: Ns,
    /// Force along z at each decision, N.
    force: Vec<f64>,
}

fn scenario(overrides: &[&str]) -> Scenario {
    let overrides: Vec<String> = overrides.iter().map(|o| o.to_string()).collect();
    scenario::load("table-5-3", &overrides).unwrap().scenario().unwrap()
}

fn segments(scenario: &Scenario) -> Vec<Segment> {
    let of = |(index, s): (usize, scenario::ResolvedSegment)| Segment {
        index: index as u32,
        start: scenario::nanoseconds(s.start_s),
        move_time: scenario::nanoseconds(s.move_s),
        path: match s.path {
            Path::Hold => PathKind::Hold,
            Path::PointToPoint => PathKind::PointToPoint,
            Path::Line => PathKind::Line,
            Path::Step => PathKind::Step,
        },
        target: arm::Pose { p: s.position_m.into(), r: scenario::rpy_deg(s.rpy_deg) },
        impedance: Impedance {
            selection: Spatial::from(s.selection.map(f64::from)),
            mass: Spatial::from(s.mass),
            damping: Spatial::from(s.damping),
            stiffness: Spatial::from(s.stiffness),
            force: Spatial::from(s.force),
        },
    };
    scenario.resolved_segments().into_iter().enumerate().map(of).collect()
}

/// What the gauges show: m (a − g) of the tool and the contact force at the tool point, sensor axes.
fn gauges(
    scenario: &Scenario,
    arm: &ArmModel,
    state: &ArmState,
    qd: &JointVector,
    qdd: &JointVector,
    force: &Vector3<f64>,
) -> Spatial {
    let tip = state.tip_motion();
    let a = tip.jacobian * qdd + tip.jdot_qd;
    let (linear, angular) = (Vector3::new(a[0], a[1], a[2]), Vector3::new(a[3], a[4], a[5]));
    let twist = tip.jacobian * qd;
    let w = Vector3::new(twist[3], twist[4], twist[5]);
    let (sensor, com) = (Vector3::from(scenario.arm.sensor_m), Vector3::from(scenario.arm.tool.com_m));
    let r = tip.pose.r * (sensor + com);
    let a_com = linear + angular.cross(&r) + w.cross(&w.cross(&r));
    let own = tip.pose.r.transpose() * (a_com - arm.gravity()) * scenario.arm.tool.mass_kg;
    let contact = tip.pose.r.transpose() * force;
    let moment = com.cross(&own) - sensor.cross(&contact);
    let f = own + contact;
    Spatial::new(f.x, f.y, f.z, moment.x, moment.y, moment.z)
}

fn run(scenario: &Scenario, period: Ns) -> Run {
    let arm = scenario.plant_arm().unwrap();
    let rotor = scenario.drives().unwrap().each(|d| d.rotor_inertia_at_output_kg_m2);
    let frame = scenario.task_frame();
    let (stiffness, gap) = (scenario.surfaces[0].stiffness_n_per_m, scenario.surfaces[0].position_m[2]);
    let normal: Vector3<f64> = frame.r.column(2).into();
    let mut pipeline = Pipeline::new(scenario).unwrap();
    for segment in segments(scenario) {
        pipeline.trajectory().push(segment);
    }
    let (mut q, mut qd) = (scenario.initial_posture().unwrap(), JointVector::zeros());
    let mut qdd = JointVector::zeros();
    let dt = PLANT_STEP as f64 * 1e-9;
    let push = |state: &ArmState| normal * (stiffness * ((state.pose().p - frame.p).dot(&normal) - gap).max(0.0));
    let mut run = Run { period, force: Vec::new() };
    for k in 0..scenario.duration_ns() / period {
        let state = ArmState::new(&arm, &q, &qd);
        let force = push(&state);
        let sensed = Sensed { q, qd, wrench: gauges(scenario, &arm, &state, &qd, &qdd, &force) };
        let job = pipeline.step(k * period, period as f64 * 1e-9, &sensed, Mode::Law);
        assert_eq!((job.torque_limited, job.law.target_limited), (0, 0));
        run.force.push(force.dot(&normal));
        for _ in 0..period / PLANT_STEP {
            let state = ArmState::new(&arm, &q, &qd);
            let force = push(&state);
            let f_tip = Spatial::new(-force.x, -force.y, -force.z, 0.0, 0.0, 0.0);
            qdd = state.aba(&job.torque, &rotor, &f_tip);
            qd += qdd * dt;
            q += qd * dt;
        }
    }
    run
}

impl Run {
    /// Force at an instant, N.
    fn at(&self, t: Ns) -> f64 {
        self.force[(t / self.period) as usize]
    }

    /// Mean force over the half second before `until_ms`, N.
    fn steady(&self, until_ms: Ns) -> f64 {
        (1..=100).map(|k| self.at(until_ms * 1_000_000 - k * PERIOD)).sum::<f64>() / 100.0
    }

    /// Greatest force until 4 s, N.
    fn first_peak(&self) -> f64 {
        let until = (4_000_000_000 / self.period) as usize;
        self.force[..until].iter().copied().fold(0.0, f64::max)
    }

    /// Greatest difference to another run, N.
    fn difference(&self, other: &Run) -> f64 {
        let instants = (0..13_000_000_000).step_by(PERIOD as usize);
        instants.map(|t| (self.at(t) - other.at(t)).abs()).fold(0.0, f64::max)
    }
}

/// Force of the ideal one-axis impedance m ẍ + b ẋ = f_d − f_e, integrated finely.
fn ideal() -> Run {
    const STEP: Ns = 10_000;
    let mut run = Run { period: STEP, force: Vec::new() };
    let (dt, mut x, mut v) = (STEP as f64 * 1e-9, 0.0f64, 0.0);
    for step in 0..13_000_000_000 / STEP {
        let fe = 10_000.0 * (x - 0.005).max(0.0);
        run.force.push(fe);
        let fd = match step * STEP / 1_000_000 {
            t if t < 1_000 => continue,
            t if t < 4_000 => 60.0,
            t if t < 7_000 => 80.0,
            t if t < 10_000 => 40.0,
            _ => 0.0,
        };
        v += (fd - fe - 1000.0 * v) / 100.0 * dt;
        x += v * dt;
    }
    run
}

#[test]
fn the_ideal_impedance_has_the_peaks_and_dips_known_of_it() {
    let ideal = ideal();
    let between = |from: usize, to: usize| ideal.force[from * 100_000..to * 100_000].iter().copied();
    assert!((ideal.first_peak() - 74.8).abs() < 0.1, "{}", ideal.first_peak());
    let second = between(4, 7).fold(0.0, f64::max);
    assert!((second - 83.3).abs() < 0.1, "60 to 80 N peaks at {second} N");
    let dip = between(7, 10).fold(100.0, f64::min);
    assert!((dip - 33.5).abs() < 0.1, "80 to 40 N dips to {dip} N");
}

#[test]
fn without_friction_the_modified_scheme_exerts_what_is_commanded() {
    let run = run(&scenario(&[]), PERIOD);
    for (until_ms, force) in [(4_000, 60.0), (7_000, 80.0), (10_000, 40.0), (13_000, 0.0)] {
        let mean = run.steady(until_ms);
        assert!((mean - force).abs() < 0.1, "{until_ms} ms: {mean} N");
    }
    let first = run.first_peak();
    println!("first peak {first:.2} N");
    assert!((73.0..79.0).contains(&first), "{first}");
}

#[test]
fn the_modified_scheme_follows_the_ideal_impedance_the_closer_the_shorter_the_period() {
    let ideal = ideal();
    let at = |period| run(&scenario(&[]), period).difference(&ideal);
    let (nominal, short) = (at(PERIOD), at(PERIOD / 10));
    println!("greatest difference to the ideal {nominal:.2} N at 5 ms, {short:.2} N at 0.5 ms");
    assert!(nominal < 2.5, "{nominal}");
    assert!(short < 1.0, "{short}");
}

#[test]
fn without_friction_the_original_scheme_works_as_well() {
    let run = run(&scenario(&["controller.scheme=original"]), PERIOD);
    for (until_ms, force) in [(4_000, 60.0), (7_000, 80.0), (10_000, 40.0), (13_000, 0.0)] {
        let mean = run.steady(until_ms);
        assert!((mean - force).abs() < 0.5, "{until_ms} ms: {mean} N");
    }
    println!("first peak {:.2} N", run.first_peak());
    assert!((68.0..78.0).contains(&run.first_peak()), "{}", run.first_peak());
}

#[test]
fn without_the_contact_force_fed_forward_the_original_scheme_holds_a_fixed_small_part_of_the_force() {
    // at rest the motors see the contact through the arm's inertia: F_e = F_d Λ/(M_d + Λ), Λ the inertia felt at the tool
    let run = run(&scenario(&["controller.scheme=original", "controller.force_feed_forward=false"]), PERIOD);
    let share = run.steady(4_000) / 60.0;
    println!("share {share:.4}");
    assert!((0.05..0.2).contains(&share), "{share}");
    for (until_ms, force) in [(7_000, 80.0), (10_000, 40.0)] {
        let mean = run.steady(until_ms);
        assert!((mean / force - share).abs() < 0.005, "{until_ms} ms: {mean} N");
    }
}
