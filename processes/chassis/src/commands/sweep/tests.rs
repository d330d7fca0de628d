//! The command on a short scenario.

use super::*;
use clap::Parser;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    args: SweepArgs,
}

fn args(out: &std::path::Path, rest: &str) -> SweepArgs {
    let line = format!("sweep table-5-3 --set duration_s=0.02 --out {} {rest}", out.display());
    Line::try_parse_from(line.split_whitespace()).unwrap_or_else(|error| panic!("{error}")).args
}

const ONE_KEY: &str = "--vary controller.kp=50..150:3 --variant modified --measure torque_share";

#[test]
fn ranges_are_refused_unless_they_name_both_ends_and_a_count_that_fits() {
    assert_eq!("a.b=0..1:3".parse::<Vary>().map(|vary| vary.values), Ok(vec![0.0, 0.5, 1.0]));
    assert_eq!("a=-1e3..2.5:2".parse::<Vary>().map(|vary| vary.values), Ok(vec![-1e3, 2.5]));
    for bad in ["", "a", "a=1..2", "=1..2:3", "a=1:3", "a=1..2:0", "a=1..2:1", "a=1..1:2", "a=0..inf:3", "a=0..1:-1"] {
        assert!(bad.parse::<Vary>().is_err(), "{bad}");
    }
    assert!("0/2".parse::<Shard>().is_err() && "3/2".parse::<Shard>().is_err() && "x".parse::<Shard>().is_err());
}

#[test]
fn unknown_keys_measures_variants_and_folders_are_refused_before_anything_runs() {
    let folder = tempfile::tempdir().expect("folder");
    for (rest, told) in [
        ("--vary controller.nonsense=0..1:2 --measure torque_share", "nonsense"),
        ("--vary controller.kp=-5..5:2 --measure torque_share", "controller.kp"),
        ("--vary controller.kp=1..2:2 --measure beauty", "beauty"),
        ("--vary controller.kp=1..2:2 --variant none", "none"),
        ("--vary controller.kp=1..2:2 --vary controller.kp=1..2:2", "varied twice"),
    ] {
        let error = run(args(&folder.path().join("s"), rest)).map(drop).expect_err(rest);
        assert!(format!("{error:?} {error}").contains(told), "{rest}: {error:?}");
        assert!(!folder.path().join("s").join("part-1-of-1.csv").exists(), "{rest}");
        let _ = std::fs::remove_dir_all(folder.path().join("s"));
    }
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("file");
    let error = run(args(&file.join("under"), ONE_KEY)).map(drop).expect_err("no folder");
    assert!(error.to_string().contains("under"), "{error:?}");
}

#[test]
fn parts_put_together_are_the_sweep_in_one_and_a_sweep_cut_short_is_taken_up_again() {
    let folder = tempfile::tempdir().expect("folder");
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    assert_eq!(run(args(&whole, ONE_KEY)).expect("runs"), 0);
    let table = std::fs::read_to_string(whole.join("table.csv")).expect("table");
    assert_eq!(table.lines().count(), 4);
    assert!(table.starts_with("controller.kp,variant,ended,torque_share\n50,modified,completed,0."), "{table}");
    assert!(std::fs::read_to_string(whole.join("torque_share.svg")).expect("picture").contains("<svg"));

    assert_eq!(run(args(&parts, &format!("{ONE_KEY} --shard 1/2"))).expect("runs"), 0);
    assert_eq!(run(args(&parts, &format!("{ONE_KEY} --merge"))).expect("runs"), 1);
    assert!(!parts.join("table.csv").exists());
    assert_eq!(run(args(&parts, &format!("{ONE_KEY} --shard 2/2"))).expect("runs"), 0);
    assert_eq!(std::fs::read_to_string(parts.join("table.csv")).expect("table"), table);

    // cut in the middle of the second line
    let part = whole.join("part-1-of-1.csv");
    let text = std::fs::read_to_string(&part).expect("points");
    std::fs::write(&part, &text[..text.len() / 2]).expect("cut");
    std::fs::remove_file(whole.join("table.csv")).expect("table");
    assert_eq!(run(args(&whole, ONE_KEY)).expect("runs"), 0);
    assert_eq!(std::fs::read_to_string(whole.join("table.csv")).expect("table"), table);

    let other = run(args(&whole, "--vary controller.kp=50..150:4 --variant modified --measure torque_share"));
    assert!(other.map(drop).expect_err("another sweep").to_string().contains("another sweep"));
}

#[test]
fn two_keys_make_a_heat_map() {
    let folder = tempfile::tempdir().expect("folder");
    let rest = "--vary controller.kp=50..150:2 --vary controller.kv=10..20:2 --variant modified --measure torque_share";
    assert_eq!(run(args(folder.path(), rest)).expect("runs"), 0);
    let svg = std::fs::read_to_string(folder.path().join("torque_share.svg")).expect("picture");
    assert!(svg.matches("<rect").count() > 4);
}
