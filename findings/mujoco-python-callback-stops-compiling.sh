#!/usr/bin/env bash
# MuJoCo 4.0.0: while a control callback in Python is set, no model can be compiled.
#
# A user would guess: mujoco.set_mjcb_control(f) concerns steps of the simulation. A second model can be loaded meanwhile,
#   as a notebook does that compares two models, or that runs its cell again.
# What happens: MjModel.from_xml_string and from_xml_path fail with "engine error: Python exception raised", though f never
#   raises and is not even called. The compiler runs the engine on a model and data of its own, which the bindings cannot
#   hand to a Python function. A passive callback has the same effect.
# Remedy: mujoco.set_mjcb_control(None) before a model is compiled, and set the callback again afterwards.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q mujoco==4.0.0 numpy==2.2.6
cat > compile.py <<'EOF'
import mujoco

PENDULUM = '<mujoco><worldbody><body><joint type="hinge" axis="0 1 0"/><geom size=".1" pos="0 0 -1"/></body></worldbody></mujoco>'
calls = 0


def callback(model, data):
    global calls
    calls += 1


print(f"MuJoCo {mujoco.__version__}; expected: the same model compiles again while a callback is set")
for name, setter in (("control", mujoco.set_mjcb_control), ("passive", mujoco.set_mjcb_passive)):
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    data = mujoco.MjData(model)
    setter(callback)
    mujoco.mj_step(model, data)
    seen = calls
    try:
        mujoco.MjModel.from_xml_string(PENDULUM)
        raise SystemExit("behaviour has changed: it compiles")
    except ValueError as error:
        print(f"actual, with a {name} callback: {error!r}; calls of the callback meanwhile: {calls - seen}")
        assert "Python exception raised" in str(error), "behaviour has changed: another message"
    assert calls == seen, "behaviour has changed: the callback is called"
    setter(None)
    mujoco.MjModel.from_xml_string(PENDULUM)
EOF
venv/bin/python compile.py
