"""Kill a sweep, parent or worker, again and again at random moments, and compare what comes out with a quiet one.

    python scripts/kill_sweeps.py [--kills 50] [--seed 0]

The sweep is of real fixed points over slope, in chunks of a tenth of a second. After each kill of the parent the same
command goes on. At the end two more sweeps of other parameters run on one folder at once. Nothing is left behind.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

POINTS = 400


def main() -> None:
    """Run the campaign; exit code 1 if a result differs."""
    options = parsed()
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        quiet, killed = Path(folder, "quiet"), Path(folder, "killed")
        run(command(quiet))
        parents = workers = 0
        while parents + workers < options.kills:
            process = subprocess.Popen(command(killed), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and parents + workers < options.kills:
                time.sleep(chance.uniform(0.0, 4.0))
                below = children_of(process.pid)
                if below and chance.random() < 0.5:
                    kill(chance.choice(below))
                    workers += 1
                elif process.poll() is None:
                    kill(process.pid)
                    parents += 1
                    break
            if process.poll() == 0:  # done before all kills were: begin anew
                print(f"{parents} parents and {workers} workers killed, finished, the same: {same(quiet, killed)}")
                for path in killed.rglob("*.h5"):
                    path.unlink()
            process.kill()
            process.wait()
        run(command(killed))
        both = [subprocess.Popen(command(Path(folder, "both")), stdout=subprocess.DEVNULL) for _ in range(2)]
        codes = [process.wait() for process in both]
        result = same(quiet, killed) and codes == [0, 0] and same(quiet, Path(folder, "both"))
    print(f"{parents} parents and {workers} workers killed; two at once ended with {codes}; the same bits: {result}")
    sys.exit(not result)


def parsed() -> argparse.Namespace:
    """The options."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    return parser.parse_args()


def command(runs: Path) -> list[str]:
    """The sweep."""
    over = f"slope_deg=0.5:7:{POINTS}"
    options = ["--stage", "fixedpoint", "--chunk-seconds", "0.1", "--runs", str(runs), "--quiet"]
    return [sys.executable, "-m", "walkerlab", "sweep", "--over", over, *options]


def run(arguments: list[str]) -> None:
    """Run to the end."""
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)


def kill(pid: int) -> None:
    """End a process at once, if it is still there."""
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def children_of(parent: int) -> list[int]:
    """The processes below one, by the kernel's table."""
    found, waiting = [], [parent]
    while waiting:
        listed = Path(f"/proc/{waiting[0]}/task/{waiting.pop(0)}/children")
        try:
            below = [int(pid) for pid in listed.read_text().split()]
        except OSError:
            continue
        found += below
        waiting += below
    return found


def same(one: Path, other: Path) -> bool:
    """Whether two folders hold the same result to the last bit."""
    from walkerlab.store.artifact import read

    digests = [[read(path).digest() for path in sorted(folder.glob("*/sweep-*.h5"))] for folder in (one, other)]
    return len(digests[0]) == 1 and digests[0] == digests[1]


if __name__ == "__main__":
    main()
