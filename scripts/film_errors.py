"""Film a walk with simulated cameras, and print the errors of the periods, step lengths and estimates that are read.

Usage: python scripts/film_errors.py [fit]

The walk is that of the tests' plain integration, which shares no code with the estimation. The camera averages each
frame over half of its time (motion blur), its lens distorts the edge of the picture by 1 %, and each angle has a random
error. With `fit`, slope and hip mass are identified, too, which takes minutes.
"""

import math
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from measured_plain_walk import measure_angles

import walkerlab
from walkerlab.api.memory import run_in_memory
from walkerlab.config.loader import load
from walkerlab.errors import WalkerlabError
from walkerlab.scene.rigid import rigid_walker

CONFIG, STEPS, DENSE_HZ = "slope-3deg", 10, 4800.0
FRAME_RATES, NOISES_DEG = (30.0, 60.0, 120.0, 240.0), (0.1, 0.3, 1.0)
DISTORTION, EXPOSURE, WIDTH_M = 0.01, 0.5, 5.0
"""Relative distortion at the edge of the picture, exposure as a fraction of the time of a frame, and width of the
picture.
"""


def filmed_angles(angle, leg_m, length_m, touches, time):
    """Return the angles (samples, 2) as seen through a lens that distorts the positions of hip and feet."""
    step = np.clip(np.searchsorted(touches, time, "right") - 1, 0, STEPS - 1)
    stance = np.where(step % 2 == 0, 1, 0)
    feet = np.stack((np.sin(angle), -np.cos(angle)), axis=2) * leg_m
    foothold = np.stack((step * length_m - 0.5 * STEPS * length_m, np.zeros(step.size)), axis=1)
    hip = foothold - feet[np.arange(step.size), stance]
    places = [hip, hip + feet[:, 0], hip + feet[:, 1]]
    middle = np.array([0.0, 0.5 * leg_m])
    hip, *feet = (
        middle
        + (each - middle) * (1.0 + DISTORTION * np.sum((each - middle) ** 2, axis=1) / (0.5 * WIDTH_M) ** 2)[:, None]
        for each in places
    )
    return np.stack([np.arctan2(*(foot - hip).T * [[1.0], [-1.0]]) for foot in feet], axis=1)


def film(config, fps, noise_deg, path):
    """Write a film, and return the periods (steps,) and the step length (m) of the walk."""
    gait = run_in_memory("fixedpoint", config).summary
    rng = np.random.default_rng(1)
    time, angle, touches = measure_angles(rigid_walker(config), np.array(gait["state"]), rng, STEPS, 0.0, 0.0, DENSE_HZ)
    length = gait["step_length_m"]
    seen = filmed_angles(angle, config.walker.leg_length_m, length, touches, time)
    frame = round(DENSE_HZ / fps)
    blur = round(EXPOSURE * frame)
    count = (time.size - blur) // frame
    frames = np.array([seen[k * frame : k * frame + blur].mean(axis=0) for k in range(count)])
    frames = np.degrees(frames) + rng.normal(0.0, noise_deg, frames.shape)
    # The time of a frame is the middle of its exposure.
    times = np.arange(count) / fps + 0.5 * (blur - 1) / DENSE_HZ
    rows = "\n".join(f"{t:.5f},{a:.4f},{b:.4f}" for t, (a, b) in zip(times, frames, strict=True))
    path.write_text(f"time (s),angle 1 (deg),angle 2 (deg)\n{rows}\n", encoding="utf-8")
    return np.diff(touches), length


def main(fits):
    columns = [
        "frames/s",
        "noise (deg)",
        "steps",
        "mean period (ms)",
        "a period (ms)",
        "mean length (mm)",
        "a length (mm)",
    ]
    columns += ["slope (deg), hip mass (kg)"] * fits
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    config = load(Path(CONFIG)).config
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.csv"
        for fps in FRAME_RATES:
            for noise in NOISES_DEG:
                periods, length = film(config, fps, noise, path)
                try:
                    read = walkerlab.read_walk(
                        path, walker=config.walker, slope_deg=math.degrees(config.slope_rad)
                    ).summary
                except WalkerlabError as error:
                    print(f"| {fps:.0f} | {noise} | {error} |", flush=True)
                    continue
                off = 1e3 * (np.array(read["step_periods_s"]) - periods.mean())
                away = 1e3 * (np.array(read["step_lengths_m"]) - length)
                errors = [
                    f"{value:.1f}" for each in (off, away) for value in (each.mean(), math.sqrt(np.mean(each**2)))
                ]
                cells = [f"{fps:.0f}", str(noise), str(read["steps"]), *errors, *([estimates(path)] if fits else [])]
                print(f"| {' | '.join(cells)} |", flush=True)


def estimates(path):
    """Describe the slope and the hip mass that a fit finds, with their standard errors and the judgement of the fit."""
    fit = {"slope_deg": None, "walker.hip_mass_kg": None}
    answer = walkerlab.identify(path, CONFIG, fit=fit, level="angles").summary
    values = ", ".join(f"{each['value']:.3f} ± {each['standard_error']:.3f}" for each in answer["estimates"])
    return f"{values}, {answer['models'][0]['fit']}"


if __name__ == "__main__":
    main("fit" in sys.argv[1:])
