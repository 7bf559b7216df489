#!/usr/bin/env bash
# A marker that was not seen: nan from ezc3d, the origin or an invented place from the package c3d.
#
# What one would guess: readers of one format agree on where a marker was, or that it was not seen.
# What happens: the format marks a gap by a negative residual, and some writers store nan. ezc3d 1.7.2 gives nan for
# both. The package c3d 0.6.0 gives the stored coordinates for a negative residual, and (0, 0, 0) for a stored nan; only
# the fourth number, -1, tells. Code that takes the first three sees a foot at the origin, or frozen where it was lost.
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


def read(path):
    with open(path, "rb") as file:
        frames = [points[0, :4].tolist() for _, points, _ in c3d.Reader(file).read_frames()]
    return ezc3d.c3d(path)["data"]["points"][:3, 0].T.tolist(), frames


# nan in the third of five frames, written by ezc3d
content = ezc3d.c3d()
content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
content["parameters"]["POINT"]["LABELS"]["value"] = ["FOOT"]
points = np.ones((4, 1, 5))
points[:3, 0] = np.array([[10.0, 20.0, 30.0]]).T
points[:3, 0, 2] = np.nan
content["data"]["points"] = points
content.write("nan.c3d")

# a residual of -1 in the third of five frames, written by c3d
writer = c3d.Writer(point_rate=100.0)
frames = []
for frame in range(5):
    frames.append((np.array([[10.0, 20.0, 30.0, -1.0 if frame == 2 else 0.0, 0.0]]), np.zeros((0, 0))))
writer.add_frames(frames)
writer.set_point_labels(["FOOT"])
with open("residual.c3d", "wb") as file:
    writer.write(file)

places = {name: read(name) for name in ("nan.c3d", "residual.c3d")}
for name, (by_ezc3d, by_c3d) in places.items():
    print(f"{name:13} frame 3: ezc3d {by_ezc3d[2]}, c3d {by_c3d[2]}")
print("expected: nan, or no place, from both readers for both files")
as_found = all(np.isnan(by_ezc3d[2]).all() for by_ezc3d, _ in places.values())
as_found &= places["nan.c3d"][1][2] == [0.0, 0.0, 0.0, -1.0]
as_found &= places["residual.c3d"][1][2] == [10.0, 20.0, 30.0, -1.0]
sys.exit(0 if as_found else "the behaviour has changed")
PYTHON
