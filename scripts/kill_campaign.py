"""Kill -9 runs at random moments, and check after each that no broken result is accepted and the next run completes.

    python scripts/kill_campaign.py                      # 200 kills of forced rigid-only runs
    python scripts/kill_campaign.py --stage report --config paper --kills 20
    python scripts/kill_campaign.py --together 8         # eight reports on one folder at once

Half of the moments fall anywhere in a run, half are when a file of the folder has just begun to change.
Prints a table in Markdown; exits 1 if anything was lost.
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
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from walkerlab.store import artifact

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
LONGEST_S = 600.0


def command(stage: str, config: str, runs: Path, *options: str) -> list[str]:
    """The command line of a run."""
    return [sys.executable, "-m", "walkerlab", stage, "-c", config, "--runs", str(runs), "--quiet", *options]


def start(arguments: Sequence[str]) -> subprocess.Popen[str]:
    """A process of its own group, so that its workers die with it."""
    return subprocess.Popen(
        arguments,
        env=ENVIRONMENT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finish(arguments: Sequence[str]) -> tuple[int, str, float]:
    """Exit code, messages and time (s) of a run that is let be."""
    began = time.perf_counter()
    process = start(arguments)
    _, said = process.communicate(timeout=LONGEST_S)
    return process.returncode, said, time.perf_counter() - began


def state_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Sizes and times of all files, to see when one begins to change."""
    found = {}
    for path in folder.rglob("*"):
        try:
            status = path.stat()
        except OSError:
            continue
        found[str(path)] = (status.st_size, status.st_mtime_ns)
    return found


def kill_at(process: subprocess.Popen[str], runs: Path, delay_s: float, at_write: bool) -> str:
    """Kill the process group after a time, or once a file begins to change after it; says when it was."""
    time.sleep(delay_s)
    before = state_of(runs)
    while at_write and process.poll() is None and state_of(runs) == before:
        time.sleep(0.0002)
    over = process.poll() is not None
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        over = True
    process.communicate()
    return "after the end" if over else "during a write" if at_write else "anywhere"


def digests(runs: Path) -> dict[str, str]:
    """Digest of the content of every stored result, by its place; a broken one raises what `read` raises."""
    return {str(path.relative_to(runs)): artifact.read(path).digest() for path in sorted(runs.rglob("*.h5"))}


def unreadable(runs: Path) -> list[str]:
    """Results that are there under their own name and are not whole."""
    broken = []
    for path in sorted(runs.rglob("*.h5")):
        if path.name.startswith("."):
            continue
        try:
            artifact.read(path)
        except Exception as error:  # whatever a broken file does to its reader is what is looked for
            broken.append(f"{path.name}: {error}")
    return broken


def campaign(stage: str, config: str, kills: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Kill, look, run again, compare; returns when the kills were and everything that was lost."""
    drawn = random.Random(seed)
    moments: Counter[str] = Counter()
    lost: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        undisturbed, runs = Path(place) / "undisturbed", Path(place) / "runs"
        finish(command(stage, config, undisturbed))
        code, said, usual_s = finish(command(stage, config, undisturbed, "--force"))
        if code not in (0, 4):
            return moments, [f"the undisturbed run exits {code}: {said}"]
        expected = digests(undisturbed)
        for number in range(kills):
            runs.mkdir(exist_ok=True)
            process = start(command(stage, config, runs, "--force"))
            moments[kill_at(process, runs, drawn.uniform(0.0, usual_s), drawn.random() < 0.5)] += 1
            lost += [f"kill {number}: {broken}" for broken in unreadable(runs)]
            again, said, _ = finish(command(stage, config, runs))
            if again != code:
                lost.append(f"kill {number}: the next run exits {again}: {said[-500:]}")
            elif digests(runs) != expected:
                lost.append(f"kill {number}: results differ from the undisturbed run's")
    return moments, lost


def together(stage: str, config: str, count: int) -> list[str]:
    """Start several runs on one folder at once; returns what went wrong."""
    wrong = []
    with tempfile.TemporaryDirectory() as place:
        runs, alone = Path(place) / "runs", Path(place) / "alone"
        processes = [start(command(stage, config, runs)) for _ in range(count)]
        for process in processes:
            _, said = process.communicate(timeout=LONGEST_S)
            if process.returncode not in (0, 4):
                wrong.append(f"one of {count} exits {process.returncode}: {said[-500:]}")
        finish(command(stage, config, alone))
        if digests(runs) != digests(alone):
            wrong.append(f"{count} at once give other results than one")
    return wrong


def main() -> int:
    """Run the campaign that was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stage", default="simulate")
    parser.add_argument("--config", default="rigid-only")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--together", type=int, default=0, metavar="N", help="instead: N runs at once")
    asked = parser.parse_args()
    began = time.perf_counter()
    if asked.together:
        wrong = together(asked.stage, asked.config, asked.together)
        print(
            f"| {asked.together} x {asked.stage} at once | {len(wrong)} wrong | {time.perf_counter() - began:.0f} s |"
        )
    else:
        moments, wrong = campaign(asked.stage, asked.config, asked.kills, asked.seed)
        print(f"| killed {asked.stage} ({asked.config}) | times |\n|---|---|")
        for when, times in sorted(moments.items()):
            print(f"| {when} | {times} |")
        print(f"| lost or broken | {len(wrong)} |\n| time | {time.perf_counter() - began:.0f} s |")
    print("\n".join(wrong), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
