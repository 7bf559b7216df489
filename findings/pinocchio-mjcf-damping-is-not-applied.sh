#!/usr/bin/env bash
# Pinocchio 4.1.0 reads damping and dry friction of joints into the model, and computes motion without them.
#
# What one would guess: the MJCF parser stores a joint's damping and frictionloss in model.damping and
# model.friction, next to model.armature, so that aba, the forward dynamics, uses all three. It does use armature.
# What happens: `aba`, `rnea` and their derivatives leave damping and friction out. The gravity of the file is not read, so
# a slope that is written as tilted gravity becomes level ground, and a joint's stiffness is dropped. Nothing is printed.
# A walker with a damped hip walks undamped: its energy, its speed and its eigenvalues are those of another one.
# Instead: tau = -model.damping * v - stiffness * (q - springref) as torque to aba, and model.gravity.linear set by hand.
# Versions: pin 4.1.0, mujoco 4.0.0, November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check pin==4.1.0 mujoco==4.0.0 numpy==2.4.6
cat > hip.py <<'EOF'
import mujoco
import numpy as np
import pinocchio as pin

MODEL = """<mujoco><compiler angle="radian"/><option gravity="{gravity}"/><worldbody><body name="leg">
<joint name="hip" axis="0 1 0" {joint}/><inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/>
</body></worldbody></mujoco>"""
LEVEL = "0 0 -9.81"
ANGLE = np.array([0.3])
SPEED = np.array([2.0])


def accelerations(joint, gravity):
    text = MODEL.format(joint=joint, gravity=gravity)
    with open("leg.xml", "w") as file:
        file.write(text)
    expected = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(expected)
    data.qpos[:] = ANGLE
    data.qvel[:] = SPEED
    mujoco.mj_forward(expected, data)
    model = pin.buildModelFromMJCF("leg.xml")
    return data.qacc[0], pin.aba(model, model.createData(), ANGLE, SPEED, np.zeros(1))[0], model


print(f"pin {pin.__version__}, mujoco {mujoco.__version__}: acceleration of the hip in rad/s^2")
plain = accelerations("", LEVEL)[1]
for name, joint, gravity in (
    ("nothing", "", LEVEL),
    ("armature", 'armature="0.5"', LEVEL),
    ("damping", 'damping="0.4"', LEVEL),
    ("frictionloss", 'frictionloss="0.4"', LEVEL),
    ("stiffness", 'stiffness="3"', LEVEL),
    ("gravity", "", "1 0 -9.76"),
):
    expected, actual, model = accelerations(joint, gravity)
    print(f"{name:13s} expected, as in MuJoCo {expected:7.3f}, Pinocchio {actual:7.3f}", end="")
    print(f"   (model.damping {model.damping.tolist()}, friction {model.friction.tolist()})")
    is_applied = name in ("nothing", "armature")
    assert np.isclose(expected, actual, atol=1e-6) == is_applied, "behaviour has changed"
    assert is_applied or np.isclose(actual, plain), "behaviour has changed"
assert accelerations('damping="0.4"', LEVEL)[2].damping[0] == 0.4, "behaviour has changed"
assert accelerations('frictionloss="0.4"', LEVEL)[2].friction[0] == 0.4, "behaviour has changed"
EOF
venv/bin/python hip.py
