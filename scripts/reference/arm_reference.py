#!/usr/bin/env python3
"""Reference values for shared/arm's tests: Pinocchio on 1000 random states, MuJoCo on 25 of them, two robots.

Writes into shared/arm/tests/data: `<robot>.pinocchio.f64` and `<robot>.mujoco.f64`, little-endian doubles, one row per
state: q(7) qd(7) qdd(7) tau(7) p(3) R(9, row-major) J(42, row-major, linear rows first) jdot_qd(6) M(28, upper triangle
by rows) bias(7) rnea(7) fd(7). Also copies the Panda's URDF (package example-robot-data, Apache-2.0) there.

    python3 -m venv .venv && .venv/bin/pip install -r scripts/reference/requirements.txt
    .venv/bin/python scripts/reference/arm_reference.py
"""
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "shared/arm/tests/data"
UPPER = np.triu_indices(7)
STATES, SAMPLE = 1000, 25


def states(seed):
    rng = np.random.default_rng(seed)
    scale = np.repeat([np.pi, 2.0, 5.0, 50.0], 7)
    return rng.uniform(-1.0, 1.0, (STATES, 28)) * scale


def row(x, p, r, j, jdot_qd, m, bias, rnea, fd):
    return np.concatenate([x, p, r.ravel(), j.ravel(), jdot_qd, m[UPPER], bias, rnea, fd])


def pinocchio_rows(urdf, tip, xs):
    full = pin.buildModelFromUrdf(str(urdf))
    fingers = [i for i in range(1, full.njoints) if "finger" in full.names[i]]
    model = pin.buildReducedModel(full, fingers, pin.neutral(full))
    assert model.nq == 7, model
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    data, frame = model.createData(), model.getFrameId(tip)
    axes = pin.LOCAL_WORLD_ALIGNED
    out = []
    for x in xs:
        q, v, a, tau = np.split(x, 4)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        pose = data.oMf[frame]
        p, r = pose.translation.copy(), pose.rotation.copy()
        j = pin.getFrameJacobian(model, data, frame, axes).copy()
        pin.forwardKinematics(model, data, q, v, np.zeros(7))
        pin.updateFramePlacements(model, data)
        jdot_qd = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector.copy()
        m = pin.crba(model, data, q).copy()
        bias = pin.nonLinearEffects(model, data, q, v).copy()
        rnea = pin.rnea(model, data, q, v, a).copy()
        fd = pin.aba(model, data, q, v, tau).copy()
        out.append(row(x, p, r, j, jdot_qd, m, bias, rnea, fd))
    return np.array(out)


def mujoco_model(urdf):
    """The robot without pictures, its fingers fixed, its fixed links kept."""
    tree = ET.parse(urdf)
    for link in tree.getroot().iter("link"):
        for tag in ("visual", "collision"):
            for e in link.findall(tag):
                link.remove(e)
    for joint in tree.getroot().iter("joint"):
        if joint.get("type") == "prismatic":
            joint.set("type", "fixed")
            for e in joint.findall("mimic"):
                joint.remove(e)
    extension = ET.SubElement(tree.getroot(), "mujoco")
    ET.SubElement(extension, "compiler", fusestatic="false", balanceinertia="false", boundmass="0")
    model = mujoco.MjModel.from_xml_string(ET.tostring(tree.getroot(), encoding="unicode"))
    assert model.nv == 7, model.nv
    model.dof_damping[:] = 0.0  # drives are not part of the rigid-body comparison
    model.opt.gravity[:] = [0.0, 0.0, -9.81]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return model


def mujoco_rows(urdf, tip, xs):
    model = mujoco_model(urdf)
    data = mujoco.MjData(model)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, tip)
    out = []
    for x in xs:
        data.qpos[:], data.qvel[:], qdd, data.qfrc_applied[:] = np.split(x, 4)
        mujoco.mj_forward(model, data)
        fd, bias = data.qacc.copy(), data.qfrc_bias.copy()
        p, r = data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy()
        jp, jr, dp, dr = (np.zeros((3, 7)) for _ in range(4))
        mujoco.mj_jacBody(model, data, jp, jr, body)
        mujoco.mj_jacDot(model, data, dp, dr, p, body)
        jdot_qd = np.vstack([dp, dr]) @ data.qvel
        m = np.zeros((7, 7))
        mujoco.mj_fullM(model, data, m)
        data.qacc[:] = qdd
        mujoco.mj_inverse(model, data)
        out.append(row(x, p, r, np.vstack([jp, jr]), jdot_qd, m, bias, data.qfrc_inverse.copy(), fd))
    return np.array(out)


def worst(a, b):
    """Largest difference over largest value, by quantity."""
    names = ["p", "R", "J", "jdot_qd", "M", "bias", "rnea", "fd"]
    edges = np.cumsum([28, 3, 9, 42, 6, 28, 7, 7, 7])
    return {
        n: float(np.max(np.abs(a[:, i:k] - b[:, i:k]).max(axis=1) / np.abs(b[:, i:k]).max(axis=1)))
        for n, i, k in zip(names, edges[:-1], edges[1:])
    }


def main():
    DATA.mkdir(parents=True, exist_ok=True)
    # both wheels install below one prefix
    share = next(p / "share" for p in Path(pin.__file__).parents if p.name == "cmeel.prefix")
    shutil.copy(share / "example-robot-data/robots/panda_description/urdf/panda.urdf", DATA / "panda.urdf")
    robots = {
        "rediestro": (ROOT / "shared/arm/src/robots/rediestro.urdf", "tool", 1),
        "panda": (DATA / "panda.urdf", "panda_hand_tcp", 2),
    }
    for name, (urdf, tip, seed) in robots.items():
        xs = states(seed)
        by_pinocchio = pinocchio_rows(urdf, tip, xs)
        by_mujoco = mujoco_rows(urdf, tip, xs[:SAMPLE])
        by_pinocchio.astype("<f8").tofile(DATA / f"{name}.pinocchio.f64")
        by_mujoco.astype("<f8").tofile(DATA / f"{name}.mujoco.f64")
        print(name, "MuJoCo against Pinocchio:", worst(by_mujoco, by_pinocchio[:SAMPLE]))


if __name__ == "__main__":
    main()
