//! Windows: samples on the wires, cuts anywhere, early ends, runaways.

mod common;

use common::{Bench, free, scenario};
use messages::{AmplifierCommand, EventKind, PlantSample, drive_status};
use nalgebra::Vector3;
use scenario::{Joints, Robot, Scenario};

/// A mass of 10 kg on the slide, base z = 0.9 m − task z, rigid, nothing to touch.
fn slide(start_z: f64) -> Scenario {
    let mut scenario = scenario(&[]);
    scenario.arm.robot = Robot::Slide;
    scenario.arm.start_position_m = [0.0, 0.0, 0.9 - start_z];
    scenario.plant.joints = Joints::Rigid;
    scenario.surfaces.clear();
    scenario
}

/// Volts for this force on the slide.
fn force(newton: f64) -> [f64; 7] {
    [newton / 1e4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

#[test]
fn a_window_has_a_sample_at_its_start_at_every_grid_point_and_at_its_end() {
    let mut bench = Bench::new(&scenario(&[]));
    assert_eq!(bench.out.mail.plant.iter().map(|s| s.t).collect::<Vec<_>>(), [0]);
    for (until, expected) in [
        (250_000, vec![0, 100_000, 200_000, 250_000]),
        (250_000, vec![250_000]),
        (400_000, vec![250_000, 300_000, 400_000]),
        (420_000, vec![400_000, 420_000]),
    ] {
        bench.window(until, &[]);
        assert_eq!(bench.out.mail.plant.iter().map(|s| s.t).collect::<Vec<_>>(), expected);
        assert_eq!(bench.out.mail.plant_probe.iter().map(|p| p.t).collect::<Vec<_>>(), [until]);
    }
}

#[test]
fn cutting_windows_anywhere_gives_the_same_bits() {
    let scenario = scenario(&["plant.integrator=semi-implicit"]);
    let commands = [
        free(0, [0.0; 7]),
        free(1_234_567, [0.0, -3.0, -0.5, 4.0, 1.0, 0.0, 0.0]),
        free(4_000_000, [0.0, -2.0, 0.0, 3.0, 0.0, 0.0, 0.0]),
    ];
    let run = |cuts: &[u64]| {
        let mut bench = Bench::new(&scenario);
        let mut samples: Vec<PlantSample> = Vec::new();
        for &until in cuts {
            let from = bench.t;
            let due: Vec<_> = commands.iter().copied().filter(|c| (from..until).contains(&c.t)).collect();
            bench.window(until, &due);
            samples.extend(bench.out.mail.plant.iter().filter(|s| s.t % 100_000 == 0));
        }
        samples.dedup_by_key(|sample| sample.t);
        (*bench.sim.state(), samples)
    };
    let whole = run(&[10_000_000]);
    assert_eq!(whole.1.len(), 101);
    for cuts in [
        &[5_000_000, 10_000_000][..],
        &[1, 1_234_567, 1_234_568, 4_000_000, 4_000_000, 7_777_777, 10_000_000],
        &[99_999, 100_000, 100_001, 1_200_000, 3_950_000, 4_000_001, 9_999_999, 10_000_000],
    ] {
        let cut = run(cuts);
        assert_eq!(cut.0, whole.0);
        assert_eq!(cut.1, whole.1);
    }
}

#[test]
fn holding_the_arm_for_ten_steps_adds_less_than_a_tenth_to_the_steps_own_error() {
    // the tool, mm, as the arm falls into the board
    let track = |settings: &[&str]| -> Vec<Vector3<f64>> {
        let mut bench = Bench::new(&scenario(settings));
        bench.window(1, &[free(0, [0.0, -2.5, -0.3, 3.0, 0.5, 0.0, 0.0])]);
        let mut place = || {
            bench.run(0.005);
            Vector3::from(bench.out.mail.plant_probe[0].position) * 1e3
        };
        (0..40).map(|_| place()).collect()
    };
    let [fine, renewed, held] =
        [&["plant.integrator=rk4", "plant.rate_hz=50000.0"][..], &["plant.frozen_steps=1"], &["plant.frozen_steps=10"]].map(track);
    let greatest = |a: &[Vector3<f64>], b: &[Vector3<f64>]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let (added, own) = (greatest(&held, &renewed), greatest(&renewed, &fine));
    assert!((fine[39] - fine[0]).norm() > 10.0, "the arm moves: {}", fine[39] - fine[0]);
    assert!(added > 0.0 && added < 0.1 * own, "{added} mm beside {own} mm");
}

#[test]
fn a_torque_acts_from_its_exact_instant_on() {
    let mut scenario = slide(0.0);
    scenario.plant.integrator = scenario::Integrator::Rk4;
    let mut bench = Bench::new(&scenario);
    bench.window(1_000_000, &[free(0, force(0.0)), free(123_456, force(50.0))]);
    bench.window(5_000_000, &[free(2_000_001, force(0.0))]);
    let (t1, t2, a) = ((2_000_001.0 - 123_456.0) * 1e-9, (5_000_000.0 - 2_000_001.0) * 1e-9, 5.0);
    let probe = bench.out.mail.plant_probe[0];
    assert!((probe.qd[0] - a * t1).abs() < 1e-11, "{} {}", probe.qd[0], a * t1);
    assert!((probe.q[0] - (0.5 * a * t1 * t1 + a * t1 * t2)).abs() < 1e-12);
}

#[test]
fn behind_flexible_joints_a_torque_that_changes_within_a_step_gives_the_rotors_its_exact_impulse() {
    let scenario = scenario(&["plant.friction_scale=0"]);
    let volts = |joint: usize, volts: f64| {
        let mut all = [0.0; 7];
        all[joint] = volts;
        all
    };
    // rotor speeds at 0.1 ms, all in the first step
    let speeds = |commands: &[AmplifierCommand]| {
        let mut bench = Bench::new(&scenario);
        bench.window(0, &[free(0, [0.0; 7])]);
        bench.window(100_000, commands);
        bench.sim.state().theta_dot
    };
    let drives = scenario.drives().expect("valid");
    let coasting = speeds(&[]);
    for joint in 0..7 {
        let data = &drives.joints[joint];
        let kicked = speeds(&[free(20_000, volts(joint, 2.0)), free(70_001, volts(joint, -1.0))]);
        let impulse = data.amplifier_nm_per_v * (2.0 * 50_001e-9 - 29_999e-9);
        let gained = (kicked - coasting) * data.rotor_inertia_at_output_kg_m2;
        for other in 0..7 {
            let expected = if other == joint { impulse } else { 0.0 };
            assert!((gained[other] - expected).abs() < 1e-15, "{joint}: {gained}, expected {impulse}");
        }
    }
}

#[test]
fn a_brake_acts_from_its_exact_instant_on_and_torques_that_change_before_it_too() {
    let scenario = scenario(&["plant.friction_scale=0"]);
    let pushed = free(20_000, [0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let braked = AmplifierCommand { t: 60_000, brake_released: 0, ..pushed };
    let mut bench = Bench::new(&scenario);
    bench.window(0, &[free(0, [0.0; 7])]);
    bench.window(60_000, &[pushed]);
    let speed = bench.out.mail.plant_probe[0].theta_dot[1];
    bench.window(100_000, &[braked]);
    // deflected by what the rotor has moved since: at most twice as fast, pushed as long again, and held a little
    let share = bench.sim.state().brake[1] / (speed * 40e-6);
    assert!(speed > 0.0 && (1.0..2.0).contains(&share), "{speed} {share}");
}

#[test]
fn a_command_that_comes_late_acts_at_once_and_none_before_those_before_it() {
    let braked = |t| messages::AmplifierCommand { brake_released: 0, ..free(t, [0.0; 7]) };
    let state = |commands: [_; 2]| {
        let mut bench = Bench::new(&scenario(&["plant.integrator=semi-implicit"]));
        bench.window(1_030_000, &[free(0, [0.0, -3.0, 0.0, 4.0, 0.0, 0.0, 0.0])]);
        bench.window(2_000_000, &commands);
        *bench.sim.state()
    };
    let push = |t| free(t, [0.0, -2.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
    assert_eq!(state([push(1_060_000), braked(1_010_000)]), state([push(1_060_000), braked(1_060_000)]));
    assert_eq!(state([push(1_000_000), braked(1_010_000)]), state([push(1_030_000), braked(1_030_000)]));
}

#[test]
fn a_closing_limit_switch_ends_the_window_and_opens_the_emergency_chain() {
    let mut bench = Bench::new(&slide(9.9999));
    bench.window(1_000_000, &[free(0, force(1000.0))]);
    let mut early = None;
    while early.is_none() && bench.t < 50_000_000 {
        bench.window(bench.t + 5_000_000, &[]);
        early = bench.out.early;
    }
    // 0.1 mm at 100 m/s²
    let t = early.expect("beyond the limit");
    assert!((1_300_000..=1_600_000).contains(&t), "{t}");
    let last = bench.out.mail.plant.last().expect("a sample");
    assert_eq!(last.t, t);
    assert_eq!(last.status & drive_status::LIMIT_SWITCH, 1 << 8);
    assert_ne!(last.status & drive_status::EMERGENCY_STOP, 0);
    assert_eq!(bench.out.mail.plant_probe.len(), 1);
    bench.window(t + 1_000_000, &[]);
    assert_eq!(bench.out.early, None, "only the change cuts");
}

#[test]
fn a_runaway_is_reported_once_and_everything_stays_finite() {
    for torque in [1e5, f64::INFINITY] {
        let mut bench = Bench::new(&slide(0.0));
        let mut events = 0;
        bench.window(1_000_000, &[free(0, force(torque))]);
        for _ in 0..200 {
            events += bench.out.mail.events.iter().filter(|e| e.kind == EventKind::Diverged as u32).count();
            for sample in &bench.out.mail.plant {
                assert!(sample.theta.iter().chain(&sample.wrench).chain(&sample.theta_dot).all(|v| v.is_finite()));
            }
            let probe = bench.out.mail.plant_probe[0];
            assert!(probe.q.iter().chain(&probe.qd).chain(&[probe.energy]).all(|v| v.is_finite()));
            bench.window(bench.t + 1_000_000, &[]);
        }
        assert_eq!(events, 1);
        assert_ne!(bench.out.mail.plant[0].status & drive_status::DIVERGED, 0);
    }
}

#[test]
fn the_sensor_carries_the_tools_weight_and_the_contact() {
    let scenario = scenario(&[]);
    let bench = Bench::new(&scenario);
    let wrench = bench.out.mail.plant[0].wrench;
    // tool axis down: the flange pulls it up, which is −z of the sensor
    let weight = scenario.arm.tool.mass_kg * 9.81;
    assert!((wrench[2] + weight).abs() < 1e-9 && wrench[0].abs() < 1e-9 && wrench[1].abs() < 1e-9, "{wrench:?}");
    assert!(wrench[3..].iter().all(|m| m.abs() < 1e-9));

    let mut pressed = scenario.clone();
    pressed.surfaces[0].position_m[2] = -0.002;
    let bench = Bench::new(&pressed);
    let (wrench, probe) = (bench.out.mail.plant[0].wrench, bench.out.mail.plant_probe[0]);
    assert!((probe.contact[2] - 20.0).abs() < 1e-9 && (probe.penetration - 0.002).abs() < 1e-12);
    assert!((wrench[2] - (20.0 - weight)).abs() < 1e-9);
    assert_eq!(bench.out.mail.events[0].kind, EventKind::FirstContact as u32);
}

#[test]
fn commands_whose_time_never_comes_do_not_pile_up() {
    let mut bench = Bench::new(&scenario(&[]));
    let memory = allocation_counter::measure(|| {
        let never = [free(u64::MAX, [0.0; 7]); 1000];
        for k in 1..100 {
            bench.window(k * 100_000, &never);
        }
    });
    assert!(memory.bytes_max < 1 << 20, "{} bytes", memory.bytes_max);
}
