//! `report.html`: one file that works offline, with script or without.

use crate::accounting::WaterfallAccount;
use crate::bus_rows::{
    AGE_HEADINGS, MASTER_HEADINGS, TASK_HEADINGS, WATERFALL_HEADINGS, counts, masters, part_name, tasks, waterfall,
};
use crate::chart::Chart;
use crate::faults;
use crate::path;
use crate::region;
use crate::result::{RunReport, VariantResult};
use crate::segments::SegmentRow;
use crate::svg;
use crate::text::{
    CHECK_HEADINGS, HEADINGS, LATENCY_HEADINGS, check_row, latency_rows, segments, sweep_table, verdict,
};
use crate::trace::Ended;
use crate::verdict::Verdict;

const TEMPLATE: &str = include_str!("html/template.html");
const STYLE: &str = include_str!("html/style.css");
const SCRIPT: &str = include_str!("html/charts.js");
const UPLOT: &str = include_str!("../vendor/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../vendor/uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../vendor/uplot/LICENSE");

/// The whole file; the message says what could not be drawn.
pub(crate) fn render(report: &RunReport, charts: &[Chart]) -> Result<String, String> {
    let title = format!("{}{}", escape(&report.title), pill(report.verdict));
    let sections = [
        section("The arm and the tool's path", "", &path::draw(report)),
        section("Limits", "", &checks(report)),
        section("Segments", SEGMENTS_NOTE, &segment_tables(report)),
        section("Faults", FAULTS_NOTE, &fault_tables(report)),
        format!("<section>{}</section>", sweeps(report)),
        section("From sensor to actuator", WATERFALL_NOTE, &waterfalls(report)),
        section("Latency of bus transfers", "From the bus request to the end of the last cycle.", &latencies(report)),
        section("Bus and processors", BUS_NOTE, &bus(report)),
        format!("<section class=about><h2>About the scenario</h2>{}</section>", paragraphs(&report.description)),
    ];
    let head = Head { name: &report.scenario, title: &title, facts: &facts(report), cards: &cards(report) };
    fill_page(&head, charts, &sections.concat())
}

const SEGMENTS_NOTE: &str = "True contact force along the report's axis; mean and rms over the last second; 90 % rise from the \
    first contact, or from the segment's start where the tool touches already.";
const FAULTS_NOTE: &str = "From a fault's injection to the first event that it caused, and to the begin of a stop (SS2 or graver); \
    contact force and way of the tool from then to the next fault or the end.";
const WATERFALL_NOTE: &str = "Where the time goes from what the force sensor felt to the change of the last D/A output, mean of \
    all control jobs, in simulated time. The parts add up to the whole to the nanosecond.";
const BUS_NOTE: &str = "Simulated time. Bounds are worst cases without faults; “none” where no bound is known.";

/// A page of its own kind: `note` stands under the title, `sections` below the pictures.
pub(crate) fn page(name: &str, title: &str, note: &str, charts: &[Chart], sections: &str) -> Result<String, String> {
    fill_page(&Head { name, title: &escape(title), facts: &escape(note), cards: "" }, charts, sections)
}

/// What stands above the pictures, as markup but for the name.
struct Head<'a> {
    name: &'a str,
    title: &'a str,
    facts: &'a str,
    cards: &'a str,
}

fn fill_page(head: &Head, charts: &[Chart], sections: &str) -> Result<String, String> {
    let data = serde_json::to_string(charts).map_err(|error| error.to_string())?;
    let pictures: Result<Vec<String>, String> = charts.iter().map(svg::draw).collect();
    let parts = [
        ("name", escape(head.name)),
        ("title", head.title.to_owned()),
        ("facts", head.facts.to_owned()),
        ("cards", head.cards.to_owned()),
        ("pictures", pictures?.join("\n")),
        ("sections", sections.to_owned()),
        ("style", style()),
        ("uplot", uplot()),
        // "</" must not end the script element
        ("data", data.replace("</", "<\\/")),
        ("script", SCRIPT.to_owned()),
    ];
    Ok(fill(TEMPLATE, &parts))
}

/// A section with a heading; nothing where it has no content.
fn section(heading: &str, note: &str, content: &str) -> String {
    if content.is_empty() {
        return String::new();
    }
    let note = if note.is_empty() { String::new() } else { format!("<p class=note>{note}</p>") };
    format!("<section><h2>{heading}</h2>{note}{content}</section>")
}

/// The verdict beside a title.
pub(crate) fn pill(of: Verdict) -> String {
    format!("<span class=\"verdict {}\">{}</span>", class(of), verdict(of))
}

/// Style of every page.
pub(crate) fn style() -> String {
    format!("{UPLOT_STYLE}\n{STYLE}")
}

/// uPlot with its licence.
pub(crate) fn uplot() -> String {
    format!("/*\n{UPLOT_LICENCE}\n*/\n{UPLOT}")
}

/// Replaces `{{name}}`; what is put in is not looked at again.
pub(crate) fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out += before;
        let Some((name, behind)) = after.split_once("}}") else {
            break;
        };
        if let Some((_, text)) = parts.iter().find(|(known, _)| *known == name) {
            out += text;
        }
        rest = behind;
    }
    out + rest
}

fn facts(report: &RunReport) -> String {
    let mut facts = vec![
        format!("scenario <b>{}</b>", escape(&report.scenario)),
        format!("seed <b>{}</b>", report.seed),
        format!("<b>{}</b>", escape(&report.pacing)),
    ];
    let simulated: f64 = report.variants.iter().map(|variant| variant.simulated_s).sum();
    let runs = report.variants.len();
    facts.push(format!("<b>{simulated:.1} s</b> simulated in {runs} run{}", if runs == 1 { "" } else { "s" }));
    let walls: Option<Vec<f64>> = report.variants.iter().map(|variant| variant.wall_s).collect();
    if let Some(wall) = walls.map(|walls| walls.iter().sum::<f64>()).filter(|wall| *wall > 0.0) {
        facts.push(format!("<b>{:.0} ×</b> real time", simulated / wall));
    }
    facts.push(format!("vmerack {}", report.vmerack));
    facts.join("<span class=dot>·</span>")
}

/// One card per variant: verdict and the figures that matter most.
fn cards(report: &RunReport) -> String {
    let mut out = String::new();
    for (i, variant) in report.variants.iter().enumerate() {
        let judged = variant.checks.iter().filter(|check| check.passed.is_some());
        let held = judged.clone().filter(|check| check.passed == Some(true)).count();
        let cells = |figures: &dyn Fn(&SegmentRow) -> Option<String>| -> String {
            let figures: Vec<String> = variant.segments.iter().filter_map(figures).collect();
            figures.join(" <i>/</i> ")
        };
        let (figures, unit, what) = if variant.segments.iter().any(|row| row.force_controlled) {
            let mean = |row: &SegmentRow| row.mean_n.map_or_else(|| "–".into(), |mean| format!("{:.1}", mean + 0.0));
            (cells(&|row| row.force_controlled.then(|| mean(row))), "N", "mean force of each force segment's last second")
        } else {
            let off = |error: f64| format!("{:.1}", 1e3 * error);
            (cells(&|row| row.position_error_m.map(off)), "mm", "off X_d at the end of each segment")
        };
        let ended = match &variant.ended {
            Ended::Completed => format!("{held} of {} limits hold", judged.count()),
            Ended::Diverged { at_s } => format!("diverged at {at_s:.2} s"),
            Ended::Stopped { at_s, .. } => format!("stopped at {at_s:.2} s"),
        };
        let findings: String =
            variant.findings.iter().map(|finding| format!("<p class=finding>{}</p>", escape(finding))).collect();
        out += &format!(
            "<article class=card><h3><i class=swatch data-color=\"{}\"></i>{}<span class=\"pill {}\">{}</span></h3>\
             <p class=big>{figures}<small>{unit}</small></p><p class=note>{what}</p>\
             <p>{ended}</p>{findings}</article>",
            i % 7,
            escape(&variant.name),
            class(variant.verdict),
            verdict(variant.verdict),
        );
    }
    out
}

fn checks(report: &RunReport) -> String {
    let rows: Vec<_> = report
        .variants
        .iter()
        .flat_map(|variant| variant.checks.iter().map(|check| check_row(&variant.name, check)))
        .collect();
    if rows.is_empty() {
        return "<p class=note>The scenario sets no limits.</p>".into();
    }
    table(&CHECK_HEADINGS, &rows)
}

fn segment_tables(report: &RunReport) -> String {
    let mut out = String::new();
    if let Some(variant) = report.variants.iter().find(|variant| !variant.ideal.is_empty()) {
        out += &format!("<h3>ideal impedance, one axis</h3>{}", table(&HEADINGS, &segments(&variant.ideal)));
    }
    for variant in &report.variants {
        out += &format!("<h3>{}</h3>{}", escape(&variant.name), table(&HEADINGS, &segments(&variant.segments)));
        if let Some(digest) = &variant.digest {
            out += &format!("<p class=note>digest <code>{}</code></p>", escape(digest));
        }
    }
    out
}

fn sweeps(report: &RunReport) -> String {
    let mut out = String::new();
    for sweep in &report.sweeps {
        let (headings, rows) = sweep_table(sweep);
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        out += &format!(
            "<h2>Sweep of <code>{}</code></h2>{}<p class=note>mean force of each segment's last second, N</p>{}",
            escape(&sweep.key),
            region::draw(sweep),
            table(&headings, &rows)
        );
    }
    out
}

fn fault_tables(report: &RunReport) -> String {
    let of = |variant: &VariantResult| {
        let rows = table(&faults::HEADINGS, &faults::cells(&variant.faults));
        format!("<h3>{}</h3>{rows}", escape(&variant.name))
    };
    report.variants.iter().filter(|variant| !variant.faults.is_empty()).map(of).collect()
}

fn latencies(report: &RunReport) -> String {
    let mut out = String::new();
    let mut shown = None;
    for variant in &report.variants {
        if !variant.transfers.is_empty() && shown != Some(&variant.transfers) {
            let rows = table(&LATENCY_HEADINGS, &latency_rows(&variant.transfers));
            out += &format!("<h3>modelled, {}</h3>{rows}", escape(&variant.name));
            shown = Some(&variant.transfers);
        }
        if !variant.measured.is_empty() {
            let rows = crate::latency::html(&variant.measured);
            out += &format!("<h3>measured, {}</h3>{rows}", escape(&variant.name));
        }
    }
    out
}

fn bus(report: &RunReport) -> String {
    let mut out = String::new();
    let mut shown = None;
    for variant in &report.variants {
        let Some(bus) = variant.bus.as_ref().filter(|bus| shown != Some(*bus)) else {
            continue;
        };
        shown = Some(bus);
        out += &format!(
            "<h3>{}</h3><p class=note>{}</p>{}{}{}{}",
            escape(&variant.name),
            escape(&counts(bus)),
            table(&WATERFALL_HEADINGS, &waterfall(&bus.waterfall)),
            table(&MASTER_HEADINGS, &masters(bus)),
            table(&TASK_HEADINGS, &tasks(bus)),
            table(&AGE_HEADINGS, &latency_rows(&bus.ages)),
        );
    }
    out
}

/// The mean way as one bar per part, each beginning where the one before ends.
fn waterfalls(report: &RunReport) -> String {
    let mut out = String::new();
    let mut shown = None;
    for variant in &report.variants {
        let Some(account) = variant.bus.as_ref().map(|bus| &bus.waterfall).filter(|account| account.jobs > 0) else {
            continue;
        };
        let means: Vec<u64> = account.parts.iter().map(|part| part.sum_ns / account.jobs).collect();
        // variants that differ by nanoseconds are one picture
        let micros: Vec<u64> = means.iter().map(|ns| ns / 1000).collect();
        if shown.as_ref() == Some(&micros) {
            continue;
        }
        shown = Some(micros);
        out += &format!("<h3>{}</h3>{}", escape(&variant.name), waterfall_picture(account));
    }
    out
}

fn waterfall_picture(account: &WaterfallAccount) -> String {
    const ROW: f64 = 22.0;
    const NAMES: f64 = 130.0;
    const BARS: f64 = 560.0;
    const FIGURES: f64 = 130.0;
    let whole = account.mean_ns(account.whole_sum_ns).max(1.0);
    let mut rows = String::new();
    let mut start = 0.0;
    let parts: Vec<_> = account.parts.iter().filter(|part| part.sum_ns > 0).collect();
    for (i, part) in parts.iter().enumerate() {
        let mean = account.mean_ns(part.sum_ns);
        let (y, middle) = (ROW * i as f64, ROW * i as f64 + 15.0);
        let (x, width) = (NAMES + BARS * start / whole, (BARS * mean / whole).max(1.0));
        rows += &format!(
            "<text x={} y={middle} text-anchor=end>{}</text><rect class=\"w{}\" x={x:.1} y={} width={width:.1} height=16 rx=2 />\
             <text class=figure x={} y={middle} text-anchor=end>{}</text>",
            NAMES - 10.0,
            part_name(part.part),
            i % 7,
            y + 3.0,
            NAMES + BARS + FIGURES - 4.0,
            micro(mean),
        );
        start += mean;
    }
    let (low, height) = (ROW * parts.len() as f64, ROW * (parts.len() + 1) as f64 + 4.0);
    rows += &format!(
        "<path class=bar d=\"M0 {}H{}\" /><text x={} y={y} text-anchor=end>whole</text>\
         <text class=figure x={} y={y} text-anchor=end>{}</text>",
        low + 3.0,
        NAMES + BARS + FIGURES,
        NAMES - 10.0,
        NAMES + BARS + FIGURES - 4.0,
        micro(whole),
        y = low + 19.0,
    );
    let width = NAMES + BARS + FIGURES;
    format!("<svg class=waterfall viewBox=\"0 0 {width} {height}\" role=img aria-label=\"latency waterfall\">{rows}</svg>")
}

fn micro(ns: f64) -> String {
    format!("{:.1} µs", 1e-3 * ns)
}

pub(crate) fn table(headings: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = headings.iter().map(|heading| format!("<th>{}</th>", escape(heading))).collect();
    let body: String = rows
        .iter()
        .map(|row| {
            let cells: String = row
                .iter()
                .map(|cell| {
                    let class = match cell.as_str() {
                        "ok" => " class=ok",
                        "VIOLATED" => " class=bad",
                        cell if cell == "–" || cell.parse::<f64>().is_ok() => " class=figure",
                        _ => "",
                    };
                    format!("<td{class}>{}</td>", escape(cell))
                })
                .collect();
            format!("<tr>{cells}</tr>")
        })
        .collect();
    format!("<div class=scroll><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>")
}

fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "good",
        Verdict::Failed => "bad",
    }
}

fn paragraphs(text: &str) -> String {
    text.split("\n\n")
        .filter(|part| !part.trim().is_empty())
        .map(|part| format!("<p>{}</p>", escape(part.trim())))
        .collect()
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_a_scenario_cannot_become_markup() {
        assert_eq!(escape("<b>&\"</b>"), "&lt;b&gt;&amp;&quot;&lt;/b&gt;");
        assert_eq!(fill("{{a}}-{{b}}", &[("a", "{{b}}".into()), ("b", "x".into())]), "{{b}}-x");
    }
}
