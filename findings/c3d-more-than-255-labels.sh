#!/usr/bin/env bash
# C3D files with more than 255 markers: the parameter LABELS, and the package c3d, know only the first 255.
#
# What one would guess: `zip(POINT:LABELS, points)` names every marker.
# What happens: a dimension of a parameter is one byte, so writers go on in LABELS2, LABELS3, ... ezc3d 1.7.2 writes these
# and leaves it to the caller to put them together; the package c3d 0.6.0 reads all 300 points of the file, but its
# `point_labels` are 255, so `zip` drops the last 45 markers without a word. As a writer, c3d cannot store them at all.
# Versions: ezc3d 1.7.2, c3d 0.6.0 (PyPI), November 2026.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cd "$folder"
venv/bin/python -W ignore - <<'PYTHON'
import sys
from importlib.metadata import version

import c3d
import ezc3d
import numpy as np

print("ezc3d", version("ezc3d"), "c3d", version("c3d"))
COUNT = 300
content = ezc3d.c3d()
content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
content["parameters"]["POINT"]["LABELS"]["value"] = [f"M{n}" for n in range(COUNT)]
points = np.ones((4, COUNT, 5))
points[0] = np.arange(COUNT)[:, None]
content["data"]["points"] = points
content.write("many.c3d")

back = ezc3d.c3d("many.c3d")
point = back["parameters"]["POINT"]
lengths = {name: len(point[name]["value"]) for name in point if name.startswith("LABELS")}
print("ezc3d: points", back["data"]["points"].shape[1], "labels", lengths)
with open("many.c3d", "rb") as file:
    reader = c3d.Reader(file)
    used, labels = reader.point_used, [label.strip() for label in reader.point_labels]
    _, frame, _ = next(iter(reader.read_frames()))
named = dict(zip(labels, frame))
print("c3d:   points", len(frame), "labels", len(labels), "the last of zip:", labels[-1])
writer = c3d.Writer(point_rate=100.0)
writer.add_frames([(np.zeros((COUNT, 5)), np.zeros((0, 0)))] * 3)
writer.set_point_labels([f"M{n}" for n in range(COUNT)])
try:
    with open("again.c3d", "wb") as file:
        writer.write(file)
    refusal = ""
except Exception as error:
    refusal = f"{type(error).__name__}: {error}"
print("c3d as a writer:", refusal or "wrote the file")
print(f"expected: {COUNT} labels for {COUNT} points from either reader, and a file from either writer")
as_found = lengths == {"LABELS": 255, "LABELS2": 45} and back["data"]["points"].shape[1] == COUNT
as_found &= used == COUNT and len(frame) == COUNT and len(labels) == 255 and "M299" not in named and bool(refusal)
sys.exit(0 if as_found else "the behaviour has changed")
PYTHON
