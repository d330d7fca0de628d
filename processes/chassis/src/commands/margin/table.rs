//! The rows of `vmerack margin` as text.

use super::Row;
use super::search::Outcome;

/// Everything that is printed.
pub fn of(scenario: &str, key: &str, rows: &[Row]) -> String {
    let mut text = format!("{scenario}: value of {key} at which the emulated loop turns unstable\n\n");
    let width = rows.iter().map(|row| row.variant.chars().count()).max().unwrap_or(0).max(7);
    text += &format!(
        "  {:width$}  {:>12}  {:>12}  {:>7}  {:>7}  {:>4}  closed form\n",
        "variant", "emulated", "predicted", "ratio", "periods", "runs"
    );
    for row in rows {
        let number =
            |value: Option<f64>, digits: usize| value.map_or_else(|| "–".into(), |value| format!("{value:.digits$}"));
        let digits = row
            .predicted
            .or(row.emulated.map(|found| found.value))
            .map_or(3, |value| if value >= 1000.0 { 1 } else { 3 });
        text += &format!(
            "  {:width$}  {:>12}  {:>12}  {:>7}  {:>7}  {:>4}  {}\n",
            row.variant,
            number(row.emulated.map(|found| found.value), digits),
            number(row.predicted, digits),
            number(row.ratio, 4),
            number(row.emulated.and_then(|found| found.periods), 1),
            row.emulated.map_or_else(|| "2".into(), |found| found.runs.to_string()),
            row.model.unwrap_or("none for this loop"),
        );
    }
    for row in rows {
        if row.emulated.is_none() {
            let ends = &row.ends;
            let side = if ends.at_from.stable { "stable" } else { "unstable" };
            text += &format!(
                "\n{}: {side} at both {} ({}) and {} ({}): widen the range with --from and --to\n",
                row.variant,
                ends.from,
                seen(&ends.at_from),
                ends.to,
                seen(&ends.at_to)
            );
        } else if !row.figures.is_empty() {
            let figures: Vec<String> =
                row.figures.iter().map(|(name, value)| format!("{name} {}", figure(*value))).collect();
            text += &format!("\n{}: {}\n", row.variant, figures.join("; "));
        }
    }
    text
}

fn seen(outcome: &Outcome) -> String {
    match outcome.growth {
        Some(growth) => format!("envelope times {growth:.3} a period"),
        None if outcome.stable => "nothing swings".into(),
        None => "diverged".into(),
    }
}

/// Four or more significant digits.
fn figure(value: f64) -> String {
    match value.abs() {
        size if size >= 1000.0 => format!("{value:.0}"),
        size if size < 1e-3 => format!("{value:.7}"),
        _ => format!("{value:.4}"),
    }
}
