//! From made-up runs to verdict and files.

mod made_up;

use made_up::{ledger, result, table_5_3, trace};
use report::{Ended, RunReport, VariantResult, Verdict};

fn close(actual: Option<f64>, expected: f64, tolerance: f64) {
    assert!(actual.is_some_and(|actual| (actual - expected).abs() < tolerance), "{actual:?}, expected {expected}");
}

#[test]
fn a_run_that_is_the_ideal_impedance_has_its_figures_and_passes() {
    let (variant, scenario) = &table_5_3()[2];
    let result = result(variant, scenario, 0.0);
    assert_eq!(result.verdict, Verdict::Passed, "{:?} {:?}", result.findings, result.checks);
    for (row, mean) in result.segments[1..].iter().zip([60.0, 80.0, 40.0, 0.0]) {
        close(row.mean_n, mean, 0.05);
    }
    close(result.run.first_peak_n, 74.8, 0.3);
    assert!(result.run.ideal_force_deviation_n.unwrap() < 1.0, "{:?}", result.run);
    close(result.run.incapable_segments, 0.0, 1e-9);
    // ω 10 1/s, ζ 0.5: a step's 90 % rise takes 1.64/ω… from the touch with some speed less
    let rise = result.segments[2].rise_s.unwrap();
    assert!((rise - 0.198).abs() < 0.02, "{rise}");
    assert!(result.segments[0].commanded_n.is_none() && result.segments[0].position_error_m.is_some());
}

#[test]
fn never_touching_is_a_result_where_the_scenario_expects_it_and_a_failure_elsewhere() {
    let variants = table_5_3();
    let expected = result(&variants[1].0, &variants[1].1, f64::NAN);
    assert_eq!(expected.verdict, Verdict::Passed, "{:?}", expected.checks);
    assert!(expected.findings[0].contains("never touched"));
    close(expected.run.incapable_segments, 3.0, 1e-9);
    assert_eq!(
        (expected.run.first_contact_s, expected.run.first_peak_n, expected.segments[1].rise_s),
        (None, None, None)
    );
    let failure = result(&variants[0].0, &variants[0].1, f64::NAN);
    assert_eq!(failure.verdict, Verdict::Failed);
}

#[test]
fn a_run_that_diverged_has_no_figures_for_what_it_did_not_finish() {
    let (variant, scenario) = &table_5_3()[0];
    let mut trace = trace(scenario, 0.0, 5.0);
    trace.plant.last_mut().unwrap().contact[2] = f64::NAN;
    let ended = Ended::Diverged { at_s: 5.0 };
    let result = VariantResult::new(scenario, variant, &trace, &ledger(scenario), ended.clone(), 5.0).unwrap();
    assert_eq!(result.verdict, Verdict::Failed);
    assert!(result.findings[0].contains("diverged at 5.000 s"));
    close(result.segments[1].mean_n, 60.0, 0.1);
    let unfinished = &result.segments[2];
    assert_eq!((unfinished.mean_n, unfinished.peak_n, unfinished.rms_error_n), (None, None, None));
    let mut lenient = variant.clone();
    lenient.may_diverge = true;
    let result = VariantResult::new(scenario, &lenient, &trace, &ledger(scenario), ended, 5.0).unwrap();
    assert_eq!(result.verdict, Verdict::Passed, "{:?}", result.checks);
}

#[test]
fn a_run_without_a_single_probe_is_reported_all_the_same() {
    let (variant, scenario) = &table_5_3()[0];
    let ended = Ended::Stopped { at_s: 0.0, reason: "hw_sim ended".into() };
    let result = VariantResult::new(scenario, variant, &Default::default(), &ledger(scenario), ended, 0.0).unwrap();
    assert_eq!(result.verdict, Verdict::Failed);
    let report = RunReport::new("x", scenario, "lockstep", vec![result], Vec::new());
    let folder = tempfile::tempdir().unwrap();
    report.write(folder.path()).unwrap();
    assert!(report::text::render(&report).contains("hw_sim ended"));
}

#[test]
fn the_files_hold_the_numbers_and_need_nothing_else() {
    let variants = table_5_3();
    let results = variants.iter().map(|(variant, scenario)| result(variant, scenario, 0.5)).collect();
    let report = RunReport::new("table-5-3", &variants[0].1, "lockstep", results, Vec::new());
    let folder = tempfile::tempdir().unwrap();
    report.write(folder.path()).unwrap();
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("report.json")).unwrap()).unwrap();
    let mean = json["variants"][0]["segments"][1]["mean_n"].as_f64();
    close(mean, 60.5, 0.05);
    assert_eq!(json["variants"][0]["checks"][0]["measure"], "force_mean_error_n");
    assert_eq!(json["schema_version"], report::SCHEMA_VERSION);
    let html = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    for foreign in ["src=\"", "href=\"http", "@import", "url("] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    assert!(html.contains("<noscript") && html.contains("<svg") && html.contains("60.5"));
    // the terminal shows the same figures
    let text = report::text::render(&report);
    assert!(text.contains(&format!("{:.2}", mean.unwrap())), "{text}");
    assert!(report.write(std::path::Path::new("/nowhere")).unwrap_err().to_string().contains("/nowhere/report.json"));
}

#[test]
fn latency_runs_from_the_request_to_the_end_of_the_transfer() {
    let (_, scenario) = &table_5_3()[0];
    let paths = ledger(scenario).paths();
    let encoder = paths.iter().find(|path| path.path == "read encoder-1").unwrap();
    assert_eq!((encoder.n, encoder.min_ns), (1000, 1135));
    assert!(encoder.max_ns.abs_diff(1375) <= 1 && encoder.p50_ns.abs_diff(1255) <= 1, "{encoder:?}");
    assert!(paths.iter().any(|path| path.path == "write da-1"));
}
