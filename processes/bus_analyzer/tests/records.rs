//! Records of made-up windows: what is written, its digest, and what survives damage.

use board::{Board, Inputs, Outputs};
use bus_analyzer::{BusAnalyzer, digest_file, recover};
use bytemuck::Zeroable;
use messages::{ControlProbe, Event, EventKind, PlantProbe, Severity, TransferRecord};
use scenario::Scenario;
use std::path::Path;

const PERIOD: u64 = 5_000_000;

fn scenario() -> Scenario {
    scenario::load("table-5-3", &[])
        .unwrap()
        .scenario()
        .unwrap()
}

/// Window `k` of a run in which every number differs from every other.
fn window(k: u64) -> Inputs {
    let mut inputs = Inputs {
        from: k.saturating_sub(1) * PERIOD,
        until: k * PERIOD,
        boot: k == 0,
        ..Inputs::default()
    };
    let t = inputs.until;
    let mut x = k as f64;
    let mut next = || {
        x += 0.1;
        x.sqrt()
    };
    let mut plant = PlantProbe {
        t,
        ..PlantProbe::zeroed()
    };
    plant.q = std::array::from_fn(|_| next());
    plant.contact = std::array::from_fn(|_| next());
    inputs.mail.plant_probe.push(plant);
    if k > 0 {
        let mut control = ControlProbe {
            t,
            job: k as u32,
            ..ControlProbe::zeroed()
        };
        control.q = std::array::from_fn(|_| next());
        control.torque = std::array::from_fn(|_| next());
        control.fe = std::array::from_fn(|_| next());
        control.x_orientation = [1.0, 0.0, 0.0, 0.0];
        inputs.mail.control_probe.push(control);
        for i in 0..31 {
            let at = inputs.from + 1000 * i;
            let transfer = TransferRecord {
                requested: at,
                granted: at + 300,
                data_at: at + 735,
                done: at + 835,
                addr: 0x20_0000 + 4 * i as u32,
                job: k as u32,
                index: i as u16,
                n: 1,
                width: 2,
                am: 0x3D,
                ..TransferRecord::zeroed()
            };
            inputs.mail.transfers.push(transfer);
        }
        inputs.mail.events.push(Event::new(
            t,
            EventKind::SegmentStart,
            Severity::Ok,
            k as f64,
            0.0,
        ));
        inputs.mail.events.push(Event::new(
            inputs.from,
            EventKind::TorqueLimit,
            Severity::Warn,
            1.0,
            3.0,
        ));
    }
    inputs
}

fn run(
    mut analyzer: BusAnalyzer,
    windows: u64,
    mut change: impl FnMut(u64, &mut Inputs),
) -> BusAnalyzer {
    let mut out = Outputs::default();
    for k in 0..windows {
        let mut inputs = window(k);
        inputs.finish = k + 1 == windows;
        change(k, &mut inputs);
        analyzer.step(inputs.until, &inputs, &mut out);
    }
    analyzer
}

fn record(path: &Path, windows: u64, change: impl FnMut(u64, &mut Inputs)) -> String {
    let analyzer = BusAnalyzer::new(&scenario(), Some(path), "title = \"x\"")
        .unwrap()
        .with_digest();
    let analyzer = run(analyzer, windows, change);
    assert_eq!(analyzer.lost(), None);
    analyzer.digest().unwrap()
}

fn digest_without_file(change: impl FnMut(u64, &mut Inputs)) -> String {
    run(
        BusAnalyzer::new(&scenario(), None, "")
            .unwrap()
            .with_digest(),
        20,
        change,
    )
    .digest()
    .unwrap()
}

#[test]
fn the_digest_of_a_run_is_that_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let online = record(&path, 20, |_, _| ());
    assert_eq!(online, digest_file(&path).unwrap());
    assert_eq!(online, digest_without_file(|_, _| ()));
}

#[test]
fn neither_order_nor_chunks_nor_compression_of_a_file_count() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    // more than a block of messages
    let digest = record(&path, 120, |_, _| ());
    let bytes = std::fs::read(&path).unwrap();
    let mut messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().collect::<Result<_, _>>().unwrap();
    messages.reverse();
    let options = mcap::WriteOptions::new().compression(None).chunk_size(Some(1000)).calculate_chunk_crcs(false);
    let mut writer = options.create(std::fs::File::create(&other).unwrap()).unwrap();
    for message in &messages {
        writer.write(message).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(digest_file(&other).unwrap(), digest);
}

#[test]
fn two_records_of_the_same_run_are_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.mcap"), folder.path().join("b.mcap")];
    for path in &paths {
        record(path, 20, |_, _| ());
    }
    assert_eq!(
        std::fs::read(&paths[0]).unwrap(),
        std::fs::read(&paths[1]).unwrap()
    );
}

#[test]
fn the_lowest_bit_of_any_torque_changes_the_digest() {
    let reference = digest_without_file(|_, _| ());
    for joint in 0..7 {
        let changed = digest_without_file(|k, inputs| {
            if k == 11 {
                let torque = &mut inputs.mail.control_probe[0].torque[joint];
                *torque = f64::from_bits(torque.to_bits() ^ 1);
            }
        });
        assert_ne!(changed, reference, "joint {joint}");
    }
}

#[test]
fn a_transfer_that_is_missing_changes_the_digest() {
    let reference = digest_without_file(|_, _| ());
    for missing in [0, 17, 30] {
        let changed = digest_without_file(|k, inputs| {
            if k == 7 {
                inputs.mail.transfers.remove(missing);
            }
        });
        assert_ne!(changed, reference, "transfer {missing}");
    }
}

#[test]
fn the_order_in_which_boards_report_events_does_not_count() {
    let reference = digest_without_file(|_, _| ());
    assert_eq!(
        digest_without_file(|_, inputs| inputs.mail.events.reverse()),
        reference
    );
}

#[test]
fn a_message_that_is_a_whole_window_late_has_no_place_in_the_digest() {
    let analyzer = run(
        BusAnalyzer::new(&scenario(), None, "")
            .unwrap()
            .with_digest(),
        5,
        |k, inputs| {
            if k == 4 {
                inputs.mail.plant_probe[0].t = 0;
            }
        },
    );
    assert_eq!(analyzer.digest(), None);
}

#[test]
fn the_record_holds_every_message_and_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    record(&path, 20, |_, _| ());
    let file = std::fs::read(&path).unwrap();
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let stats = summary.stats.unwrap();
    // 20 plant probes × 4, 19 control probes × 7, 38 events, 20 windows, URDF and task frame
    assert_eq!(stats.message_count, 20 * 4 + 19 * 7 + 38 + 20 + 2);
    assert_eq!((stats.attachment_count, stats.metadata_count), (1, 1));
    assert_eq!(
        mcap::read::attachment(&file, &summary.attachment_indexes[0])
            .unwrap()
            .data,
        &b"title = \"x\""[..]
    );
    let metadata = mcap::read::metadata(&file, &summary.metadata_indexes[0])
        .unwrap()
        .metadata;
    assert_eq!(
        (metadata["seed"].as_str(), metadata["duration_ns"].as_str()),
        ("1", "13000000000")
    );
}

#[test]
fn a_record_cut_short_is_recovered_up_to_its_last_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let whole = folder.path().join("whole.mcap");
    record(&whole, 400, |_, _| ());
    let bytes = std::fs::read(&whole).unwrap();
    let mut last = 0;
    for share in [3, 6, 9, 12, 15] {
        let cut = folder.path().join("cut.mcap");
        let output = folder.path().join("recovered.mcap");
        std::fs::write(&cut, &bytes[..bytes.len() * share / 16]).unwrap();
        assert!(digest_file(&cut).is_err());
        let report = recover(&cut, &output).unwrap();
        assert!(!report.was_complete && report.gaps.is_empty(), "{report:?}");
        assert!(
            report.messages >= last && report.bytes_lost < bytes.len() as u64,
            "{report:?}"
        );
        last = report.messages;
        let recovered = std::fs::read(&output).unwrap();
        let stats = mcap::Summary::read(&recovered)
            .unwrap()
            .unwrap()
            .stats
            .unwrap();
        assert_eq!(stats.message_count, report.messages);
        assert_eq!((stats.attachment_count, stats.metadata_count), (1, 1));
        digest_file(&output).unwrap();
    }
    assert!(last > 1000, "{last}");
}

#[test]
fn a_whole_record_recovers_to_the_same_digest() {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["in.mcap", "out.mcap"].map(|name| folder.path().join(name));
    let digest = record(&input, 200, |_, _| ());
    let report = recover(&input, &output).unwrap();
    assert!(report.was_complete, "{report}");
    assert_eq!(digest_file(&output).unwrap(), digest);
    assert!(recover(&input, &input).is_err());
    assert_eq!(digest_file(&input).unwrap(), digest);
}

#[test]
fn a_damaged_chunk_is_left_out_and_said_to_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["in.mcap", "out.mcap"].map(|name| folder.path().join(name));
    record(&input, 400, |_, _| ());
    let mut bytes = std::fs::read(&input).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let chunk = summary.chunk_indexes[2].clone();
    bytes[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 0x10;
    std::fs::write(&input, bytes).unwrap();
    assert!(digest_file(&input).is_err());
    let report = recover(&input, &output).unwrap();
    assert_eq!(report.damaged_chunks, 1);
    assert!(report.gaps["/control/state"] > 10, "{report}");
}

#[test]
fn noise_is_no_record() {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["in.mcap", "out.mcap"].map(|name| folder.path().join(name));
    for noise in [&b""[..], b"\x89MCAP0\r\n", &[7; 1000]] {
        std::fs::write(&input, noise).unwrap();
        assert!(recover(&input, &output).is_err());
        assert!(digest_file(&input).is_err());
    }
}

#[test]
fn a_file_that_takes_no_more_ends_the_record_but_not_the_run() {
    use std::io::Read;
    use std::os::fd::AsRawFd;
    // a pipe whose reader leaves after 200 kB: every later write fails
    let (mut reader, writer) = std::io::pipe().unwrap();
    let path = format!("/proc/self/fd/{}", writer.as_raw_fd());
    let thread = std::thread::spawn(move || {
        let mut rest = vec![0; 200_000];
        reader.read_exact(&mut rest).unwrap();
    });
    let analyzer = BusAnalyzer::new(&scenario(), Some(Path::new(&path)), "")
        .unwrap()
        .with_digest();
    let mut analyzer = analyzer;
    let mut out = Outputs::default();
    for k in 0..2000 {
        analyzer.step(0, &window(k), &mut out);
    }
    thread.join().unwrap();
    let lost = analyzer
        .lost()
        .expect("a pipe without a reader takes no more");
    assert!(lost.at > 0 && lost.reason.contains("Broken pipe"), "{lost}");
    assert_eq!(out.mail.events.len(), 1);
    assert!(analyzer.digest().is_some());
}

#[test]
fn a_record_that_cannot_be_created_is_refused_with_its_path() {
    let error = BusAnalyzer::new(&scenario(), Some(Path::new("/nowhere/a.mcap")), "")
        .err()
        .unwrap();
    assert!(error.contains("/nowhere/a.mcap"), "{error}");
}
