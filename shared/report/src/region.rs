//! Where the limits hold: a field per run over the two keys of a sweep, drawn as SVG.

use crate::html::escape;
use crate::result::Sweep;
use std::fmt::Write;

const FIELD: usize = 56;
const LEFT: usize = 120;
const TOP: usize = 18;

/// The picture of a sweep over two keys; empty for one key.
pub(crate) fn draw(sweep: &Sweep) -> String {
    let Some(across) = &sweep.across else { return String::new() };
    let columns = sorted(sweep.points.iter().map(|point| point.value));
    let rows = sorted(sweep.points.iter().filter_map(|point| point.across));
    let (width, height) = (LEFT + FIELD * columns.len() + 20, TOP + FIELD * rows.len() + 52);
    let mut fields = String::new();
    for point in &sweep.points {
        let place = |among: &[f64], value: f64| among.iter().position(|other| *other == value).unwrap_or(0);
        let row = point.across.map_or(0, |value| place(&rows, value));
        let x = LEFT + FIELD * place(&columns, point.value);
        // the second key grows upwards
        let y = TOP + FIELD * (rows.len() - 1 - row);
        let (class, mark) = if point.passed { ("holds", "✓") } else { ("broken", "✗") };
        let _ = write!(
            fields,
            "<rect class={class} x={x} y={y} width={FIELD} height={FIELD} /><text x={} y={} text-anchor=middle>{mark}</text>",
            x + FIELD / 2,
            y + FIELD / 2 + 5
        );
    }
    for (i, value) in columns.iter().enumerate() {
        let (x, y) = (LEFT + FIELD * i + FIELD / 2, TOP + FIELD * rows.len() + 18);
        let _ = write!(fields, "<text x={x} y={y} text-anchor=middle>{value}</text>");
    }
    for (i, value) in rows.iter().rev().enumerate() {
        let _ = write!(fields, "<text x={} y={} text-anchor=end>{value}</text>", LEFT - 8, TOP + FIELD * i + FIELD / 2 + 5);
    }
    let (x, y) = (LEFT + FIELD * columns.len() / 2, height - 8);
    let _ = write!(fields, "<text x={x} y={y} text-anchor=middle>{}</text>", escape(&sweep.key));
    let _ = write!(fields, "<text x=4 y={} >{}</text>", TOP - 6, escape(across));
    format!(
        "<p class=note>Each field is a run: ✓ where it holds every limit of the scenario.</p>\
         <svg class=region viewBox=\"0 0 {width} {height}\" width={width} role=img aria-label=\"where the limits hold\">{fields}</svg>"
    )
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}
