//! Faults of the encoders, as the bus sees them: counts, speeds, and the cards' own checks.

mod cards;

use cards::{Bench, MS, scenario};
use messages::registers::encoder::{
    CARD_STATUS, COUNT, INDEX, STATUS_INDEX, STATUS_LEVEL, STATUS_QUADRATURE, VELOCITY, VELOCITY_LSB,
};

/// Shafts that turn at 20 000 counts/s, with one fault of joint 2 from 10 ms on, for 10 ms.
fn bench(kind: &str, amount: f64) -> Bench<impl Fn(f64) -> f64> {
    let fault = format!("fault=[{{ target='joint-2', kind='{kind}', start_s=0.01, duration_s=0.01, amount={amount:?} }}]");
    Bench::new(&scenario(&[&fault]), |t| 0.5 + 20_000.0 * t)
}

#[test]
fn an_illegal_change_costs_two_counts_and_is_told_once_in_the_status_of_both_channels() {
    let mut bench = bench("quadrature-error", 1.0);
    assert_eq!(bench.read(9 * MS, 0, CARD_STATUS), 0);
    assert_eq!(bench.read(11 * MS, 0, CARD_STATUS), (STATUS_QUADRATURE << 8) as i32);
    assert_eq!(bench.read(11 * MS, 0, CARD_STATUS), 0, "reading clears it");
    assert_eq!((bench.read(12 * MS, 0, COUNT), bench.read(12 * MS, 1, COUNT)), (240, 238));
}

#[test]
fn an_open_wire_stops_count_and_speed_and_shows_as_long_as_it_is_open() {
    let mut bench = bench("wire-break", 0.0);
    for t in [10, 15, 19] {
        assert_eq!(bench.read(t * MS, 0, CARD_STATUS), (STATUS_LEVEL << 8) as i32, "{t} ms");
        assert_eq!((bench.read(t * MS, 1, COUNT), bench.read(t * MS, 1, VELOCITY)), (200, 0));
    }
    assert_eq!(bench.read(20 * MS, 0, CARD_STATUS), 0);
}

#[test]
fn lost_counts_show_when_the_next_index_mark_latches_another_count() {
    let mut bench = bench("lost-counts", 7.0);
    assert_eq!(bench.read(199 * MS, 1, COUNT), 3980 - 7);
    assert_eq!(bench.read(199 * MS, 0, CARD_STATUS), 0, "not before");
    assert_eq!(bench.read(201 * MS, 0, CARD_STATUS), (STATUS_INDEX << 8) as i32);
    assert_eq!((bench.read(201 * MS, 1, INDEX), bench.read(201 * MS, 0, INDEX)), (4000 - 7, 4000));
}

#[test]
fn a_counter_that_wraps_too_early_jumps_back() {
    let mut bench = bench("wrap", 8.0);
    // 8 bits, sign-extended
    assert_eq!((bench.read(9 * MS, 1, COUNT), bench.read(11 * MS, 1, COUNT)), (180, 220 - 256));
    assert_eq!(bench.read(21 * MS, 1, COUNT), 420);
}

#[test]
fn a_clock_that_gains_finds_the_edges_further_apart_and_shows_speeds_too_low_while_it_drifts() {
    for ppm in [5_000.0, -5_000.0] {
        let fault = format!(
            "fault=[{{ target='encoder_if', kind='clock-drift', start_s=0.03, duration_s=0.01, amount={ppm:?} }}]"
        );
        let mut bench = Bench::new(&scenario(&[&fault]), |t| 0.5 + 20_000.0 * t);
        let shown = [29, 35, 41].map(|t| f64::from(bench.read(t * MS, 1, VELOCITY)) * VELOCITY_LSB);
        let drifting = 20_000.0 / (1.0 + ppm * 1e-6);
        for (shown, expected) in shown.into_iter().zip([20_000.0, drifting, 20_000.0]) {
            assert!((shown - expected).abs() <= VELOCITY_LSB, "{ppm} ppm: {shown}, expected {expected}");
        }
    }
}
