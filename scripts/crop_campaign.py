"""Cut recordings of a walk at random beginnings and ends, and count the heel strikes that are missed or invented.

The walk is that of the built-in compass walker, whose heel strikes are known from the simulation.

    python scripts/crop_campaign.py [COUNT] [SEED]
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "exchange"))
from filmed_walks import PERIOD_S, SLOPE, angles_at

import walkerlab
from walkerlab.errors import ConfigError

FRAME_RATES = (25.0, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0, 1000.0)  # frames/s
NOISES_DEG = (0.0, 0.01, 0.05, 0.1)
NEAR_S = 0.02  # half of the cuts are at most this far from a heel strike
STRIKES_S = PERIOD_S * np.arange(9)
MARGIN_S = 0.03  # strikes that are nearer to an end do not count


class Crop(NamedTuple):
    begin_s: float
    end_s: float
    fps: float
    noise_rad: float
    gap_s: float  # time of a gap of 30 ms, or negative if there is none


class Count(NamedTuple):
    """Result of reading a crop."""

    missed: int
    invented: int
    errors: list[float]  # errors of the strikes, as multiples of their stated standard errors
    problem: str  # message if the recording is refused


def draw(rng: np.random.Generator) -> Crop:
    def cut(strike: int) -> float:
        spread = NEAR_S if rng.random() < 0.5 else 0.5 * PERIOD_S
        return float(STRIKES_S[strike] + rng.uniform(-spread, spread))

    fps, noise = float(rng.choice(FRAME_RATES)), math.radians(float(rng.choice(NOISES_DEG)))
    gap = float(STRIKES_S[4] + rng.uniform(-0.05, 0.05)) if rng.random() < 0.3 and fps >= 100.0 else -1.0
    return Crop(max(cut(int(rng.integers(1, 3))), 0.0), cut(int(rng.integers(6, 8))), fps, noise, gap)


def count_strikes(crop: Crop, rng: np.random.Generator, folder: Path) -> Count:
    """Read a cropped recording, and compare its heel strikes with those of the walk."""
    time = np.arange(crop.begin_s, crop.end_s, 1.0 / crop.fps)
    time = time[(time < crop.gap_s) | (time > crop.gap_s + 0.03)]
    angle = angles_at(time) + crop.noise_rad * rng.standard_normal((time.size, 2))
    path = folder / "crop.csv"
    rows = "\n".join(f"{t:.6f},{a:.9g},{b:.9g}" for t, (a, b) in zip(time, angle, strict=True))
    path.write_text(f"time (s),angle 1 (rad),angle 2 (rad)\n{rows}\n", encoding="utf-8")
    try:
        summary = walkerlab.read_walk(path, slope_deg=math.degrees(SLOPE)).summary
    except ConfigError as error:
        return Count(0, 0, [], f"{error.message}")
    strikes = summary["first_heel_strike_s"] + np.array([0.0, *summary["touch_times_s"]])
    errors = np.array(summary["touch_errors_s"])
    sure = STRIKES_S[(time[0] + MARGIN_S < STRIKES_S) & (time[-1] - MARGIN_S > STRIKES_S)]
    away = np.abs(strikes[:, None] - STRIKES_S)
    missed = int(np.sum(np.abs(sure[:, None] - strikes).min(axis=1) > 0.1 * PERIOD_S))
    invented = int(np.sum(away.min(axis=1) > 0.1 * PERIOD_S)) + strikes.size - np.unique(away.argmin(axis=1)).size
    return Count(missed, invented, (away.min(axis=1) / errors).tolist(), "")


def main() -> None:
    count, seed = (int(word) for word in (*sys.argv[1:], *("1000", "0")[len(sys.argv) - 1 :]))
    rng, counts = np.random.default_rng(seed), []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            crop = draw(rng)
            result = count_strikes(crop, rng, Path(folder))
            counts.append(result)
            if result.missed or result.invented or result.problem or max(result.errors, default=0.0) > 5.0:
                print(number, crop, result._replace(errors=[round(each, 1) for each in result.errors]), flush=True)
    errors = np.array([error for result in counts for error in result.errors])
    print(f"{count} crops, {errors.size} strikes: {sum(c.missed for c in counts)} missed, "
          f"{sum(c.invented for c in counts)} invented, {sum(bool(c.problem) for c in counts)} refused")  # fmt: skip
    print(f"within two stated errors: {np.mean(errors <= 2.0):.1%}; largest: {errors.max():.1f} errors")


if __name__ == "__main__":
    main()
