//! Pictures for readers without script: the same charts as static SVG.

use crate::chart::{Chart, Paint};
use plotters::coord::Shift;
use plotters::prelude::*;

const PALETTE: [RGBColor; 7] = [
    RGBColor(0x1f, 0x6f, 0xd1),
    RGBColor(0xd9, 0x5f, 0x02),
    RGBColor(0x1b, 0x9e, 0x77),
    RGBColor(0x8a, 0x56, 0xc8),
    RGBColor(0xc2, 0x2f, 0x6b),
    RGBColor(0x7a, 0x7a, 0x00),
    RGBColor(0x55, 0x66, 0x77),
];
/// Width of a picture, and of the legend in it.
const WIDTH: i32 = 1060;
const LEGEND: i32 = 180;
/// Lengths of strokes and of what is between them.
const DASHES: [(u32, u32); 3] = [(6, 4), (2, 4), (10, 4)];
const GRID: RGBColor = RGBColor(0xdd, 0xdd, 0xdd);
/// More points than the picture has pixels say nothing.
const POINTS: usize = 650;

/// One chart; the message says what the drawing library did not like.
pub(crate) fn draw(chart: &Chart) -> Result<String, String> {
    let mut svg = String::new();
    let area = SVGBackend::with_string(&mut svg, (WIDTH as u32, if chart.tall { 420 } else { 280 })).into_drawing_area();
    plot(chart, &area).map_err(|error| error.to_string())?;
    drop(area);
    Ok(svg)
}

fn plot(chart: &Chart, area: &DrawingArea<SVGBackend, Shift>) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let values = || chart.lines.iter().flat_map(|line| line.y.iter().flatten().copied());
    let (low, high) = values().fold((0.0f64, 0.0f64), |(low, high), y| (low.min(y), high.max(y)));
    let margin = 0.05 * (high - low).max(1e-3);
    let end = chart.t.last().copied().unwrap_or(1.0).max(1e-3);
    let mut plot = ChartBuilder::on(area)
        .caption(format!("{} ({})", chart.title, chart.unit), ("sans-serif", 18))
        .margin(8)
        .margin_right(LEGEND)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
    plot.configure_mesh().light_line_style(WHITE).bold_line_style(GRID).x_desc("t (s)").draw()?;
    for span in &chart.boxes {
        let corners = [(span.from, span.min.max(low - margin)), (span.until, span.max.min(high + margin))];
        // out of the picture
        if corners[0].1 >= corners[1].1 {
            continue;
        }
        let color = if span.allowed { PALETTE[2] } else { PALETTE[4] };
        plot.draw_series([Rectangle::new(corners, color.mix(0.15).filled())])?;
    }
    let stride = chart.t.len().div_ceil(POINTS).max(1);
    for (i, line) in chart.lines.iter().enumerate() {
        let (color, width) = match line.color {
            Paint::Ideal => (BLACK, 1),
            Paint::Command => (RGBColor(0x99, 0x99, 0x99), 1),
            Paint::Palette(i) => (PALETTE[i % PALETTE.len()], 2),
        };
        let points = chart.t.iter().zip(&line.y).step_by(stride).filter_map(|(t, y)| Some((*t, (*y)?)));
        let style = color.stroke_width(width);
        // the legend stands beside the curves, not on them
        let (x, y) = (WIDTH - LEGEND + 12, 40 + 18 * i as i32);
        if line.dash > 0 {
            let (dash, gap) = DASHES[(line.dash - 1) % DASHES.len()];
            plot.draw_series(DashedLineSeries::new(points, dash, gap, style))?;
            area.draw(&PathElement::new([(x, y), (x + 9, y)], style))?;
            area.draw(&PathElement::new([(x + 15, y), (x + 24, y)], style))?;
        } else {
            plot.draw_series(LineSeries::new(points, style))?;
            area.draw(&PathElement::new([(x, y), (x + 24, y)], style))?;
        }
        area.draw(&Text::new(line.label.clone(), (x + 32, y - 6), ("sans-serif", 12)))?;
    }
    area.present()?;
    Ok(())
}
