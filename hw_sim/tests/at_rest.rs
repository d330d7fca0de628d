//! An arm that nothing moves stays where it is.

mod common;

use common::{Bench, free, scenario};

#[test]
fn a_braked_arm_does_not_move_from_the_first_instant_on() {
    for joints in ["flexible", "rigid"] {
        let scenario = scenario(&[&format!("plant.joints={joints}")]);
        let mut bench = Bench::new(&scenario);
        let start = *bench.sim.state();
        bench.run(1.0);
        let moved = (bench.sim.state().q - start.q).amax();
        assert!(moved < 1e-9, "{joints}: {moved} rad");
        assert!((start.q - scenario.initial_posture().expect("reachable")).amax() == 0.0);
    }
}

#[test]
fn the_arm_below_breakaway_stays_at_rest_for_60_s_with_its_brakes_off() {
    let scenario = scenario(&[]);
    let drives = scenario.drives().expect("built in");
    let mut bench = Bench::new(&scenario);
    // the motors carry 95 % of what the links ask for; friction holds the rest
    let volts = std::array::from_fn(|i| 0.95 * bench.sim.state().load[i] / drives.joints[i].amplifier_nm_per_v);
    bench.window(1_000_000, &[free(0, volts)]);
    // the ring-down of the brakes' release
    bench.run(10.0);
    let settled = bench.sim.state().q;
    bench.run(60.0);
    let crept = (bench.sim.state().q - settled).amax();
    assert!(crept < 1e-9, "{crept} rad in 60 s");
    assert!(bench.sim.state().qd.amax() < 1e-9);
}
