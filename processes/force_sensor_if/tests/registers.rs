//! The card as the bus sees it: what a register shows, and of when.

mod card;

use card::{Access, Bench, MS, read, scenario, write};
use messages::EventKind;
use messages::registers::force;
use proptest::prelude::*;

/// Counts per N of the default card.
const PER_N: f64 = 16384.0 / 400.0;

fn z(force: f64) -> [f64; 6] {
    [0.0, 0.0, force, 0.0, 0.0, 0.0]
}

const FZ: u32 = 2 * 2;

#[test]
fn filter_4_delays_a_ramp_by_128_ms_within_2_percent() {
    let slope = 700.0;
    let mut bench = Bench::new(&scenario(&[]), |t| z(slope * t));
    // at an instant at which filter 4 publishes, so that no hold is in it
    let t = 17 * 32 * MS;
    let value = bench.read_signed(t, force::filter(4) + FZ) / PER_N;
    let delay = t as f64 * 1e-9 - value / slope;
    assert!((delay / 0.128 - 1.0).abs() < 0.02, "{delay}");
    assert!(
        (delay - 0.1275).abs() < 0.5 / PER_N / slope + 1e-9,
        "{delay}"
    );
}

#[test]
fn every_filter_holds_its_value_from_one_publication_to_the_next() {
    for n in 0..=5 {
        let mut bench = Bench::new(&scenario(&[]), |t| z(100.0 * t));
        let period = 125_000 << (2 * n);
        let t = 800 * MS / period * period;
        let early = bench.read(t, force::filter(n) + FZ);
        assert_eq!(
            bench.read(t + period - 1, force::filter(n) + FZ),
            early,
            "filter {n}"
        );
        let counter = bench.read(t + period - 1, force::counter(n));
        assert_eq!(u64::from(counter), t / period, "filter {n}");
        assert_eq!(
            bench.read(t + period, force::counter(n)),
            counter + 1,
            "filter {n}"
        );
        if n <= 3 {
            assert!(
                bench.read(t + 4 * period, force::filter(n) + FZ) > early,
                "filter {n}"
            );
        }
    }
}

#[test]
fn an_access_sees_the_8_khz_sample_at_or_before_it_not_the_one_of_the_windows_start() {
    // 1000 counts a ms
    let mut bench = Bench::new(&scenario(&[]), |t| z((1e6 * t - 5000.0) / PER_N));
    let at = [
        5_000_000, 5_124_999, 5_125_000, 6_001_000, 8_374_999, 8_375_000,
    ];
    bench.run(5 * MS);
    let accesses = at.map(|t| read(t, force::filter(0) + FZ));
    let words: Vec<_> = bench.window(10 * MS, &accesses).to_vec();
    for (word, t) in words.iter().zip(at) {
        let sampled = t / 125_000 * 125_000;
        assert_eq!(word.t, t);
        assert_eq!(
            f64::from(word.value as i16),
            (sampled as f64 * 1e-3 - 5000.0).round(),
            "at {t}"
        );
    }
}

#[test]
fn an_offset_written_tares_every_sample_after_it_and_none_before() {
    let mut bench = Bench::new(&scenario(&[]), |_| z(10.0));
    let counts = (10.0 * PER_N).round();
    let accesses = [
        read(5_000_100, force::filter(0) + FZ),
        write(5_000_200, force::OFFSET + FZ, -400),
        read(5_000_300, force::OFFSET + FZ),
        read(5_124_999, force::filter(0) + FZ),
        read(5_125_000, force::filter(0) + FZ),
    ];
    bench.run(5 * MS);
    let words: Vec<f64> = bench
        .window(6 * MS, &accesses)
        .iter()
        .map(|w| f64::from(w.value as u16 as i16))
        .collect();
    assert_eq!(words, [counts, -400.0, counts, counts - 400.0]);
    // it has its time through the filters like any other change
    let settled = bench.read_signed(300 * MS, force::filter(4) + FZ);
    assert_eq!(settled, counts - 400.0);
}

#[test]
fn a_write_that_failed_on_the_bus_changes_nothing_and_a_read_that_failed_gets_no_answer() {
    let mut bench = Bench::new(&scenario(&[]), |_| z(0.0));
    let failed = |access: Access| Access {
        status: 1,
        ..access
    };
    assert!(
        bench
            .window(
                MS,
                &[
                    failed(write(10, force::OFFSET, 77)),
                    failed(read(20, force::OFFSET))
                ]
            )
            .is_empty()
    );
    // and the value posted with it is gone: a later write of another register does not find it
    let words = bench.window(
        2 * MS,
        &[
            write(MS + 10, force::OFFSET + 2, 5),
            read(MS + 20, force::OFFSET),
            read(MS + 30, force::OFFSET + 2),
        ],
    );
    assert_eq!(words.iter().map(|w| w.value).collect::<Vec<_>>(), [0, 5]);
}

#[test]
fn warnings_come_at_80_percent_of_full_scale_and_saturation_clamps_at_full_scale() {
    let ramp = |t: f64| [0.0, -1000.0 * t, 1000.0 * t, 0.0, 100.0 * t, 0.0];
    let mut bench = Bench::new(&scenario(&[]), ramp);
    assert_eq!(bench.read(319 * MS, force::WARNINGS), 0);
    assert_eq!(bench.read(321 * MS, force::WARNINGS), 0b010110);
    assert_eq!(bench.read(399 * MS, force::ERRORS), 0);
    assert!(bench.events.is_empty());
    assert_eq!(bench.read(401 * MS, force::ERRORS), 0b010110);
    assert_eq!(bench.read_signed(401 * MS, force::filter(0) + 2), -16384.0);
    assert_eq!(bench.read_signed(401 * MS, force::filter(0) + FZ), 16384.0);
    bench.run(900 * MS);
    let [event] = bench.events.as_slice() else {
        panic!("{:?}", bench.events)
    };
    assert_eq!(
        (event.kind, event.t),
        (EventKind::ForceSaturated as u32, 400 * MS)
    );
}

#[test]
fn full_scales_are_n_and_tenths_of_nm_and_unused_words_are_zero() {
    let mut bench = Bench::new(&scenario(&[]), |_| [1.0; 6]);
    let scales = [0, 1, 2, 3, 4, 5].map(|axis| bench.read(0, force::FULL_SCALE + 2 * axis));
    assert_eq!(scales, [400, 400, 400, 400, 400, 400]);
    let scales = Bench::new(&scenario(&["force_sensor_if.full_scale_nm=30.0"]), |_| {
        [1.0; 6]
    })
    .read(0, force::FULL_SCALE + 6);
    assert_eq!(scales, 300);
    for unused in [0, force::FULL_SCALE + 12, force::filter(6) + 12, 0x3FFE] {
        assert_eq!(bench.read(0, unused), 0, "{unused:#x}");
    }
}

#[test]
fn the_same_seed_gives_the_same_noise_and_another_seed_another() {
    let noise = |seed: &str| {
        let scenario = scenario(&[
            "force_sensor_if.noise_n=0.5",
            "force_sensor_if.noise_nm=0.05",
            seed,
        ]);
        let mut bench = Bench::new(&scenario, |_| [0.0; 6]);
        let accesses: Vec<_> = (0..400)
            .map(|k| read(k * 125_000, force::filter(0) + FZ))
            .collect();
        bench
            .window(50 * MS, &accesses)
            .iter()
            .map(|word| word.value as i16)
            .collect::<Vec<_>>()
    };
    let first = noise("seed=1");
    assert_eq!(first, noise("seed=1"));
    assert_ne!(first, noise("seed=2"));
    let n = first.len() as f64;
    let mean = first.iter().map(|c| f64::from(*c)).sum::<f64>() / n;
    let deviation = (first
        .iter()
        .map(|c| (f64::from(*c) - mean).powi(2))
        .sum::<f64>()
        / n)
        .sqrt();
    assert!(mean.abs() < 4.0 * 0.5 * PER_N / n.sqrt(), "{mean}");
    assert!(
        (deviation / (0.5 * PER_N) - 1.0).abs() < 0.15,
        "{deviation}"
    );
}

#[test]
fn an_offset_of_the_gauges_is_there_from_the_start_behind_every_filter() {
    let scenario = scenario(&[
        "force_sensor_if.offset_n=[0.0, 0.0, 5.0]",
        "force_sensor_if.offset_nm=[0.1, 0.0, 0.0]",
    ]);
    let mut bench = Bench::new(&scenario, |_| z(-15.0));
    for n in 0..=6 {
        assert_eq!(
            bench.read_signed(MS, force::filter(n) + FZ),
            (-10.0 * PER_N).round(),
            "filter {n}"
        );
        assert_eq!(
            bench.read_signed(MS, force::filter(n) + 6),
            (0.1 * 16384.0 / 40.0_f64).round(),
            "filter {n}"
        );
    }
}

#[test]
fn a_pure_delay_is_exact_to_the_nanosecond_whatever_the_sampling_time() {
    // 1e9 counts at full scale: fine enough to see nanoseconds
    for delay_ms in [128.0, 10.03, 0.125, 0.05, 0.0] {
        let filter = format!("force_sensor_if.filter={{ delay_ms = {delay_ms:?} }}");
        let scenario = scenario(&[&filter, "force_sensor_if.full_scale_counts=1e9"]);
        let mut bench = Bench::new(&scenario, |t| z(1000.0 * t)).longwords();
        for t in [200_000_000, 200_037_777, 200_124_999, 200_125_001] {
            let counts = bench.read(t, 2 * (force::filter(0) + FZ)) as i32;
            let delayed = t as f64 * 1e-9 - f64::from(counts) / 1e9 * 0.4;
            assert!(
                (delayed - delay_ms * 1e-3).abs() < 2e-9,
                "{delay_ms} at {t}: {delayed}"
            );
            let newest = bench.read(t, 2 * force::counter(0));
            assert_eq!(u64::from(newest), (t - (delay_ms * 1e6) as u64) / 125_000);
        }
    }
}

#[test]
fn before_a_pure_delay_is_over_the_first_sample_shows() {
    let scenario = scenario(&["force_sensor_if.filter={ delay_ms = 20.0 }"]);
    let mut bench = Bench::new(&scenario, |t| z(3.0 + 100.0 * t));
    assert_eq!(
        bench.read_signed(19 * MS, force::filter(0) + FZ),
        (3.0 * PER_N).round()
    );
    assert_eq!(
        bench.read_signed(30 * MS, force::filter(0) + FZ),
        (4.0 * PER_N).round()
    );
}

#[test]
fn silent_wires_hold_their_last_value() {
    let scenario = scenario(&[]);
    let mut card = force_sensor_if::ForceSensorIf::new(&scenario).unwrap();
    let mut inputs = board::Inputs {
        until: 10 * MS,
        ..Default::default()
    };
    let mut out = board::Outputs::default();
    let mut transfer: messages::TransferRecord = bytemuck::Zeroable::zeroed();
    transfer.addr = scenario.card_base("force-sensor").unwrap() + force::filter(0) + FZ;
    (transfer.n, transfer.width, transfer.data_at) = (1, 1, 20 * MS);
    let mut sample: messages::PlantSample = bytemuck::Zeroable::zeroed();
    sample.wrench = z(10.0);
    inputs.mail.plant.push(sample);
    board::Board::step(&mut card, 0, &inputs, &mut out);
    inputs.mail.plant.clear();
    (inputs.from, inputs.until) = (10 * MS, 20 * MS);
    inputs.transfers.push(transfer);
    board::Board::step(&mut card, 0, &inputs, &mut out);
    assert_eq!(f64::from(out.mail.words[0].value), (10.0 * PER_N).round());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn nothing_depends_on_where_windows_are_cut(mut cuts in prop::collection::vec(0_u64..40 * MS, 0..40)) {
        let scenario = scenario(&["force_sensor_if.noise_n=1.0"]);
        let signal = |t: f64| z(200.0 * t);
        let accesses: Vec<_> = (0..200)
            .map(|i: u64| read(i * 199_000 + 37, if i.is_multiple_of(2) { force::filter(0) } else { force::filter(2) } + FZ))
            .collect();
        let whole: Vec<_> = Bench::new(&scenario, signal).window(40 * MS, &accesses).iter().map(|w| w.value).collect();
        let mut bench = Bench::new(&scenario, signal);
        cuts.sort_unstable();
        cuts.push(40 * MS);
        let mut from = 0;
        let mut pieces = Vec::new();
        for until in cuts {
            let inside: Vec<_> = accesses.iter().filter(|a| from <= a.t && a.t < until).copied().collect();
            pieces.extend(bench.window(until, &inside).iter().map(|w| w.value));
            from = until;
        }
        prop_assert_eq!(pieces, whole);
    }
}

#[test]
fn accesses_in_no_order_or_dated_far_ahead_are_answered_within_their_window() {
    for filter in ["force_sensor_if.filter={ cascade = 0 }", "force_sensor_if.filter={ delay_ms = 3.0 }"] {
        let mut bench = Bench::new(&scenario(&[filter]), |t| z(100.0 * t));
        bench.run(5 * MS);
        let fz = force::filter(0) + FZ;
        let at = [9 * MS + 1, 5 * MS, u64::MAX, 0, 7 * MS + 3];
        let words: Vec<u64> = bench.window(10 * MS, &at.map(|t| read(t, fz))).iter().map(|word| word.t).collect();
        assert_eq!(words, [9 * MS + 1, 5 * MS, 10 * MS, 0, 7 * MS + 3]);
        bench.run(20 * MS);
    }
}

#[test]
fn a_card_that_is_powered_up_late_samples_from_then_on() {
    // a sample each 125 µs of the years before would take hours
    let hours = 3_600_000 * MS;
    let mut card = force_sensor_if::ForceSensorIf::new(&scenario(&["force_sensor_if.filter={ delay_ms = 3.0 }"])).unwrap();
    let mut inputs = board::Inputs { boot: true, from: 10_000 * hours, until: 10_000 * hours, ..Default::default() };
    let sample = messages::PlantSample { t: inputs.from, wrench: z(100.0), ..bytemuck::Zeroable::zeroed() };
    inputs.mail.plant.push(sample);
    let mut transfer: messages::TransferRecord = bytemuck::Zeroable::zeroed();
    transfer.addr = scenario(&[]).card_base("force-sensor").unwrap() + force::filter(0) + FZ;
    (transfer.data_at, transfer.n, transfer.width) = (inputs.from, 1, 1);
    inputs.transfers.push(transfer);
    let mut out = board::Outputs::default();
    board::Board::step(&mut card, inputs.until, &inputs, &mut out);
    assert_eq!(out.mail.words[0].value, (100.0 * PER_N) as u32, "what was before the first sample is like it");
}
