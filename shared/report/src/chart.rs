//! The report's pictures as data; [`crate::html`] and [`crate::svg`] draw the same.

use crate::ideal::Ideal;
use crate::result::RunReport;
use crate::series::Series;
use messages::JOINTS;
use scenario::Measure;
use serde::Serialize;

/// Points per line at most: a 13 s run at 200 Hz goes in whole.
const POINTS: usize = 2600;

/// A run's signals along the report's axis.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curves {
    pub force: Series,
    pub position: Series,
    pub target: Series,
    /// Per joint, % of its limit.
    pub torque: [Series; JOINTS],
    pub ideal: Ideal,
}

/// One picture: lines over the same instants.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Chart {
    pub title: String,
    pub unit: &'static str,
    pub t: Vec<f64>,
    pub lines: Vec<Line>,
    pub boxes: Vec<Span>,
    pub tall: bool,
}

/// One line. `color` counts a palette; the ideal and the command have their own.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Line {
    pub label: String,
    pub color: Paint,
    pub dashed: bool,
    pub y: Vec<Option<f64>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Paint {
    Ideal,
    Command,
    Palette(usize),
}

/// Where a limit applies: from, until (s), least, greatest; `allowed` says on which side of it one is inside.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Span {
    pub allowed: bool,
    pub from: f64,
    pub until: f64,
    pub min: f64,
    pub max: f64,
}

/// All pictures of a report.
pub(crate) fn charts(report: &RunReport) -> Vec<Chart> {
    let end = report.variants.iter().map(|variant| variant.simulated_s).fold(0.0, f64::max);
    let densest = report.variants.iter().map(|variant| variant.curves.force.t.len()).max().unwrap_or(0);
    let n = densest.clamp(2, POINTS);
    let grid: Vec<f64> = (0..n).map(|i| round(end * i as f64 / (n - 1) as f64, 4)).collect();
    let axis = report.axis;
    let line = |label: &str, color: usize, of: &Series, scale: f64| Line {
        label: label.to_owned(),
        color: Paint::Palette(color),
        dashed: false,
        y: sample(of, &grid, scale),
    };
    let ideals = || {
        // variants whose ideal is the same share a line
        let mut shown: Vec<(&str, &Ideal)> = Vec::new();
        for variant in &report.variants {
            let ideal = &variant.curves.ideal;
            let same = |other: &Ideal| {
                let pairs = ideal.force.y.iter().zip(&other.force.y);
                pairs.clone().count() > 0 && pairs.into_iter().all(|(a, b)| (a - b).abs() < 0.05)
            };
            if !ideal.force.t.is_empty() && !shown.iter().any(|(_, other)| same(other)) {
                shown.push((&variant.name, ideal));
            }
        }
        let single = shown.len() == 1;
        shown.into_iter().map(move |(name, ideal)| {
            (if single { "ideal impedance".to_owned() } else { format!("ideal of {name}") }, ideal)
        })
    };
    let reference = |label: String, of: &Series, scale: f64| Line {
        label,
        color: Paint::Ideal,
        dashed: true,
        y: sample(of, &grid, scale),
    };
    let chart = |title: String, unit, lines, boxes, tall| Chart { title, unit, t: grid.clone(), lines, boxes, tall };

    let mut force =
        vec![Line { label: "F_d".into(), color: Paint::Command, dashed: true, y: commanded(report, &grid) }];
    let mut position = Vec::new();
    let mut error = Vec::new();
    for (i, variant) in report.variants.iter().enumerate() {
        force.push(line(&variant.name, i, &variant.curves.force, 1.0));
        position.push(line(&variant.name, i, &variant.curves.position, 1e3));
        let difference = Series {
            t: variant.curves.target.t.clone(),
            y: (variant.curves.target.t.iter().zip(&variant.curves.target.y))
                .map(|(t, target)| target - variant.curves.position.at(*t).unwrap_or(*target))
                .collect(),
        };
        error.push(line(&variant.name, i, &difference, 1e3));
    }
    // dashed, and last: it must be seen on top of a run that follows it
    force.extend(ideals().map(|(label, ideal)| reference(label, &ideal.force, 1.0)));
    position.extend(ideals().map(|(label, ideal)| reference(label, &ideal.position, 1e3)));
    let mut charts = vec![
        chart(format!("Contact force along {axis}"), "N", force, limits(report), true),
        chart(format!("Tool position along {axis}"), "mm", position, Vec::new(), false),
        chart(format!("Target error Xᵗ − X along {axis}"), "mm", error, Vec::new(), false),
    ];
    for variant in &report.variants {
        let lines = (0..JOINTS).map(|i| line(&format!("joint {}", i + 1), i, &variant.curves.torque[i], 1.0)).collect();
        let limit = |min, max| Span { allowed: false, from: 0.0, until: end, min, max };
        let boxes = vec![limit(100.0, 1000.0), limit(-1000.0, -100.0)];
        charts.push(chart(format!("Joint torques: {}", variant.name), "% of limit", lines, boxes, false));
    }
    charts
}

/// The value of each grid interval that lies farthest from the one before, so that no peak is lost.
fn sample(of: &Series, grid: &[f64], scale: f64) -> Vec<Option<f64>> {
    let spacing = grid.get(1).copied().unwrap_or(0.0);
    let mut last: Option<f64> = None;
    grid.iter()
        .map(|&t| {
            if of.t.last().is_none_or(|&end| t > end + spacing)
                || of.t.first().is_some_and(|&start| t < start - spacing)
            {
                return None;
            }
            let inside = of.t.partition_point(|&sample| sample <= t - 0.5 * spacing)
                ..of.t.partition_point(|&sample| sample <= t + 0.5 * spacing);
            let distance = |y: f64| last.map_or(0.0, |last| (y - last).abs());
            let value = match inside.len() {
                0 | 1 => of.at(t)?,
                _ => of.y[inside].iter().copied().reduce(|a, b| if distance(b) > distance(a) { b } else { a })?,
            };
            last = Some(value);
            Some(round(value * scale, 3))
        })
        .collect()
}

fn commanded(report: &RunReport, grid: &[f64]) -> Vec<Option<f64>> {
    let rows = report.variants.first().map_or(&[][..], |variant| &variant.segments);
    grid.iter().map(|t| rows.iter().find(|row| row.start_s <= *t && *t < row.end_s)?.commanded_n).collect()
}

/// Limits on forces, as areas of the force picture.
fn limits(report: &RunReport) -> Vec<Span> {
    let mut boxes: Vec<Span> = Vec::new();
    for variant in &report.variants {
        for check in &variant.checks {
            let row = variant.segments.iter().find(|row| Some(&row.name) == check.segment.as_ref());
            let span = match (check.measure, row, check.min, check.max) {
                (Measure::ForceMeanErrorN, Some(row), _, Some(max)) => {
                    let wanted = row.commanded_n.unwrap_or(0.0);
                    Span {
                        allowed: true,
                        from: (row.end_s - 1.0).max(row.start_s),
                        until: row.end_s,
                        min: wanted - max,
                        max: wanted + max,
                    }
                }
                (Measure::FirstPeakN, _, Some(min), Some(max)) => {
                    let from = variant.run.first_contact_s.unwrap_or(0.0);
                    let row = variant.segments.iter().find(|row| row.start_s <= from && from < row.end_s);
                    let from = row.map_or(0.0, |row| row.start_s);
                    Span { allowed: true, from, until: from + 1.0, min, max }
                }
                _ => continue,
            };
            if !boxes.contains(&span) {
                boxes.push(span);
            }
        }
    }
    boxes
}

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarse_grid_keeps_a_peak_between_its_points() {
        let mut series = Series::default();
        for i in 0..=1000 {
            series.push(f64::from(i) * 0.01, if i == 333 { 50.0 } else { 1.0 });
        }
        let grid: Vec<f64> = (0..=10).map(f64::from).collect();
        let values = sample(&series, &grid, 1.0);
        assert_eq!(values.iter().flatten().copied().fold(0.0, f64::max), 50.0);
    }

    #[test]
    fn a_line_ends_where_its_run_ended() {
        let series = Series { t: vec![0.0, 1.0, 2.0, 3.0], y: vec![1.0; 4] };
        let grid: Vec<f64> = (0..=6).map(f64::from).collect();
        assert_eq!(sample(&series, &grid, 1.0).iter().filter(|y| y.is_some()).count(), 5);
    }
}
