//! Xᵗ is an integrator of force: an arm that cannot move shows what keeps it in bounds.

mod rig;

use arm::{JointVector, Spatial};
use control_computer::{Impedance, Job, Mode, Pipeline, Segment, Sensed};
use messages::PathKind;
use rig::{PERIOD, table_5_3};
use scenario::Scenario;
use vme::Ns;

/// An arm held fast in free space, told to push along z.
struct Held {
    pipeline: Pipeline,
    sensed: Sensed,
    now: Ns,
}

impl Held {
    fn new(mut scenario: Scenario) -> Held {
        scenario.controller.tool_compensation = false;
        let sensed =
            Sensed { q: scenario.initial_posture().unwrap(), qd: JointVector::zeros(), wrench: Spatial::zeros() };
        let pipeline = Pipeline::new(&scenario).unwrap();
        Held { pipeline, sensed, now: 0 }
    }

    fn push(&mut self, newtons: f64) {
        let x = self.step().x;
        self.pipeline.trajectory().push(Segment {
            index: 0,
            start: self.now,
            move_time: 0,
            path: PathKind::Hold,
            target: x,
            impedance: Impedance {
                selection: Spatial::new(1.0, 1.0, 0.0, 1.0, 1.0, 1.0),
                mass: Spatial::repeat(100.0),
                damping: Spatial::repeat(1000.0),
                stiffness: Spatial::repeat(1000.0),
                force: Spatial::new(0.0, 0.0, newtons, 0.0, 0.0, 0.0),
            },
        });
    }

    fn step(&mut self) -> Job {
        let job = self.pipeline.step(self.now, PERIOD as f64 * 1e-9, &self.sensed, Mode::Law);
        self.now += PERIOD;
        job
    }
}

/// Xᵗ − X along z, m.
fn error(job: &Job) -> f64 {
    job.law.xt.pose.p.z - job.x.p.z
}

#[test]
fn the_target_stays_at_its_limit_says_so_and_leaves_it_at_once_when_told_to() {
    let mut scenario = table_5_3();
    scenario.controller.max_target_error_m = 0.02;
    let mut held = Held::new(scenario);
    held.push(60.0);
    for _ in 0..400 {
        assert!(error(&held.step()) <= 0.02 + 1e-12);
    }
    let job = held.step();
    assert!((error(&job) - 0.02).abs() < 1e-12);
    assert_eq!((job.law.target_limited, job.torque_limited), (0b100, 0));
    // an integrator that had run on for 2 s at 0.06 m/s would need as long to come back
    held.push(-60.0);
    for _ in 0..10 {
        held.step();
    }
    let job = held.step();
    assert!(error(&job) < 0.0195, "{}", error(&job));
    assert_eq!(job.law.target_limited, 0);
}

#[test]
fn the_target_gets_no_further_away_than_the_torques_can_pull() {
    let mut held = Held::new(table_5_3());
    held.push(60.0);
    let mut errors = Vec::new();
    for _ in 0..6000 {
        let job = held.step();
        assert_eq!(job.law.target_limited, 0, "the limit of 0.5 m is never reached");
        errors.push((error(&job), job.torque_limited != 0));
    }
    // at 0.06 m/s the target would be 1.8 m away; it stops where K_p (Xᵗ − X) alone needs all of a joint's torque
    let first_cut = errors.iter().position(|(_, cut)| *cut).unwrap();
    let (at_cut, end) = (errors[first_cut].0, errors[5999].0);
    assert!(end < at_cut + 0.03, "{at_cut} {end}");
    assert!(end - errors[5000].0 < 1e-9, "{} {end}", errors[5000].0);
}
