#!/usr/bin/env bash
# C3D recordings of more than 65,535 frames, 4.5 minutes at 240 frames/s: ezc3d writes them whole and reads back a part of them.
#
# What one would guess: a writer that takes 70,000 frames without a word gives a file that it can read, or a reader goes on to the
# end of the data. A file of 65,535 frames, the most that the format's 16-bit counter can hold, is an ordinary one.
# What happens:
#   70,000 frames  all are in the file of ezc3d, but its header and POINT:FRAMES say 65,535. ezc3d returns the first 65,535
#                  without a warning: a walk simply ends 19 s early
#   65,535 frames  whole in ezc3d, *empty* in the package c3d, whose 16-bit number of the last frame overflows to 0. It warns of
#                  an incomplete reading, and the loop over frames ends before the first
#   65,534 frames  whole in both
# Instead: write parts of at most 65,534 frames, or lower the rate.
# Versions: ezc3d 1.7.2, c3d 0.6.0, numpy 2.4.6, November 2026. Source: issues 308 and 372 of ezc3d. Vicon stores 65,535 for
# longer recordings, too. ezc3d went on to the end of the file until rotations could stand there.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q --disable-pip-version-check ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cat > frames.py <<'EOF'
import warnings
from importlib.metadata import version

import c3d
import ezc3d
import numpy as np

warnings.simplefilter("ignore")
RATE = 240.0


def write(frames):
    """Write a marker whose x counts the frames."""
    recording = ezc3d.c3d()
    recording["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    recording["parameters"]["POINT"]["LABELS"]["value"] = ("hip",)
    points = np.zeros((4, 1, frames))
    points[0, 0] = np.arange(frames)
    recording["data"]["points"] = points
    recording.write("walk.c3d")


def frames_stored():
    """Return how many frames follow one another in the bytes of the file."""
    content = open("walk.c3d", "rb").read()
    first_block = int.from_bytes(content[16:18], "little")
    values = np.frombuffer(content[512 * (first_block - 1) :], dtype="<f4")
    x = values[: 4 * (len(values) // 4)].reshape(-1, 4)[:, 0]
    return int(x.max()) + 1


print({name: version(name) for name in ("ezc3d", "c3d", "numpy")})
EXPECTED = {65_534: (65_534, 65_534), 65_535: (65_535, 0), 70_000: (65_535, 0)}
for frames, (with_ezc3d, with_c3d) in EXPECTED.items():
    write(frames)
    points = ezc3d.c3d("walk.c3d")["data"]["points"]
    read_by_c3d = sum(1 for _ in c3d.Reader(open("walk.c3d", "rb")).read_frames())
    print(
        f"written {frames}, in the file {frames_stored()}; read by ezc3d {points.shape[2]} "
        f"({points.shape[2] / RATE:.1f} of {frames / RATE:.1f} s), c3d {read_by_c3d}"
    )
    assert frames_stored() == frames, "behaviour has changed"
    assert points.shape[2] == with_ezc3d, "behaviour has changed"
    assert read_by_c3d == with_c3d, "behaviour has changed"
EOF
venv/bin/python frames.py
