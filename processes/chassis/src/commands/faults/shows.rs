//! When a fault that lies hidden comes to show: an output that stays where it is once another one is asked for, index marks
//! that do not come once the motor should have passed one. Its bound counts from there.

use super::plan::Bound;
use board::Ns;
use messages::PlantProbe;
use report::Trace;
use scenario::{Scenario, Site};

/// From the begin of fault number `fault` until it shows by what `bound` states, or the run's end, ms; 0 where it states
/// nothing.
pub fn after_ms(bound: &Bound, scenario: &Scenario, fault: usize, run: &Trace, begun: Ns) -> f64 {
    let at = match (bound.output_steps, bound.motor_turns, scenario.fault_site(fault)) {
        (Some(steps), _, Ok(Site::Converter(joint))) => asked_elsewhere(scenario, run, begun, joint, steps),
        (_, Some(turns), Ok(Site::Encoder(joint))) => turned(scenario, run, begun, joint, turns),
        _ => return 0.0,
    };
    let end = run.plant.last().map_or(begun, |probe| probe.t);
    at.unwrap_or(end).saturating_sub(begun) as f64 * 1e-6
}

/// The arm as it is next seen from `t` on.
fn next(run: &Trace, t: Ns) -> Option<&PlantProbe> {
    run.plant.get(run.plant.partition_point(|probe| probe.t < t))
}

/// The first job that asks the joint's output to be so many steps of the converter from where it was at `begun`.
fn asked_elsewhere(scenario: &Scenario, run: &Trace, begun: Ns, joint: usize, steps: f64) -> Option<Ns> {
    // an output that stays is what it was
    let held = next(run, begun)?.motor_torque[joint];
    let step = scenario.drives().ok()?.joints[joint].amplifier_nm_per_v * 20.0 / 2f64.powi(scenario.da_io.bits.into());
    let asks = |probe: &&messages::ControlProbe| (probe.torque[joint] - held).abs() > steps * step;
    run.control.iter().filter(|probe| probe.t >= begun).find(asks).map(|probe| probe.t)
}

/// When the joint's motor has turned so often since `begun`.
fn turned(scenario: &Scenario, run: &Trace, begun: Ns, joint: usize, turns: f64) -> Option<Ns> {
    let from = next(run, begun)?.theta[joint];
    let way = turns * std::f64::consts::TAU / scenario.drives().ok()?.joints[joint].gear_ratio;
    let there = |probe: &&PlantProbe| probe.t >= begun && (probe.theta[joint] - from).abs() > way;
    run.plant.iter().find(there).map(|probe| probe.t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use messages::ControlProbe;

    const MS: Ns = 1_000_000;

    fn scenario(fault: &str) -> Scenario {
        scenario::load("table-5-3", &[format!("fault=[{fault}]")]).expect("document").scenario().expect("scenario")
    }

    #[test]
    fn an_output_that_stays_shows_with_the_first_job_that_asks_for_more_steps_than_stated() {
        let scenario = scenario("{ target = 'joint-3', kind = 'da-stuck', start_s = 0.01 }");
        let step = scenario.drives().expect("drives").joints[2].amplifier_nm_per_v * 20.0 / 4096.0;
        let mut run = Trace::default();
        for job in 0..8_u64 {
            let (mut control, mut plant) = (ControlProbe::zeroed(), PlantProbe::zeroed());
            (control.t, plant.t) = (5 * MS * job, 5 * MS * job);
            // one step a job, and far off before the fault begins
            control.torque[2] = 40.0 * step + if job < 2 { 90.0 } else { step * job as f64 };
            plant.motor_torque[2] = 42.0 * step;
            run.control.push(control);
            run.plant.push(plant);
        }
        let bound = |steps| Bound { output_steps: Some(steps), ..Bound::default() };
        assert_eq!(after_ms(&bound(2.5), &scenario, 0, &run, 10 * MS), 15.0);
        assert_eq!(after_ms(&bound(9.0), &scenario, 0, &run, 10 * MS), 25.0, "never: to the end");
        assert_eq!(after_ms(&Bound::default(), &scenario, 0, &run, 10 * MS), 0.0);
    }

    #[test]
    fn a_missing_index_mark_shows_once_the_motor_has_turned_as_often_as_stated() {
        let scenario = scenario("{ target = 'joint-1', kind = 'index-loss', start_s = 0.1 }");
        let gear = scenario.drives().expect("drives").joints[0].gear_ratio;
        let mut run = Trace::default();
        for i in 0..400_u64 {
            let mut plant = PlantProbe { t: i * MS, ..PlantProbe::zeroed() };
            // backwards, a turn in 100 ms
            plant.theta[0] = -std::f64::consts::TAU / gear * i as f64 / 100.0;
            run.plant.push(plant);
        }
        let bound = Bound { motor_turns: Some(1.25), ..Bound::default() };
        assert_eq!(after_ms(&bound, &scenario, 0, &run, 100 * MS).round(), 126.0);
    }
}
