//! Any content of any file that a user gives: an error or an answer, never a panic, a hang or memory without bound.
//!
//! The corpus is what the project ships (scenarios, arms), states of its own and a record made on the spot; `words.toml`
//! has what reading goes wrong at. Each draw spoils one file and reads it. Files of absurd size and shape go through the
//! command under a limit of its address space.

use arm::ArmModel;
use bus_analyzer::digest_file;
use chassis::commands::faults::plan::Plan;
use chassis::rack_run::{self, Setting};
use rack_tests::{Bench, Draw, fuzz, program, spoil_file, workspace};
use report::{Comparison, StoredRun};
use std::path::Path;
use std::process::Command;
use toml::{Table, Value};

/// Most memory that reading one of these small files takes, bytes.
const MEMORY: u64 = 64 << 20;
/// Address space of the command, KiB: its code, its threads' stacks, and little else.
const ADDRESS_SPACE: &str = "1500000";

fn words(kind: &str) -> Vec<String> {
    let path = workspace().join("tests/corpus/words.toml");
    let table: Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    table[kind].as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned()).collect()
}

/// Files of a folder with this ending.
fn shipped(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let mut paths: Vec<_> =
        std::fs::read_dir(workspace().join(folder)).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().ends_with(ending));
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// One of the corpus, spoilt.
fn draw_file(draw: &mut Draw, corpus: &[Vec<u8>], words: &[String]) -> Vec<u8> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let mut bytes = corpus[draw.below(corpus.len())].clone();
    let other = &corpus[draw.below(corpus.len())];
    spoil_file(draw, &mut bytes, other, &words);
    bytes
}

#[test]
fn no_scenario_breaks_its_reader_and_what_it_accepts_runs_or_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.toml");
    let mut corpus = shipped("shared/scenarios", ".toml");
    corpus.retain(|text| text.starts_with(b"title"));
    let words = words("scenario");
    fuzz(200, |draw| {
        std::fs::write(&path, draw_file(draw, &corpus, &words)).unwrap();
        let memory = allocation_counter::measure(|| {
            let name = path.to_str().unwrap();
            let Ok(variants) = scenario::load(name, &[]).and_then(|document| document.variants()) else { return };
            if let Some((_, scenario)) = variants.first() {
                // an error is an answer
                let _ = rack_run::rehearse(scenario);
            }
        });
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

/// Spoils one value somewhere in a tree.
fn spoil_leaf(draw: &mut Draw, value: &mut Value) {
    match value {
        Value::Table(table) if !table.is_empty() => {
            let place = draw.below(table.len());
            table.iter_mut().skip(place).take(1).for_each(|(_, value)| spoil_leaf(draw, value));
        }
        Value::Array(list) if !list.is_empty() => {
            let place = draw.below(list.len());
            spoil_leaf(draw, &mut list[place]);
        }
        leaf => *leaf = spoilt(draw, leaf),
    }
}

/// Another value of the same type, at which arithmetic or a reader goes wrong.
fn spoilt(draw: &mut Draw, value: &Value) -> Value {
    let whole = [0, 1, -1, 2, 3, 7, 100, 255, 65_535, 10_000, 1_000_000_000, 1 << 40, i64::MAX, i64::MIN];
    let reals = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-3, 1e3, 1e6, 1e9, 1e18, 1e300, -1e300, 5e-324, f64::NAN, f64::INFINITY];
    let words = ["", "x", "bus", "cpu-1", "cpu-2", "control", "force-sensor", "joint-3", "hw_sim", "da_io", "chassis"];
    match value {
        Value::Integer(_) => Value::Integer(whole[draw.below(whole.len())]),
        Value::Float(_) => Value::Float(reals[draw.below(reals.len())]),
        Value::Boolean(on) => Value::Boolean(!on),
        Value::String(_) => Value::String(words[draw.below(words.len())].to_owned()),
        other => other.clone(),
    }
}

#[test]
fn no_value_in_a_scenario_breaks_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.toml");
    let names = ["table-5-3", "bus-stress", "failures", "peg-in-hole", "processor-time", "one-axis-delay"];
    let corpus = names.map(|name| {
        let scenario = scenario::load(name, &[]).unwrap().variants().unwrap().pop().unwrap().1;
        Value::try_from(scenario).unwrap()
    });
    fuzz(150, |draw| {
        let mut tree = corpus[draw.below(corpus.len())].clone();
        for _ in 0..=draw.below(3) {
            spoil_leaf(draw, &mut tree);
        }
        std::fs::write(&path, toml::to_string(&tree).unwrap()).unwrap();
        let memory = allocation_counter::measure(|| {
            let Ok(document) = scenario::load(path.to_str().unwrap(), &[]) else { return };
            if let Ok(scenario) = document.scenario() {
                // an error is an answer
                let _ = rack_run::rehearse(&scenario);
            }
        });
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

#[test]
fn no_campaign_breaks_its_reader() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.toml");
    let corpus = shipped("processes/chassis/src/commands/faults", ".toml");
    let words = words("scenario");
    let document = scenario::load("campaign", &[]).unwrap();
    fuzz(20, |draw| {
        std::fs::write(&path, draw_file(draw, &corpus, &words)).unwrap();
        let memory = allocation_counter::measure(|| drop(Plan::load(path.to_str(), &document)));
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

#[test]
fn no_urdf_breaks_its_reader() {
    let mut corpus = shipped("shared/arm/src/robots", ".urdf");
    corpus.extend(shipped("shared/arm/tests/data", ".urdf"));
    let words = words("urdf");
    fuzz(500, |draw| {
        let text = String::from_utf8_lossy(&draw_file(draw, &corpus, &words)).into_owned();
        let tip = ["tool", "panda_link8"][draw.below(2)];
        let memory = allocation_counter::measure(|| drop(ArmModel::from_urdf(&text, None, tip)));
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

#[test]
fn no_states_file_breaks_the_command() {
    let corpus = [std::fs::read(workspace().join("tests/corpus/states.jsonl")).unwrap()];
    let words = words("states");
    let bench = Bench::new();
    fuzz(12, |draw| {
        bench.write("states.jsonl", draw_file(draw, &corpus, &words));
        let outcome = limited(&bench, &["arm", "eval", "--json", "--states", "states.jsonl"]);
        assert!(matches!(outcome.status.code(), Some(0 | 2)), "{:?}\n{}", outcome.status, outcome.stderr);
    });
}

/// A record of a few windows, as it is written and without compression and CRC, so that its readers get to see what is spoilt.
fn records(folder: &Path) -> [Vec<u8>; 2] {
    let path = folder.join("sound.mcap");
    let document = scenario::load("table-5-3", &["duration_s=0.05".to_owned()]).unwrap();
    let (variant, scenario) = document.variants().unwrap().swap_remove(0);
    let setting = Setting { in_process: true, record: Some(path.clone()), ..Setting::default() };
    rack_run::run(&scenario, &variant, &setting, &mut |_| {}).unwrap();
    let sound = std::fs::read(&path).unwrap();
    let open = folder.join("open.mcap");
    let options = mcap::WriteOptions::new().compression(None).calculate_chunk_crcs(false).chunk_size(Some(4096));
    let mut writer = options.create(std::fs::File::create(&open).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&sound).unwrap() {
        writer.write(&message.unwrap()).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(digest_file(&path).unwrap(), digest_file(&open).unwrap(), "compression and chunks count");
    [sound, std::fs::read(&open).unwrap()]
}

#[test]
fn no_record_breaks_its_readers_and_what_is_recovered_has_a_digest() {
    let folder = tempfile::tempdir().unwrap();
    let (path, whole) = (folder.path().join("hostile.mcap"), folder.path().join("whole.mcap"));
    let corpus = records(folder.path());
    fuzz(150, |draw| {
        std::fs::write(&path, draw_file(draw, &corpus, &[])).unwrap();
        let memory = allocation_counter::measure(|| {
            let _ = digest_file(&path);
            if bus_analyzer::recover(&path, &whole).is_ok() {
                digest_file(&whole).expect("a recovered record is whole");
            }
        });
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

#[test]
fn no_report_breaks_the_comparison() {
    let bench = Bench::new();
    let short = ["--variant", "modified", "--in-process", "--no-record", "--duration", "0.3", "--out", "run"];
    let outcome = bench.run(&[&["run", "table-5-3"], &short[..]].concat());
    assert!(matches!(outcome.status.code(), Some(0 | 4)), "{}", outcome.stderr);
    let [report, charts] = ["report.json", "charts.json"].map(|name| bench.path("run").join(name));
    let corpus = [&report, &charts].map(|path| std::fs::read(path).unwrap());
    let other = StoredRun::load(&bench.path("run")).unwrap();
    let words = words("report");
    fuzz(100, |draw| {
        for (path, sound) in [&report, &charts].into_iter().zip(&corpus) {
            let sound = std::slice::from_ref(sound);
            let content = if draw.below(2) == 0 { sound[0].clone() } else { draw_file(draw, sound, &words) };
            std::fs::write(path, content).unwrap();
        }
        let memory = allocation_counter::measure(|| {
            if let Ok(run) = StoredRun::load(&bench.path("run")) {
                for runs in [vec![run.clone(), other.clone()], vec![other.clone(), run]] {
                    let comparison = Comparison::new(runs);
                    let _ = (comparison.text(), comparison.html());
                }
            }
        });
        assert!(memory.bytes_max < MEMORY, "{} bytes", memory.bytes_max);
    });
}

/// Runs `vmerack` in a bounded address space.
fn limited(bench: &Bench, arguments: &[&str]) -> rack_tests::Outcome {
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -v $0 && exec \"$@\"", ADDRESS_SPACE]).arg(program("vmerack")).args(arguments);
    bench.start_command(command).wait()
}

#[test]
fn endless_and_deeply_nested_files_are_refused_within_bounded_memory() {
    let bench = Bench::new();
    let links = |n: usize| "<link name='a'>".repeat(n) + &"</link>".repeat(n);
    bench.write("deep.urdf", format!("<robot name='r'>{}</robot>", links(200_000)));
    bench.write("deep.toml", format!("a = {}1{}\n", "[".repeat(200_000), "]".repeat(200_000)));
    bench.write("tables.toml", format!("{}a = 1\n", "a.".repeat(200_000)));
    bench.write("variants.toml", "[[variant]]\nname = \"v\"\n".repeat(30_000));
    bench.write("deep.jsonl", format!("{{\"q\":{}\n", "[".repeat(60_000)));
    for arguments in [
        ["scenario", "check", "deep.toml"].as_slice(),
        &["scenario", "check", "tables.toml"],
        &["scenario", "check", "variants.toml"],
        &["scenario", "check", "/dev/zero"],
        &["arm", "eval", "--states", "/dev/zero"],
        &["arm", "eval", "--states", "deep.jsonl"],
        &["arm", "show", "--tip", "tool", "--urdf", "deep.urdf"],
        &["arm", "show", "--tip", "tool", "--urdf", "/dev/zero"],
    ] {
        let outcome = limited(&bench, arguments);
        assert_eq!(outcome.status.code(), Some(2), "{arguments:?}: {:?}\n{}", outcome.status, outcome.stderr);
    }
}

/// Opcode, length, content.
fn mcap_record(opcode: u8, length: u64, content: &[u8]) -> Vec<u8> {
    [&[opcode], &length.to_le_bytes()[..], content].concat()
}

#[test]
fn records_that_claim_absurd_lengths_are_refused_or_cut_within_bounded_memory() {
    let bench = Bench::new();
    let magic = b"\x89MCAP0\r\n";
    let header = mcap_record(1, 8, &[0; 8]);
    // a chunk of 40 bytes and no records that claims to hold an exabyte of them
    let mut chunk = [0_u8; 40];
    chunk[16..24].copy_from_slice(&(1_u64 << 60).to_le_bytes());
    for (name, record) in [
        ("length.mcap", mcap_record(5, 1 << 60, &[0; 20])),
        ("longest.mcap", mcap_record(5, u64::MAX, &[0; 20])),
        ("quarter.mcap", mcap_record(5, 200 << 20, &[0; 20])),
        ("chunk.mcap", mcap_record(6, 40, &chunk)),
    ] {
        bench.write(name, [magic, header.as_slice(), &record].concat());
        let outcome = limited(&bench, &["log", "digest", name]);
        assert_eq!(outcome.status.code(), Some(1), "{name}: {:?}\n{}", outcome.status, outcome.stderr);
        let outcome = limited(&bench, &["log", "recover", name, "-o", "whole.mcap"]);
        assert!(matches!(outcome.status.code(), Some(1 | 3)), "{name}: {:?}\n{}", outcome.status, outcome.stderr);
    }
    let outcome = limited(&bench, &["log", "digest", "/dev/zero"]);
    assert_eq!(outcome.status.code(), Some(1), "{:?}\n{}", outcome.status, outcome.stderr);
}
