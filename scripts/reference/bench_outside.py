#!/usr/bin/env python3
"""Times Pinocchio and MuJoCo on the built-in REDIESTRO, prints lines `tool name ns/call`.

Pinocchio: compiled from the wheel's headers in two builds, plain -O3 and -march=native; both are printed. MuJoCo: the
wheel's library, called from C++. Without g++, the Python calls are timed instead and the tool's name says `python`
(1-3 microseconds of each such figure are the call from Python). Needs scripts/reference/requirements.txt. The
programs are compiled once (minutes), into the build folder, and again only when their source is newer. MuJoCo comes first:
it compiles in seconds. Whatever takes longer than its limit is left out, and stderr says so.

    $(./scripts/python-env.sh outside) scripts/reference/bench_outside.py
"""
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# wall time that one program may take
COMPILE_S, RUN_S = 900, 120
URDF = ROOT / "shared/arm/src/robots/rediestro.urdf"
sys.path.insert(0, str(HERE))
from arm_reference import mujoco_model  # noqa: E402


def numbers(model):
    """The arm as the numbers that bench_pinocchio.cpp reads."""
    out = []

    def placement(m):
        out.extend([*m.rotation.ravel(), *m.translation])

    for i in range(1, 8):
        body = model.inertias[i]
        placement(model.jointPlacements[i])
        out.extend([body.mass, *body.lever, *body.inertia.ravel()])
    placement(model.frames[model.getFrameId("tool")].placement)
    return " ".join(repr(float(x)) for x in out)


def compiled(work):
    wheel = Path(mujoco.__file__).parent
    library = next(wheel.glob("libmujoco.so*"))
    model = work / "arm.xml"
    mujoco.mj_saveLastXML(str(model), mujoco_model(URDF))
    options = [f"-I{wheel}/include", library, f"-Wl,-rpath,{wheel}"]
    measure("mujoco", HERE / "bench_mujoco.cpp", work / "mujoco-bench", options, [model])

    prefix = next(p for p in Path(pin.__file__).parents if p.name == "cmeel.prefix")
    arm = numbers(pin.buildModelFromUrdf(str(URDF)))
    headers = [f"-I{prefix}/include", f"-I{prefix}/include/eigen3"]
    # Pinocchio has more joint types, and steps with more arguments, than Boost allows for by default
    headers += ["-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DBOOST_FUSION_INVOKE_MAX_ARITY=10"]
    for name, options in (("pinocchio", []), ("pinocchio-native", ["-march=native"])):
        measure(name, HERE / "bench_pinocchio.cpp", work / name, [*options, *headers], [], arm)


def measure(tool, source, binary, options, arguments, text=None):
    """Compiles and runs one program and reports its lines."""
    try:
        build(source, binary, options)
        ran = subprocess.run([binary, *arguments], input=text, text=True, capture_output=True, check=True, timeout=RUN_S)
        report(tool, ran.stdout)
    except subprocess.TimeoutExpired as late:
        print(f"{tool} is left out: {late.cmd[0]} took more than {late.timeout:.0f} s", file=sys.stderr)


def build(source, binary, options):
    if binary.exists() and binary.stat().st_mtime > source.stat().st_mtime:
        return
    # under another name first: a compiler that was stopped leaves nothing that looks finished
    part = binary.with_suffix(".part")
    command = ["g++", "-std=c++17", "-O3", "-DNDEBUG", source, *options, "-o", part]
    subprocess.run(command, check=True, timeout=COMPILE_S)
    part.rename(binary)


def report(tool, text):
    for line in text.splitlines():
        name, ns = line.split()
        print(f"{tool} {name} {ns}", flush=True)


def from_python():
    model = pin.buildModelFromUrdf(str(URDF))
    data = model.createData()
    q, v, a = (np.random.default_rng(1).uniform(-1, 1, 7) for _ in range(3))
    mj = mujoco_model(URDF)
    mj_data = mujoco.MjData(mj)
    for tool, name, call in (
        ("pinocchio-python", "fk", lambda: pin.framesForwardKinematics(model, data, q)),
        ("pinocchio-python", "rnea", lambda: pin.rnea(model, data, q, v, a)),
        ("pinocchio-python", "crba", lambda: pin.crba(model, data, q)),
        ("pinocchio-python", "aba", lambda: pin.aba(model, data, q, v, a)),
        ("mujoco-python", "plant_step", lambda: mujoco.mj_step(mj, mj_data)),
    ):
        start = time.perf_counter_ns()
        for _ in range(20000):
            call()
        report(tool, f"{name} {(time.perf_counter_ns() - start) / 20000:.1f}")


if __name__ == "__main__":
    if shutil.which("g++"):
        work = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "bench-outside"
        work.mkdir(parents=True, exist_ok=True)
        compiled(work)
    else:
        from_python()
