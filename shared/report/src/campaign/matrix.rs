//! The picture of a campaign: kinds by phases, each field with the time to detect, coloured by what it came to.

use super::{CampaignReport, DrawRow, DrawVerdict};
use crate::html::escape;
use std::fmt::Write;

const LEFT: usize = 150;
const TOP: usize = 40;
const FIELD: (usize, usize) = (170, 26);

/// The picture as SVG.
pub(super) fn draw(report: &CampaignReport) -> String {
    let (columns, rows) = (report.phases.len(), report.kinds.len());
    let (width, height) = (LEFT + FIELD.0 * columns + 8, TOP + FIELD.1 * rows + 8);
    let mut fields = String::new();
    for (i, phase) in report.phases.iter().enumerate() {
        let x = LEFT + FIELD.0 * i + FIELD.0 / 2;
        let _ = write!(fields, "<text class=head x={x} y={} text-anchor=middle>{}</text>", TOP - 14, escape(phase));
    }
    for (j, kind) in report.kinds.iter().enumerate() {
        let y = TOP + FIELD.1 * j;
        let _ = write!(fields, "<text x={} y={} text-anchor=end>{}</text>", LEFT - 10, y + 18, escape(&kind.kind));
        for (i, phase) in report.phases.iter().enumerate() {
            let of_field = |row: &&DrawRow| row.kind == kind.kind && row.phase == *phase;
            let faults: Vec<&DrawRow> = report.rows.iter().filter(of_field).collect();
            if faults.is_empty() {
                continue;
            }
            let (class, words) = field(&faults);
            let (x, w, h) = (LEFT + FIELD.0 * i + 1, FIELD.0 - 2, FIELD.1 - 2);
            let _ = write!(
                fields,
                "<g><title>{}</title><rect class={class} x={x} y={y} width={w} height={h} rx=4 />\
                 <text x={} y={} text-anchor=middle>{words}</text></g>",
                escape(&hint(&kind.kind, phase, &faults)),
                x + w / 2,
                y + 17
            );
        }
    }
    format!(
        "<svg class=campaign viewBox=\"0 0 {width} {height}\" width={width} role=img aria-label=\"kinds of faults by phases\">\
         {fields}</svg>{LEGEND}"
    )
}

const LEGEND: &str = "<p class=\"note legend\"><i class=passed></i>all passed<i class=mixed></i>wrong reaction or too much force\
    <i class=late></i>some late<i class=undetected></i>some undetected<i class=none></i>no effect</p>";

/// Colour and words of a field.
fn field(faults: &[&DrawRow]) -> (&'static str, String) {
    let effective: Vec<&&DrawRow> = faults.iter().filter(|row| row.effect).collect();
    let worst = faults.iter().map(|row| row.verdict).max().unwrap_or(DrawVerdict::NoEffect);
    let class = match worst {
        DrawVerdict::Passed => "passed",
        DrawVerdict::NoEffect if effective.is_empty() => "none",
        DrawVerdict::NoEffect => "passed",
        DrawVerdict::Late => "late",
        DrawVerdict::WrongReaction | DrawVerdict::TooMuchForce => "mixed",
        DrawVerdict::Undetected | DrawVerdict::NotInjected => "undetected",
    };
    if worst == DrawVerdict::NotInjected {
        return (class, "not injected".into());
    }
    if effective.is_empty() {
        return (class, "no effect".into());
    }
    let times: Vec<f64> = effective.iter().filter_map(|row| row.detected_after_ms).collect();
    let time = match times.iter().copied().reduce(f64::max) {
        Some(greatest) if greatest < 9.95 => format!("≤ {greatest:.1} ms"),
        Some(greatest) => format!("≤ {greatest:.0} ms"),
        None => "unseen".into(),
    };
    (class, format!("{time} <tspan class=soft>{} of {}</tspan>", times.len(), effective.len()))
}

/// What the pointer shows: what each fault was seen by, how often.
fn hint(kind: &str, phase: &str, faults: &[&DrawRow]) -> String {
    let mut seen: Vec<(String, usize)> = Vec::new();
    for row in faults {
        let what =
            format!("{}, {}: {}", row.detected_by.as_deref().unwrap_or("nothing"), row.reaction, row.verdict.name());
        match seen.iter_mut().find(|(known, _)| *known == what) {
            Some((_, count)) => *count += 1,
            None => seen.push((what, 1)),
        }
    }
    let lines: Vec<String> = seen.into_iter().map(|(what, count)| format!("{count} × {what}")).collect();
    format!("{kind}, {phase}\n{}", lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;

    #[test]
    fn a_field_takes_the_colour_of_its_worst_fault_and_shows_the_greatest_time() {
        let mut slow = row("contact", DrawVerdict::Late);
        slow.detected_after_ms = Some(75.4);
        let svg =
            draw(&report(vec![row("contact", DrawVerdict::Passed), slow, row("free motion", DrawVerdict::NoEffect)]));
        assert!(svg.contains("class=late") && svg.contains("≤ 75 ms") && svg.contains("2 of 2"));
        assert!(svg.contains("class=none") && svg.contains(">no effect<"));
    }

    #[test]
    fn a_fault_without_effect_beside_one_that_passed_leaves_the_field_passed() {
        let rows = [row("contact", DrawVerdict::Passed), row("contact", DrawVerdict::NoEffect)];
        let (class, words) = field(&rows.iter().collect::<Vec<_>>());
        assert_eq!(class, "passed");
        assert!(words.contains("1 of 1"));
    }
}
