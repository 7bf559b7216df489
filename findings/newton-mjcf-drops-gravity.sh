#!/usr/bin/env bash
# Newton 1.8.0: ModelBuilder.add_mjcf ignores the file's gravity, and so turns a slope into level ground, without a word.
#
# A user would guess: <option gravity="1 0 -9"> of an MJCF file, the usual way to write a slope, becomes the model's
#   gravity; masses, inertias and joints of the file do arrive.
# What happens: the gravity is that of the builder, (0, 0, -9.81), in size and direction. The keyframe is dropped, too, so
#   the model starts at qpos0 and at rest. Nothing is printed.
# Remedy: model.set_gravity(...) after finalize(), and joint_q and joint_qd from the keyframe by hand.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q newton==1.8.0 warp-lang==1.19.0 numpy==2.2.6
cat > slope.xml <<'EOF'
<mujoco model="slope">
  <compiler angle="radian"/>
  <option gravity="1 0 -9"/>
  <worldbody>
    <body name="block" pos="0 0 1">
      <joint name="along" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.4 0.4 0.1"/>
      <geom type="sphere" size="0.05"/>
    </body>
  </worldbody>
  <keyframe><key name="start" qpos="0.3" qvel="1"/></keyframe>
</mujoco>
EOF
cat > load.py <<'EOF'
import contextlib
import io
import warnings

import newton
import numpy as np
import warp

warp.config.quiet = True
output = io.StringIO()
with warnings.catch_warnings(record=True) as caught, contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
    warnings.simplefilter("always")
    builder = newton.ModelBuilder()
    builder.add_mjcf("slope.xml")
said = [str(each.message) for each in caught if "gravity" in str(each.message) or "key" in str(each.message)]
said += [line for line in output.getvalue().splitlines() if "gravity" in line or "key" in line]
model = builder.finalize(device="cpu")
gravity, q, qd = (np.ravel(value.numpy()) for value in (model.gravity, model.joint_q, model.joint_qd))
print(f"Newton {newton.__version__}: mass {model.body_mass.numpy().tolist()} kg arrives")
print("expected: gravity [1, 0, -9]; from the keyframe q 0.3, qd 1")
print(f"actual: gravity {gravity.tolist()}, q {q.tolist()}, qd {qd.tolist()}; messages about either: {said}")
assert np.allclose(gravity, (0, 0, -9.81)), "behaviour has changed: gravity"
assert q.tolist() == [0.0], "behaviour has changed: keyframe"
assert not said, "behaviour has changed: it is said"
EOF
venv/bin/python load.py
