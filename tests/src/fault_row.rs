//! One fault injected into a run, and what the report says of it.

use crate::bench::{Bench, Edit};
use serde_json::Value as Json;
use toml::{Table, Value};

/// A `[[fault]]` of a scenario, with the keys that `more` states beside target, kind and begin.
pub fn fault(target: &str, kind: &str, start_s: f64, more: &[(&str, Value)]) -> Value {
    let stated = [("target", Value::from(target)), ("kind", Value::from(kind)), ("start_s", Value::Float(start_s))];
    Value::Table(Table::from_iter(stated.iter().chain(more).map(|(key, value)| ((*key).to_owned(), value.clone()))))
}

/// The report's row of one fault.
#[derive(Clone, Debug)]
pub struct FaultRow {
    /// Detector that saw it; `none` where nothing did.
    pub detected_by: String,
    /// The card that did not answer; `none` where it was none.
    pub card: String,
    /// From its begin until it was seen, ms; NaN where nothing saw it.
    pub after_ms: f64,
    /// From its begin until the arm began to stop, ms; NaN where it did not.
    pub stopping_after_ms: f64,
    /// Gravest state of the control computer.
    pub reaction: String,
    /// Greatest contact force, N.
    pub peak_force_n: f64,
    /// Greatest distance of the tool from where it was at the begin, m.
    pub distance_m: f64,
}

impl FaultRow {
    /// Rows of the injected faults in a run of table 5-3 under sensor noise (0.2 N), with these further changes, in the order
    /// of their begins. The run must succeed and leave nothing behind.
    pub fn of_run(faults: Vec<Value>, seconds: f64, edits: &[Edit<'_>]) -> Vec<FaultRow> {
        let bench = Bench::new();
        let mut changes = vec![
            ("force_sensor_if.noise_n", Value::Float(0.2)),
            ("safety.max_same_force_jobs", Value::Integer(10)),
            ("fault", Value::Array(faults)),
        ];
        changes.extend_from_slice(edits);
        let scenario = bench.scenario("faulty.toml", &changes);
        let seconds = seconds.to_string();
        let line = ["run", scenario, "--duration", &seconds, "--in-process", "--no-record", "--json", "--out", "out"];
        let outcome = bench.run(&line).expect_code(0).expect_nothing_left();
        let report: Json = serde_json::from_str(&outcome.stdout).expect("JSON");
        report["variants"][0]["faults"].as_array().expect("rows").iter().map(FaultRow::of).collect()
    }

    /// The row of the only fault.
    pub fn of_one(fault: Value, seconds: f64, edits: &[Edit<'_>]) -> FaultRow {
        let rows = FaultRow::of_run(vec![fault], seconds, edits);
        assert_eq!(rows.len(), 1, "{rows:?}");
        rows[0].clone()
    }

    fn of(row: &Json) -> FaultRow {
        let number = |key: &str| row[key].as_f64().unwrap_or(f64::NAN);
        FaultRow {
            detected_by: row["detected_by"].as_str().unwrap_or("none").into(),
            card: row["card"].as_str().unwrap_or("none").into(),
            after_ms: 1e3 * number("detected_after_s"),
            stopping_after_ms: 1e3 * number("stopping_after_s"),
            reaction: row["reaction"].as_str().expect("a state").into(),
            peak_force_n: number("peak_force_n"),
            distance_m: number("distance_m"),
        }
    }
}
