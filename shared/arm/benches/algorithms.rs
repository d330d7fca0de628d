//! Time per call of every algorithm on REDIESTRO: prints `name ns/call`, the fastest of 200 batches over 64 random
//! postures (the fastest, because other work on the machine can only slow a batch down).
//!
//!     cargo bench -p arm            # the table beside Pinocchio's: scripts/reference/bench_outside.py, same names

use arm::{
    ArmModel, ArmState, FrozenArm, JointVector, Spatial, aba, crba, forward_kinematics, jacobian, jdot_qd, rnea, tip_motion,
};
use std::hint::black_box;
use std::time::Instant;

const STATES: usize = 64;
const CALLS: usize = 2_000;
const BATCHES: usize = 200;

struct State {
    q: JointVector,
    qd: JointVector,
    x: JointVector,
}

fn states() -> Vec<State> {
    // a small congruential generator: the values only have to be scattered
    let mut seed = 1_u64;
    let mut draw = move |scale: f64| {
        JointVector::from_fn(|_, _| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0) * scale
        })
    };
    (0..STATES).map(|_| State { q: draw(3.1), qd: draw(2.0), x: draw(5.0) }).collect()
}

fn bench<T>(name: &str, states: &[State], call: impl Fn(&State) -> T) {
    let mut fastest = f64::INFINITY;
    // under callgrind, which counts instructions, a few are enough
    let batches = std::env::var("BATCHES").map_or(BATCHES, |n| n.parse().expect("a number"));
    for _ in 0..batches {
        let start = Instant::now();
        for k in 0..CALLS {
            black_box(call(black_box(&states[k % STATES])));
        }
        fastest = fastest.min(start.elapsed().as_nanos() as f64 / CALLS as f64);
    }
    println!("{name:<16} {fastest:8.1}");
}

fn main() {
    let model = ArmModel::rediestro();
    let states = states();
    let none = JointVector::zeros();
    let free = Spatial::zeros();
    bench("fk", &states, |s| forward_kinematics(&model, &s.q));
    bench("jacobian", &states, |s| jacobian(&model, &s.q));
    bench("jdot_qd", &states, |s| jdot_qd(&model, &s.q, &s.qd));
    bench("tip_motion", &states, |s| tip_motion(&model, &s.q, &s.qd));
    bench("rnea", &states, |s| rnea(&model, &s.q, &s.qd, &s.x));
    bench("crba", &states, |s| crba(&model, &s.q));
    bench("aba", &states, |s| aba(&model, &s.q, &s.qd, &s.x, &none, &free));
    // frozen and asked once, and asked nearby: what a plant step asks of the model
    bench("frozen+fd", &states, |s| FrozenArm::new(&ArmState::new(&model, &s.q, &s.qd), &none).accelerations(&s.x, &free));
    let frozen = FrozenArm::new(&ArmState::new(&model, &states[0].q, &states[0].qd), &none);
    bench("nearby", &states, |s| {
        let (pose, twist) = (frozen.pose(&s.q), frozen.twist(&s.qd));
        let qdd = frozen.accelerations(&s.x, &twist);
        (pose, frozen.tip_acceleration(&qdd))
    });
    // tip motion, then torques for accelerations that depend on it: what a control step asks of the model
    bench("tip+rnea", &states, |s| {
        let state = ArmState::new(&model, &s.q, &s.qd);
        let tip = state.tip_motion();
        state.rnea(&(tip.jacobian.tr_mul(&tip.jdot_qd) + s.x))
    });
}
