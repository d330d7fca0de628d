// Time per call of Pinocchio's algorithms on one seven-joint arm: prints `name ns/call` under the names of
// shared/arm/benches/algorithms.rs, measured the same way. Header-only, so that the compiler's options decide; the arm
// comes as numbers on standard input (bench_outside.py compiles, feeds and runs this).
#include <pinocchio/fwd.hpp> // first: it sets limits of Boost that the others need

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <Eigen/Cholesky>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <vector>

namespace pin = pinocchio;
using Vector = Eigen::VectorXd;
constexpr int STATES = 64, CALLS = 2000, BATCHES = 200;
struct State { Vector q, qd, x; };

template <class F> void bench(const char *name, const std::vector<State> &states, F call) {
    std::vector<double> batches;
    for (int b = 0; b < BATCHES; ++b) {
        auto start = std::chrono::steady_clock::now();
        for (int k = 0; k < CALLS; ++k) call(states[k % STATES]);
        batches.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / CALLS);
    }
    std::printf("%-16s %8.1f\n", name, *std::min_element(batches.begin(), batches.end()));
}

pin::SE3 placement() {
    Eigen::Matrix3d r;
    Eigen::Vector3d p;
    for (int i = 0; i < 9; ++i) std::cin >> r(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) std::cin >> p(i);
    return {r, p};
}

int main() {
    pin::Model model;
    pin::JointIndex last = 0;
    for (int i = 0; i < 7; ++i) {
        last = model.addJoint(last, pin::JointModelRZ(), placement(), "joint_" + std::to_string(i + 1));
        double mass;
        Eigen::Vector3d com;
        Eigen::Matrix3d tensor;
        std::cin >> mass;
        for (int k = 0; k < 3; ++k) std::cin >> com(k);
        for (int k = 0; k < 9; ++k) std::cin >> tensor(k / 3, k % 3);
        model.appendBodyToJoint(last, pin::Inertia(mass, com, tensor));
    }
    const auto tip = model.addFrame(pin::Frame("tip", last, 0, placement(), pin::OP_FRAME));
    if (!std::cin) return std::fprintf(stderr, "no arm on standard input\n"), 2;
    pin::Data data(model);
    std::srand(1);
    std::vector<State> states;
    for (int k = 0; k < STATES; ++k)
        states.push_back({Vector::Random(model.nq) * 3.1, Vector::Random(model.nv) * 2, Vector::Random(model.nv) * 5});
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, model.nv);
    const Vector none = Vector::Zero(model.nv);
    const auto axes = pin::LOCAL_WORLD_ALIGNED;

    bench("fk", states, [&](const State &s) {
        pin::forwardKinematics(model, data, s.q);
        pin::updateFramePlacement(model, data, tip);
    });
    bench("jacobian", states, [&](const State &s) {
        pin::computeJointJacobians(model, data, s.q);
        pin::updateFramePlacement(model, data, tip);
        pin::getFrameJacobian(model, data, tip, axes, jacobian);
    });
    Vector drift(6);
    bench("jdot_qd", states, [&](const State &s) {
        pin::forwardKinematics(model, data, s.q, s.qd, none);
        pin::updateFramePlacement(model, data, tip);
        drift = pin::getFrameClassicalAcceleration(model, data, tip, axes).toVector();
    });
    auto tip_motion = [&](const State &s) {
        pin::forwardKinematics(model, data, s.q, s.qd, none);
        pin::computeJointJacobians(model, data);
        pin::updateFramePlacement(model, data, tip);
        pin::getFrameJacobian(model, data, tip, axes, jacobian);
        drift = pin::getFrameClassicalAcceleration(model, data, tip, axes).toVector();
    };
    bench("tip_motion", states, tip_motion);
    bench("rnea", states, [&](const State &s) { pin::rnea(model, data, s.q, s.qd, s.x); });
    bench("crba", states, [&](const State &s) {
        data.M.setZero();
        pin::crba(model, data, s.q);
        data.M.triangularView<Eigen::StrictlyLower>() = data.M.transpose().triangularView<Eigen::StrictlyLower>();
    });
    bench("aba", states, [&](const State &s) { pin::aba(model, data, s.q, s.qd, s.x); });
    Vector wanted(model.nv);
    // what a control step needs besides the control law: kinematics, weighted least squares, inverse dynamics
    Eigen::Matrix<double, 7, 7> normal;
    Eigen::LLT<Eigen::Matrix<double, 7, 7>> factors;
    bench("control_step", states, [&](const State &s) {
        tip_motion(s);
        normal.noalias() = jacobian.transpose() * jacobian;
        normal.diagonal().array() += 1e-3;
        wanted.noalias() = jacobian.transpose() * drift;
        wanted -= 2e-3 * s.qd;
        factors.compute(normal);
        factors.solveInPlace(wanted);
        pin::rnea(model, data, s.q, s.qd, wanted);
    });
    bench("tip+rnea", states, [&](const State &s) {
        tip_motion(s);
        wanted.noalias() = jacobian.transpose() * drift;
        wanted += s.x;
        pin::rnea(model, data, s.q, s.qd, wanted);
    });
}
