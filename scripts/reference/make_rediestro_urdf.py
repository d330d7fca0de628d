#!/usr/bin/env python3
"""Writes shared/arm/src/robots/rediestro.urdf from the Denavit-Hartenberg table and the surrogate masses below.

Convention per row: Rz(theta) Tz(b) Tx(a) Rx(alpha). Link i lies in the frame that turns with joint i, between that
frame's origin and (a, 0, b): a thin-walled tube along this line, and a solid sphere (the next joint's actuator; for
link 7 force sensor and tool) at its end. Needs Python 3 only:

    python3 scripts/reference/make_rediestro_urdf.py > shared/arm/src/robots/rediestro.urdf
"""
import math

# alpha deg, a mm, b mm
DH = [
    (-58.31, 0.0, 952.29),
    (-20.0289, 231.13, -22.32),
    (105.26, 0.0, 36.34),
    (60.91, 398.84, 0.0),
    (59.88, 0.0, -471.60),
    (-75.47, 135.55, 578.21),
    (0.0, 234.44, -145.07),
]
# Surrogates: tube mass kg, tube radius m, lump mass kg, lump radius m, limit deg, speed rad/s, torque Nm
LINKS = [
    (5.0, 0.08, 9.0, 0.09, 170, 1.5, 250),
    (2.0, 0.06, 8.0, 0.09, 120, 1.5, 250),
    (1.0, 0.06, 6.0, 0.08, 170, 1.5, 180),
    (3.0, 0.05, 4.0, 0.07, 160, 1.8, 180),
    (2.5, 0.045, 3.5, 0.06, 175, 2.0, 80),
    (2.2, 0.04, 2.0, 0.05, 120, 2.5, 40),
    (1.2, 0.035, 1.6, 0.04, 175, 2.5, 40),
]


def n(x):
    """The shortest decimal that reads back as the same double."""
    return repr(x + 0.0)


def body(a, b, tube, rt, lump, rs):
    """Mass, centre of mass and inertia about it of tube and sphere, in the turning frame."""
    end = (a, 0.0, b)
    l2 = a * a + b * b
    u = (a / math.sqrt(l2), 0.0, b / math.sqrt(l2))
    axial, across = tube * rt * rt, tube * (l2 / 12 + rt * rt / 2)
    mass = tube + lump
    com = [(tube * 0.5 + lump) * e / mass for e in end]
    inertia = [[0.0] * 3 for _ in range(3)]
    for m, c in ((tube, [0.5 * e for e in end]), (lump, list(end))):
        d = [c[k] - com[k] for k in range(3)]
        dd = sum(x * x for x in d)
        for i in range(3):
            for j in range(3):
                inertia[i][j] += m * ((dd if i == j else 0.0) - d[i] * d[j])
    for i in range(3):
        for j in range(3):
            same = 1.0 if i == j else 0.0
            inertia[i][j] += across * same + (axial - across) * u[i] * u[j] + 0.4 * lump * rs * rs * same
    return mass, com, inertia


print('<?xml version="1.0"?>')
print("<!-- Written by scripts/reference/make_rediestro_urdf.py: change that, not this. -->")
print("<!-- REDIESTRO, isotropic seven-joint arm. The placement of the joints is the published Denavit-Hartenberg table -->")
print("<!-- (the first offset, 952.29 mm, from memory of the literature). SURROGATE, plausible but not measured, since no -->")
print("<!-- figures are public: all masses, centres of mass, inertias, joint limits, speed limits and torque limits. -->")
print('<robot name="rediestro">')
print('  <link name="base"/>')
for i, ((alpha, a_mm, b_mm), (tube, rt, lump, rs, deg, speed, effort)) in enumerate(zip(DH, LINKS), 1):
    a, b = a_mm / 1000, b_mm / 1000
    mass, com, t = body(a, b, tube, rt, lump, rs)
    if i == 1:
        xyz, rpy = "0 0 0", "0 0 0"
    else:
        pa, pb = DH[i - 2][1] / 1000, DH[i - 2][2] / 1000
        xyz, rpy = f"{n(pa)} 0 {n(pb)}", f"{n(math.radians(DH[i - 2][0]))} 0 0"
    limit = n(math.radians(deg))
    print(f'  <joint name="joint_{i}" type="revolute">')
    print(f'    <origin xyz="{xyz}" rpy="{rpy}"/>')
    print(f'    <parent link="{"base" if i == 1 else f"link_{i - 1}"}"/>')
    print(f'    <child link="link_{i}"/>')
    print('    <axis xyz="0 0 1"/>')
    print(f'    <limit lower="-{limit}" upper="{limit}" velocity="{speed}" effort="{effort}"/>')
    print("  </joint>")
    print(f'  <link name="link_{i}">')
    print("    <inertial>")
    print(f'      <origin xyz="{" ".join(n(c) for c in com)}" rpy="0 0 0"/>')
    print(f'      <mass value="{n(mass)}"/>')
    print(f'      <inertia ixx="{n(t[0][0])}" ixy="{n(t[0][1])}" ixz="{n(t[0][2])}" '
          f'iyy="{n(t[1][1])}" iyz="{n(t[1][2])}" izz="{n(t[2][2])}"/>')
    print("    </inertial>")
    length, pitch = math.hypot(a, b), math.atan2(a, b)
    print("    <visual>")
    print(f'      <origin xyz="{n(a / 2)} 0 {n(b / 2)}" rpy="0 {n(pitch)} 0"/>')
    print(f'      <geometry><cylinder radius="{rt}" length="{n(length)}"/></geometry>')
    print("    </visual>")
    print("    <visual>")
    print(f'      <origin xyz="{n(a)} 0 {n(b)}"/>')
    print(f'      <geometry><sphere radius="{rs}"/></geometry>')
    print("    </visual>")
    print("  </link>")
print('  <joint name="tool_mount" type="fixed">')
print(f'    <origin xyz="{n(DH[6][1] / 1000)} 0 {n(DH[6][2] / 1000)}" rpy="{n(math.radians(DH[6][0]))} 0 0"/>')
print('    <parent link="link_7"/>')
print('    <child link="tool"/>')
print("  </joint>")
print('  <link name="tool"/>')
print("</robot>")
