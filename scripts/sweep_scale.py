"""Measure the overhead of a sweep: memory and time of the sweeping process for points that take no time.

    python scripts/sweep_scale.py [--points 10000 100000] [--limit-mb 500]

Each point returns the summary of a real fixed point, so that rows, files and the result are as large as real ones. The
exit code is 1 if the sweeping process needs more memory than the limit.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

from walkerlab.config.reads import RigidConfig
from walkerlab.pipeline.plan.graph import Graph
from walkerlab.pipeline.plan.stage import Stage
from walkerlab.pipeline.store.content import Content

HERE = Path(__file__)
GRAPH = Graph(Stage("echo", HERE.stem, "Say what a fixed point says.", RigidConfig), at=f"{HERE.stem}:GRAPH")


def run(config: Any, _inputs: Any, _progress: Any) -> Content:
    """Run the stage: return the summary of the paper's gaits, on the slope of the point."""
    return Content({}, real_summary() | {"slope_rad": config.slope_rad})


@lru_cache
def real_summary() -> dict[str, Any]:
    """Return the summary of `fixedpoint` for the paper's walker."""
    import walkerlab

    return dict(walkerlab.run("fixedpoint", runs=os.environ["SWEEP_SCALE_RUNS"]).summary)


def main() -> None:
    """Measure each number of points in a separate process."""
    options = parsed()
    if options.one:
        measure(options.one)
        return
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = os.pathsep.join(filter(None, (str(HERE.parent), os.environ.get("PYTHONPATH"))))
        environment = os.environ | {"SWEEP_SCALE_RUNS": folder, "PYTHONPATH": path}
        for points in options.points:
            command = [sys.executable, str(HERE), "--one", str(points)]
            said = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
            print(said, end="")
            worst = max(worst, float(said.split(" MB")[0].split()[-1]))
    print(f"within {options.limit_mb:.0f} MB: {worst <= options.limit_mb}")
    sys.exit(worst > options.limit_mb)


def parsed() -> argparse.Namespace:
    """Parse the options."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--points", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--limit-mb", type=float, default=500.0)
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    return parser.parse_args()


def measure(points: int) -> None:
    """Sweep once, and print memory and time."""
    from walkerlab.config.loader import load
    from walkerlab.pipeline.store.runs import RunFolder
    from walkerlab.pipeline.sweeps.question import axis_of_text, build_sweep
    from walkerlab.pipeline.sweeps.sweep import SweepRun, SweepWork

    runs = Path(os.environ["SWEEP_SCALE_RUNS"], str(points))
    real_summary()
    before, started, used = peak_mb(), time.perf_counter(), time.process_time()
    question = build_sweep("echo", [axis_of_text(f"slope_deg=0.5:5:{points}")])
    swept = SweepRun(question, load(), RunFolder(runs, "scale"), GRAPH).run(SweepWork())
    wall, used = time.perf_counter() - started, time.process_time() - used
    size, chunks = swept.path.stat().st_size, list(swept.path.parent.glob("sweep-chunks/*.h5"))
    print(
        f"{points} points: peak memory {peak_mb():.0f} MB, of it {before:.0f} MB before any point; "
        f"{1e3 * used / points:.2f} ms a point of the sweeping process, {wall:.0f} s in all; "
        f"result {size / 1e6:.0f} MB; {len(chunks)} chunks, {sum(path.stat().st_size for path in chunks) / 1e6:.0f} MB"
    )


def peak_mb() -> float:
    """Return the maximum memory that this process has used (MB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    main()
