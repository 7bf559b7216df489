"""What a warm `walkerlab simulate` takes as a whole process, beside a bare process that does no more than it must."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

# imports what a walk needs, calls its compiled kernel, writes its numbers
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
    """Seconds of `walkerlab simulate` and of the bare process, medians of so many of each in turn.

    The gait is there already, as it is for a user who changes how far to walk; the walk itself is done each time.
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
    """How long a process takes."""
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - start


if __name__ == "__main__":
    ours, alone = whole_process_times(9)
    print(f"walkerlab simulate {ours:.3f} s, bare process {alone:.3f} s")
