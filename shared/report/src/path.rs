//! The arm and the way of its tool as a picture: the arm from the side, the tool's path from above and from the side.
//!
//! An SVG of its own that takes the page's colours, dark or light. Equal scales in both directions of a view; a bar says how
//! long something is. The task frame's z points into the surface, so it points down in the picture.

use crate::result::RunReport;
use std::fmt::Write;

/// Most points of a path.
const POINTS: usize = 400;
/// Side of a view, and the distance between two.
const SIDE: f64 = 270.0;
const GAP: f64 = 25.0;
/// Height of a view's title and of its scale bar.
const TITLE: f64 = 28.0;
const BAR: f64 = 30.0;
/// Least extent of a view, m.
const LEAST: f64 = 1e-3;

/// Where the tool was, and how the arm stood.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way {
    /// Tool point in the task frame, m.
    pub tool: Vec<[f64; 3]>,
    /// Joint origins and tip, base first, in the base frame, m: at the start and at the end. Empty where no arm is drawn.
    pub arm: Vec<Vec<[f64; 3]>>,
}

impl Way {
    /// Keeps as many points as a picture shows.
    pub fn thin(tool: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        let stride = tool.len().div_ceil(POINTS).max(1);
        let last = tool.last().copied();
        let mut kept: Vec<[f64; 3]> = tool.into_iter().step_by(stride).collect();
        kept.extend(last);
        kept
    }
}

/// A line of a view, in its two coordinates.
struct Stroke {
    class: String,
    points: Vec<[f64; 2]>,
    /// Dots at the corners.
    joints: bool,
}

/// The picture; nothing where no run has moved anything.
pub(crate) fn draw(report: &RunReport) -> String {
    let ways: Vec<&Way> = report.variants.iter().map(|variant| &variant.curves.way).collect();
    let mut views = Vec::new();
    if let Some(way) = ways.iter().find(|way| !way.arm.is_empty()) {
        let strokes = way.arm.iter().enumerate().map(|(i, arm)| Stroke {
            class: if i == 0 { "was" } else { "arm" }.into(),
            points: arm.iter().map(|p| [p[0], p[2]]).collect(),
            joints: true,
        });
        views.push(view("the arm from the side: pale at the start", ["x", "z"], 1.0, &strokes.collect::<Vec<_>>()));
    }
    let paths = |across: usize, up: usize| -> Vec<Stroke> {
        let strokes = ways.iter().enumerate().filter(|(_, way)| way.tool.len() > 1);
        strokes
            .map(|(i, way)| Stroke {
                class: format!("p{}", i % 7),
                points: way.tool.iter().map(|p| [p[across], p[up]]).collect(),
                joints: false,
            })
            .collect()
    };
    if ways.iter().any(|way| way.tool.len() > 1) {
        views.push(view("the tool's path from above", ["x", "y"], 1.0, &paths(0, 1)));
        views.push(view("from the side: z into the surface", ["y", "z"], -1.0, &paths(1, 2)));
    }
    if views.is_empty() {
        return String::new();
    }
    let width = views.len() as f64 * (SIDE + GAP) - GAP;
    let height = TITLE + SIDE + BAR;
    let mut svg = format!("<svg class=path viewBox=\"0 0 {width} {height}\" role=img aria-label=\"arm and path of the tool\">");
    for (i, view) in views.iter().enumerate() {
        let _ = write!(svg, "<g transform=\"translate({} 0)\">{view}</g>", i as f64 * (SIDE + GAP));
    }
    svg + "</svg>"
}

/// One view; `up` is 1 where the second coordinate points up, -1 where it points down.
fn view(title: &str, names: [&str; 2], up: f64, strokes: &[Stroke]) -> String {
    let all = || strokes.iter().flat_map(|stroke| &stroke.points);
    let range = |k: usize| {
        all().fold((f64::MAX, f64::MIN), |(low, high), point| (low.min(point[k]), high.max(point[k])))
    };
    let (x, y) = (range(0), range(1));
    let extent = 1.15 * (x.1 - x.0).max(y.1 - y.0).max(LEAST);
    let scale = SIDE / extent;
    let at = |point: &[f64; 2]| {
        let centred = [point[0] - 0.5 * (x.0 + x.1), point[1] - 0.5 * (y.0 + y.1)];
        (0.5 * SIDE + scale * centred[0], TITLE + 0.5 * SIDE - up * scale * centred[1])
    };
    let mut svg = format!("<text class=head x=0 y=16>{title}</text><rect class=frame x=0 y={TITLE} width={SIDE} height={SIDE} rx=6 />");
    for stroke in strokes {
        let points: String = stroke.points.iter().map(at).map(|(x, y)| format!("{x:.1},{y:.1} ")).collect();
        let _ = write!(svg, "<polyline class=\"{}\" points=\"{}\" />", stroke.class, points.trim_end());
        let ends = [stroke.points.first(), stroke.points.last()];
        let dots: Vec<&[f64; 2]> =
            if stroke.joints { stroke.points.iter().collect() } else { ends.into_iter().flatten().collect() };
        for (i, (x, y)) in dots.into_iter().map(at).enumerate() {
            // a path begins with a ring and ends with a dot
            let hollow = if !stroke.joints && i == 0 { " hollow" } else { "" };
            let _ = write!(svg, "<circle class=\"{}{hollow}\" cx={x:.1} cy={y:.1} r=3.5 />", stroke.class);
        }
    }
    let length = round_length(extent / 3.0);
    let (left, low) = (8.0, TITLE + SIDE + 10.0);
    let arrow = if up > 0.0 { "↑" } else { "↓" };
    let _ = write!(
        svg,
        "<path class=bar d=\"M{left} {low}h{:.1}m0 -4v8m{:.1} -8v8\" /><text x={:.1} y={}>{}</text><text x={SIDE} y={} text-anchor=end>{} → {} {arrow}</text>",
        scale * length,
        -scale * length,
        left + scale * length + 8.0,
        low + 4.0,
        metres(length),
        low + 4.0,
        names[0],
        names[1],
    );
    svg
}

/// The greatest of 1, 2, 5 times a power of ten that is not above `length`.
fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().find(|step| step * power <= length * (1.0 + 1e-9));
    step.unwrap_or(1.0) * power
}

fn metres(length: f64) -> String {
    match length {
        length if length >= 1.0 => format!("{length:.0} m"),
        length if length >= 0.01 => format!("{:.0} cm", 100.0 * length),
        length if length >= 0.001 => format!("{:.0} mm", 1e3 * length),
        length => format!("{:.0} µm", 1e6 * length),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_bar_has_a_round_length() {
        for (length, round, text) in [(0.34, 0.2, "20 cm"), (0.05, 0.05, "5 cm"), (0.0019, 0.001, "1 mm"), (7.0, 5.0, "5 m")] {
            assert!((round_length(length) - round).abs() < 1e-12, "{length}");
            assert_eq!(metres(round_length(length)), text);
        }
    }

    #[test]
    fn a_view_holds_every_point_and_keeps_angles() {
        let points = vec![[0.0, 0.0], [0.3, 0.0], [0.3, 0.1]];
        let svg = view("", ["x", "y"], 1.0, &[Stroke { class: "p0".into(), points, joints: false }]);
        let drawn = svg.split_once("points=\"").and_then(|(_, rest)| rest.split_once('"')).expect("a line").0;
        let corners: Vec<Vec<f64>> =
            drawn.split(' ').map(|corner| corner.split(',').map(|n| n.parse().expect("number")).collect()).collect();
        assert!(corners.iter().all(|c| (0.0..=SIDE).contains(&c[0]) && (TITLE..=TITLE + SIDE).contains(&c[1])));
        let (across, up) = (corners[1][0] - corners[0][0], corners[1][1] - corners[2][1]);
        assert!((across / up - 3.0).abs() < 0.01, "{drawn}");
    }
}
