#!/usr/bin/env bash
# Pinocchio 4.1.0: its MJCF parser takes Euler angles about fixed axes for angles about turning axes, without a word.
#
# What one would guess: eulerseq="XYZ" of <compiler> are rotations about fixed axes and eulerseq="xyz", the default, about
# axes that turn with the body. The case of the letters is all that tells them apart, and Pinocchio reads `eulerseq`.
# What happens: Pinocchio reads the letters, but not their case. A leg that is turned in two directions hangs elsewhere,
# here by 11 degrees, with its mass and joints right. A rotation about one axis shows no difference. Drake 1.51.1 reads both.
# eulerseq="XYZ" is what keeps the rpy angles of a URDF or an SDF file, which are about fixed axes, in MJCF.
# Instead: `quat`, or eulerseq in small letters with the order of the angles reversed.
# Versions: pin 4.1.0, mujoco 4.0.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check pin==4.1.0 mujoco==4.0.0 numpy==2.4.6
cat > turn.py <<'EOF'
import mujoco
import numpy as np
import pinocchio as pin

MODEL = """<mujoco><compiler angle="radian" eulerseq="{order}"/><worldbody><body name="leg" euler="{angles}">
<joint name="hip" axis="0 1 0"/><inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""
print(f"pin {pin.__version__}, mujoco {mujoco.__version__}")
for angles in ("0.5 0.3 0.2", "0 0.3 0"):
    for order in ("XYZ", "xyz"):
        text = MODEL.format(order=order, angles=angles)
        expected = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(expected)
        mujoco.mj_forward(expected, data)
        with open("leg.xml", "w") as file:
            file.write(text)
        model = pin.buildModelFromMJCF("leg.xml")
        actual = model.jointPlacements[1].rotation
        difference = np.degrees(np.linalg.norm(pin.log3(data.xmat[1].reshape(3, 3).T @ actual)))
        print(f"{order}, euler {angles}: Pinocchio's leg is turned by {difference:.1f} degrees from MuJoCo's, expected 0.0")
        is_equal = difference < 1e-4
        assert is_equal == (order == "xyz" or angles == "0 0.3 0"), "behaviour has changed"
EOF
venv/bin/python turn.py
