#!/usr/bin/env bash
# pybullet 3.2.7: loadMJCF takes mass and centre from <inertial>, but computes the moments of inertia from the geoms.
#
# A user would guess: <inertial mass diaginertia> of an MJCF file gives mass and inertia, as in MuJoCo, and the flag
#   URDF_USE_INERTIA_FROM_FILE makes sure of it.
# What happens: the inertia is that of the bounding box of the body's geoms filled with the mass, without a warning. A rod of
#   0.4 kg m^2 with a small ball as foot gets 0.0033 kg m^2, and a body with a long visual capsule gets too much. With
#   URDF_USE_INERTIA_FROM_FILE the inertia is zero. Swings and impacts are then those of another body.
# Remedy: p.changeDynamics(body, link, localInertiaDiagonal=[...]) for every link after loading.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q pybullet==3.2.7 mujoco==4.0.0 numpy==2.2.6
cat > rod.xml <<'EOF'
<mujoco model="rod">
  <compiler angle="radian"/>
  <worldbody>
    <body name="rod" pos="0 0 1">
      <joint name="hinge" type="hinge" axis="0 1 0"/>
      <inertial pos="0 0 -0.3" mass="2" diaginertia="0.4 0.4 0.1"/>
      <geom name="foot" type="sphere" size="0.05" pos="0 0 -0.5"/>
    </body>
  </worldbody>
</mujoco>
EOF
cat > load.py <<'EOF'
import importlib.metadata

import mujoco
import pybullet as p

body = mujoco.MjModel.from_xml_path("rod.xml").body("rod")
print(f"expected, as in MuJoCo {mujoco.__version__}: mass {body.mass[0]} kg, inertia {body.inertia.tolist()} kg m^2")
p.connect(p.DIRECT)
version = importlib.metadata.version("pybullet")
found = {}
for name, flags in (("default flags", 0), ("URDF_USE_INERTIA_FROM_FILE", p.URDF_USE_INERTIA_FROM_FILE)):
    (loaded,) = p.loadMJCF("rod.xml", flags=flags)
    links = [p.getDynamicsInfo(loaded, link) for link in range(-1, p.getNumJoints(loaded))]
    (rod,) = [link for link in links if link[0] > 0]
    found[name] = rod[2]
    print(f"actual, pybullet {version}, {name}: mass {rod[0]} kg, inertia {list(rod[2])} kg m^2")
    assert rod[0] == 2.0
assert all(abs(value - 2 * 2 * 0.1**2 / 12) < 1e-6 for value in found["default flags"]), "behaviour has changed"
assert found["URDF_USE_INERTIA_FROM_FILE"] == (0.0, 0.0, 0.0), "behaviour has changed"
EOF
venv/bin/python load.py
