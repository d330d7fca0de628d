//! A campaign as text: one table for the terminal, one line per fault as CSV.

use super::{CampaignReport, DrawRow, KindSummary};
use crate::text::{table, verdict};
use crate::verdict::Verdict;

/// Headings of the table of kinds.
pub(super) const KIND_HEADINGS: [&str; 13] = [
    "kind",
    "draws",
    "effective",
    "in bound",
    "median ms",
    "greatest ms",
    "bound ms",
    "safe ms",
    "undetected",
    "late",
    "wrong reaction",
    "too much force",
    "verdict",
];

/// Cells of the table of kinds.
pub(super) fn kind_cells(kind: &KindSummary) -> Vec<String> {
    let mut cells =
        vec![kind.kind.clone(), kind.draws.to_string(), kind.effective.to_string(), kind.in_bound.to_string()];
    cells.extend([ms(kind.median_ms), ms(kind.greatest_ms), ms(Some(kind.bound_ms)), ms(kind.safe_ms)]);
    cells.extend([kind.undetected, kind.late, kind.wrong_reaction, kind.too_much_force].map(|n| n.to_string()));
    cells.push(if kind.shown || kind.verdict == Verdict::Failed && kind.undetected > 0 {
        verdict(kind.verdict).into()
    } else {
        "not shown".into()
    });
    cells
}

/// Milliseconds, or a dash.
pub(super) fn ms(time: Option<f64>) -> String {
    time.map_or("–".into(), |time| format!("{time:.2}"))
}

/// What the terminal shows.
pub(super) fn text(report: &CampaignReport) -> String {
    let mut out = format!("{}\ncampaign {}, seed {}\n\n", report.title, report.campaign, report.seed);
    out += &table(&KIND_HEADINGS, &report.kinds.iter().map(kind_cells).collect::<Vec<_>>());
    let totals = &report.totals;
    out += &format!(
        "\n{} faults, {} with an effect: {} undetected, {} detected late, {} wrong reactions, {} with too much force; \
         {} kinds not shown\n",
        totals.draws,
        totals.effective,
        totals.undetected,
        totals.late,
        totals.wrong_reaction,
        totals.too_much_force,
        totals.not_shown
    );
    out += &format!("{}\n", null(report));
    for trip in &report.null.false_trips {
        out += &format!("  seed {}: {} at {:.4} s\n", trip.seed, trip.what, trip.at_s);
    }
    out + &format!("verdict: {}\n", verdict(report.verdict))
}

/// One line about the runs without a fault.
pub(super) fn null(report: &CampaignReport) -> String {
    let null = &report.null;
    format!(
        "without a fault: {} runs of {:.0} s together, {:.0} s of them in contact, {} false trips",
        null.runs,
        null.simulated_s,
        null.contact_s,
        null.false_trips.len()
    )
}

/// A line per fault.
pub(super) fn csv(rows: &[DrawRow]) -> String {
    let mut out = String::from(
        "kind,target,phase,seed,amount,injected_s,effect,detected_by,detected_after_ms,bound_ms,safe_after_ms,reaction,\
         expected,force_before_n,peak_force_n,force_growth_n,peak_torque_share,distance_mm,verdict\n",
    );
    for row in rows {
        let figure = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        let fields = [
            plain(&row.kind),
            plain(&row.target),
            plain(&row.phase),
            row.seed.to_string(),
            row.amount.to_string(),
            row.injected_s.to_string(),
            row.effect.to_string(),
            row.detected_by.clone().unwrap_or_default(),
            figure(row.detected_after_ms),
            row.bound_ms.to_string(),
            figure(row.safe_after_ms),
            row.reaction.clone(),
            row.expected.clone(),
            row.force_before_n.to_string(),
            row.peak_force_n.to_string(),
            figure(row.force_growth_n),
            row.peak_torque_share.to_string(),
            row.distance_mm.to_string(),
            row.verdict.name().to_owned(),
        ];
        out += &(fields.join(",") + "\n");
    }
    out
}

/// Text without what has a meaning in a line.
fn plain(text: &str) -> String {
    text.replace([',', '\n', '\r', '"'], " ")
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;
    use crate::DrawVerdict;

    #[test]
    fn every_fault_is_a_line_with_as_many_fields_as_the_heading() {
        let text = csv(&[row("a, phase", DrawVerdict::Passed), row("contact", DrawVerdict::NoEffect)]);
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [19; 3]);
        assert!(text.lines().nth(2).unwrap().ends_with("no effect"));
    }

    #[test]
    fn a_kind_without_enough_effective_draws_is_called_not_shown() {
        let mut report = report(vec![row("contact", DrawVerdict::Passed)]);
        report.kinds[0].shown = false;
        assert!(report.text().contains("not shown"));
    }
}
