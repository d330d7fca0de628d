//! Tables for a terminal.

use crate::accounting::BusAccount;
use crate::bus_rows::{
    AGE_HEADINGS, MASTER_HEADINGS, TASK_HEADINGS, WATERFALL_HEADINGS, counts, masters, tasks, waterfall,
};
use crate::faults;
use crate::ledger::PathLatency;
use crate::result::{RunReport, Sweep, VariantResult};
use crate::segments::SegmentRow;
use crate::stretches::Course;
use crate::trace::Ended;
use crate::verdict::{Check, Verdict};

/// The whole report: segments and latencies per variant, sweeps, verdict last.
pub fn render(report: &RunReport) -> String {
    let mut out = format!("{}\nseed {}, {}, force along {}\n", report.title, report.seed, report.pacing, report.axis);
    let mut shown: Option<&[SegmentRow]> = None;
    for variant in &report.variants {
        if !variant.ideal.is_empty() && shown.is_none_or(|rows| rows != variant.ideal) {
            let of = if report.variants.iter().all(|other| other.ideal == variant.ideal) {
                String::new()
            } else {
                format!(", {}", variant.name)
            };
            out += &format!("\nideal impedance, one axis{of}\n{}", table(&HEADINGS, &segments(&variant.ideal)));
            shown = Some(&variant.ideal);
        }
        out += &format!("\n{}\n{}", variant.name, table(&HEADINGS, &segments(&variant.segments)));
        for finding in &variant.findings {
            out += &format!("  {finding}\n");
        }
        if !variant.faults.is_empty() {
            out += &table(&faults::HEADINGS, &faults::cells(&variant.faults));
        }
    }
    let mut shown: Option<&[PathLatency]> = None;
    let mut accounted: Option<&BusAccount> = None;
    for variant in &report.variants {
        if !variant.transfers.is_empty() && shown.is_none_or(|paths| paths != variant.transfers) {
            out += &format!("\nmodelled latency of bus transfers, {}\n{}", variant.name, latencies(&variant.transfers));
            shown = Some(&variant.transfers);
        }
        if let Some(bus) = variant.bus.as_ref().filter(|bus| accounted != Some(*bus)) {
            out += &format!("\nbus and processors, {}\n{}", variant.name, bus_tables(bus));
            accounted = Some(bus);
        }
        if !variant.measured.is_empty() {
            out += &format!("\nmeasured latency, {}\n{}", variant.name, crate::latency::text(&variant.measured));
        }
    }
    for sweep in &report.sweeps {
        let (headings, rows) = sweep_table(sweep);
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        out += &format!(
            "\nmean and rms error of the force in the last second over {}\n{}",
            sweep.key,
            table(&headings, &rows)
        );
    }
    out += "\nlimits\n";
    out += &checks(&report.variants);
    out += &format!("\nverdict: {}\n", verdict(report.verdict));
    out
}

/// `passed` or `FAILED`.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "FAILED",
    }
}

/// Headings of the segment table.
pub(crate) const HEADINGS: [&str; 9] =
    ["segment", "until s", "F_d N", "mean N", "error N", "rms N", "peak N", "90 % rise s", "|X−X_d| mm"];

/// Cells of the segment table.
pub(crate) fn segments(rows: &[SegmentRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|row| {
            vec![
                match row.course {
                    Course::AsPlanned => row.name.clone(),
                    course => format!("{} ({})", row.name, course.words()),
                },
                format!("{}", (1e4 * row.end_s).round() / 1e4),
                number(row.commanded_n, 1),
                number(row.mean_n, 2),
                number(row.mean_error_n, 2),
                number(row.rms_error_n, 2),
                number(row.peak_n, 1),
                number(row.rise_s, 3),
                number(row.position_error_m.map(|error| 1e3 * error), 2),
            ]
        })
        .collect()
}

/// Headings of a latency table.
pub(crate) const LATENCY_HEADINGS: [&str; 6] = ["path", "n", "min µs", "p50 µs", "p99 µs", "max µs"];

/// Cells of a latency table.
pub(crate) fn latency_rows(paths: &[PathLatency]) -> Vec<Vec<String>> {
    let micro = |ns: u64| format!("{:.3}", ns as f64 * 1e-3);
    paths
        .iter()
        .map(|path| {
            let figures = [path.min_ns, path.p50_ns, path.p99_ns, path.max_ns].map(micro);
            [vec![path.path.clone(), path.n.to_string()], figures.to_vec()].concat()
        })
        .collect()
}

/// A sweep: one row per variant and value, one column per force segment.
pub(crate) fn sweep_table(sweep: &Sweep) -> (Vec<String>, Vec<Vec<String>>) {
    let mut headings = vec!["variant".to_owned(), sweep.key.clone()];
    if let Some(across) = &sweep.across {
        headings.extend([across.clone(), "limits".into()]);
    }
    let rows = sweep.points.first().map_or(&[][..], |point| &point.segments);
    headings.extend(rows.iter().filter(|row| row.force_controlled).map(|row| row.name.clone()));
    headings.extend(rows.iter().filter(|row| row.force_controlled).map(|row| format!("{} rms", row.name)));
    headings.extend(["first peak N", "bus load %", "ended"].map(str::to_owned));
    let mut points: Vec<_> = sweep.points.iter().collect();
    let order = |name: &str| sweep.points.iter().position(|point| point.variant == name);
    points.sort_by(|a, b| order(&a.variant).cmp(&order(&b.variant)).then(a.value.total_cmp(&b.value)));
    let cells = points
        .into_iter()
        .map(|point| {
            let mut row = vec![point.variant.clone(), format!("{}", point.value)];
            if let Some(across) = point.across {
                row.extend([format!("{across}"), if point.passed { "hold" } else { "BROKEN" }.into()]);
            }
            row.extend(point.segments.iter().filter(|row| row.force_controlled).map(|row| number(row.mean_n, 2)));
            let forces = point.segments.iter().filter(|row| row.force_controlled);
            row.extend(forces.map(|row| number(row.rms_error_n, 2)));
            row.push(number(point.run.first_peak_n, 1));
            row.push(number(point.run.bus_load.map(|load| 100.0 * load), 2));
            row.push(match (&point.ended, point.run.first_contact_s) {
                (Ended::Diverged { at_s }, _) => format!("diverged at {at_s:.2} s"),
                (Ended::Stopped { reason, .. }, _) => reason.clone(),
                (Ended::Completed, None) => "never touched".into(),
                (Ended::Completed, Some(_)) => "completed".into(),
            });
            row
        })
        .collect();
    (headings, cells)
}

fn bus_tables(bus: &BusAccount) -> String {
    [
        format!("{}\n", counts(bus)),
        table(&MASTER_HEADINGS, &masters(bus)),
        table(&TASK_HEADINGS, &tasks(bus)),
        table(&AGE_HEADINGS, &latency_rows(&bus.ages)),
        table(&WATERFALL_HEADINGS, &waterfall(&bus.waterfall)),
    ]
    .join("\n")
}

fn latencies(paths: &[PathLatency]) -> String {
    table(&LATENCY_HEADINGS, &latency_rows(paths))
}

fn checks(variants: &[VariantResult]) -> String {
    let rows: Vec<_> = variants
        .iter()
        .flat_map(|variant| variant.checks.iter().map(|check| check_row(&variant.name, check)))
        .collect();
    table(&CHECK_HEADINGS, &rows)
}

/// Headings of the table of limits.
pub(crate) const CHECK_HEADINGS: [&str; 6] = ["variant", "measure", "value", "limit", "", "source"];

/// Cells of one limit.
pub(crate) fn check_row(variant: &str, check: &Check) -> Vec<String> {
    let limit = match (check.min, check.max) {
        (Some(min), Some(max)) => format!("{min} … {max}"),
        (Some(min), None) => format!("≥ {min}"),
        (None, Some(max)) => format!("≤ {max}"),
        (None, None) => String::new(),
    };
    let segment = check.segment.as_ref().map_or_else(String::new, |segment| format!(", {segment}"));
    let result = match check.passed {
        Some(true) => "ok",
        Some(false) => "VIOLATED",
        None => "not judged",
    };
    let times = check.relative_to.as_ref().map_or_else(String::new, |other| format!(", times that of {other}"));
    let measure = format!("{}{segment}{times}", measure_name(check));
    vec![variant.to_owned(), measure, figure(check.value), limit, result.to_owned(), check.source.clone()]
}

/// The measure as a scenario names it.
fn measure_name(check: &Check) -> String {
    serde_json::to_value(check.measure).ok().and_then(|name| name.as_str().map(str::to_owned)).unwrap_or_default()
}

/// A number, or a dash where there is none.
fn number(value: Option<f64>, digits: usize) -> String {
    match value.filter(|value| value.is_finite()) {
        // no "-0.00"
        Some(value) => {
            format!("{:.digits$}", if value.abs() < 0.5 * 10f64.powi(-(digits as i32)) { 0.0 } else { value })
        }
        None => "–".into(),
    }
}

/// A number of any size in five digits, or a dash where there is none.
pub(crate) fn figure(value: Option<f64>) -> String {
    let Some(value) = value.filter(|value| value.is_finite()) else { return "–".into() };
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        return format!("{value:.4e}");
    }
    let digits = if size == 0.0 { 0 } else { (4 - size.log10().floor() as i32).clamp(0, 8) as usize };
    format!("{value:.digits$}")
}

/// Columns as wide as they need to be: text to the left, figures to the right.
pub(crate) fn table(headings: &[&str], rows: &[Vec<String>]) -> String {
    let figures: Vec<bool> = (0..headings.len())
        .map(|i| {
            let mut cells = rows.iter().filter_map(|row| row.get(i)).filter(|cell| *cell != "–");
            cells.all(|cell| cell.parse::<f64>().is_ok())
        })
        .collect();
    let width = |i: usize| {
        let cells = rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count());
        cells.chain([headings[i].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut out = String::new();
        for (i, cell) in cells.enumerate() {
            let padding = " ".repeat(widths[i] - cell.chars().count());
            let (left, right) = if figures[i] { (padding.as_str(), "") } else { ("", padding.as_str()) };
            out += &format!("  {left}{cell}{right}");
        }
        out.trim_end().to_owned() + "\n"
    };
    let mut out = line(&mut headings.iter().copied());
    out += &line(&mut widths.iter().map(|width| "─".repeat(*width)).collect::<Vec<_>>().iter().map(String::as_str));
    for row in rows {
        out += &line(&mut row.iter().map(String::as_str));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_stand_to_the_right_and_text_to_the_left() {
        let rows = [vec!["a".into(), "1.5".into()], vec!["long".into(), "–".into()], vec!["b".into(), "10.25".into()]];
        let expected = "  name      N\n  ────  ─────\n  a       1.5\n  long      –\n  b     10.25\n";
        assert_eq!(table(&["name", "N"], &rows), expected);
    }

    #[test]
    fn what_is_no_number_is_a_dash() {
        assert_eq!(
            (number(Some(f64::NAN), 2), number(None, 2), number(Some(-0.001), 2)),
            ("–".into(), "–".into(), "0.00".into())
        );
    }
}
