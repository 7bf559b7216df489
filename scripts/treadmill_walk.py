"""Convert the treadmill walk of GaitAnalysisToolKit to angles of both legs, in the form that `identify` reads.

Usage: python scripts/treadmill_walk.py RAWDATA [FILE, docs/downloads/treadmill.csv by default]

RAWDATA is gaitanalysis/octave/2d_inverse_dynamics/test/rawdata.txt of its source distribution (Apache-2.0): planar
markers of the right side of a person at 100 Hz. A leg is the line from the trochanter to the ankle. The left leg was
not recorded, and is assumed to do the same half a stride later.
"""

import sys
from pathlib import Path

import numpy as np

TIME, HIP, ANKLE, FORCE = 0, (3, 4), (7, 8), 14
ON_GROUND_N = 50.0  # vertical force under the foot


def read(path):
    """Return time (frames,), the right leg's angle (frames,) in rad, and the instants of its heel strikes."""
    rows = np.genfromtxt(path, comments="%")
    time = rows[:, TIME]
    markers = {name: [filled(time, rows[:, column]) for column in columns] for name, columns in
               {"hip": HIP, "ankle": ANKLE}.items()}  # fmt: skip
    ahead, below = (ankle - hip for hip, ankle in zip(markers["hip"], markers["ankle"], strict=True))
    loaded = rows[:, FORCE] > ON_GROUND_N
    strikes = time[1:][loaded[1:] & ~loaded[:-1]]
    return time, np.arctan2(ahead, -below), strikes


def filled(time, values):
    """Fill in values by interpolation where a marker was hidden."""
    seen = np.isfinite(values)
    return np.interp(time, time[seen], values[seen])


def main(source, file):
    time, right, strikes = read(source)
    half = 0.5 * float(np.mean(np.diff(strikes)))
    inside = time >= time[0] + half
    left = np.interp(time[inside] - half, time, right)
    rows = zip(time[inside] - time[inside][0], right[inside], left, strict=True)
    lines = (f"{t:.2f},{first:.5f},{second:.5f}" for t, first, second in rows)
    file.write_text("\n".join(("time (s),angle 1 (rad),angle 2 (rad)", *lines)) + "\n")
    print(f"{file}: heel strikes at {', '.join(f'{strike:.2f}' for strike in strikes)} s; a step takes {half:.3f} s")


if __name__ == "__main__":
    default = Path(__file__).parents[1] / "docs" / "downloads" / "treadmill.csv"
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else default)
