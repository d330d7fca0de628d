//! The report's pictures as data; [`crate::html`] and [`crate::svg`] draw the same.

use crate::ideal::Ideal;
use crate::path::Way;
use crate::result::RunReport;
use crate::series::Series;
use messages::JOINTS;
use scenario::Measure;
use serde::{Deserialize, Serialize};

/// Points per line at most: a 13 s run at 200 Hz goes in whole.
const POINTS: usize = 2600;
/// The same where there is a line per joint.
const JOINT_POINTS: usize = 900;

/// A run's signals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curves {
    /// Along the report's axis.
    pub force: Series,
    /// Along x, y, z.
    pub position: [Series; 3],
    /// X_d along the report's axis.
    pub desired: Series,
    /// Xᵗ along the report's axis.
    pub target: Series,
    /// Angle between X and X_d, degrees.
    pub turn: Series,
    /// Per joint, % of the way from the middle of its range to its limit.
    pub angle: [Series; JOINTS],
    /// Per joint, % of its limit.
    pub torque: [Series; JOINTS],
    pub ideal: Ideal,
    pub way: Way,
}

/// One picture: lines over the same instants.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Chart {
    pub title: String,
    pub unit: String,
    pub t: Vec<f64>,
    pub lines: Vec<Line>,
    pub boxes: Vec<Span>,
    pub tall: bool,
}

/// One line. `color` counts a palette; the ideal and the command have their own. `dash` counts strokes; 0 is solid.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Line {
    pub label: String,
    pub color: Paint,
    pub dash: usize,
    pub y: Vec<Option<f64>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Paint {
    Ideal,
    Command,
    Palette(usize),
}

/// Where a limit applies: from, until (s), least, greatest; `allowed` says on which side of it one is inside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    let instants = |most: usize| -> Vec<f64> {
        let n = densest.clamp(2, most);
        (0..n).map(|i| round(end * i as f64 / (n - 1) as f64, 4)).collect()
    };
    let grid = instants(POINTS);
    let line = |label: &str, color: usize, of: &Series, scale: f64, grid: &[f64]| Line {
        label: label.to_owned(),
        color: Paint::Palette(color),
        dash: 0,
        y: sample(of, grid, scale),
    };
    let each = |of: &dyn Fn(&Curves) -> Series, scale: f64| -> Vec<Line> {
        let variants = report.variants.iter().enumerate();
        variants.map(|(i, variant)| line(&variant.name, i, &of(&variant.curves), scale, &grid)).collect()
    };
    let dashed = |label: String, color: Paint, y: Vec<Option<f64>>| Line { label, color, dash: 1, y };
    let chart = |title: String, unit: &str, lines, boxes, tall| Chart {
        title,
        unit: unit.to_owned(),
        t: grid.clone(),
        lines,
        boxes,
        tall,
    };
    let axis = report.axis;

    let mut force = vec![dashed("F_d".into(), Paint::Command, commanded(report, &grid))];
    force.extend(each(&|curves| curves.force.clone(), 1.0));
    // dashed, and last: it must be seen on top of a run that follows it
    let ideals = ideals(report);
    let ideal_lines = |of: &dyn Fn(&Ideal) -> &Series, scale: f64| -> Vec<Line> {
        let line = |(i, (label, ideal)): (usize, &(String, &Ideal))| Line {
            dash: i + 1,
            ..dashed(label.clone(), Paint::Ideal, sample(of(ideal), &grid, scale))
        };
        ideals.iter().enumerate().map(line).collect()
    };
    force.extend(ideal_lines(&|ideal| &ideal.force, 1.0));
    let mut charts = vec![chart(format!("Contact force along {axis}"), "N", force, force_limits(report), true)];
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut lines = each(&|curves| curves.position[k].clone(), 1e3);
        let mut boxes = Vec::new();
        if name == axis {
            lines.extend(ideal_lines(&|ideal| &ideal.position, 1e3));
            boxes = position_limits(report);
        }
        charts.push(chart(format!("Tool position along {name}"), "mm", lines, boxes, false));
    }
    let error = |curves: &Curves| Series {
        t: curves.target.t.clone(),
        y: (curves.target.t.iter().zip(&curves.target.y))
            .map(|(t, target)| target - report.along(&curves.position).at(*t).unwrap_or(*target))
            .collect(),
    };
    charts.push(chart(format!("Target error Xᵗ − X along {axis}"), "mm", each(&error, 1e3), Vec::new(), false));
    charts.push(chart(
        "Orientation: angle between X and X_d".into(),
        "deg",
        each(&|curves| curves.turn.clone(), 1.0),
        Vec::new(),
        false,
    ));
    let coarse = instants(JOINT_POINTS);
    let limit = |min, max| Span { allowed: false, from: 0.0, until: end, min, max };
    for variant in &report.variants {
        let curves = &variant.curves;
        for (title, unit, series) in [
            ("Joint angles", "% of the way to the limit", &curves.angle),
            ("Joint torques", "% of the limit", &curves.torque),
        ] {
            charts.push(Chart {
                title: format!("{title}: {}", variant.name),
                unit: unit.into(),
                t: coarse.clone(),
                lines: (0..JOINTS).map(|i| line(&format!("joint {}", i + 1), i, &series[i], 1.0, &coarse)).collect(),
                boxes: vec![limit(100.0, 1000.0), limit(-1000.0, -100.0)],
                tall: false,
            });
        }
    }
    // a picture of lines that are all flat and the same shows nothing
    charts.retain(|chart| chart.lines.iter().any(|line| line.y.iter().flatten().any(|y| y.abs() > 1e-9)));
    // where nothing is touched, the position is what it is about
    let main = format!("Tool position along {axis}");
    if !charts.iter().any(|chart| chart.tall)
        && let Some(i) = charts.iter().position(|chart| chart.title == main)
    {
        charts[..=i].rotate_right(1);
        charts[0].tall = true;
    }
    charts
}

/// Ideal impedances and what they are called; variants whose ideal is the same share one.
fn ideals(report: &RunReport) -> Vec<(String, &Ideal)> {
    let mut shown: Vec<(&str, &Ideal)> = Vec::new();
    let same = |a: &Series, b: &Series, tolerance: f64| {
        a.y.len() == b.y.len() && a.y.iter().zip(&b.y).all(|(a, b)| (a - b).abs() < tolerance)
    };
    for variant in &report.variants {
        let ideal = &variant.curves.ideal;
        let known = |other: &Ideal| same(&ideal.force, &other.force, 0.05) && same(&ideal.position, &other.position, 1e-5);
        if !ideal.force.t.is_empty() && !shown.iter().any(|(_, other)| known(other)) {
            shown.push((&variant.name, ideal));
        }
    }
    let single = shown.len() == 1;
    let label = |name: &str| if single { "ideal impedance".to_owned() } else { format!("ideal of {name}") };
    shown.into_iter().map(|(name, ideal)| (label(name), ideal)).collect()
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
    let holds = |row: &&crate::SegmentRow, t: f64| row.begun() && row.start_s <= t && t < row.end_s;
    grid.iter().map(|t| rows.iter().find(|row| holds(row, *t))?.commanded_n).collect()
}

/// Limits on forces, as areas of the force picture.
fn force_limits(report: &RunReport) -> Vec<Span> {
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

/// Limits on where X may end, as areas of the position picture (mm).
fn position_limits(report: &RunReport) -> Vec<Span> {
    let mut boxes: Vec<Span> = Vec::new();
    for variant in &report.variants {
        for check in &variant.checks {
            let row = variant.segments.iter().find(|row| Some(&row.name) == check.segment.as_ref());
            let (Measure::PositionErrorM | Measure::EncoderPositionErrorM, Some(row), Some(max), None) =
                (check.measure, row, check.max, &check.relative_to)
            else {
                continue;
            };
            let Some(wanted) = variant.curves.desired.before(row.end_s) else { continue };
            let (from, until) = (row.end_s - 0.1 * (row.end_s - row.start_s), row.end_s);
            let span = Span { allowed: true, from, until, min: 1e3 * (wanted - max), max: 1e3 * (wanted + max) };
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
