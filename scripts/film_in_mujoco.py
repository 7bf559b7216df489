"""Film the paper's walker in MuJoCo: write the angles of both legs as a camera at 120 Hz would give them.

Usage: python scripts/film_in_mujoco.py [FILE, film.csv by default]

MuJoCo steps the exported model with its own contact. The film begins within a step, its clock is fast by 0.2 %, and its
angles, in degrees, have errors of 0.15 degrees. MuJoCo 4.0 made docs/downloads/film.csv.
"""

import math
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np

import walkerlab

SLOPE_RAD, STRIDES, SECONDS = 0.0174, 5, 7.0
RATE_HZ, LATE_S, CLOCK_RATE, ERROR_DEG = 120.0, 0.25, 1.002, 0.15


def film():
    """Return time (frames,) in s and angles (frames, 2) in rad, beginning with the leg that swings first."""
    with tempfile.TemporaryDirectory() as folder:
        path, *_ = walkerlab.export_model(Path(folder) / "paper.xml", slope_rad=SLOPE_RAD, strides=STRIDES)
        model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    rows = []
    while data.time < SECONDS:
        mujoco.mj_step(model, data)
        turn, hip = data.joint("turn").qpos[0], data.joint("hip").qpos[0]
        rows.append((data.time, turn + hip - SLOPE_RAD, turn - SLOPE_RAD))
    time, *angles = np.array(rows).T
    frames = np.arange(LATE_S, SECONDS, 1.0 / RATE_HZ / CLOCK_RATE)
    return frames, np.column_stack([np.interp(frames, time, angle) for angle in angles])


def main(file):
    frames, angles = film()
    measured = np.degrees(angles) + np.random.default_rng(0).normal(0.0, ERROR_DEG, angles.shape)
    clock = (frames - frames[0]) * CLOCK_RATE
    rows = (f"{time:.4f},{first:.3f},{second:.3f}" for time, (first, second) in zip(clock, measured, strict=True))
    file.write_text("\n".join(("time (s),angle 1 (deg),angle 2 (deg)", *rows)) + "\n")
    print(f"{file}: {clock.size} frames over {clock[-1]:.2f} s; the slope is {math.degrees(SLOPE_RAD):.4f} deg")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "film.csv"))
