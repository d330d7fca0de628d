//! Pictures of a sweep: lines over one key, a heat map over two. Broken points are crosses.

use super::plan::Plan;
use super::store::Row;
use plotters::prelude::*;

type Drawn = Result<(), Box<dyn std::error::Error>>;

const SIZE: (u32, u32) = (820, 520);
const PANEL_HEIGHT: u32 = 420;

/// The picture of one measure as SVG; none where there is nothing to draw: more than two keys, or no figure at all.
pub fn of(plan: &Plan, rows: &[Row], column: usize) -> Result<Option<String>, String> {
    let figures: Vec<f64> = rows.iter().filter_map(|row| row.values[column]).filter(|value| value.is_finite()).collect();
    let (Some(least), Some(greatest)) = (figures.iter().copied().reduce(f64::min), figures.iter().copied().reduce(f64::max)) else {
        return Ok(None);
    };
    let mut svg = String::new();
    match plan.vary().len() {
        1 => lines(&mut svg, plan, rows, column, (least, greatest)),
        2 => heat_map(&mut svg, plan, rows, column, (least, greatest)),
        _ => return Ok(None),
    }
    .map_err(|error| error.to_string())?;
    Ok(Some(svg))
}

/// A range with some room, never empty.
fn roomy((least, greatest): (f64, f64)) -> std::ops::Range<f64> {
    let room = (0.05 * (greatest - least)).max(1e-9 * greatest.abs()).max(1e-12);
    least - room..greatest + room
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, greatest), &value| (least.min(value), greatest.max(value)))
}

fn lines(svg: &mut String, plan: &Plan, rows: &[Row], column: usize, bounds: (f64, f64)) -> Drawn {
    let (vary, points) = (&plan.vary()[0], plan.points());
    let y = roomy(bounds);
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(74)
        .build_cartesian_2d(roomy(range(&vary.values)), y.clone())?;
    chart.configure_mesh().x_desc(vary.key.as_str()).y_desc(plan.columns()[column]).light_line_style(TRANSPARENT).draw()?;
    for (i, variant) in plan.variants().iter().enumerate() {
        let color = Palette99::pick(i).to_rgba();
        let of_variant = || rows.iter().filter(|row| points[row.index].variant == *variant);
        let place = |row: &Row| Some((points[row.index].values[0], row.values[column]?));
        let sound: Vec<(f64, f64)> = of_variant().filter(|row| row.ended == "completed").filter_map(place).collect();
        let broken = of_variant().filter(|row| row.ended != "completed").map(|row| (points[row.index].values[0], y.start));
        chart
            .draw_series(LineSeries::new(sound.iter().copied(), color.stroke_width(2)))?
            .label(variant.as_str())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], color.stroke_width(2)));
        chart.draw_series(sound.iter().map(|&place| Circle::new(place, 3, color.filled())))?;
        chart.draw_series(broken.map(|place| Cross::new(place, 5, RED.stroke_width(2))))?;
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.85)).border_style(BLACK.mix(0.4)).draw()?;
    root.present()?;
    Ok(())
}

/// Corners of the cells: half-way between the values.
fn corners(values: &[f64]) -> Vec<f64> {
    let half = |i: usize, j: usize| 0.5 * (values[i] + values[j]);
    let last = values.len() - 1;
    if last == 0 {
        let room = 0.5 * values[0].abs().max(1.0);
        return vec![values[0] - room, values[0] + room];
    }
    let mut corners = vec![values[0] - (half(0, 1) - values[0])];
    corners.extend((0..last).map(|i| half(i, i + 1)));
    corners.push(values[last] + values[last] - half(last - 1, last));
    corners
}

/// Dark violet to light yellow, equally far apart for the eye, colour-blind or not.
fn shade(share: f64) -> RGBColor {
    const STOPS: [[f64; 3]; 3] = [[68.0, 1.0, 84.0], [33.0, 145.0, 140.0], [253.0, 231.0, 37.0]];
    let (i, part) = if share < 0.5 { (0, 2.0 * share) } else { (1, 2.0 * share - 1.0) };
    let mixed = |c: usize| (STOPS[i][c] + part * (STOPS[i + 1][c] - STOPS[i][c])) as u8;
    RGBColor(mixed(0), mixed(1), mixed(2))
}

fn heat_map(svg: &mut String, plan: &Plan, rows: &[Row], column: usize, (least, greatest): (f64, f64)) -> Drawn {
    let (first, second) = (&plan.vary()[0], &plan.vary()[1]);
    let (xs, ys) = (corners(&first.values), corners(&second.values));
    let (x_ends, y_ends) = (range(&xs), range(&ys));
    let points = plan.points();
    let cell = |values: &[f64], value: f64| values.iter().position(|&other| other == value).unwrap_or(0);
    let share = |value: f64| if greatest > least { (value - least) / (greatest - least) } else { 0.5 };
    let panels = plan.variants().len() as u32;
    let root = SVGBackend::with_string(svg, (SIZE.0, PANEL_HEIGHT * panels)).into_drawing_area();
    root.fill(&WHITE)?;
    for (panel, variant) in root.split_evenly((panels as usize, 1)).iter().zip(plan.variants()) {
        let title = format!("{} of {variant}: {least:.4} (dark) to {greatest:.4} (light)", plan.columns()[column]);
        let mut chart = ChartBuilder::on(panel)
            .caption(title, ("sans-serif", 15))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(74)
            .build_cartesian_2d(x_ends.0..x_ends.1, y_ends.0..y_ends.1)?;
        chart.configure_mesh().disable_mesh().x_desc(first.key.as_str()).y_desc(second.key.as_str()).draw()?;
        for row in rows.iter().filter(|row| points[row.index].variant == *variant) {
            let values = &points[row.index].values;
            let (i, j) = (cell(&first.values, values[0]), cell(&second.values, values[1]));
            let corner = [(xs[i], ys[j]), (xs[i + 1], ys[j + 1])];
            match row.values[column].filter(|_| row.ended == "completed") {
                Some(value) => {
                    let color = shade(share(value));
                    chart.draw_series([Rectangle::new(corner, color.filled())])?;
                }
                None => {
                    chart.draw_series([Cross::new((values[0], values[1]), 5, RED.stroke_width(2))])?;
                }
            }
        }
    }
    root.present()?;
    Ok(())
}
