#!/usr/bin/env bash
# DART 6.20.0: its MJCF parser gives every body 1 kg m^2 about each axis, and moves a body without `pos` to its centre of mass.
#
# What one would guess: <inertial pos mass diaginertia> gives a body's mass, centre of mass and moments of inertia, as in
# MuJoCo, and a body without `pos` stands at the origin of its parent.
# What happens:
#   moments of inertia   always 1 kg m^2: diaginertia, fullinertia and the shapes of geoms are not read. Legs swing too slowly
#   body without `pos`   stands where <inertial pos> is. The hinge moves with it, and the centre of mass is twice as far down
#   body without geom    weighs 1 kg, with the centre of mass in its origin: a leg of rods without a shape does not swing
#   gravity, stiffness, armature   are dropped; a slope becomes level ground. Damping arrives
# Nothing is printed.
# Instead: `pos` and a geom for every body, then setMoment, gravity and springs by hand.
# Versions: dartpy 6.20.0 (utils.MjcfParser), mujoco 4.0.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check dartpy==6.20.0 mujoco==4.0.0 numpy==2.4.6
cat > swing.py <<'EOF'
import os
from importlib.metadata import version

import dartpy as dart
import mujoco
import numpy as np

ANGLE = 0.3
MODEL = """<mujoco model="leg"><compiler angle="radian"/><option gravity="{gravity}"/><worldbody><body name="leg" {pos}>
<joint name="hinge" type="hinge" axis="0 1 0" {joint}/>
<inertial pos="0 0 -0.3" mass="2" diaginertia="0.4 0.4 0.1"/>{geom}</body></worldbody></mujoco>"""
POS = 'pos="0 0 0"'
GEOM = '<geom type="sphere" size="0.05" pos="0 0 -0.5"/>'
LEVEL = "0 0 -9.81"


def in_mujoco():
    model = mujoco.MjModel.from_xml_path("leg.xml")
    data = mujoco.MjData(model)
    data.qpos[:] = ANGLE
    mujoco.mj_forward(model, data)
    return (model.body_mass[1], model.body_inertia[1, 1], data.xanchor[0, 2], model.body_ipos[1, 2]), data.qacc[0]


def in_dart():
    walker = dart.utils.MjcfParser.readWorld(os.path.abspath("leg.xml")).getSkeleton(0)
    walker.setPositions([ANGLE])
    walker.computeForwardDynamics()
    leg = walker.getBodyNode("leg")
    inertia = leg.getInertia()
    hinge = leg.getParentJoint().getTransformFromParentBodyNode().translation()[2]
    body = (leg.getMass(), inertia.getMoment()[1, 1], hinge, inertia.getLocalCOM()[2])
    return body, walker.getAccelerations()[0]


def swing(mass, moment, centre):
    return mass * 9.81 * centre * np.sin(ANGLE) / (moment + mass * centre**2)


print(f"DART {version('dartpy')}, MuJoCo {mujoco.__version__}")
print(f"mass, moment about y, height of the hinge, centre of mass from the hinge; acceleration at {ANGLE} rad")
for name, pos, geom, joint, gravity, expected in (
    ("with pos and geom", POS, GEOM, "", LEVEL, ((2, 1, 0, -0.3), swing(2, 1, -0.3))),
    ("without pos", "", GEOM, "", LEVEL, ((2, 1, -0.3, -0.3), swing(2, 1, -0.3))),
    ("without pos and geom", "", "", "", LEVEL, ((1, 1, -0.3, 0), 0.0)),
    ("on a slope", POS, GEOM, "", "1 0 -9.76", ((2, 1, 0, -0.3), swing(2, 1, -0.3))),
    ("with a spring", POS, GEOM, 'stiffness="3"', LEVEL, ((2, 1, 0, -0.3), swing(2, 1, -0.3))),
    ("with armature", POS, GEOM, 'armature="0.5"', LEVEL, ((2, 1, 0, -0.3), swing(2, 1, -0.3))),
):
    with open("leg.xml", "w") as file:
        file.write(MODEL.format(pos=pos, geom=geom, joint=joint, gravity=gravity))
    for program, (body, acceleration) in (("MuJoCo", in_mujoco()), ("DART", in_dart())):
        values = " ".join(f"{value:5.2f}" for value in body)
        print(f"{name:20s} {program:6s} {values}; {acceleration:7.3f} rad/s^2", "(expected)" * (program == "MuJoCo"))
    assert np.allclose(in_mujoco()[0], (2, 0.4, 0, -0.3)), "the expected body"
    assert np.allclose(body, expected[0]) and np.isclose(acceleration, expected[1]), "behaviour has changed"
EOF
venv/bin/python swing.py
