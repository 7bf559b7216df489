#!/usr/bin/env bash
# MuJoCo 4.0.0: a foot that slides is pushed off the ground by its damper, and only a contact pair can prevent it.
#
# A user would guess: solref = (-stiffness, -damping) gives a contact a normal force of spring and damper. A sphere that
#   slides at constant depth gets the spring's force, whatever its speed; friction is mu times that.
# What happens: with the elliptic cone, a sphere that slides at v at constant depth has a normal force of
#   (N + mu c v) / (1 + mu^2 / impratio): spring force N, and c the damper of solref, though nothing moves along the normal.
#   At 0.5 m/s it is 59 times the spring's force here. The damper also acts on the slip, and the force is projected on
#   the cone along its metric. A larger impratio makes it worse. A heel strike with slip, such as a walker's, bounces.
# Remedy: an explicit <pair> with its own small damper in friction (solreffriction="0 -b"), and an impratio larger by the
#   same factor. A geom has no solreffriction.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q mujoco==4.0.0 numpy==2.2.6
cat > slide.py <<'EOF'
import mujoco
import numpy as np

MU, K, C, DEPTH, D = 0.7, 2.0e5, 5.0e3, 1e-4, 1e-4


def force(speed, impratio, pair=""):
    """Normal force (N) of a sphere of 1 kg that is held at DEPTH and slides."""
    contact = f'condim="3" solref="{-K} {-C}" solimp="{D} {D} 1 .5 1"'
    own = "" if pair else f'{contact} friction="{MU} 0 0" priority="1"'
    bits = 'contype="0" conaffinity="0"' if pair else ""
    listed = f'<contact><pair geom1="foot" geom2="floor" {contact} friction="{MU} {MU} 0 0 0" {pair}/></contact>'
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <option cone="elliptic" impratio="{impratio}" gravity="0 0 0" tolerance="1e-14"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" {bits}/>
    <body pos="0 0 .1">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <geom name="foot" type="sphere" size=".1" mass="1" {own} {bits}/>
    </body>
  </worldbody>
  {listed if pair else ""}
</mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[1], data.qvel[0] = -DEPTH, speed
    mujoco.mj_forward(model, data)
    result = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, result)
    return result[0]


spring = force(0.0, 1.0)
print(f"MuJoCo {mujoco.__version__}; expected at every speed: {spring:.2f} N")
for speed in (0.1, 0.5):
    for impratio in (1.0, 10.0):
        found, formula = force(speed, impratio), (spring + MU * C * speed) / (1.0 + MU**2 / impratio)
        print(f"actual at {speed} m/s, impratio {impratio:g}: {found:.2f} N; by the formula {formula:.2f} N")
        assert abs(found / formula - 1.0) < 0.02, "behaviour has changed"
pair = force(0.5, 1000.0, f'solreffriction="0 {-C / 1000.0}"')
print(f"with a pair, its damper in friction 1000 times smaller and impratio 1000: {pair:.2f} N")
assert abs(pair / spring - 1.0) < 0.2, "behaviour has changed: the remedy"
EOF
venv/bin/python slide.py
