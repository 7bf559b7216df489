#!/usr/bin/env bash
# A URDF link without <inertial> weighs 0, 1 or 10 kg: four programs, four bodies.
#
# What one would guess: a link without <inertial> has no mass, as the URDF specification says ("defaults to a zero mass and
# zero inertia"), or a program that needs a mass refuses the file. A shape for collisions does not change the mass.
# What happens, for a leg of 1 m with a box as collision shape, hung on a hinge:
#   Pinocchio   0 kg; the acceleration of the hinge is nan, without a warning
#   MuJoCo     10 kg, from the collision shape with the density of water, without a warning
#   pybullet    1 kg, spread over the collision shape's box; it prints 'using mass=1, localinertiadiagonal = 1,1,1',
#               which is not the inertia that it then uses
#   DART        1 kg, 1 kg m^2 about each axis, with its centre of mass on the hinge, without a warning
# So the leg hangs, swings or does nothing. Drake 1.51.1 refuses the first step.
# Instead: write <inertial> in every link that moves.
# Versions: pin 4.1.0, mujoco 4.0.0, pybullet 3.2.7, dartpy 6.20.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check pin==4.1.0 mujoco==4.0.0 pybullet==3.2.7 dartpy==6.20.0 numpy==2.4.6
cat > leg.urdf <<'EOF'
<robot name="walker">
<link name="hip"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="leg"><collision><origin xyz="0 0 -0.5"/><geometry><box size="0.1 0.1 1"/></geometry></collision></link>
<joint name="hinge" type="continuous"><parent link="hip"/><child link="leg"/><axis xyz="0 1 0"/></joint>
</robot>
EOF
cat > weigh.py <<'EOF'
import os

import dartpy as dart
import mujoco
import numpy as np
import pinocchio as pin
import pybullet as p

found = {}
model = pin.buildModelFromUrdf("leg.urdf")
acceleration = pin.aba(model, model.createData(), pin.neutral(model), np.zeros(1), np.ones(1))
found["Pinocchio"] = (model.inertias[1].mass, model.inertias[1].inertia[1, 1], model.inertias[1].lever[2])
model = mujoco.MjModel.from_xml_path("leg.urdf")
leg = model.body("leg")
found["MuJoCo"] = (leg.mass[0], leg.inertia[1], leg.ipos[2])
p.connect(p.DIRECT)
mass, _, inertia, centre = p.getDynamicsInfo(p.loadURDF("leg.urdf", useFixedBase=True), 0)[:4]
found["pybullet"] = (mass, inertia[1], centre[2])
inertia = dart.utils.DartLoader().parseSkeleton(os.path.abspath("leg.urdf")).getBodyNode("leg").getInertia()
found["DART"] = (inertia.getMass(), inertia.getMoment()[1, 1], inertia.getLocalCOM()[2])
print("expected: one body in all programs, of 0 kg, or an error")
for name, (mass, inertia, centre) in found.items():
    print(f"{name:9s} mass {mass:6.3f} kg, inertia about y {inertia:.4f} kg m^2, centre of mass at z = {centre:.2f} m")
print("Pinocchio's acceleration of the hinge at a torque of 1 N m:", acceleration)
EXPECTED = {"Pinocchio": (0, 0, 0), "MuJoCo": (10, 10 * 1.01 / 12, -0.5), "pybullet": (1, 0.0845, 0), "DART": (1, 1, 0)}
for name, values in EXPECTED.items():
    assert np.allclose(found[name], values, atol=2e-3), f"behaviour of {name} has changed"
assert np.isnan(acceleration).all(), "behaviour has changed"
EOF
venv/bin/python weigh.py
