#!/usr/bin/env bash
# MuJoCo 4.0.0: equal feet of one walker are a soft and a hard spring, and a body that may turn is a harder one.
#
# A user would guess: solref = (-stiffness, -damping) is per unit of the mass that rests on the contact, so feet with
#   equal solref rest equally deep under equal loads. The documentation speaks of mass-normalised units.
# What happens: the contact is scaled by `body_invweight0` of the foot's body, trace(J M^-1 J^T) / 3 at its centre of
#   mass in the pose qpos0. It counts directions in which the body cannot move, and depends on the body's place in the
#   chain. Of two equal legs with a hip mass on one of them, one rests at 78 % and one at 167 % of the depth of a free ball
#   of the same total mass. A ball on two slides has 1/m; with a hinge added, about which it never turns, 2/(3 m).
# Remedy: multiply both values of solref by body_invweight0 of the foot's body times the mass that it carries, or set the
#   flag `diagexact` (3.10 and later) and measure again.
# Source: engine_setconst.c (set0) and engine_core_constraint.c (diagonal approximation) of MuJoCo.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q mujoco==4.0.0 numpy==2.2.6
cat > rest.py <<'EOF'
import mujoco
import numpy as np

D, STIFFNESS, DAMPING, G = 0.1, 150_000.0, 2_900.0, 9.81
FOOT = (
    f'<geom type="sphere" size="0.01" pos="0 0 {{z}}" solref="{-STIFFNESS} {-DAMPING}" solimp="{D} {D} 1 0.5 1" priority="1"/>'
)
INERTIAL = '<inertial pos="0 0 {z}" mass="{m}" diaginertia="{i} {i} {i}"/>'
SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>'
TURN = '<joint type="hinge" axis="0 1 0"/>'
FREE_BALL = f'<body><freejoint/>{INERTIAL.format(z=0, m=20, i=1)}{FOOT.format(z=0)}</body>'
SLIDING_BALL = f'<body>{SLIDES}{INERTIAL.format(z=0, m=20, i=1)}{FOOT.format(z=0)}</body>'
PLANAR_BALL = f'<body>{SLIDES}{TURN}{INERTIAL.format(z=0, m=20, i=1)}{FOOT.format(z=0)}</body>'


def walker(first, second):
    """Two legs of 5 kg at half their length of 1 m, with 10 kg at the hip on the first; both hang straight."""
    hip = INERTIAL.format(z=-1 / 6, m=15, i=5 / 6)
    leg = INERTIAL.format(z=-0.5, m=5, i=1e-9)
    return f'<body>{SLIDES}{TURN}{hip}{first}<body>{TURN}{leg}{second}</body></body>'


def depth(body, foot_z):
    """Depth (m) at which the contact carries the weight of 20 kg, while the joints are held."""
    xml = f'<mujoco><option gravity="0 0 {-G}"/><worldbody><geom type="plane" size="0 0 1"/>{body}</worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    ball = next(geom for geom in range(model.ngeom) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE)
    vertical = 2 if model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE else 1

    def force(penetration):
        data.qpos[vertical] = 0.01 - foot_z - penetration
        data.qfrc_applied[:] = 0.0
        mujoco.mj_forward(model, data)
        lever = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, lever, None, data.geom_xpos[ball], model.geom_bodyid[ball])
        data.qfrc_applied[:] = data.qfrc_bias - 20 * G * lever[2]
        mujoco.mj_forward(model, data)
        result = np.zeros(6)
        mujoco.mj_contactForce(model, data, 0, result)
        return result[0]

    low, high = 1e-7, 1e-3
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if force(middle) < 20 * G else (low, middle)
    return high, model.body_invweight0[model.geom_bodyid[ball], 0]


expected = (1 - D) * G / STIFFNESS
cases = {
    "free ball of 20 kg": (FREE_BALL, 0.0, 1.0),
    "the same ball on two slides": (SLIDING_BALL, 0.0, 1.0),
    "the same ball on two slides and a hinge": (PLANAR_BALL, 0.0, 2 / 3),
    "walker of 20 kg on the leg with the hip's mass": (walker(FOOT.format(z=-1), ""), -1.0, 7 / 9),
    "walker of 20 kg on the other leg": (walker("", FOOT.format(z=-1)), -1.0, 5 / 3),
}
print(f"MuJoCo {mujoco.__version__}; solref {-STIFFNESS} {-DAMPING}, solimp d = {D}")
print(f"expected everywhere: a depth at rest of (1 - d) g / K = {expected:.4e} m")
for name, (body, foot_z, ratio) in cases.items():
    rest, weight = depth(body, foot_z)
    print(f"actual: {rest:.4e} m = {rest / expected:.4f} of it, invweight0 {weight:.5f} 1/kg: {name}")
    assert abs(rest / expected / ratio - 1) < 1e-4, f"behaviour has changed: {name}"
EOF
venv/bin/python rest.py
