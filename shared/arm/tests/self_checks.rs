//! The algorithms against each other and against finite differences, on random states of REDIESTRO and the Panda.

use arm::{
    ArmModel, ArmState, FrozenArm, JointMatrix, JointVector, Spatial, Tool, aba, bias, crba, forward_kinematics, gravity_torque,
    jacobian, jdot_qd, rnea, rotation, tip_motion,
};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

fn joints(scale: f64) -> impl Strategy<Value = JointVector> {
    prop::array::uniform7(-scale..scale).prop_map(JointVector::from)
}

fn wrench() -> impl Strategy<Value = Spatial> {
    prop::array::uniform6(-50.0..50.0f64).prop_map(Spatial::from)
}

fn robot() -> impl Strategy<Value = ArmModel> {
    let panda =
        ArmModel::from_urdf(include_str!("data/panda.urdf"), None, "panda_hand_tcp").expect("a seven-joint arm");
    prop::sample::select(vec![ArmModel::rediestro(), panda])
}

/// Twist that takes one pose to another in `dt` seconds.
fn difference(from: &arm::Pose, to: &arm::Pose, dt: f64) -> Spatial {
    let (v, w) = ((to.p - from.p) / dt, rotation::log(&(to.r * from.r.transpose())) / dt);
    Spatial::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn columns_of_the_mass_matrix_are_newton_euler_torques_of_unit_accelerations(model in robot(), q in joints(3.1)) {
        let m = crba(&model, &q);
        let g = gravity_torque(&model, &q);
        for i in 0..7 {
            let unit = JointVector::from_fn(|k, _| f64::from(k == i));
            let column = rnea(&model, &q, &JointVector::zeros(), &unit) - g;
            prop_assert!((column - m.column(i)).amax() < 1e-12 * m.amax().max(g.amax()));
        }
    }

    #[test]
    fn forward_dynamics_undo_inverse_dynamics_with_armature_and_tip_wrench(
        model in robot(), q in joints(3.1), qd in joints(3.0), qdd in joints(10.0), f in wrench(), rotors in prop::bool::ANY,
    ) {
        let armature = JointVector::repeat(if rotors { 0.6 } else { 0.0 });
        let tau = rnea(&model, &q, &qd, &qdd) + armature.component_mul(&qdd) - jacobian(&model, &q).tr_mul(&f);
        let back = aba(&model, &q, &qd, &tau, &armature, &f);
        // the Panda's lightest direction weighs about 1e-3 kg m² against torques of 100 Nm
        prop_assert!((back - qdd).amax() < 1e-9, "{}", (back - qdd).amax());
    }

    #[test]
    fn the_jacobian_is_the_derivative_of_the_pose(model in robot(), q in joints(3.1)) {
        let j = jacobian(&model, &q);
        let h = 1e-5;
        for i in 0..7 {
            let step = JointVector::from_fn(|k, _| if k == i { h } else { 0.0 });
            let (a, b) = (forward_kinematics(&model, &(q - step)), forward_kinematics(&model, &(q + step)));
            prop_assert!((difference(&a, &b, 2.0 * h) - j.column(i)).amax() < 1e-9);
        }
    }

    #[test]
    fn jdot_qd_is_the_derivative_of_the_twist_at_constant_joint_speed(model in robot(), q in joints(3.1), qd in joints(2.0)) {
        let h = 1e-5;
        let twist = |q: JointVector| jacobian(&model, &q) * qd;
        let numeric = (twist(q + qd * h) - twist(q - qd * h)) / (2.0 * h);
        prop_assert!((numeric - jdot_qd(&model, &q, &qd)).amax() < 1e-7);
    }

    #[test]
    fn coriolis_torques_do_the_work_that_changes_the_mass_matrix(model in robot(), q in joints(3.1), qd in joints(2.0)) {
        // q̇ᵀ(Ṁ − 2C)q̇ = 0
        let h = 1e-5;
        let numeric = (crba(&model, &(q + qd * h)) - crba(&model, &(q - qd * h))) / (2.0 * h);
        let coriolis = bias(&model, &q, &qd) - gravity_torque(&model, &q);
        let left = 0.5 * qd.dot(&multiply(&numeric, &qd));
        prop_assert!((left - qd.dot(&coriolis)).abs() < 1e-6 * (1.0 + left.abs()));
    }

    #[test]
    fn one_shared_pass_gives_the_same_bits_as_the_functions(q in joints(3.1), qd in joints(2.0), qdd in joints(5.0), f in wrench()) {
        let model = ArmModel::rediestro();
        let state = ArmState::new(&model, &q, &qd);
        prop_assert_eq!(state.tip_motion(), tip_motion(&model, &q, &qd));
        prop_assert_eq!(state.tip_motion().pose, forward_kinematics(&model, &q));
        prop_assert_eq!(state.tip_motion().jacobian, jacobian(&model, &q));
        prop_assert_eq!(state.tip_motion().jdot_qd, jdot_qd(&model, &q, &qd));
        prop_assert_eq!(state.rnea(&qdd), rnea(&model, &q, &qd, &qdd));
        prop_assert_eq!(state.mass_matrix(), crba(&model, &q));
        prop_assert_eq!(state.aba(&qdd, &qd.abs(), &f), aba(&model, &q, &qd, &qdd, &qd.abs(), &f));
    }

    #[test]
    fn an_arm_frozen_in_a_posture_is_that_arm_there(
        model in robot(), q in joints(3.1), qd in joints(3.0), tau in joints(50.0), f in wrench(), rotors in prop::bool::ANY,
    ) {
        let armature = JointVector::repeat(if rotors { 0.6 } else { 0.0 });
        let (state, tip) = (ArmState::new(&model, &q, &qd), tip_motion(&model, &q, &qd));
        let frozen = FrozenArm::new(&state, &armature);
        prop_assert_eq!(frozen.pose(&q), tip.pose);
        prop_assert!((frozen.twist(&qd) - tip.twist).amax() < 1e-13);
        prop_assert!((frozen.tip_acceleration(&tau) - (tip.jacobian * tau + tip.jdot_qd)).amax() < 1e-12);
        let (a, b) = (frozen.accelerations(&tau, &f), state.aba(&tau, &armature, &f));
        prop_assert!((a - b).amax() < 1e-10 * b.amax(), "{}", (a - b).amax() / b.amax());
    }

    #[test]
    fn a_frozen_arms_pose_is_right_to_second_order(model in robot(), q in joints(3.1), dq in joints(1.0)) {
        let frozen = FrozenArm::new(&ArmState::new(&model, &q, &JointVector::zeros()), &JointVector::zeros());
        let error = |h: f64| {
            let (near, true_pose) = (frozen.pose(&(q + dq * h)), forward_kinematics(&model, &(q + dq * h)));
            (near.p - true_pose.p).norm() + (near.r - true_pose.r).norm()
        };
        let (coarse, fine) = (error(1e-3), error(1e-4));
        prop_assert!(coarse < 3e-5 && fine < 0.0101 * coarse + 1e-12, "{coarse:e} {fine:e}");
    }

    #[test]
    fn the_gravity_torque_is_the_gradient_of_the_potential_energy(model in robot(), q in joints(3.1)) {
        let zero = JointVector::zeros();
        let torque = gravity_torque(&model, &q);
        for i in 0..7 {
            let moved = |d: f64| {
                let q = q + JointVector::from_fn(|k, _| if k == i { d } else { 0.0 });
                ArmState::new(&model, &q, &zero).potential_energy()
            };
            let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            prop_assert!((slope - torque[i]).abs() < 1e-6, "joint {}: {slope} {}", i + 1, torque[i]);
        }
    }

    #[test]
    fn the_twist_is_the_jacobian_times_the_joint_speeds(model in robot(), q in joints(3.1), qd in joints(2.0)) {
        let tip = tip_motion(&model, &q, &qd);
        prop_assert!((tip.twist - tip.jacobian * qd).amax() < 1e-13);
    }

    #[test]
    fn a_tool_weighs_on_the_joints_as_its_weight_at_its_centre_of_mass(q in joints(3.1)) {
        let model = ArmModel::rediestro();
        let com = Vector3::new(0.03, -0.05, 0.12);
        let tool = Tool { mass: 2.5, com, inertia: Matrix3::identity() * 0.01 };
        let added = gravity_torque(&model.clone().with_tool(&tool), &q) - gravity_torque(&model, &q);
        let at_com = jacobian(&model.with_tip(Matrix3::identity(), com), &q);
        let weight = Spatial::new(0.0, 0.0, -2.5 * 9.81, 0.0, 0.0, 0.0);
        prop_assert!((added + at_com.tr_mul(&weight)).amax() < 1e-12);
    }
}

/// Energy of a swinging, frictionless arm: kinetic, and potential by the work of gravity's torques.
#[test]
fn a_free_swing_keeps_its_energy() {
    let model = ArmModel::rediestro();
    let (mut q, mut qd) = (JointVector::from([0.1, 0.4, -0.7, 1.1, 0.3, -0.5, 0.9]), JointVector::zeros());
    let none = JointVector::zeros();
    let accelerate = |q: &JointVector, qd: &JointVector| aba(&model, q, qd, &none, &none, &Spatial::zeros());
    let kinetic = |q: &JointVector, qd: &JointVector| 0.5 * qd.dot(&multiply(&crba(&model, q), qd));
    let h = 1e-3;
    let (mut gained, mut largest, mut power) = (0.0, 0.0_f64, 0.0);
    for _ in 0..1000 {
        // RK4 on the arm; Simpson on gravity's power −q̇ᵀg, at the same three moments
        let (k1, v1) = (accelerate(&q, &qd), qd);
        let v2 = qd + k1 * (h / 2.0);
        let k2 = accelerate(&(q + v1 * (h / 2.0)), &v2);
        let v3 = qd + k2 * (h / 2.0);
        let k3 = accelerate(&(q + v2 * (h / 2.0)), &v3);
        let v4 = qd + k3 * h;
        let k4 = accelerate(&(q + v3 * h), &v4);
        let middle = q + (v1 * 2.0 + v2 + v3) * (h / 8.0);
        let middle_speed = qd + (k1 * 5.0 + k2 * 4.0 + k3 * 4.0 - k4) * (h / 24.0);
        let middle_power = -middle_speed.dot(&gravity_torque(&model, &middle));
        q += (v1 + v2 * 2.0 + v3 * 2.0 + v4) * (h / 6.0);
        qd += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        let next_power = -qd.dot(&gravity_torque(&model, &q));
        gained += (power + 4.0 * middle_power + next_power) * (h / 6.0);
        power = next_power;
        largest = largest.max(kinetic(&q, &qd));
    }
    let drift = (kinetic(&q, &qd) - gained).abs() / largest;
    println!("energy drift over 1 s: {drift:.1e} of {largest:.0} J");
    assert!(largest > 10.0 && drift < 1e-6, "{drift} of {largest} J");
}

fn multiply(m: &JointMatrix, v: &JointVector) -> JointVector {
    JointVector::from_fn(|i, _| (0..7).map(|k| m[(i, k)] * v[k]).sum())
}
