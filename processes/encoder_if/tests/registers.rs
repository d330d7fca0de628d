//! The cards as the bus sees them.

mod cards;

use cards::{Bench, MS, TURN, scenario};
use messages::registers::encoder;
use proptest::prelude::*;

/// Half a unit of the velocity register, and what floating point adds.
const LSB: f64 = 0.51 * encoder::VELOCITY_LSB;

#[test]
fn a_count_is_the_shaft_angle_in_quarter_lines_downwards_rounded_at_the_access() {
    // 1e5 counts/s: an edge every 10 µs
    let mut bench = Bench::new(&scenario(&[]), |t| 1e5 * t - 200.0);
    for (t, count) in [
        (0, -200),
        (5_000, -200),
        (10_001, -199),
        (1_234_567, -77),
        (2_000_001, 0),
        (7_777_777, 577),
    ] {
        assert_eq!(bench.read(t, 0, encoder::COUNT), count, "at {t}");
    }
}

#[test]
fn every_joint_has_its_channel_and_the_eighth_channel_reads_zero() {
    let scenario = scenario(&[]);
    let mut cards = encoder_if::EncoderIf::new(&scenario).unwrap();
    let mut inputs = board::Inputs {
        boot: true,
        ..Default::default()
    };
    let mut out = board::Outputs::default();
    let mut sample: messages::PlantSample = bytemuck::Zeroable::zeroed();
    sample.theta =
        core::array::from_fn(|joint| (joint as f64 + 1.5) / TURN * core::f64::consts::TAU);
    inputs.mail.plant.push(sample);
    for card in 1..=4 {
        for channel in 0..2 {
            let mut transfer: messages::TransferRecord = bytemuck::Zeroable::zeroed();
            (transfer.n, transfer.width) = (1, 2);
            transfer.addr = scenario.card_base(&format!("encoder-{card}")).unwrap()
                + channel * encoder::CHANNEL;
            inputs.transfers.push(transfer);
        }
    }
    board::Board::step(&mut cards, 0, &inputs, &mut out);
    let counts: Vec<_> = out.mail.words.iter().map(|word| word.value).collect();
    assert_eq!(counts, [1, 2, 3, 4, 5, 6, 7, 0]);
}

#[test]
fn the_counter_wraps_at_its_width_in_both_directions() {
    let scenario = scenario(&["encoder_if.counter_bits=12"]);
    let mut up = Bench::new(&scenario, |t| 1e5 * t + 2046.5);
    assert_eq!(up.read(0, 3, encoder::COUNT), 2046);
    assert_eq!(up.read(6_000, 3, encoder::COUNT), 2047);
    assert_eq!(up.read(16_000, 3, encoder::COUNT), -2048);
    assert_eq!(
        up.read(40_960_000, 3, encoder::COUNT),
        2046,
        "a whole turn of the counter later"
    );
    let mut down = Bench::new(&scenario, |t| -1e5 * t - 2047.5);
    assert_eq!(down.read(4_000, 3, encoder::COUNT), -2048);
    assert_eq!(down.read(6_000, 3, encoder::COUNT), 2047);
}

#[test]
fn a_constant_speed_is_exact_to_the_registers_resolution_from_fast_to_slow() {
    for speed in [
        2e5, 12_345.678, 1000.0, 999.0, 333.3, 120.0, -120.0, -1500.0, -98_765.4,
    ] {
        let mut bench = Bench::new(&scenario(&[]), |t| speed * t + 0.25);
        for t in [60_000_000, 60_003_217, 61_700_000] {
            let measured = bench.speed(t);
            assert!(
                (measured - speed).abs() <= LSB,
                "{speed} at {t}: {measured}"
            );
        }
    }
}

#[test]
fn below_two_edges_in_20_ms_the_speed_reads_zero() {
    let mut bench = Bench::new(&scenario(&[]), |t| 40.0 * t);
    for t in [100_000_000, 113_000_000, 130_000_000] {
        assert_eq!(bench.speed(t), 0.0);
    }
}

#[test]
fn a_shaft_that_starts_from_rest_is_measured_within_its_first_millisecond() {
    let start = 0.1;
    let mut bench = Bench::new(&scenario(&[]), |t| 0.5 + 20_000.0 * (t - start).max(0.0));
    assert_eq!(bench.speed(100_000_000), 0.0);
    assert!((bench.speed(100_400_000) - 20_000.0).abs() <= LSB);
}

#[test]
fn a_shaft_that_stops_falls_below_one_count_over_the_time_since_its_last_edge() {
    // moves at 5000 counts/s and stops dead at 0.1 s
    let mut bench = Bench::new(&scenario(&[]), |t| 0.5 + 5000.0 * t.min(0.1));
    let last_edge = 0.0999;
    for t in [
        100_000_000,
        100_500_000,
        101_000_000,
        105_000_000,
        115_000_000_u64,
    ] {
        let bound = 1.0 / (t as f64 * 1e-9 - last_edge);
        let expected = bound.min(5000.0);
        let measured = bench.speed(t);
        assert!(
            (measured - expected).abs() < 1e-3 * expected,
            "{t}: {measured} {expected}"
        );
    }
    assert_eq!(bench.speed(121_000_000), 0.0);
}

#[test]
fn a_reversal_changes_the_sign_within_the_window() {
    // a triangle: +10 000 counts/s until 50 ms, then −10 000
    let mut bench = Bench::new(&scenario(&[]), |t| {
        0.3 + 500.0 - 10_000.0 * (t - 0.05).abs()
    });
    assert!((bench.speed(50_000_000) - 10_000.0).abs() <= LSB);
    let midway = bench.speed(50_500_000);
    assert!(midway.abs() < 1500.0, "{midway}");
    assert!((bench.speed(51_200_000) + 10_000.0).abs() <= LSB);
}

#[test]
fn a_shaft_that_dithers_over_one_edge_reads_zero() {
    // a quarter of a count around an edge at 500 Hz
    let mut bench = Bench::new(&scenario(&[]), |t| {
        100.0 + 0.25 * (core::f64::consts::TAU * 500.0 * t).sin()
    });
    for t in [50_000_000, 51_300_000, 52_700_000] {
        assert_eq!(bench.speed(t), 0.0);
    }
}

#[test]
fn an_accelerating_shaft_is_measured_half_a_window_late() {
    let acceleration = 1e6;
    let mut bench = Bench::new(&scenario(&[]), |t| 0.5 * acceleration * t * t);
    let t = 80_000_000;
    let lag = t as f64 * 1e-9 - bench.speed(t) / acceleration;
    assert!((lag - 0.0005).abs() < 0.00003, "{lag}");
}

#[test]
fn the_index_latch_holds_the_count_of_the_last_mark_in_both_directions() {
    // out over two marks and back over both
    let mut bench = Bench::new(&scenario(&[]), |t| {
        3000.0 + 6000.0 * (core::f64::consts::PI * t).sin()
    });
    assert_eq!(bench.read(0, 5, encoder::INDEX), 0, "none passed yet");
    assert_eq!(bench.read(40 * MS, 5, encoder::INDEX), 0);
    assert_eq!(bench.read(100 * MS, 5, encoder::INDEX), 4000);
    assert_eq!(bench.read(500 * MS, 5, encoder::INDEX), 8000);
    assert_eq!(bench.read(850 * MS, 5, encoder::INDEX), 8000);
    assert_eq!(bench.read(1100 * MS, 5, encoder::INDEX), 4000);
    assert_eq!(
        bench.read(1300 * MS, 5, encoder::INDEX),
        0,
        "the mark at angle 0"
    );
}

#[test]
fn an_index_read_does_not_see_a_mark_passed_later_in_the_window() {
    // passes the mark at 5 ms
    let mut bench = Bench::new(&scenario(&[]), |t| 3500.0 + 1e5 * t);
    let addr = bench.addr(0, encoder::INDEX);
    let words = bench.window(
        10 * MS,
        &[(4_999_000, addr, false), (5_001_000, addr, false)],
    );
    assert_eq!(
        words.iter().map(|word| word.value).collect::<Vec<_>>(),
        [0, 4000]
    );
}

#[test]
fn status_reads_zero_and_a_failed_transfer_has_no_answer() {
    let mut bench = Bench::new(&scenario(&[]), |t| t);
    let addr = bench.addr(6, encoder::STATUS);
    let words = bench.window(MS, &[(10, addr, true), (20, addr, false)]);
    assert_eq!(
        words
            .iter()
            .map(|word| (word.t, word.value))
            .collect::<Vec<_>>(),
        [(20, 0)]
    );
}

#[test]
fn a_delay_shifts_count_and_speed_exactly() {
    // straight between the arm's steps, so that the ends of windows add nothing to the signal
    let smooth = |t: f64| 3e4 * t + 500.0 * (40.0 * t).sin();
    let position = |t: f64| {
        let step = (t / 1e-4).floor();
        let (from, to) = (smooth(step * 1e-4), smooth((step + 1.0) * 1e-4));
        from + (t / 1e-4 - step) * (to - from)
    };
    let mut prompt = Bench::new(&scenario(&[]), position);
    let mut late = Bench::new(&scenario(&["encoder_if.delay_ms=7.3"]), position);
    for t in [30_000_000, 33_333_333, 41_000_007, 58_999_999] {
        for register in [encoder::COUNT, encoder::VELOCITY] {
            let (late, prompt) = (
                late.read(t + 7_300_000, 2, register),
                prompt.read(t, 2, register),
            );
            assert!(
                late.abs_diff(prompt) <= u32::from(register == encoder::VELOCITY),
                "{late} {prompt}: {register} at {t}"
            );
        }
    }
}

#[test]
fn a_tachometer_shows_the_true_speed_delayed_like_the_count() {
    let overrides = [
        "encoder_if.velocity=\"tachometer\"",
        "encoder_if.delay_ms=10",
    ];
    let mut bench = Bench::new(&scenario(&overrides), |t| 5e4 * t * t);
    let speed = bench.speed(45_000_000);
    assert!((speed - 1e5 * 0.035).abs() < 0.05, "{speed}");
}

#[test]
fn before_a_delay_is_over_the_shaft_seems_to_stand_where_it_was_first() {
    let mut bench = Bench::new(&scenario(&["encoder_if.delay_ms=50"]), |t| 700.5 + 1e4 * t);
    assert_eq!(bench.read(30 * MS, 0, encoder::COUNT), 700);
    assert_eq!(bench.speed(49 * MS), 0.0);
    assert_eq!(bench.read(60 * MS, 0, encoder::COUNT), 800);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn nothing_depends_on_where_windows_are_cut(mut cuts in prop::collection::vec(0_u64..40 * MS, 0..40)) {
        let scenario = scenario(&[]);
        // linear: the signal between two steps of the arm is the same whatever is cut
        let position = |t: f64| 4321.0 * t + 0.123;
        let registers = [encoder::COUNT, encoder::VELOCITY, encoder::INDEX];
        let mut whole = Bench::new(&scenario, position);
        let accesses: Vec<_> = (0..99)
            .map(|i: u64| (i * 399_000 + 37, whole.addr(0, registers[i as usize % 3]), false))
            .collect();
        let whole: Vec<_> = whole.window(40 * MS, &accesses).iter().map(|w| w.value as i32).collect();
        let mut bench = Bench::new(&scenario, position);
        cuts.sort_unstable();
        cuts.push(40 * MS);
        let mut from = 0;
        let mut pieces = Vec::new();
        for until in cuts {
            let inside: Vec<_> = accesses.iter().filter(|a| from <= a.0 && a.0 < until).copied().collect();
            pieces.extend(bench.window(until, &inside).iter().map(|w| w.value as i32));
            from = until;
        }
        prop_assert_eq!(pieces, whole);
    }
}

#[test]
fn shafts_whose_angles_are_no_numbers_have_no_speed_and_break_nothing() {
    let mut bench = Bench::new(&scenario(&[]), |t| if t > 0.05 { f64::NAN } else { 3000.0 * t });
    assert!((bench.speed(49_000_000) - 3000.0).abs() <= LSB);
    for t in [50_500_000, 51_000_000, 65_000_000, 90_000_000] {
        let speed = bench.speed(t);
        assert!(speed.abs() <= 3000.0 + LSB, "{speed}");
    }
}

#[test]
fn transfers_of_absurd_length_and_date_end_within_their_window() {
    let mut cards = encoder_if::EncoderIf::new(&scenario(&[])).unwrap();
    let mut inputs = board::Inputs { boot: true, until: MS, ..Default::default() };
    inputs.mail.plant.push(bytemuck::Zeroable::zeroed());
    for data_at in [u64::MAX, 0] {
        let addr = scenario(&[]).card_base("encoder-1").unwrap();
        inputs.transfers.push(messages::TransferRecord { data_at, addr, n: u32::MAX, ..bytemuck::Zeroable::zeroed() });
    }
    let mut out = board::Outputs::default();
    board::Board::step(&mut cards, MS, &inputs, &mut out);
    assert!(out.mail.words.iter().all(|word| word.t <= MS));
    assert!(out.mail.words.len() < 10_000, "{}", out.mail.words.len());
}
