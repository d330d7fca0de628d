//! The built-in scenario `table-5-3` as a user runs it, and the figures that its limits do not carry.

use rack_tests::Bench;
use serde_json::Value;

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("no number `{key}` in {value}"))
}

/// First force peaks (N) of the variants with these overrides, in one process.
fn first_peaks(overrides: &[&str]) -> Vec<f64> {
    let variants = ["--variant", "modified-frictionless", "--variant", "original-frictionless"];
    let run = ["run", "table-5-3", "--in-process", "--no-record", "--json", "--out", "out"];
    let settings: Vec<&str> = overrides.iter().flat_map(|setting| ["--set", *setting]).collect();
    // a limit that is meant for other settings may be violated here
    let outcome = Bench::new().run(&[&run[..], &variants, &settings].concat());
    let report: Value = serde_json::from_str(&outcome.stdout).unwrap_or_else(|error| panic!("{error}: {outcome:?}"));
    report["variants"]
        .as_array()
        .expect("variants")
        .iter()
        .map(|variant| number(&variant["run"], "first_peak_n"))
        .collect()
}

#[test]
fn the_scenario_passes_and_writes_a_record_a_report_and_a_picture() {
    let bench = Bench::new();
    let outcome = bench.run(&["run", "table-5-3", "--json", "--out", "out"]).expect_code(0).expect_nothing_left();
    let out = bench.path("out");
    let report: Value = serde_json::from_str(&outcome.stdout).expect("nothing but JSON on standard output");
    let file = std::fs::read_to_string(out.join("report.json")).expect("report.json");
    assert_eq!(report, serde_json::from_str::<Value>(&file).expect("JSON"));
    assert_eq!(report["verdict"], "passed");

    let variants = report["variants"].as_array().expect("variants");
    let names: Vec<&str> = variants.iter().filter_map(|variant| variant["name"].as_str()).collect();
    assert_eq!(names, ["modified", "original", "modified-frictionless", "original-frictionless"]);
    for variant in variants {
        let name = variant["name"].as_str().expect("name");
        assert_eq!(variant["verdict"], "passed", "{name}");
        assert_eq!(number(variant, "simulated_s"), 13.0, "{name}");
        assert_eq!(number(variant, "transfer_errors"), 0.0, "{name}");
        assert_eq!(variant["digest"], bench.digest_of(&format!("out/{name}.mcap")), "{name}");
    }
    let html = std::fs::read_to_string(out.join("report.html")).expect("report.html");
    assert!(html.contains("<svg"), "no picture");
    for reference in ["src=\"http", "href=\"http", "@import", "<link"] {
        assert!(!html.contains(reference), "the report is not self-contained: {reference}");
    }
}

#[test]
fn friction_defeats_the_original_scheme_and_not_the_modified_one() {
    let run = ["run", "table-5-3", "--in-process", "--no-record", "--json", "--out", "out"];
    let outcome = Bench::new().run(&run).expect_code(0);
    let report: Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    // last-second means of the segments with 60, 80, 40 and 0 N
    let means = |name: &str| -> Vec<f64> {
        let variants = report["variants"].as_array().expect("variants");
        let variant = variants.iter().find(|variant| variant["name"] == name).expect("variant");
        let segments = variant["segments"].as_array().expect("segments");
        segments.iter().filter(|row| row["force_controlled"] == true).map(|row| number(row, "mean_n")).collect()
    };
    let wanted = [60.0, 80.0, 40.0, 0.0];
    let worst = |means: &[f64]| means.iter().zip(wanted).map(|(mean, force)| (mean - force).abs()).fold(0.0, f64::max);
    for name in ["modified-frictionless", "original-frictionless"] {
        assert!(worst(&means(name)) < 1.0, "{name}: {:?}", means(name));
    }
    let modified = means("modified");
    assert!(worst(&modified) < 10.0, "{modified:?}");
    assert!(modified[1] > modified[0] && modified[0] > modified[2] && modified[2] > modified[3], "{modified:?}");
    let original = means("original");
    let incapable =
        original.iter().zip(wanted).filter(|(mean, force)| *force > 0.0 && (*mean - force).abs() > force / 2.0);
    assert!(incapable.count() >= 2, "{original:?}");
}

#[test]
fn rigid_joints_bring_the_modified_scheme_to_the_ideal_first_peak() {
    let peaks = first_peaks(&["plant.joints=rigid"]);
    // closed form of the ideal impedance: 60 N step at M 100, B 1000, K_e 10 000, 5 mm before the surface
    assert!((peaks[0] - 74.8).abs() < 6.0, "modified: {} N", peaks[0]);
    assert!((60.0..=80.0).contains(&peaks[1]), "original: {} N", peaks[1]);
}

#[test]
fn flexible_joints_keep_both_schemes_first_peaks_near_the_ideal() {
    for peak in first_peaks(&[]) {
        assert!((62.0..=78.0).contains(&peak), "{peak} N");
    }
}
