//! Runs side by side, from the folders that they have left.

mod made_up;

use made_up::{result, table_5_3};
use report::{Comparison, RunReport, StoredRun};
use std::path::Path;

/// A run of two variants whose forces are off by `error_n`.
fn run(folder: &Path, error_n: f64) -> StoredRun {
    let variants = table_5_3();
    let results = variants[..2].iter().map(|(variant, scenario)| result(variant, scenario, error_n)).collect();
    std::fs::create_dir_all(folder).unwrap();
    RunReport::new("table-5-3", &variants[0].1, "lockstep", results, Vec::new()).write(folder).unwrap();
    StoredRun::load(folder).unwrap()
}

#[test]
fn a_run_beside_itself_differs_in_nothing_and_beside_another_in_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    let (one, other) = (run(&folder.path().join("one"), 0.5), run(&folder.path().join("other"), 2.0));
    let same = Comparison::new(vec![one.clone(), one.clone()]);
    assert!(same.figures().iter().all(|figure| figure.is_same()));
    assert!(same.text().contains("one (2)"), "{}", same.text());

    let both = Comparison::new(vec![one, other]);
    let mean = both.figures().iter().find(|f| f.variant == "modified" && f.segment == "60 N" && f.measure == "mean_n");
    let mean = mean.expect("in both");
    assert!((mean.spread().unwrap() - 1.5).abs() < 0.05, "{mean:?}");
    let page = both.html().unwrap();
    for told in ["one: modified", "other: original", "Contact force along z", "<noscript"] {
        assert!(page.contains(told), "{told}");
    }
    assert!(page.matches("ideal impedance").count() >= 1);
}

#[test]
fn what_is_no_run_is_refused_with_its_file_and_reason() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |told: &str| {
        let error = StoredRun::load(folder.path()).unwrap_err().to_string();
        assert!(error.contains("report.json") && error.contains(told), "{error}");
    };
    refusal("vmerack run");
    std::fs::write(folder.path().join("report.json"), "{").unwrap();
    refusal("line 1");
    std::fs::write(folder.path().join("report.json"), "{\"schema_version\": 99}").unwrap();
    refusal("99");
}
