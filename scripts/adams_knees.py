"""Simulate the ADAMS files of kneed walkers with the reader of the tests, and compare the walks with the contact model.

Usage: python scripts/adams_knees.py [WALKERS, 10 by default] [STRIDES, 3 by default]

Each random walker is exported with `--law functions`. The reader simulates the walk from nothing but the text of the
dataset (.adm) and of the command file (.acf). The script prints the largest differences of touch times and of times at
which knees lock.
"""

import sys
import time
from pathlib import Path

import numpy as np


def main(walkers, strides):
    tests = Path(__file__).parents[1] / "tests"
    sys.path[:0] = [str(tests), str(tests / "exchange")]
    from exported_walkers import random_kneed_walker, run_kneed

    for seed in range(walkers):
        begun = time.perf_counter()
        walker = random_kneed_walker(seed, strides)
        touches, locks, walk = run_kneed(*walker)
        late = np.abs(touches - walk.touch_time_s[: touches.size]).max()
        late_locks = np.abs(locks - walk.knee_strike_time_s[: locks.size]).max()
        took = time.perf_counter() - begun
        print(f"{walker[0]} {seed}: {touches.size} of {2 * strides} steps, touches differ by {late:.1e} s, ", end="")
        print(f"locks by {late_locks:.1e} s ({took:.0f} s)", flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in [*sys.argv[1:], *("10", "3")[len(sys.argv) - 1 :]]))
