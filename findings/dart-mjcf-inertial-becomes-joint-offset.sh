#!/usr/bin/env bash
# DART 6.20.0: its MJCF parser gives every body 1 kg and 1 kg m^2, and moves the joint to the centre of mass.
#
# What one would guess: <inertial pos mass diaginertia> gives a body's mass, inertia and centre of mass, as in MuJoCo.
# What happens: the parser keeps nothing of <inertial> but `pos`, and takes that for the place of the body. A leg of 2 kg
# on a hinge at the origin, with its centre of mass 0.3 m below, becomes 1 kg and 1 kg m^2 on a hinge 0.3 m below the origin
# through its own centre of mass: it does not swing at all. Gravity is (0, 0, -9.81) whatever <option> says, and stiffness
# and armature of a joint are dropped; damping arrives. Nothing is printed.
# Instead: set inertia and joint offsets again after reading, or exchange the model as SDF.
# Versions: dartpy 6.20.0 (utils.MjcfParser), mujoco 4.0.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check dartpy==6.20.0 mujoco==4.0.0 numpy==2.4.6
cat > leg.xml <<'EOF'
<mujoco model="leg">
  <compiler angle="radian"/>
  <option gravity="1 0 -9"/>
  <worldbody>
    <body name="leg">
      <joint name="hinge" type="hinge" axis="0 1 0" stiffness="3" armature="0.5" damping="0.2"/>
      <inertial pos="0 0 -0.3" mass="2" diaginertia="0.4 0.4 0.1"/>
    </body>
  </worldbody>
</mujoco>
EOF
cat > swing.py <<'EOF'
import os
from importlib.metadata import version

import dartpy as dart
import mujoco
import numpy as np

ANGLE = 0.3
model = mujoco.MjModel.from_xml_path("leg.xml")
data = mujoco.MjData(model)
data.qpos[:] = ANGLE
mujoco.mj_forward(model, data)
mujoco.mj_kinematics(model, data)
inertia = 0.4 + 2 * 0.3**2
print(f"MuJoCo {mujoco.__version__}: mass {model.body_mass[1]} kg, gravity {model.opt.gravity.tolist()},")
print(f"    hinge at {data.xanchor[0].tolist()}, acceleration at {ANGLE} rad {data.qacc[0]:.3f} rad/s^2")
torque = 2 * 0.3 * (-1.0 * np.cos(ANGLE) - 9.0 * np.sin(ANGLE)) - 3 * ANGLE
assert np.isclose(data.qacc[0], torque / (inertia + 0.5)), "the expected value"

world = dart.utils.MjcfParser.readWorld(os.path.abspath("leg.xml"))
walker = world.getSkeleton(0)
walker.setPositions([ANGLE])
walker.computeForwardDynamics()
leg = walker.getBodyNode("leg")
moment = leg.getInertia().getMoment()
offset = leg.getParentJoint().getTransformFromParentBodyNode().translation()
centre = leg.getInertia().getLocalCOM()
print(f"DART {version('dartpy')}: mass {leg.getMass()} kg, gravity {world.getGravity().tolist()},")
print(f"    hinge at {offset.tolist()}, acceleration at {ANGLE} rad {walker.getAccelerations()[0]:.3f} rad/s^2,")
print(f"    moments of inertia {np.diag(moment).tolist()}, centre of mass from the hinge {centre.tolist()}")
hinge = walker.getDof(0)
print(f"    stiffness {hinge.getSpringStiffness()} N m/rad, damping {hinge.getDampingCoefficient()} N m s/rad")
assert leg.getMass() == 1.0 and np.array_equal(moment, np.eye(3)), "behaviour has changed"
assert np.allclose(offset, (0, 0, -0.3)) and np.allclose(centre, 0), "behaviour has changed"
assert np.allclose(world.getGravity(), (0, 0, -9.81)), "behaviour has changed"
assert hinge.getSpringStiffness() == 0.0 and hinge.getDampingCoefficient() == 0.2, "behaviour has changed"
assert walker.getAccelerations()[0] == 0.0, "behaviour has changed"
EOF
venv/bin/python swing.py
