"""Compare the times of two versions of the package for the same work: compiling, commands, and warm calls."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

WALKERLAB = ("-m", "walkerlab")
BARE = ("-c", "import numpy, numba, h5py, pydantic, typer, ruamel.yaml")
# Commands that begin without compiled code. They run in this order.
COLD = (
    ("cold: fixedpoint", (("fixedpoint",),)),
    ("cold: contact-sim after it", (("contact-sim",),)),
    ("cold: both of kneed after that", (("fixedpoint", "-c", "kneed"), ("contact-sim", "-c", "kneed"))),
)
# Commands that print how long they took without the start of the process.
STAGES = (
    ("basin, rigid, 300 x 300", ("basin", "--set", "basin.cells=[300,300]", "--set", "basin.refine=1")),
    ("basin, contact, 12 x 12", ("basin", "--set", "basin.model=contact", "--set", "basin.cells=[12,12]")),
    ("cascade to period 16", ("continuation", "--set", "continuation.to=0.09")),
    ("100 fixed points", ("sweep", "--stage", "fixedpoint", "--over", "slope_deg=0.5:5:100")),
)
PROCESSES = "fixedpoint --force, as a process"
BARE_IMPORTS = "bare imports"
# number of samples of each warm call in one process, and the time for which a sample repeats it
SAMPLES, SAMPLE_S = 5, 0.05
WARM = """
import json, sys
sys.path[:0] = {folders!r}
from version_speed import warm_times
print(json.dumps(warm_times({wanted!r})))
"""
Times = dict[str, list[float]]


def print_speed(versions: Sequence[Any], wanted: str, rounds: int) -> None:
    """Measure both versions in turn, and print a table with the best and the median time of each, and their ratios."""
    times: list[Times] = [{}, {}]
    for lap in range(rounds):
        # The versions take turns in going first, because each finds the machine as the other left it.
        for place in (0, 1) if lap % 2 == 0 else (1, 0):
            for figure, seconds in measured(versions[place], wanted):
                times[place].setdefault(figure, []).append(seconds)
                print(f"\rround {lap + 1} of {rounds}: {figure:60}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    head = ("seconds: best, median", "other", "", "this", "", "ratio of best", "of medians")
    print("| {:42} | {:>9} | {:>9} | {:>9} | {:>9} | {:>13} | {:>10} |".format(*head))
    print("|---" * len(head) + "|")
    for figure in times[0]:
        if figure not in times[1]:
            continue
        old, new = ([min(each[figure]), median(each[figure])] for each in times)
        cells = [f"{seconds:9.4g}" for seconds in (*old, *new)]
        print(f"| {figure:42} | {' | '.join(cells)} | {new[0] / old[0]:13.3f} | {new[1] / old[1]:10.3f} |")


def measured(version: Any, wanted: str) -> Iterator[tuple[str, float]]:
    """Yield the name of each figure and its seconds for a version: one measurement, or several for a warm call."""
    with tempfile.TemporaryDirectory(prefix="walkerlab-speed-") as folder:
        if any(re.search(wanted, figure) for figure, _ in COLD):
            cold = replace(version, cache=Path(folder) / "cache")
            for figure, commands in COLD:
                yield figure, sum(seconds(cold, (*WALKERLAB, *line), folder) for line in commands)
        for figure, line in STAGES:
            if re.search(wanted, figure):
                yield figure, told_seconds(version, line, folder)
        if re.search(wanted, PROCESSES):
            seconds(version, (*WALKERLAB, "fixedpoint"), folder)
            yield PROCESSES, seconds(version, (*WALKERLAB, "fixedpoint", "--force"), folder)
            yield BARE_IMPORTS, seconds(version, BARE, folder)
        own_scripts = [str(version.checkout / "scripts")] if version.checkout else []
        code = WARM.format(folders=[*own_scripts, str(Path(__file__).parent)], wanted=wanted)
        for figure, samples in json.loads(printed(version, ("-c", code), folder)).items():
            yield from ((figure, sample) for sample in samples)


def printed(version: Any, arguments: Sequence[str], folder: str) -> str:
    """Return the output of a process of a version."""
    command = [version.python, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=version.environment(), cwd=folder)
    if done.returncode:
        sys.exit(f"{version.name}: {' '.join(arguments)}\n{done.stderr}")
    return done.stdout


def seconds(version: Any, arguments: Sequence[str], folder: str) -> float:
    """Return the time of a process of a version."""
    start = time.perf_counter()
    printed(version, arguments, folder)
    return time.perf_counter() - start


def told_seconds(version: Any, line: Sequence[str], folder: str) -> float:
    """Return the seconds that a warm command states for its work, on one core."""
    before = ("fixedpoint",) if line[0] == "basin" else None
    common = ("--runs", f"{folder}/warm", "--jobs", "1", "-q")
    if before:
        printed(version, (*WALKERLAB, *before, *common), folder)
    answer = json.loads(printed(version, (*WALKERLAB, *line, *common, "--json"), folder))
    return float(answer["stages"][-1]["wall_s"] if "stages" in answer else answer["wall_s"])


def warm_times(wanted: str) -> Times:
    """Return samples of the seconds of warm calls in this process. Each version has its own scripts/benchmark.py."""
    return {figure: samples_of(work()) for figure, work in warm_work().items() if re.search(wanted, figure)}


def warm_work() -> dict[str, Callable[[], Callable[[], Any]]]:
    """Return functions that prepare each piece of warm work."""
    import benchmark

    import walkerlab

    def seed_to_gait() -> Callable[[], Any]:
        kept: list[Callable[[], Any]] = []
        list(benchmark.newton_lines(lambda work: kept.append(work) or 0.0))  # type: ignore[arg-type]
        return kept[0]

    def contact_walk() -> Callable[[], Any]:
        trial = benchmark.contact_trial_of(benchmark.ONE_DEGREE)
        return trial.prepare("radau5", 1e-5, benchmark.BUDGET)

    def ten_steps() -> Callable[[], Any]:
        return benchmark.printed_trial().prepare("dop853", 1e-8, benchmark.BUDGET)

    ground = walkerlab.contact()
    return {
        "ten rigid steps, dop853 at 1e-8": ten_steps,
        "contact walk of 7 s, radau5 at 1e-5": contact_walk,
        "seed to gait": seed_to_gait,
        "find_gait, from Python": lambda: lambda: walkerlab.find_gait(slope_deg=1),
        "simulate, from Python": lambda: lambda: walkerlab.simulate(slope_deg=1),
        "simulate with contact, from Python": lambda: lambda: walkerlab.simulate(slope_deg=1, contact=ground),
    }


def samples_of(work: Callable[[], Any]) -> list[float]:
    """Return several samples of the time of a call (s). Each sample is the mean over repeated calls, and the first call
    is not counted.
    """
    work()
    start = time.perf_counter()
    work()
    calls = max(1, round(SAMPLE_S / (time.perf_counter() - start)))
    samples = []
    for _ in range(SAMPLES):
        start = time.perf_counter()
        for _ in range(calls):
            work()
        samples.append((time.perf_counter() - start) / calls)
    return samples
