"""Kill runs (kill -9) at random moments. Check that no broken result is accepted and that the next run completes.

    python scripts/kill_campaign.py                      # 200 kills of forced rigid-only runs
    python scripts/kill_campaign.py --stage report --config paper --kills 20 --spread
    python scripts/kill_campaign.py --stage report --config paper --together 2 8   # 2, then 8 runs at once on a folder
    python scripts/kill_campaign.py --sweeps --kills 50                  # a sweep of fixed points, or a worker of it

Half of the kills come at a random moment, the others when a file of the folder has just begun to change. With --spread
the moments are spread over all results: each time another result is missing from a complete folder, and the run is
killed while it computes this result, so that a kill takes no longer than its result. With --sweeps either the sweeping
process or one of its workers is killed within a second after a chunk was stored. The same command then continues, and
at the end two such sweeps run on one folder at once. The script prints a table in Markdown, and exits with 1 if
anything was lost.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

from walkerlab.pipeline.store import artifact

sys.path.append(str(Path(__file__).resolve().parent.parent / "tests"))
from process_table import processes_below

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent.parent)}
LONGEST_S = 600.0
LOCK = ".lock"
LATEST = 0.85  # Kill before this fraction of the usual time, because a run that has ended cannot be killed.


def command(stage: str, config: str, runs: Path, *options: str) -> list[str]:
    """Return the command line of a run."""
    return [sys.executable, "-m", "walkerlab", stage, "-c", config, "--runs", str(runs), "--quiet", *options]


def start(arguments: Sequence[str]) -> subprocess.Popen[str]:
    """Start a process in a group of its own, so that its workers die with it."""
    return subprocess.Popen(
        arguments,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def finish(arguments: Sequence[str]) -> tuple[int, str, float]:
    """Return exit code, messages and time (s) of a run that is not killed."""
    began = time.perf_counter()
    process = start(arguments)
    _, said = process.communicate(timeout=LONGEST_S)
    return process.returncode, said, time.perf_counter() - began


def state_of(folder: Path) -> dict[str, tuple[int, int]]:
    """Return sizes and times of all files but the lock. They show when a file begins to change."""
    found = {}
    for path in folder.rglob("*"):
        if path.name == LOCK:
            continue
        try:
            status = path.stat()
        except OSError:
            continue
        found[str(path)] = (status.st_size, status.st_mtime_ns)
    return found


def kill_at(process: subprocess.Popen[str], runs: Path, delay_s: float, at_write: bool) -> str:
    """Kill the process group after `delay_s`, or, with `at_write`, when a file next changes after that. Return a
    description of the moment.
    """
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
    """Return the digest of every stored result by path. Raises the error of `read` for a broken result."""
    return {str(path.relative_to(runs)): artifact.read(path).digest() for path in sorted(runs.rglob("*.h5"))}


def unreadable(runs: Path) -> list[str]:
    """List the results that have their final name and are broken."""
    broken = []
    for path in sorted(runs.rglob("*.h5")):
        if path.name.startswith("."):
            continue
        try:
            artifact.read(path)
        except Exception as error:  # any error of the reader counts
            broken.append(f"{path.name}: {error}")
    return broken


class Campaign:
    """Kills of one kind of run, one after another, and their consequences."""

    def __init__(self, stage: str, config: str, seed: int, place: Path) -> None:
        """Prepare a folder for the undisturbed run and one for the disturbed runs, both in `place`."""
        self.stage, self.config, self.drawn = stage, config, random.Random(seed)
        self.undisturbed, self.runs = place / "undisturbed", place / "runs"
        self.moments: Counter[str] = Counter()
        self.lost: list[str] = []
        self.code, self.expected = 0, {}

    def undisturbed_run(self, *options: str) -> float:
        """Compute the results without a disturbance, for comparison, and return the time it took (s)."""
        self.code, said, took_s = finish(command(self.stage, self.config, self.undisturbed, *options))
        if self.code not in (0, 4):
            raise SystemExit(f"the undisturbed run exits {self.code}: {said}")
        self.expected = digests(self.undisturbed)
        return took_s

    def kill(self, most_s: float, about: str, *options: str) -> None:
        """Kill a run within `most_s` seconds, check the results that it left, and let the next run complete."""
        at_write, delay_s = self.drawn.random() < 0.5, self.drawn.uniform(0.0, LATEST * most_s)
        process = start(command(self.stage, self.config, self.runs, *options))
        moment = kill_at(process, self.runs, delay_s, at_write)
        self.moments[moment] += 1
        number = sum(self.moments.values())
        self.lost += [f"kill {number}, {about}: {broken}" for broken in unreadable(self.runs)]
        code, said, _ = finish(command(self.stage, self.config, self.runs))
        if code != self.code:
            self.lost.append(f"kill {number}, {about}: the next run exits {code}: {said[-500:]}")
        else:
            found = digests(self.runs)
            differ = sorted(name for name in {*found, *self.expected} if found.get(name) != self.expected.get(name))
            if differ:
                self.lost.append(f"kill {number}, {about}: not those of the undisturbed run: {', '.join(differ)}")
        print(f"kill {number}, {about}, {moment}: {len(self.lost)} lost so far", file=sys.stderr, flush=True)


def campaign(stage: str, config: str, kills: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Kill forced runs. Return when each was killed, and everything that was lost."""
    with tempfile.TemporaryDirectory() as place:
        one = Campaign(stage, config, seed, Path(place))
        one.undisturbed_run()
        usual_s = one.undisturbed_run("--force")
        one.runs.mkdir()
        for _ in range(kills):
            one.kill(usual_s, "forced", "--force")
        return one.moments, one.lost


def spread(stage: str, config: str, kills: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Kill runs that compute one missing result of a complete folder, each result in turn."""
    with tempfile.TemporaryDirectory() as place:
        one = Campaign(stage, config, seed, Path(place))
        one.undisturbed_run()
        starting_s = one.undisturbed_run()
        makings = {path: making_s(one.undisturbed / path) for path in one.expected}
        for number in range(kills):
            missing = list(makings)[number % len(makings)]
            shutil.rmtree(one.runs, ignore_errors=True)
            shutil.copytree(one.undisturbed, one.runs)
            (one.runs / missing).unlink()
            one.kill(starting_s + makings[missing], f"{Path(missing).stem} missing")
        return one.moments, one.lost


def making_s(path: Path) -> float:
    """Return the time (s) that a result took."""
    origin = artifact.read(path).provenance
    return (datetime.fromisoformat(origin.ended_utc) - datetime.fromisoformat(origin.started_utc)).total_seconds()


def together(stage: str, config: str, counts: Sequence[int]) -> list[str]:
    """Start several runs on one folder at once, for each of the counts. Return what went wrong."""
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        alone = Path(place) / "alone"
        usual_code, _, _ = finish(command(stage, config, alone))
        for count in counts:
            runs = Path(place) / f"{count}"
            processes = [start(command(stage, config, runs, "--json")) for _ in range(count)]
            made: Counter[str] = Counter()
            for process in processes:
                printed, said = process.communicate(timeout=LONGEST_S)
                if process.returncode != usual_code:
                    wrong.append(f"one of {count} exits {process.returncode}: {said[-500:]}")
                    continue
                made.update(done["stage"] for done in json.loads(printed)["stages"] if done["action"] == "run")
            wrong += [f"{count} at once make {name} {times} times" for name, times in made.items() if times > 1]
            if digests(runs) != digests(alone):
                wrong.append(f"{count} at once give other results than one")
            print(f"{count} at once: {len(wrong)} wrong so far", file=sys.stderr, flush=True)
    return wrong


SWEEP = ("--stage", "fixedpoint", "--over", "slope_deg=0.5:7:400", "--chunk-seconds", "0.1")


def sweeps(kills: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Kill a sweep or one of its workers, and let it continue. Return what was killed, and what went wrong."""
    drawn, killed, wrong = random.Random(seed), Counter[str](), list[str]()
    with tempfile.TemporaryDirectory() as place:
        quiet, runs, both = (Path(place) / name for name in ("quiet", "runs", "both"))
        finish(command("sweep", "paper", quiet, *SWEEP))

        def judge(folder: Path, what: str) -> None:
            found = [artifact.read(path).digest() for path in folder.glob("*/sweep-*.h5")]
            if found != [artifact.read(path).digest() for path in quiet.glob("*/sweep-*.h5")]:
                wrong.append(f"{what}: not the result of the undisturbed sweep")

        while killed.total() < kills:
            process = start(command("sweep", "paper", runs, *SWEEP))
            while process.poll() is None and killed.total() < kills:
                before = len(list(runs.glob("*/sweep-chunks/*.h5")))
                while process.poll() is None and len(list(runs.glob("*/sweep-chunks/*.h5"))) <= before:
                    time.sleep(0.02)
                time.sleep(drawn.uniform(0.0, 1.0))
                below = processes_below(process.pid)
                what, pid = (
                    ("worker", drawn.choice(below)) if below and drawn.random() < 0.5 else ("parent", process.pid)
                )
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                killed[what] += 1
                if what == "parent":
                    break
            process.communicate()
            if process.returncode == 0:  # The sweep ended before all kills, so start over.
                judge(runs, f"after {killed.total()} kills")
                shutil.rmtree(runs)
        finish(command("sweep", "paper", runs, *SWEEP))
        judge(runs, "after all kills")
        for process in [start(command("sweep", "paper", both, *SWEEP)) for _ in range(2)]:
            wrong += [said] if (said := process.communicate()[1]) and process.returncode else []
        judge(both, "two at once")
    return killed, wrong


def main() -> int:
    """Run the requested campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stage", default="simulate")
    parser.add_argument("--config", default="rigid-only")
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--spread", action="store_true", help="kill while each result in turn is being computed")
    parser.add_argument("--together", type=int, nargs="+", metavar="N", help="instead: N runs at once")
    parser.add_argument("--sweeps", action="store_true", help="kill a sweep of fixed points instead")
    asked = parser.parse_args()
    began = time.perf_counter()
    if asked.together:
        wrong = together(asked.stage, asked.config, asked.together)
        counts = " and ".join(map(str, asked.together))
        print(f"| {counts} x {asked.stage} ({asked.config}) at once | {len(wrong)} wrong |")
    else:
        kill = spread if asked.spread else campaign
        what = "sweep" if asked.sweeps else f"{asked.stage} ({asked.config})"
        asking = sweeps if asked.sweeps else partial(kill, asked.stage, asked.config)
        moments, wrong = asking(asked.kills, asked.seed)
        print(f"| killed {what} | times |\n|---|---|")
        for when, times in sorted(moments.items()):
            print(f"| {when} | {times} |")
        print(f"| lost or broken | {len(wrong)} |")
    print(f"\n{time.perf_counter() - began:.0f} s")
    print("\n".join(wrong), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
