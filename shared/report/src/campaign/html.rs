//! The page of a campaign: matrix, kinds, what fell short, every fault.

use super::table::{KIND_HEADINGS, kind_cells, ms, null};
use super::{CampaignReport, DrawRow, DrawVerdict, matrix};
use crate::html::{escape, fill, pill, style, table};

const TEMPLATE: &str = include_str!("../html/campaign.html");

const HEADINGS: [&str; 14] = [
    "fault",
    "phase",
    "at s",
    "detected by",
    "after ms",
    "bound ms",
    "safe ms",
    "reaction",
    "expected",
    "force N",
    "peak N",
    "peak torque %",
    "moved mm",
    "verdict",
];

/// The whole file; works without script.
pub(super) fn render(report: &CampaignReport) -> String {
    let short: Vec<&DrawRow> = report.rows.iter().filter(|row| row.verdict > DrawVerdict::NoEffect).collect();
    let of_kinds: Vec<Vec<String>> = report.kinds.iter().map(kind_cells).collect();
    let parts = [
        ("scenario", escape(&report.scenario)),
        ("verdict", pill(report.verdict)),
        ("style", style()),
        ("facts", facts(report)),
        ("cards", cards(report)),
        ("matrix", matrix::draw(report)),
        ("kinds", table(&KIND_HEADINGS, &of_kinds)),
        ("short", if short.is_empty() { "<p class=note>Nothing.</p>".into() } else { faults(&short) }),
        ("null", null_runs(report)),
        ("count", report.rows.len().to_string()),
        ("rows", faults(&report.rows.iter().collect::<Vec<_>>())),
    ];
    fill(TEMPLATE, &parts)
}

fn facts(report: &CampaignReport) -> String {
    [
        format!("scenario <b>{}</b>", escape(&report.scenario)),
        format!("campaign <b>{}</b>", escape(&report.campaign)),
        format!("seed <b>{}</b>", report.seed),
        format!("control period <b>{} ms</b>", report.period_ms),
        format!("vmerack {}", report.vmerack),
    ]
    .join("<span class=dot>·</span>")
}

fn cards(report: &CampaignReport) -> String {
    let totals = &report.totals;
    let share = |part: usize| if totals.effective > 0 { 100.0 * part as f64 / totals.effective as f64 } else { 0.0 };
    let in_bound: usize = report.kinds.iter().map(|kind| kind.in_bound).sum();
    let cards = [
        ("faults", totals.draws.to_string(), format!("{} of them with an effect", totals.effective), false),
        (
            "detected in time",
            format!("{:.1} %", share(in_bound)),
            "of those with an effect".into(),
            in_bound < totals.effective,
        ),
        ("undetected", totals.undetected.to_string(), format!("{} detected late", totals.late), totals.undetected > 0),
        (
            "wrong reaction",
            totals.wrong_reaction.to_string(),
            format!("{} with too much force after STO", totals.too_much_force),
            totals.wrong_reaction + totals.too_much_force > 0,
        ),
        (
            "false trips",
            totals.false_trips.to_string(),
            format!(
                "in {:.0} s without a fault, {:.0} s of them in contact",
                report.null.simulated_s, report.null.contact_s
            ),
            totals.false_trips > 0,
        ),
        ("kinds not shown", totals.not_shown.to_string(), format!("of {}", report.kinds.len()), totals.not_shown > 0),
    ];
    let card = |(what, figure, note, bad): &(&str, String, String, bool)| {
        let class = if *bad { "big short" } else { "big" };
        format!(
            "<article class=card><h3>{what}</h3><p class=\"{class}\">{figure}</p><p class=note>{note}</p></article>"
        )
    };
    cards.iter().map(card).collect()
}

fn null_runs(report: &CampaignReport) -> String {
    let trips = &report.null.false_trips;
    let cells = trips.iter().map(|trip| vec![trip.seed.to_string(), format!("{:.4}", trip.at_s), trip.what.clone()]);
    let rows: Vec<Vec<String>> = cells.collect();
    let line = null(report);
    let listed = if rows.is_empty() { String::new() } else { table(&["seed", "at s", "what"], &rows) };
    format!("<p>{}{}.</p>{listed}", line[..1].to_uppercase(), &line[1..])
}

fn faults(rows: &[&DrawRow]) -> String {
    let cells = |row: &&DrawRow| {
        vec![
            format!("{} of {}", row.kind, row.target),
            row.phase.clone(),
            format!("{:.4}", row.injected_s),
            row.detected_by.clone().unwrap_or("–".into()),
            ms(row.detected_after_ms),
            ms(Some(row.bound_ms)),
            ms(row.safe_after_ms),
            row.reaction.clone(),
            row.expected.clone(),
            format!("{:.1}", row.force_before_n),
            format!("{:.1}", row.peak_force_n),
            format!("{:.0}", 1e2 * row.peak_torque_share),
            format!("{:.2}", row.distance_mm),
            row.verdict.name().into(),
        ]
    };
    table(&HEADINGS, &rows.iter().map(cells).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;

    #[test]
    fn the_page_is_whole_and_escapes_what_comes_from_files() {
        let page = render(&report(vec![row("contact", DrawVerdict::Undetected)]));
        assert!(page.contains("a &lt;scenario&gt;") && !page.contains("{{"));
        assert!(page.contains("stuck of force_sensor") && page.contains("</html>"));
        assert!(!page.contains("src=") && !page.contains("href=\"http"), "self-contained");
    }
}
