//! What a sweep runs: the points, and what each of them is measured by.

use miette::miette;
use report::VariantResult;
use scenario::{Document, Measure, Scenario, ScenarioError, Variant};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::str::FromStr;

/// More points are a mistake.
const MOST_POINTS: usize = 1_000_000;

/// A key and its values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Vary {
    /// Key path.
    pub key: String,
    /// In the order of the runs.
    pub values: Vec<f64>,
}

impl FromStr for Vary {
    type Err = String;

    fn from_str(text: &str) -> Result<Vary, String> {
        const EXPECTED: &str = "expected KEY.PATH=A..B:N, for example controller.kp=50..400:8";
        let parse = || {
            let (key, range) = text.split_once('=')?;
            let (ends, count) = range.rsplit_once(':')?;
            let (first, last) = ends.split_once("..")?;
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            Some((key.trim(), number(first)?, number(last)?, count.trim().parse::<usize>().ok()?))
        };
        let (key, first, last, count) = parse().ok_or(EXPECTED)?;
        if key.is_empty() {
            return Err(EXPECTED.into());
        }
        if count == 0 || count > MOST_POINTS || (count == 1) != (first == last) {
            return Err(format!("{count} values from {first} to {last}: {EXPECTED}; two different ends need two values or more"));
        }
        let share = |i: usize| i as f64 / (count - 1).max(1) as f64;
        Ok(Vary { key: key.into(), values: (0..count).map(|i| first + (last - first) * share(i)).collect() })
    }
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Its number in the sweep.
    pub index: usize,
    /// One value per key.
    pub values: Vec<f64>,
    /// Variant.
    pub variant: String,
}

/// A measure, of the run or of one segment.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Column {
    name: String,
    measure: Measure,
    segment: Option<String>,
}

/// A whole sweep. As JSON it tells one sweep from another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Plan {
    scenario: String,
    /// Of the scenario with the overrides of the command line.
    sha256: String,
    vary: Vec<Vary>,
    variants: Vec<String>,
    columns: Vec<Column>,
}

impl Plan {
    /// The sweep of `document`; no measures: those of its limits.
    pub fn new(document: &Document, vary: Vec<Vary>, variants: Vec<String>, measures: &[String]) -> miette::Result<Plan> {
        let scenario = document.scenario()?;
        let points = vary.iter().map(|vary| vary.values.len()).try_fold(variants.len(), usize::checked_mul);
        if points.is_none_or(|points| points > MOST_POINTS) {
            return Err(refusal("--vary", "", format!("more than {MOST_POINTS} points")));
        }
        if let Some(i) = (1..vary.len()).find(|&i| vary[..i].iter().any(|earlier| earlier.key == vary[i].key)) {
            return Err(refusal("--vary", &vary[i].key, "is varied twice".into()));
        }
        let mut columns: Vec<Column> = Vec::new();
        for measure in wanted(&scenario, measures)? {
            for column in of(&scenario, measure)? {
                if !columns.contains(&column) {
                    columns.push(column);
                }
            }
        }
        let text = serde_json::to_string(&scenario).map_err(|error| miette!("{error}"))?;
        let sha256 = Sha256::digest(text).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Plan { scenario: document.name.clone(), sha256, vary, variants, columns })
    }

    /// Every combination; the last key varies fastest, variants faster still.
    pub fn points(&self) -> Vec<Point> {
        let mut combinations = vec![Vec::new()];
        for vary in &self.vary {
            let longer = |start: &Vec<f64>, value: &f64| start.iter().chain([value]).copied().collect();
            combinations = combinations.iter().flat_map(|start| vary.values.iter().map(move |value| longer(start, value))).collect();
        }
        let runs = combinations.iter().flat_map(|values| self.variants.iter().map(move |variant| (values, variant)));
        runs.enumerate()
            .map(|(index, (values, variant))| Point { index, values: values.clone(), variant: variant.clone() })
            .collect()
    }

    /// The scenario of a point.
    pub fn resolve(&self, document: &Document, point: &Point) -> miette::Result<(Variant, Scenario)> {
        let mut varied = document.clone();
        for (vary, value) in self.vary.iter().zip(&point.values) {
            varied = varied.with(&vary.key, toml::Value::Float(*value))?;
        }
        let mut variants = varied.variants()?;
        let place = variants.iter().position(|(variant, _)| variant.name == point.variant);
        Ok(variants.swap_remove(place.ok_or_else(|| miette!("variant {} is gone", point.variant))?))
    }

    /// Keys varied.
    pub fn vary(&self) -> &[Vary] {
        &self.vary
    }

    /// Variants run.
    pub fn variants(&self) -> &[String] {
        &self.variants
    }

    /// Names of the measures, `measure` or `measure:segment`.
    pub fn columns(&self) -> Vec<&str> {
        self.columns.iter().map(|column| column.name.as_str()).collect()
    }

    /// What a run came to, one figure per column.
    pub fn values(&self, result: &VariantResult) -> Vec<Option<f64>> {
        self.columns.iter().map(|column| result.measure(column.measure, column.segment.as_deref())).collect()
    }
}

fn refusal(origin: &str, key: &str, message: String) -> miette::Report {
    ScenarioError::Override { origin: origin.into(), key: key.into(), message }.into()
}

fn wanted(scenario: &Scenario, names: &[String]) -> miette::Result<Vec<Measure>> {
    if names.is_empty() {
        let limits: Vec<Measure> = scenario.limits.iter().map(|limit| limit.measure).collect();
        return match limits.is_empty() {
            true => Err(refusal("--measure", "", "the scenario has no limits; say what is to be measured".into())),
            false => Ok(limits),
        };
    }
    let measure = |name: &String| {
        toml::Value::String(name.clone()).try_into().map_err(|error: toml::de::Error| refusal("--measure", name, error.message().into()))
    };
    names.iter().map(measure).collect()
}

/// One column for a measure of the run, one per segment that has it otherwise.
fn of(scenario: &Scenario, measure: Measure) -> miette::Result<Vec<Column>> {
    let Ok(toml::Value::String(name)) = toml::Value::try_from(measure) else {
        return Err(miette!("a measure without a name: {measure:?}"));
    };
    Ok(match report::segments_with(scenario, measure) {
        None => vec![Column { name, measure, segment: None }],
        Some(segments) => segments
            .into_iter()
            .map(|segment| Column { name: format!("{name}:{segment}"), measure, segment: Some(segment) })
            .collect(),
    })
}
