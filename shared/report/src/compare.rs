//! Several runs side by side: their figures in one table, their curves in one picture.
//!
//! Reads what [`RunReport::write`](crate::RunReport::write) has left in the runs' folders. Figures belong together by variant, segment and
//! measure, pictures by their title; what a run does not have is a dash. Curves keep the first run's instants.

use crate::chart::{Chart, Line, Paint};
use crate::html;
use crate::result::SCHEMA_VERSION;
use crate::text::{figure, table};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A folder that holds no run that can be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file cannot be read.
    #[error("{}: {reason}; expected a folder that `vmerack run` has written", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// What the operating system, or the parser, says.
        reason: String,
    },
    /// Written by another version.
    #[error("{}: schema version {found}, expected {expected}; run the scenario again", path.display())]
    Schema {
        /// Which file.
        path: PathBuf,
        /// Version found.
        found: Value,
        /// Version that this program writes.
        expected: u32,
    },
}

/// One run, as its folder has it.
#[derive(Clone, Debug)]
pub struct StoredRun {
    /// What it is called in tables and legends: its folder.
    pub label: String,
    report: Value,
    charts: Vec<Chart>,
}

impl StoredRun {
    /// The run in that folder.
    pub fn load(folder: &Path) -> Result<StoredRun, CompareError> {
        let path = folder.join("report.json");
        let report: Value = read(&path)?;
        if report["schema_version"] != SCHEMA_VERSION {
            return Err(CompareError::Schema { path, found: report["schema_version"].clone(), expected: SCHEMA_VERSION });
        }
        let path = folder.join("charts.json");
        let charts: Vec<Chart> = read(&path)?;
        if let Some(chart) = charts.iter().find(|chart| chart.lines.iter().any(|line| line.y.len() != chart.t.len())) {
            let reason = format!("a curve of `{}` has not as many values as there are instants", chart.title);
            return Err(CompareError::Read { path, reason });
        }
        let name = std::path::absolute(folder).ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
        Ok(StoredRun { label: name.unwrap_or_else(|| folder.display().to_string()), report, charts })
    }

    fn variants(&self) -> impl Iterator<Item = (&str, &Value)> {
        let variants = self.report["variants"].as_array().map_or(&[][..], Vec::as_slice);
        variants.iter().map(|variant| (variant["name"].as_str().unwrap_or(""), variant))
    }
}

/// Reports and curves of our own are shorter.
const MOST_BYTES: u64 = 256 << 20;

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, CompareError> {
    let failed = |reason: String| CompareError::Read { path: path.to_owned(), reason };
    let text = scenario::read_text(path, MOST_BYTES).map_err(failed)?;
    serde_json::from_str(&text).map_err(|error| failed(error.to_string()))
}

/// One figure in all runs.
#[derive(Clone, Debug, PartialEq)]
pub struct ComparedFigure {
    /// Variant.
    pub variant: String,
    /// Segment; empty for a figure of the whole run.
    pub segment: String,
    /// Key in `report.json`.
    pub measure: String,
    /// Value in each run.
    pub values: Vec<Option<f64>>,
}

impl ComparedFigure {
    /// Every run has the same.
    pub fn is_same(&self) -> bool {
        self.values.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Greatest less least value, where every run has one.
    pub fn spread(&self) -> Option<f64> {
        let values: Option<Vec<f64>> = self.values.iter().copied().collect();
        let (low, high) = values?.into_iter().fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
        Some(high - low)
    }
}

/// Runs side by side.
#[derive(Clone, Debug)]
pub struct Comparison {
    runs: Vec<StoredRun>,
    figures: Vec<ComparedFigure>,
}

impl Comparison {
    /// Puts runs side by side, in this order.
    pub fn new(mut runs: Vec<StoredRun>) -> Comparison {
        // two folders may have one name
        for i in 1..runs.len() {
            let same = runs[..i].iter().filter(|run| run.label == runs[i].label).count();
            if same > 0 {
                runs[i].label = format!("{} ({})", runs[i].label, same + 1);
            }
        }
        let mut figures: Vec<ComparedFigure> = Vec::new();
        for (i, run) in runs.iter().enumerate() {
            for (variant, result) in run.variants() {
                let segments = result["segments"].as_array().map_or(&[][..], Vec::as_slice);
                let whole = [("", &result["run"])];
                let parts = segments.iter().map(|row| (row["name"].as_str().unwrap_or(""), row));
                for (segment, object) in whole.into_iter().chain(parts) {
                    for (measure, value) in object.as_object().into_iter().flatten() {
                        let Some(value) = value.as_f64() else { continue };
                        let is_it = |figure: &&mut ComparedFigure| {
                            figure.variant == variant && figure.segment == segment && figure.measure == *measure
                        };
                        match figures.iter_mut().find(is_it) {
                            Some(figure) => figure.values[i] = Some(value),
                            None => {
                                let mut values = vec![None; runs.len()];
                                values[i] = Some(value);
                                let (variant, segment) = (variant.to_owned(), segment.to_owned());
                                figures.push(ComparedFigure { variant, segment, measure: measure.clone(), values });
                            }
                        }
                    }
                }
            }
        }
        Comparison { runs, figures }
    }

    /// Every figure of every run.
    pub fn figures(&self) -> &[ComparedFigure] {
        &self.figures
    }

    /// Tables for the terminal; figures that are the same in all runs are only counted.
    pub fn text(&self) -> String {
        let same = self.figures.iter().filter(|figure| figure.is_same()).count();
        let headings = self.headings();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        format!(
            "{}\n{}\n{same} of {} figures are the same in all runs\n",
            table(&RUN_HEADINGS, &self.run_rows()),
            table(&headings, &self.rows(true)),
            self.figures.len()
        )
    }

    /// One page: curves over each other, tables below. The message says what could not be drawn.
    pub fn html(&self) -> Result<String, String> {
        let headings = self.headings();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        let sections = format!(
            "<section><h2>Runs</h2>{}</section><section><h2>Figures that differ</h2>{}</section>\
             <section><h2>All figures</h2><details><summary>{} figures</summary>{}</details></section>",
            html::table(&RUN_HEADINGS, &self.run_rows()),
            html::table(&headings, &self.rows(true)),
            self.figures.len(),
            html::table(&headings, &self.rows(false)),
        );
        let names: Vec<&str> = self.runs.iter().map(|run| run.label.as_str()).collect();
        let note = "Where every run has one line, colour tells the runs apart; elsewhere colour tells variants or joints apart, and \
                    the stroke the runs, in their order: solid, dashed, dotted.";
        html::page("comparison of runs", &names.join(" – "), note, &self.charts(), &sections)
    }

    fn headings(&self) -> Vec<String> {
        let fixed = ["variant", "segment", "figure"].map(str::to_owned);
        let runs = self.runs.iter().map(|run| run.label.clone());
        fixed.into_iter().chain(runs).chain(["spread".to_owned()]).collect()
    }

    fn rows(&self, different: bool) -> Vec<Vec<String>> {
        let shown = self.figures.iter().filter(|row| !different || !row.is_same());
        shown
            .map(|row| {
                let mut cells = vec![row.variant.clone(), row.segment.clone(), row.measure.clone()];
                cells.extend(row.values.iter().map(|value| figure(*value)));
                cells.push(figure(row.spread()));
                cells
            })
            .collect()
    }

    fn run_rows(&self) -> Vec<Vec<String>> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let mut rows = Vec::new();
        for run in &self.runs {
            for (variant, result) in run.variants() {
                let digest = result["digest"].as_str();
                let others = self.runs.iter().filter(|other| {
                    let theirs = other.variants().find(|(name, _)| *name == variant);
                    digest.is_some() && theirs.is_some_and(|(_, theirs)| theirs["digest"].as_str() == digest)
                });
                let digest = match (digest, others.count()) {
                    (None, _) => "–".to_owned(),
                    (Some(digest), n) => {
                        let short = digest.get(..12).unwrap_or(digest);
                        if n == self.runs.len() { format!("{short} (all)") } else { short.to_owned() }
                    }
                };
                rows.push(vec![
                    run.label.clone(),
                    text(&run.report["scenario"]),
                    text(&run.report["seed"]),
                    text(&run.report["pacing"]),
                    variant.to_owned(),
                    text(&result["verdict"]),
                    digest,
                ]);
            }
        }
        rows
    }

    /// Pictures with the lines of all runs.
    fn charts(&self) -> Vec<Chart> {
        let mut titles: Vec<&str> = Vec::new();
        for chart in self.runs.iter().flat_map(|run| &run.charts) {
            if !titles.contains(&chart.title.as_str()) {
                titles.push(&chart.title);
            }
        }
        titles.into_iter().filter_map(|title| self.chart(title)).collect()
    }

    fn chart(&self, title: &str) -> Option<Chart> {
        let of = |run: &StoredRun| run.charts.iter().find(|chart| chart.title == title).cloned();
        let all: Vec<(usize, Chart)> = self.runs.iter().enumerate().filter_map(|(i, run)| Some((i, of(run)?))).collect();
        let (_, first) = all.first()?;
        let own = |line: &&Line| matches!(line.color, Paint::Palette(_));
        let single = all.iter().all(|(_, chart)| chart.lines.iter().filter(own).count() < 2);
        let mut merged = Chart { lines: Vec::new(), ..first.clone() };
        for (i, chart) in &all {
            for line in &chart.lines {
                let y = resampled(&chart.t, &line.y, &first.t);
                match line.color {
                    Paint::Palette(color) => merged.lines.push(Line {
                        label: format!("{}: {}", self.runs[*i].label, line.label),
                        color: Paint::Palette(if single { *i } else { color }),
                        dash: if single { 0 } else { *i },
                        y,
                    }),
                    // what is ideal or commanded in several runs is drawn once
                    _ if merged.lines.iter().any(|other| other.label == line.label && close(&other.y, &y)) => {}
                    _ => merged.lines.push(Line { y, ..line.clone() }),
                }
            }
        }
        Some(merged)
    }
}

const RUN_HEADINGS: [&str; 7] = ["run", "scenario", "seed", "pacing", "variant", "verdict", "digest"];

/// Values at other instants, linear between the given ones; none beyond their ends.
fn resampled(t: &[f64], y: &[Option<f64>], at: &[f64]) -> Vec<Option<f64>> {
    if t == at {
        return y.to_vec();
    }
    at.iter()
        .map(|&instant| {
            let after = t.partition_point(|&t| t <= instant);
            let before = after.checked_sub(1)?;
            match (t.get(after), y[before]) {
                (Some(&next), Some(from)) => {
                    let share = (instant - t[before]) / (next - t[before]);
                    Some(y[after].map_or(from, |to| from + share * (to - from)))
                }
                (None, from) if t[before] == instant => from,
                _ => None,
            }
        })
        .collect()
}

fn close(a: &[Option<f64>], b: &[Option<f64>]) -> bool {
    a.iter().zip(b).all(|pair| match pair {
        (Some(a), Some(b)) => (a - b).abs() < 0.05,
        _ => true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_brought_to_the_instants_of_the_first_run() {
        let y = [Some(0.0), Some(2.0), None];
        let at = resampled(&[0.0, 1.0, 2.0], &y, &[0.0, 0.5, 1.0, 3.0]);
        assert_eq!(at, [Some(0.0), Some(1.0), Some(2.0), None]);
    }
}
