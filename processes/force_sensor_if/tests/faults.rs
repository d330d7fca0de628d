//! Every fault of the force sensor, as the bus sees it.

mod card;

use card::{Bench, MS, scenario};
use messages::EventKind;
use messages::registers::force;
use scenario::{Fault, FaultKind};

type Sensor = Bench<fn(f64) -> [f64; 6]>;

const PER_N: f64 = 16384.0 / 400.0;
const FZ: u32 = 2 * 2;

/// A card under 20 N along z with one fault from 10 ms on, for 10 ms.
fn bench(kind: FaultKind, amount: f64) -> Sensor {
    let mut scenario = scenario(&[]);
    scenario.faults = vec![Fault {
        target: "force_sensor".into(),
        kind,
        start_s: 0.010,
        duration_s: Some(0.010),
        every_s: None,
        mean_time_between_s: None,
        probability: 1.0,
        axes: vec![2],
        amount,
    }];
    Bench::new(&scenario, |t| [1.0, 0.0, 20.0 + 100.0 * t, 0.0, 0.0, 0.0])
}

fn true_force(t: u64) -> f64 {
    20.0 + 100.0 * t as f64 * 1e-9
}

/// Force along z in N at `t`, and its error.
fn error(bench: &mut Sensor, t: u64) -> f64 {
    bench.read_signed(t, force::filter(0) + FZ) / PER_N - true_force(t)
}

const LSB: f64 = 0.51 / PER_N;

#[test]
fn a_bias_holds_from_its_begin_to_its_end_on_its_axis_alone() {
    let mut bench = bench(FaultKind::Bias, -5.0);
    assert!(error(&mut bench, 9 * MS).abs() < LSB);
    assert!((error(&mut bench, 10 * MS) + 5.0).abs() < LSB);
    assert!((bench.read_signed(15 * MS, force::filter(0)) / PER_N - 1.0).abs() < LSB);
    assert!(error(&mut bench, 20 * MS).abs() < LSB);
}

#[test]
fn a_drift_grows_with_time() {
    let mut bench = bench(FaultKind::Drift, 1000.0);
    assert!((error(&mut bench, 15 * MS) - 5.0).abs() < LSB);
}

#[test]
fn a_stuck_sensor_repeats_its_sample_while_the_counter_goes_on() {
    let mut bench = bench(FaultKind::Stuck, 0.0);
    let stuck = bench.read(10 * MS, force::filter(0) + FZ);
    assert_eq!(bench.read(19 * MS, force::filter(0) + FZ), stuck);
    assert_eq!(bench.read(19 * MS, force::counter(0)), 19 * 8);
    assert!(error(&mut bench, 21 * MS).abs() < LSB);
}

#[test]
fn a_dropout_stops_samples_and_counter_and_both_come_back() {
    let mut bench = bench(FaultKind::Dropout, 0.0);
    let (before, counter) = (bench.read(9 * MS + 875_000, force::filter(0) + FZ), bench.read(9 * MS + 875_000, force::counter(0)));
    assert_eq!(bench.read(19 * MS, force::filter(0) + FZ), before);
    assert_eq!(bench.read(19 * MS, force::counter(0)), counter);
    assert_eq!(bench.read(20 * MS, force::counter(0)), 160);
    assert!(error(&mut bench, 20 * MS).abs() < LSB);
}

#[test]
fn samples_that_come_late_are_the_ones_of_then_and_the_counter_says_so() {
    let mut bench = bench(FaultKind::Delay, 4.0);
    // 100 N/s: 4 ms late is 0.4 N short
    assert!(error(&mut bench, 10 * MS - 1).abs() < 0.2);
    assert!((error(&mut bench, 18 * MS) + 0.4).abs() < LSB);
    assert_eq!(bench.read(18 * MS, force::counter(0)), (18 - 4) * 8);
    assert_eq!(bench.read(20 * MS, force::counter(0)), 20 * 8);
    assert!(error(&mut bench, 20 * MS).abs() < LSB);
}

#[test]
fn a_spike_is_one_sample() {
    let mut bench = bench(FaultKind::Spike, 30.0);
    assert!((error(&mut bench, 10 * MS) - 30.0).abs() < LSB);
    assert!(error(&mut bench, 10 * MS + 125_000).abs() < LSB);
}

#[test]
fn noise_has_the_stated_deviation_while_it_holds() {
    let mut bench = bench(FaultKind::Noise, 2.0);
    let errors: Vec<f64> = (80..160).map(|k| error(&mut bench, k * 125_000)).collect();
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / 80.0).sqrt();
    // five standard errors of a deviation of 80 draws
    assert!((deviation / 2.0 - 1.0).abs() < 5.0 / 160.0_f64.sqrt(), "{deviation}");
    assert!(error(&mut bench, 20 * MS).abs() < LSB);
}

#[test]
fn a_saturated_axis_reads_full_scale_and_shows_in_the_error_word() {
    let mut bench = bench(FaultKind::Saturation, 0.0);
    assert_eq!(bench.read_signed(15 * MS, force::filter(0) + FZ), 16384.0);
    assert_eq!(bench.read(15 * MS, force::ERRORS), 1 << 2);
    assert_eq!(bench.read(20 * MS, force::ERRORS), 0);
}

#[test]
fn an_open_cable_reads_zero_and_shows_in_the_error_word() {
    let mut bench = bench(FaultKind::WireBreak, 0.0);
    assert_eq!(bench.read_signed(15 * MS, force::filter(0) + FZ), 0.0);
    assert_eq!(bench.read(15 * MS, force::ERRORS), u32::from(force::ERROR_SENSOR_CHANGE));
    assert_eq!(bench.read(20 * MS, force::ERRORS), 0);
}

#[test]
fn each_fault_is_told_once_with_its_number_at_its_begin() {
    let mut bench = bench(FaultKind::Bias, 1.0);
    bench.run(30 * MS);
    let told: Vec<_> = bench.events.iter().filter(|e| e.kind == EventKind::FaultInjected as u32).map(|e| (e.t, e.a)).collect();
    assert_eq!(told, [(10 * MS, 0.0)]);
}
