#!/usr/bin/env bash
# A planar joint of a URDF lies in three planes in four programs, because Pinocchio and pybullet do not read its <axis>.
#
# What one would guess: the axis of a planar joint is the normal of its plane, as the URDF specification says. With the
# axis (0, 1, 0), a walker moves in the sagittal plane x-z and falls freely if nothing carries it.
# What happens: MuJoCo and DART do that. In Pinocchio the plane is always x-y of the joint's frame: the walker slides over
# the ground, turns about the vertical, and gravity does nothing to it. In pybullet the plane is always y-z: the walker
# falls, but moves sideways instead of forwards. Neither prints a word.
# Instead: two prismatic joints and a continuous one, which all read alike.
# Versions: pin 4.1.0, pybullet 3.2.7, mujoco 4.0.0, dartpy 6.20.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check pin==4.1.0 pybullet==3.2.7 mujoco==4.0.0 dartpy==6.20.0 numpy==2.4.6
cat > plane.py <<'EOF'
"""Find the directions in which a body on a planar joint can move, in four programs."""

import os

import dartpy as dart
import mujoco
import numpy as np
import pinocchio as pin
import pybullet as p

INERTIA = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
MODEL = f"""<robot name="walker"><link name="ground">{INERTIA}</link><link name="leg">{INERTIA}</link>
<joint name="root" type="planar"><parent link="ground"/><child link="leg"/><axis xyz="AXIS"/></joint></robot>"""


def in_mujoco():
    model = mujoco.MjModel.from_xml_path("walker.urdf")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacBody(model, data, jacobian, None, 1)
    return np.abs(jacobian).sum(axis=1) > 1e-6


def in_dart():
    walker = dart.utils.DartLoader().parseSkeleton(os.path.abspath("walker.urdf"))
    of_joint = walker.getWorldJacobian(walker.getBodyNode("leg"))[3:, 6:]
    return np.abs(of_joint).sum(axis=1) > 1e-6


def in_pinocchio():
    model = pin.buildModelFromUrdf("walker.urdf")
    jacobian = pin.computeJointJacobians(model, model.createData(), pin.neutral(model))[:3]
    return np.abs(jacobian).sum(axis=1) > 1e-6


def in_pybullet():
    moves = []
    for direction in range(3):
        p.resetSimulation()
        p.setGravity(*(10.0 * np.eye(3)[direction]))
        walker = p.loadURDF("walker.urdf", useFixedBase=True)
        for _ in range(50):
            p.stepSimulation()
        moves.append(abs(p.getLinkState(walker, 0)[0][direction]) > 1e-6)
    return np.array(moves)


p.connect(p.DIRECT)
PROGRAMS = {"MuJoCo": in_mujoco, "DART": in_dart, "Pinocchio": in_pinocchio, "pybullet": in_pybullet}
IGNORES_AXIS = {"Pinocchio": "xy", "pybullet": "yz"}
for axis, expected in (("1 0 0", "yz"), ("0 1 0", "xz"), ("0 0 1", "xy")):
    with open("walker.urdf", "w") as file:
        file.write(MODEL.replace("AXIS", axis))
    for name, directions in PROGRAMS.items():
        plane = "".join(np.array(["x", "y", "z"])[directions()])
        print(f"axis {axis}: expected plane {expected}, {name:9s} {plane}")
        assert plane == IGNORES_AXIS.get(name, expected), "behaviour has changed"
EOF
venv/bin/python plane.py
