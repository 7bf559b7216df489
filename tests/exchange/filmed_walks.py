"""Recordings of a walk of the built-in compass by films, sensors and markers."""

import functools
import math

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import walkerlab

PERIOD_S, LENGTH_M = 0.7035968805, 0.3714302
SLOPE = 0.0174
LEGS = {"angle 1": "HIP>FOOT1", "angle 2": "HIP>FOOT2"}


@functools.cache
def splines():
    """Return the walk of the paper's compass as a spline through the leg angles of each step."""
    trajectory = walkerlab.simulate(strides=4).content["trajectory"]
    pieces = []
    for step in range(8):
        rows = trajectory["step"] == step
        time = trajectory["time"][rows]
        pieces.append((time, CubicHermiteSpline(time, trajectory["angle"][rows], trajectory["velocity"][rows])))
    return pieces


def angles_at(time):
    """Return the leg angles (samples, 2) of the same walk, with the first heel strike at time 0."""
    angle = np.empty((time.size, 2))
    for instants, spline in splines():
        rows = (time >= instants[0]) & (time <= instants[-1])
        angle[rows] = spline(time[rows])
    return angle


def sampled(begin=0.0, end=7.5 * PERIOD_S, fps=100.0, noise=0.0, seed=0):
    time = np.arange(begin, end, 1.0 / fps)
    return time, angles_at(time) + noise * np.random.default_rng(seed).standard_normal((time.size, 2))


def read(folder, time, angle, header="time (s),angle 1 (rad),angle 2 (rad)", **options):
    rows = "\n".join(f"{t:.9f},{a:.12g},{b:.12g}" for t, (a, b) in zip(time, angle, strict=True))
    path = folder / "walk.csv"
    path.write_text(f"{header}\n{rows}\n", encoding="utf-8")
    return walkerlab.read_walk(path, slope_deg=math.degrees(SLOPE), **options).summary


def all_steps_are_right(summary, period=1e-5, length=1e-5):
    return summary["step_periods_s"] == pytest.approx([PERIOD_S] * summary["steps"], abs=period) and summary[
        "step_lengths_m"
    ] == pytest.approx([LENGTH_M] * summary["steps"], abs=length)


def places_of(angle, belt_m_s=0.0, fps=100.0):
    """Return positions (samples, marker, axis) of hip and feet in m: x along the slope, y up, z sideways. The hip
    sways.
    """
    time = np.arange(len(angle)) / fps
    stride = np.arange(len(angle)) / fps / PERIOD_S
    from_hip = np.stack([np.sin(angle), -np.cos(angle), np.broadcast_to([0.1, -0.1], angle.shape)], axis=2)
    stance = np.where(np.floor(stride) % 2 == 0, 1, 0)
    foothold = np.floor(stride) * LENGTH_M * np.cos(SLOPE), -np.floor(stride) * LENGTH_M * np.sin(SLOPE)
    rows = np.arange(len(angle))
    hip = np.zeros((len(angle), 3))
    hip[:, 0] = foothold[0] - from_hip[rows, stance, 0] - belt_m_s * time
    hip[:, 1] = foothold[1] - from_hip[rows, stance, 1]
    feet = hip[:, None] + from_hip
    sway = 0.03 * np.sin(math.pi * stride)
    return np.concatenate((hip[:, None] + sway[:, None, None] * [0.0, 0.0, 1.0], feet), axis=1)


def read_places(folder, places, fps=100.0, **options):
    """Read a .trc file of the markers HIP, FOOT1 and FOOT2 (mm)."""
    names = ("HIP", "FOOT1", "FOOT2")
    rows = [
        "\t".join([str(n + 1), f"{n / fps:.6f}", *(f"{value:.6f}" for value in 1e3 * row.ravel())])
        for n, row in enumerate(places)
    ]
    head = [
        "PathFileType\t4\t(X/Y/Z)\twalk.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{fps}\t{fps}\t{len(rows)}\t3\tmm\t{fps}\t1\t{len(rows)}",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{n}" for n in (1, 2, 3) for axis in "XYZ"),
        "",
    ]
    path = folder / "walk.trc"
    path.write_text("\n".join([*head, *rows]), encoding="utf-8")
    return walkerlab.read_walk(path, **{"columns": LEGS, "slope_deg": math.degrees(SLOPE), **options}).summary
