#!/usr/bin/env bash
# Sports2D turns its coordinates until the floor is level: leg angles of a walk on a ramp are from the floor's normal.
#
# What one would guess: with a level camera the metres in Sports2D's .trc are along the image's axes, so that a plumb
# line is vertical, and the slope of a ramp can be measured in them.
# What happens: with the default `floor_angle = 'auto'` the line through the ankles' slow points is taken for the horizon.
# On a ramp of 3 degrees coordinates are turned by 3 degrees, and a plumb line leans by as much. (Segment angles are
# corrected by the same angle with `correct_segment_angles_with_floor_angle`.) On a treadmill no point of a foot rests:
# feet on a belt below 7 pixels a frame count as resting, the direction of gait is zero but for rounding, and a level
# belt leans by 0.4 degrees.
# `floor_angle = 0` keeps the image's axes.
# Versions: Sports2D 0.8.34 (functions compute_floor_line and convert_px_to_meters in process.py), Pose2Sim 0.10.49.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps sports2d==0.8.34 pose2sim==0.10.49 rtmlib==0.0.16
# only what the import needs: no window toolkit, no pose models
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.2.6 pandas==2.3.3 \
    opencv-python-headless==4.12.0.88 matplotlib==3.11.2 scipy==1.17.1 statsmodels==0.15.0 filterpy==2.0.0 \
    anytree==2.13.0 tqdm==4.70.1 toml==0.10.2 rtoml==0.14.0 av==18.1.0 c3d==0.6.0 lxml==6.1.3 onnxruntime==1.32.0
cd "$folder"
venv/bin/python -W ignore - 2> "$folder/log" <<'PYTHON' || { cat "$folder/log"; exit 1; }
import sys
from importlib.metadata import version

import numpy as np
import pandas as pd
from Sports2D.process import compute_floor_line, convert_px_to_meters

print("sports2d", version("sports2d"), "pose2sim", version("pose2sim"))
FEET = ("LAnkle", "RAnkle")
TIME = np.arange(300) / 60.0  # s, 60 frames/s
SCALE = 300.0  # pixels per m


def film(ramp_deg, belt_m_s):
    """Return the ankles of a walk to the right, as a level camera sees them (y downwards), and their scores."""
    ramp, feet = np.radians(ramp_deg), {}
    for leg, name in enumerate(FEET):
        stride = (TIME / 0.7 + leg) / 2.0
        swing = np.clip(2.0 * (stride - np.floor(stride)) - 1.0, 0.0, 1.0)
        along = 0.8 * (np.floor(stride) + swing) - belt_m_s * TIME
        x = 100.0 + SCALE * along * np.cos(ramp)
        y = 400.0 + SCALE * (along * np.sin(ramp) - 0.05 * np.sin(np.pi * swing))
        feet[name] = pd.DataFrame({"X": x, "Y": y, "Z": 0.0 * x})
    return pd.concat(feet, axis=1), pd.DataFrame({name: np.ones(TIME.size) for name in FEET})


def lean_of_a_plumb_line(floor_angle, origin):
    line = pd.DataFrame([[200.0, 100.0, 0.0], [200.0, 400.0, 0.0]], columns=list("XYZ"))
    line.columns = pd.MultiIndex.from_product([["Hip"], line.columns])
    places = convert_px_to_meters(line, 1.7, 510.0, 10.0, 1000, 1000, 0.0, origin[1], -floor_angle).to_numpy()
    return np.degrees(np.arctan2(*(places[1] - places[0])[:2] * [1.0, -1.0]))


seen = {}
for place, ramp_deg, belt_m_s in (("floor", 0.0, 0.0), ("ramp", 3.0, 0.0), ("treadmill", 0.0, 0.8 / 1.4)):
    angle, origin, direction = compute_floor_line(*film(ramp_deg, belt_m_s), FEET)
    seen[place] = np.degrees(angle), lean_of_a_plumb_line(angle, origin), direction
    print(f"{place} of {ramp_deg:g} degrees: floor {seen[place][0]:.2f}, plumb line {seen[place][1]:.2f} degrees, "
          f"direction {direction:.2g} (expected: plumb line 0, direction 1)")
as_described = (
    abs(seen["floor"][1]) < 0.1
    and abs(seen["ramp"][1] - 3.0) < 0.1
    and seen["floor"][2] > 0.9
    and abs(seen["treadmill"][2]) < 1e-6
    and 0.2 < abs(seen["treadmill"][1]) < 1.0
)
sys.exit(0 if as_described else "The behaviour has changed.")
PYTHON
echo "As described."
