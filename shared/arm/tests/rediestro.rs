//! What is known of REDIESTRO, held against the built-in model: isotropy, the table-top posture, the surrogate's anchors.

use arm::drives::DriveData;
use arm::{ArmModel, JointMatrix, JointVector, crba, forward_kinematics, gravity_torque, jacobian};
use nalgebra::{SMatrix, SymmetricEigen, Vector3};

fn degrees(q: [f64; 7]) -> JointVector {
    JointVector::from(q.map(f64::to_radians))
}

fn table_top() -> JointVector {
    degrees([69.2, -15.3, -72.0, -132.4, 159.8, 64.7, 104.0])
}

/// Condition number of the Jacobian with its linear rows divided by the characteristic length.
fn condition(model: &ArmModel, q: &JointVector, length: f64) -> f64 {
    let mut j = jacobian(model, q);
    j.fixed_rows_mut::<3>(0).scale_mut(1.0 / length);
    let s = j.singular_values();
    s.max() / s.min()
}

#[test]
fn the_isotropic_posture_has_a_jacobian_of_condition_one_whatever_joint_1_does() {
    let model = ArmModel::rediestro();
    for first in [-150.0, 0.0, 33.0] {
        let q = degrees([first, -10.96, 91.90, 113.93, -2.26, 150.25, 63.76]);
        let condition = condition(&model, &q, 0.2206);
        assert!(condition <= 1.001, "{condition}");
        let mut j = jacobian(&model, &q);
        j.fixed_rows_mut::<3>(0).scale_mut(1.0 / 0.2206);
        let difference = j * j.transpose() - SMatrix::<f64, 6, 6>::identity() * (7.0 / 3.0);
        assert!(difference.amax() < 2e-3, "JJᵀ = 7/3: {difference}");
    }
}

#[test]
fn the_table_top_posture_puts_the_tool_down_at_its_place() {
    let model = ArmModel::rediestro();
    let pose = forward_kinematics(&model, &table_top());
    assert!((pose.p - Vector3::new(0.6, 0.0, 0.9)).norm() < 2e-3, "{}", pose.p);
    assert!((pose.r.column(2) + Vector3::z()).norm() < 2e-3, "{}", pose.r);
    let condition = condition(&model, &table_top(), 0.2206);
    assert!((condition - 5.25).abs() < 0.02, "{condition}");
}

#[test]
fn the_surrogate_masses_ask_for_the_torques_they_were_chosen_for() {
    let model = ArmModel::rediestro();
    assert!((model.link_masses().sum() - 51.0).abs() < 1e-12);
    let g = gravity_torque(&model, &table_top());
    for (torque, expected) in g.iter().zip([0.0, -78.0, -18.0, 77.0, 19.0, -6.0, 0.0]) {
        assert!((torque - expected).abs() < 0.6, "{g}");
    }
    let (j, m) = (jacobian(&model, &table_top()), crba(&model, &table_top()));
    let rotors = JointMatrix::from_diagonal(&DriveData::rediestro().each(|d| d.rotor_inertia_at_output_kg_m2));
    let task = |m: JointMatrix| (j * m.try_inverse().expect("a mass matrix") * j.transpose()).try_inverse();
    // the tip pushed along z: free to give way in the other axes, or guided by them
    let free = |m: JointMatrix| 1.0 / (j * m.try_inverse().expect("a mass matrix") * j.transpose())[(2, 2)];
    let guided = task(m + rotors).expect("not singular")[(2, 2)];
    println!("task inertia in z: links {}, with rotors {}, guided {guided} kg", free(m), free(m + rotors));
    assert!((guided - 22.5).abs() < 0.1, "{guided} kg");
    let stiffness = DriveData::rediestro().each(|d| d.stiffness_nm_per_rad);
    let k_z = free(JointMatrix::from_diagonal(&stiffness));
    assert!((k_z - 54e3).abs() < 1e3, "{k_z} N/m");
    assert!(SymmetricEigen::new(m).eigenvalues.min() > 0.0);
}

#[test]
fn the_reach_is_about_1_4_m_from_the_shoulder() {
    let model = ArmModel::rediestro();
    assert!((model.shoulder() - Vector3::new(0.0, 0.0, 0.95229)).norm() < 1e-12);
    let reach = model.reach();
    assert!((1.35..1.5).contains(&reach), "{reach}");
}

#[test]
fn gravity_never_asks_for_more_than_169_nm() {
    let model = ArmModel::rediestro();
    // joint 2 carries everything; a coarse search over what it carries
    let mut worst = 0.0_f64;
    for k in 0..40_000_u64 {
        let q = JointVector::from_fn(|i, _| (halton(k + 1, [2, 3, 5, 7, 11, 13, 17][i]) - 0.5) * std::f64::consts::TAU);
        worst = worst.max(gravity_torque(&model, &q).amax());
    }
    println!("worst gravity torque {worst} Nm");
    assert!(worst > 155.0 && worst < 172.0, "{worst}");
}

fn halton(mut k: u64, base: u64) -> f64 {
    let (mut f, mut r) = (1.0, 0.0);
    while k > 0 {
        f /= base as f64;
        r += f * (k % base) as f64;
        k /= base;
    }
    r
}
