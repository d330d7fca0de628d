//! Whether a fault had an effect: its run beside the fault-free twin of the same seed.
//!
//! Jobs are compared by number, the arm at the instants of the jobs, from the fault's begin to the end of its run. What
//! the boards say about the fault itself (events, safety state) does not count.

use super::plan::Effect;
use super::watch::Seen;
use board::Ns;
use messages::{ControlProbe, JOINTS, PlantProbe};

/// Greatest differences between two runs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    force_n: f64,
    torque_nm: f64,
    angle_rad: f64,
    time_ms: f64,
    transfers: f64,
}

impl Difference {
    /// Between a run and its twin, from `from` to the end of the run.
    pub fn of(run: &Seen, twin: &Seen, from: Ns) -> Difference {
        let transfers =
            |seen: &Seen, end: Ns| seen.transfers.iter().filter(|t| (from..=end).contains(*t)).count() as f64;
        let (run_of, twin_of) = (run, twin);
        let (run, twin) = (&run.trace, &twin.trace);
        let end = run.plant.last().map_or(0, |probe| probe.t);
        let more = transfers(run_of, end) - transfers(twin_of, end);
        let mut difference = Difference { transfers: more.abs(), ..Difference::default() };
        let after = |trace: &report::Trace| trace.control.partition_point(|probe| probe.t < from);
        let mut jobs = run.control[after(run)..].iter().peekable();
        for theirs in &twin.control[after(twin)..] {
            if theirs.t > end {
                break;
            }
            while jobs.next_if(|ours| ours.job < theirs.job).is_some() {}
            match jobs.next_if(|ours| ours.job == theirs.job) {
                Some(ours) => difference.job(ours, theirs),
                // near the end the run may be too short for a job that is merely late
                None => difference.time_ms = f64::MAX,
            }
            difference.arm(at(&run.plant, theirs.t), at(&twin.plant, theirs.t));
        }
        difference
    }

    /// Whether any difference is greater than stated.
    pub fn exceeds(&self, effect: &Effect) -> bool {
        self.force_n > effect.force_n
            || self.torque_nm > effect.torque_nm
            || self.angle_rad > effect.angle_rad
            || self.time_ms > effect.time_ms
            || effect.transfers.is_some_and(|most| self.transfers > most)
    }

    fn job(&mut self, ours: &ControlProbe, theirs: &ControlProbe) {
        let apart = |a: Ns, b: Ns| a.abs_diff(b) as f64 * 1e-6;
        for k in 0..3 {
            raise(&mut self.force_n, ours.fe[k] - theirs.fe[k]);
        }
        for i in 0..JOINTS {
            raise(&mut self.torque_nm, ours.torque[i] - theirs.torque[i]);
            raise(&mut self.angle_rad, ours.q[i] - theirs.q[i]);
        }
        raise(&mut self.time_ms, apart(ours.t, theirs.t));
        raise(&mut self.time_ms, apart(ours.force_age, theirs.force_age));
        raise(&mut self.time_ms, apart(ours.encoder_age, theirs.encoder_age));
    }

    fn arm(&mut self, ours: Option<&PlantProbe>, theirs: Option<&PlantProbe>) {
        let (Some(ours), Some(theirs)) = (ours, theirs) else { return };
        for k in 0..3 {
            raise(&mut self.force_n, ours.contact[k] - theirs.contact[k]);
        }
        for i in 0..JOINTS {
            raise(&mut self.angle_rad, ours.q[i] - theirs.q[i]);
        }
    }
}

fn raise(greatest: &mut f64, difference: f64) {
    // what is no number differs from everything
    *greatest = if difference.is_nan() { f64::MAX } else { greatest.max(difference.abs()) };
}

/// The state last known at `t`.
fn at(probes: &[PlantProbe], t: Ns) -> Option<&PlantProbe> {
    probes[..probes.partition_point(|probe| probe.t <= t)].last()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    const PERIOD: Ns = 5_000_000;

    fn trace(jobs: u32) -> Seen {
        let mut seen = Seen::default();
        let trace = &mut seen.trace;
        for job in 0..jobs {
            let t = Ns::from(job) * PERIOD;
            trace.control.push(ControlProbe { t, job, ..ControlProbe::zeroed() });
            trace.plant.push(PlantProbe { t, ..PlantProbe::zeroed() });
        }
        seen
    }

    #[test]
    fn a_run_does_not_differ_from_itself_and_a_shorter_one_only_where_both_are() {
        assert_eq!(Difference::of(&trace(10), &trace(10), 0), Difference::default());
        assert_eq!(Difference::of(&trace(5), &trace(10), 0), Difference::default());
    }

    #[test]
    fn what_was_before_the_fault_does_not_count() {
        let mut run = trace(10);
        run.trace.control[3].fe[2] = 7.0;
        assert_eq!(Difference::of(&run, &trace(10), 4 * PERIOD), Difference::default());
        let difference = Difference::of(&run, &trace(10), 3 * PERIOD);
        assert!(difference.exceeds(&Effect { force_n: 6.9, ..Effect::default() }));
        assert!(!difference.exceeds(&Effect { force_n: 7.1, ..Effect::default() }));
    }

    #[test]
    fn one_transfer_more_is_a_difference_where_transfers_count() {
        let mut run = trace(10);
        run.transfers = vec![1, PERIOD, 2 * PERIOD];
        let difference = |from| Difference::of(&run, &trace(10), from);
        let counts = Effect { transfers: Some(1.0), ..Effect::default() };
        assert!(difference(PERIOD).exceeds(&counts) && !difference(2 * PERIOD).exceeds(&counts));
        assert!(!difference(0).exceeds(&Effect::default()));
    }

    #[test]
    fn a_job_that_is_missing_or_late_is_a_difference_in_time() {
        let mut run = trace(10);
        run.trace.control[6].t += 600_000;
        assert!(Difference::of(&run, &trace(10), 0).exceeds(&Effect::default()));
        let mut run = trace(10);
        run.trace.control.remove(6);
        let greatest = Effect { time_ms: 1e9, ..Effect::default() };
        assert!(Difference::of(&run, &trace(10), 0).exceeds(&greatest));
    }
}
