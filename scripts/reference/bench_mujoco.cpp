// Time per call of MuJoCo on one seven-joint arm without contact: prints `name ns/call`. The model is an MJCF file
// (bench_outside.py writes it, compiles and runs this).
#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

constexpr int STATES = 64, CALLS = 2000, BATCHES = 200;

int main(int argc, char **argv) {
    char error[500] = "";
    mjModel *m = argc == 2 ? mj_loadXML(argv[1], nullptr, error, sizeof error) : nullptr;
    if (!m) return std::fprintf(stderr, "usage: %s MODEL.xml %s\n", argv[0], error), 2;
    mjData *d = mj_makeData(m);
    std::srand(1);
    std::vector<double> x(STATES * 3 * m->nv);
    for (auto &v : x) v = 2.0 * std::rand() / RAND_MAX - 1.0;
    auto bench = [&](const char *name, auto call) {
        std::vector<double> batches;
        for (int b = 0; b < BATCHES; ++b) {
            auto start = std::chrono::steady_clock::now();
            for (int k = 0; k < CALLS; ++k) {
                const double *s = &x[(k % STATES) * 3 * m->nv];
                for (int i = 0; i < m->nv; ++i) {
                    d->qpos[i] = 3.1 * s[i];
                    d->qvel[i] = 2.0 * s[i + m->nv];
                    d->qfrc_applied[i] = 5.0 * s[i + 2 * m->nv];
                }
                call();
            }
            batches.push_back(
                std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / CALLS);
        }
            std::printf("%-16s %8.1f\n", name, *std::min_element(batches.begin(), batches.end()));
    };
    std::vector<double> f(m->nv);
    bench("fk", [&] { mj_kinematics(m, d); });
    bench("jacobian", [&] {
        static double jp[3 * 64], jr[3 * 64];
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_jacBody(m, d, jp, jr, m->nbody - 1);
    });
    bench("jdot_qd", [&] {
        static double dp[3 * 64], dr[3 * 64], tip[6];
        const int body = m->nbody - 1;
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_comVel(m, d);
        mj_jacDot(m, d, dp, dr, d->xpos + 3 * body, body);
        mju_mulMatVec(tip, dp, d->qvel, 3, m->nv);
        mju_mulMatVec(tip + 3, dr, d->qvel, 3, m->nv);
    });
    bench("rnea", [&] {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_comVel(m, d);
        mj_rne(m, d, 1, f.data());
    });
    bench("crba", [&] {
        mj_kinematics(m, d);
        mj_comPos(m, d);
        mj_crb(m, d);
    });
    // it has no articulated-body algorithm: CRB and a factorisation give the same accelerations
    bench("aba", [&] { mj_forward(m, d); });
    bench("plant_step", [&] { mj_step(m, d); });
}
