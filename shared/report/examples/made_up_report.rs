//! Writes a report of made-up runs, to look at: `cargo run -p report --example made_up_report FOLDER`.

#[allow(dead_code)]
#[path = "../tests/made_up/mod.rs"]
mod made_up;

use report::{RunReport, Sweep, SweepPoint};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("FOLDER is missing")?;
    let variants = made_up::table_5_3();
    let errors = [3.0, f64::NAN, 0.0, -0.4];
    let mut results: Vec<_> = variants
        .iter()
        .zip(errors)
        .map(|((variant, scenario), error)| made_up::result(variant, scenario, error))
        .collect();
    results.iter_mut().for_each(|result| result.wall_s = Some(0.2));
    let points = [0.0, 0.5, 1.0, 1.5, 2.0].into_iter().flat_map(|factor| {
        let (variant, scenario) = &variants[0];
        let (other, other_scenario) = &variants[1];
        let original = if factor > 0.0 { f64::NAN } else { 0.1 };
        [
            SweepPoint::new(factor, None, &made_up::result(variant, scenario, 3.0 * factor)),
            SweepPoint::new(factor, None, &made_up::result(other, other_scenario, original)),
        ]
    });
    let sweep = Sweep { key: "plant.friction_scale".into(), across: None, points: points.collect() };
    let report = RunReport::new("table-5-3", &variants[0].1, "made up", results, vec![sweep]);
    report.write(folder.as_ref())?;
    print!("{}", report::text::render(&report));
    Ok(())
}
