#!/usr/bin/env bash
# Drake 1.51.1: the MJCF parser drops `armature` of a joint without a motor, without a warning; with a motor it counts.
#
# A user would guess: what the parser cannot express it says, as it does for stiffness, frictionloss, contype and
#   keyframe; and the inertia of a joint does not depend on whether a motor acts on it.
# What happens: the same leg has an inertia of 0.51 kg m^2 about its hinge if the joint is passive and 0.61 if a motor acts
#   on it, of which 0.1 is the armature. MuJoCo has 0.61 in both. Passive walkers with joint armature swing too fast.
# Remedy: add a motor that is never used, or raise the inertia of the link.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q drake==1.51.1 mujoco==4.0.0 numpy==2.2.6
cat > mass.py <<'EOF'
import importlib.metadata
import logging

import mujoco
import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

MODEL = """<mujoco model="leg"><compiler angle="radian"/><worldbody><body name="leg">
<joint name="hip" type="hinge" axis="0 1 0" armature="0.1" stiffness="2"/>
<inertial pos="0 0 -0.5" mass="2" diaginertia="0.01 0.01 0.01"/></body></worldbody>{motor}</mujoco>"""
MOTOR = '<actuator><motor name="motor" joint="hip"/></actuator>'


class Messages(logging.Handler):
    texts = []

    def emit(self, record):
        self.texts.append(record.getMessage())


logging.getLogger("drake").addHandler(Messages())
print(f"Drake {importlib.metadata.version('drake')}, MuJoCo {mujoco.__version__}")
inertias = []
for name, motor in (("passive joint", ""), ("joint with a motor", MOTOR)):
    model = mujoco.MjModel.from_xml_string(MODEL.format(motor=motor))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    unit = np.ones((1, 1))
    mujoco.mj_solveM(model, data, inverse := np.zeros((1, 1)), unit)
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(MODEL.format(motor=motor), "xml")
    plant.Finalize()
    inertia = plant.CalcMassMatrix(plant.CreateDefaultContext())[0, 0]
    inertias.append(inertia)
    print(f"{name}: expected, as in MuJoCo, {1 / inverse[0, 0]:.3f} kg m^2; actual in Drake {inertia:.3f} kg m^2")
warned = [text for text in Messages.texts if "armature" in text]
print(f"messages about stiffness: {sum('stiffness' in text for text in Messages.texts)}, about armature: {len(warned)}")
assert np.allclose(inertias, (0.51, 0.61)), "behaviour has changed"
assert not warned, "behaviour has changed: it is said"
assert any("stiffness" in text for text in Messages.texts)
EOF
venv/bin/python mass.py
