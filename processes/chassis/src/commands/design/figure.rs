//! Figure 6.2 of the book, ω_n over ζ, with every bound in it and the choices as points. A static SVG.

use miette::miette;
use plotters::prelude::*;
use stability::{Bound, Judgement};

use super::request::Request;
use super::table::Short;

/// Size of the picture in pixels.
const SIZE: (u32, u32) = (820, 560);
/// The axes of the printed figure: ζ up to 2, and 400 rad/s at T_s = 0.005 s.
const ZETA_END: f64 = 2.0;
const A_END: f64 = 2.0;
/// Points of a curve.
const POINTS: u32 = 800;

/// The figure as SVG text.
pub fn of(request: &Request) -> miette::Result<String> {
    let mut svg = String::new();
    draw(&mut svg, request).map_err(|error| miette!("--plot: cannot draw the figure: {error}"))?;
    Ok(svg)
}

fn draw(svg: &mut String, request: &Request) -> Result<(), Box<dyn std::error::Error>> {
    let delay = request.effective_delay;
    let choices = choices(request);
    let zeta_end = choices.iter().map(|c| 1.1 * c.1).fold(ZETA_END, f64::max);
    let omega_end = choices
        .iter()
        .map(|c| 1.1 * c.2)
        .fold(2.0 * A_END / delay, f64::max);

    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(
            format!(
                "Stable ω_n below each bound, T_s = {} s",
                Short(delay / 2.0)
            ),
            ("sans-serif", 18),
        )
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..zeta_end, 0.0..omega_end)?;
    chart
        .configure_mesh()
        .x_desc("ζ")
        .y_desc("ω_n, rad/s")
        .light_line_style(TRANSPARENT)
        .draw()?;

    // From just above 0, where ζ = 0 bears no delay at all.
    let zetas = (1..=POINTS).map(|i| zeta_end * f64::from(i) / f64::from(POINTS));
    let curve = |bound: Bound| {
        zetas
            .clone()
            .map(move |zeta| (zeta, bound.omega_n_max(zeta, delay)))
            .take_while(move |point| point.1 <= omega_end)
    };
    chart.draw_series(AreaSeries::new(curve(Bound::Exact), 0.0, GREEN.mix(0.12)))?;
    for bound in Bound::ALL {
        let (color, label) = match bound {
            Bound::Published => (RGBColor(120, 120, 120), "published (6.2.9)"),
            Bound::Pade => (RGBColor(214, 120, 0), "full Routh, Padé form"),
            Bound::Exact => (RGBColor(0, 120, 60), "exact delay: safe"),
            Bound::ForceDelayOnly => (RGBColor(30, 90, 200), "only the force delayed"),
        };
        chart
            .draw_series(LineSeries::new(curve(bound), color.stroke_width(2)))?
            .label(label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], color.stroke_width(2)));
    }
    for (name, zeta, omega_n) in choices {
        chart
            .draw_series([Circle::new((zeta, omega_n), 5, RED.filled())])?
            .label(format!(
                "{name}: ζ {}, ω_n {} rad/s",
                Short(zeta),
                Short(omega_n)
            ))
            .legend(|(x, y)| Circle::new((x + 11, y), 5, RED.filled()));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.4))
        .draw()?;
    root.present()?;
    Ok(())
}

/// Name, ζ and ω_n of the points to draw.
fn choices(request: &Request) -> Vec<(&'static str, f64, f64)> {
    let point = |name, judgement: &Judgement| {
        let impedance = &judgement.impedance;
        (
            name,
            impedance.damping_ratio(),
            impedance.natural_frequency(),
        )
    };
    let axes = [
        ("force axis", &request.force),
        ("impedance axis", &request.impedance),
        ("rescaled", &request.rescaled),
    ];
    let mut points: Vec<_> = axes
        .into_iter()
        .filter_map(|(name, axis)| Some(point(name, &axis.as_ref()?.judgement)))
        .collect();
    if points.is_empty() {
        points.push(point("choice", &request.governing));
    }
    points
}
