"""Compare the time of a whole `walkerlab simulate` process, with compiled code, with that of a bare process that only
simulates the walk.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

# Imports only what a walk needs, calls the compiled kernel, and writes the numbers.
BARE = """
import sys
import h5py
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.physics.solvers.registry import Tolerances

walker = assembled(RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED))
start = (-0.20420, 0.16940, -0.605819, -0.861041)
walk = take_walk(walker, Tolerances("dop853", 1e-10, 1e-12, 10**6), start, 10, True)
with h5py.File(sys.argv[1], "w") as file:
    file["heel_strikes"] = walk.touch_time_s
    file["final_state"] = walk.final_state
"""


def whole_process_times(repeats: int) -> tuple[float, float]:
    """Return the seconds of `walkerlab simulate` and of the bare process, as medians of repeats that take turns.

    The gait exists already, as for a user who changes the number of strides, but the walk is computed each time.
    """
    with tempfile.TemporaryDirectory() as folder:
        runs = Path(folder)
        simulate = [sys.executable, "-m", "walkerlab", "simulate", "--quiet", "--runs", str(runs)]
        bare = [sys.executable, "-c", BARE, str(runs / "bare.h5")]
        for warm_up in (simulate, bare):
            seconds(warm_up)
        times: tuple[list[float], list[float]] = ([], [])
        for _ in range(repeats):
            (runs / "paper" / "simulate.h5").unlink()
            times[0].append(seconds(simulate))
            times[1].append(seconds(bare))
    return median(times[0]), median(times[1])


def seconds(command: list[str]) -> float:
    """Return the time of a process."""
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start


if __name__ == "__main__":
    ours, alone = whole_process_times(9)
    print(f"walkerlab simulate {ours:.3f} s, bare process {alone:.3f} s")
