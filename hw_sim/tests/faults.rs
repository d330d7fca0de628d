//! Faults of amplifiers and brakes: what the arm does under them, and what the wires say.

mod common;

use common::{Bench, free, scenario};
use messages::{AmplifierCommand, EventKind, drive_status};

/// Arm of table 5-3 at rest on its brakes, with one fault of joint 2 from 1 ms on.
fn bench(kind: &str, amount: f64) -> Bench {
    let fault = format!("fault=[{{ target='joint-2', kind='{kind}', start_s=1e-3, amount={amount:?} }}]");
    Bench::new(&scenario(&[&fault]))
}

/// Amplifiers off, brakes in.
fn off(t: u64) -> AmplifierCommand {
    AmplifierCommand { t, volts: [0.0; 7], enabled: 0, brake_released: 0 }
}

fn status(bench: &Bench) -> u32 {
    bench.out.mail.plant.last().expect("a sample").status
}

#[test]
fn a_tripped_amplifier_ends_the_window_says_so_and_gives_no_torque() {
    let mut bench = bench("amplifier-trip", 0.0);
    bench.window(5_000_000, &[free(0, [0.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0])]);
    assert_eq!(bench.out.early, Some(1_000_000));
    assert_eq!(status(&bench) & drive_status::AMPLIFIER_TRIPPED, 1 << 1);
    let told: Vec<_> = bench.out.mail.events.iter().map(|event| (event.kind, event.t, event.a)).collect();
    assert_eq!(told, [(EventKind::FaultInjected as u32, 1_000_000, 0.0)]);
    bench.window(5_000_000, &[]);
    assert_eq!(bench.out.mail.plant_probe[0].motor_torque[1], 0.0);
}

#[test]
fn a_stuck_brake_stays_in_and_its_contact_says_so() {
    let mut bench = bench("brake-stuck", 0.0);
    bench.window(5_000_000, &[off(0)]);
    bench.window(10_000_000, &[free(5_000_000, [0.0; 7])]);
    assert_eq!(status(&bench) & drive_status::BRAKE_ENGAGED, 1 << 17);
    bench.run(0.1);
    // of the motors: the link swings on its transmission
    let speed = bench.out.mail.plant_probe[0].theta_dot;
    assert!(speed[1].abs() < 1e-2 * speed[3].abs(), "joint 2 hangs on its brake, the arm falls: {speed:?}");
}

#[test]
fn a_brake_that_slips_holds_its_share_of_the_torque_alone() {
    // gravity asks some 60 % of the drive's torque of joint 2, and the brake holds more than the drive gives
    for (share, slips) in [(0.9, false), (0.1, true)] {
        let mut bench = bench("brake-slip", share);
        bench.run(0.3);
        assert_eq!(
            status(&bench) & drive_status::BRAKE_ENGAGED,
            drive_status::BRAKE_ENGAGED,
            "its contact is none the wiser"
        );
        let speed = bench.out.mail.plant_probe[0].qd[1].abs();
        assert_eq!(speed > 0.05, slips, "{share}: {speed} rad/s");
    }
}
