//! `vmerack margin`: the value of a key at which the emulated loop turns unstable, beside the closed form.
//!
//! Runs the scenario in this process at values of the key found by bisection. A run is unstable where the oscillation of X
//! in the last segment grows from period to period (its envelope over up to 20 periods) or the plant diverges. Exit code 0
//! where every variant has its boundary, 1 where one is stable, or unstable, over the whole range, 2 where key or range
//! are bad; those are found before anything runs.

mod prediction;
mod search;
mod table;

use crate::commands::run::{chosen, end_on_signals};
use crate::parallel::parallel;
use clap::Args;
use miette::{IntoDiagnostic, miette};
use prediction::Loop;
use scenario::{Document, Scenario, ScenarioError, Variant};
use search::{Boundary, Ends};
use serde::Serialize;

/// Find the value of a key at which the loop turns unstable.
#[derive(Debug, Args)]
pub struct MarginArgs {
    /// A built-in scenario or a file.
    scenario: String,
    /// Key that is varied, for example encoder_if.delay_ms.
    #[arg(long, value_name = "KEY.PATH")]
    key: String,
    /// One end of the range [default: a quarter of the scenario's value].
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    from: Option<f64>,
    /// The other end [default: four times the scenario's value].
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    to: Option<f64>,
    /// How well the value is to be known, as a share of it.
    #[arg(long, value_name = "SHARE", default_value_t = 1e-3)]
    tolerance: f64,
    /// This variant only; may be repeated.
    #[arg(long, value_name = "NAME")]
    variant: Vec<String>,
    /// Override a key of the scenario; may be repeated.
    #[arg(long, value_name = "KEY.PATH=VALUE")]
    set: Vec<String>,
    /// Print JSON and nothing else.
    #[arg(long)]
    json: bool,
}

/// What came out for one variant.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Row {
    /// Variant.
    pub variant: String,
    /// Boundary of the emulated loop; none: the whole range is on one side of it.
    pub emulated: Option<Boundary>,
    /// What the ends of the range are.
    pub ends: Ends,
    /// Where the closed form has the boundary; none: there is none for this loop, or not in the range.
    pub predicted: Option<f64>,
    /// Emulated over predicted.
    pub ratio: Option<f64>,
    /// The closed form.
    pub model: Option<&'static str>,
    /// The loop's figures at the emulated boundary, beside all bounds that apply.
    pub figures: Vec<(&'static str, f64)>,
}

/// Runs the command and returns its exit code.
pub fn run(args: MarginArgs) -> miette::Result<u8> {
    let (key, json) = (args.key.clone(), args.json);
    end_on_signals()?;
    let (name, rows) = rows(&args)?;
    if json {
        let value = serde_json::json!({ "scenario": name, "key": key, "rows": rows });
        println!("{}", serde_json::to_string_pretty(&value).into_diagnostic()?);
    } else {
        print!("{}", table::of(&name, &key, &rows));
    }
    Ok(u8::from(rows.iter().any(|row| row.emulated.is_none())))
}

/// One row per variant, and the scenario's name.
pub(crate) fn rows(args: &MarginArgs) -> miette::Result<(String, Vec<Row>)> {
    let document = scenario::load(&args.scenario, &args.set)?;
    let refuse = |option: &str, message: String| -> miette::Report {
        ScenarioError::Override { origin: option.into(), key: args.key.clone(), message }.into()
    };
    if !(1e-6..=0.1).contains(&args.tolerance) {
        return Err(refuse("--tolerance", format!("is {}, expected 1e-6 to 0.1", args.tolerance)));
    }
    let mut jobs = Vec::new();
    for (variant, scenario) in chosen(&document, &args.variant)? {
        let (value, whole) = match scenario.value(&args.key) {
            Some(toml::Value::Integer(value)) => (value as f64, true),
            Some(toml::Value::Float(value)) => (value, false),
            Some(_) => return Err(refuse("--key", "is no number".into())),
            None => return Err(refuse("--key", "the scenario has no such key".into())),
        };
        let (from, to) = (args.from.unwrap_or(0.25 * value), args.to.unwrap_or(4.0 * value));
        if !(from.is_finite() && to.is_finite() && from < to) {
            return Err(refuse(
                "--from/--to",
                format!("{from} to {to} is no range; expected two numbers, the smaller one first"),
            ));
        }
        let vary = Vary { document: document.clone(), key: args.key.clone(), whole, variant: variant.name };
        // what a value at either end breaks is found here
        vary.at(from)?;
        vary.at(to)?;
        jobs.push((vary, from, to));
    }
    let rows = parallel(&jobs, |(vary, from, to)| row(vary, *from, *to, args.tolerance));
    Ok((document.name.clone(), rows.into_iter().collect::<miette::Result<_>>()?))
}

fn row(vary: &Vary, from: f64, to: f64, tolerance: f64) -> miette::Result<Row> {
    let (ends, emulated) = search::boundary(from, to, tolerance, &mut |value| {
        let (variant, scenario) = vary.at(value)?;
        search::emulate(&scenario, &variant)
    })?;
    let reserve = |value: f64| -> miette::Result<Option<f64>> {
        let (_, scenario) = vary.at(value)?;
        Ok(Loop::of(&scenario).map_err(|reason| miette!("{reason}"))?.map(|known| known.reserve()))
    };
    let predicted = search::crossing(from, to, &reserve)?;
    let value = emulated.as_ref().map_or(from, |boundary| boundary.value);
    let known = Loop::of(&vary.at(value)?.1).map_err(|reason| miette!("{reason}"))?;
    Ok(Row {
        variant: vary.variant.clone(),
        ratio: emulated.as_ref().zip(predicted).map(|(emulated, predicted)| emulated.value / predicted),
        emulated,
        ends,
        predicted,
        model: known.as_ref().map(Loop::name),
        figures: known.map_or_else(Vec::new, |known| known.figures()),
    })
}

/// A variant whose key is varied.
struct Vary {
    document: Document,
    key: String,
    /// The key takes whole numbers only.
    whole: bool,
    variant: String,
}

impl Vary {
    /// The variant with the key at `value`.
    fn at(&self, value: f64) -> miette::Result<(Variant, Scenario)> {
        let value = if self.whole { toml::Value::Integer(value.round() as i64) } else { toml::Value::Float(value) };
        let varied = self.document.with(&self.key, value)?.variants()?;
        let found = varied.into_iter().find(|(variant, _)| variant.name == self.variant);
        found.ok_or_else(|| miette!("variant {} is gone", self.variant))
    }
}

#[cfg(test)]
mod tests;
