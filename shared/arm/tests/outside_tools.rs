//! The algorithms against Pinocchio (1000 states) and MuJoCo (25), for REDIESTRO and the Panda. The values are files made
//! by `scripts/reference/arm_reference.py`.
//!
//! A relative error is the largest difference within a quantity over the largest value in it, in one state.

use arm::{ArmModel, JointVector, Spatial, aba, bias, crba, rnea, tip_motion};

const ROW: usize = 137;

struct Row<'a>(&'a [f64]);

impl Row<'_> {
    fn joints(&self, at: usize) -> JointVector {
        JointVector::from_column_slice(&self.0[at..at + 7])
    }
}

fn rows(file: &str) -> Vec<f64> {
    let path = format!("{}/tests/data/{file}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(path).expect("reference values are part of the repository");
    bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
}

fn rediestro() -> ArmModel {
    ArmModel::rediestro()
}

fn panda() -> ArmModel {
    ArmModel::from_urdf(include_str!("data/panda.urdf"), None, "panda_hand_tcp")
        .expect("the Panda is a seven-joint arm")
}

/// Worst relative error over all states, in the order of `NAMES`.
fn worst(model: &ArmModel, file: &str, states: usize) -> [f64; 8] {
    let values = rows(file);
    assert_eq!(values.len(), states * ROW);
    let mut worst = [0.0_f64; 8];
    for row in values.chunks_exact(ROW).map(Row) {
        let (q, qd, qdd, tau) = (row.joints(0), row.joints(7), row.joints(14), row.joints(21));
        let tip = tip_motion(model, &q, &qd);
        let m = crba(model, &q);
        let upper: Vec<f64> = (0..7).flat_map(|i| (i..7).map(move |j| m[(i, j)])).collect();
        let fd = aba(model, &q, &qd, &tau, &JointVector::zeros(), &Spatial::zeros());
        let ours: [Vec<f64>; 8] = [
            tip.pose.p.as_slice().to_vec(),
            tip.pose.r.transpose().as_slice().to_vec(),
            tip.jacobian.transpose().as_slice().to_vec(),
            tip.jdot_qd.as_slice().to_vec(),
            upper,
            bias(model, &q, &qd).as_slice().to_vec(),
            rnea(model, &q, &qd, &qdd).as_slice().to_vec(),
            fd.as_slice().to_vec(),
        ];
        let mut theirs = &row.0[28..];
        for (k, ours) in ours.iter().enumerate() {
            let (part, rest) = theirs.split_at(ours.len());
            theirs = rest;
            let largest = part.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            let difference = ours.iter().zip(part).fold(0.0_f64, |a, (x, y)| a.max((x - y).abs()));
            worst[k] = worst[k].max(difference / largest);
        }
    }
    worst
}

const NAMES: [&str; 8] = ["p", "R", "J", "jdot_qd", "M", "bias", "rnea", "fd"];

fn check(model: &ArmModel, file: &str, states: usize) {
    let worst = worst(model, file, states);
    for (k, (name, error)) in NAMES.iter().zip(worst).enumerate() {
        println!("{file} {name}: {error:.1e}");
        let limit = if k < 3 { 1e-13 } else { 1e-12 };
        assert!(error <= limit, "{file}: {name} differs by {error:e} (relative)");
    }
}

#[test]
fn rediestro_agrees_with_pinocchio_on_1000_states() {
    check(&rediestro(), "rediestro.pinocchio.f64", 1000);
}

#[test]
fn the_panda_agrees_with_pinocchio_on_1000_states() {
    check(&panda(), "panda.pinocchio.f64", 1000);
}

#[test]
fn both_agree_with_mujoco_on_25_states() {
    check(&rediestro(), "rediestro.mujoco.f64", 25);
    check(&panda(), "panda.mujoco.f64", 25);
}
