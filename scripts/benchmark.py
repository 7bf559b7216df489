"""Measure what the project claims about speed, as ratios within one run on one machine.

    python scripts/benchmark.py [--quick] [--write]

All code is compiled beforehand, and times are medians. Other programs are named with their versions. With --write the
table goes into docs/performance.md. With --quick each time is the median of fewer repeats.
"""

from __future__ import annotations

import argparse
import math
import platform
import re
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from leaving_out import HEAD, leaving_out_rows
from right_hand_sides import ONE_DEGREE, times_ns
from whole_process import whole_process_times

from walkerlab.config.analyses import COORDINATES
from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.evidence.benchmarks.accuracy import START_RATE_FACTOR
from walkerlab.evidence.benchmarks.references import Reference, reference_for
from walkerlab.evidence.benchmarks.trials import (
    USER_SCRIPT,
    ContactTrial,
    RigidTrial,
    Trial,
    contact_trial,
    walk_as_a_script,
)
from walkerlab.evidence.paper.appendix_a import compass, compass_or_none
from walkerlab.physics.hybrid.endings import FALLEN_HIP
from walkerlab.physics.hybrid.recorded_walk import scale_rates
from walkerlab.physics.hybrid.rigid_lanes import new_fates, new_lane_memory, two_legs, walk_lanes
from walkerlab.physics.orbits.basin import ATOL, RTOL, Attractors
from walkerlab.physics.orbits.families import ValueSpan
from walkerlab.physics.orbits.fixed_point import (
    SEARCH_TOLERANCES,
    RigidGait,
    Search,
    SlopeBranch,
    find_gaits,
    map_over_slope,
)
from walkerlab.physics.orbits.newton import Effort
from walkerlab.physics.orbits.rigid_map import state_on_section
from walkerlab.physics.orbits.small_slope import seeds
from walkerlab.physics.orbits.step_map import Cycle, gait_near
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.runner import Options, execute
from walkerlab.pipeline.stages.continuation import FamilyQuestion, search_of
from walkerlab.pipeline.store.runs import RunFolder
from walkerlab.scene.contact import MAP_RTOL, contact_scene, start_state
from walkerlab.scene.parameter import parameter_of
from walkerlab.scene.rigid import rigid_walker

PRINTED_START = (0.1674, -0.60, -0.84)  # theta_2 and the velocities of x_p, eq. 11
STEPS = 10
BUDGET = 2_000_000
PEER_STARTS, PEER_STEPS = 24, 12  # number of starts in a basin that a library simulates, and number of steps from each
LADDER = tuple(10.0 ** (-half / 2) for half in range(6, 26))
PAGE = Path(__file__).parent.parent / "docs" / "performance.md"
PART = re.compile(r"(<!-- made by scripts/benchmark\.py: ([a-z-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
PEER_LEVELS = {"scipy-radau": 2e-6, "scipy-lsoda": 1e-4}
RADAU_WHERE_BARS_WERE_SET_S = 0.567
"""Time that SciPy's Radau took for the contact walk on the machine for which the bars in seconds were chosen."""
FEW = " Few repeats (--quick)."
MET, MISSED, STRETCH = "bar met", "bar missed", "stretch met"


@dataclass(frozen=True)
class Line:
    """A claim with its measured value, the bar that the value must meet, and the verdict."""

    work: str
    measured: str
    bar: str
    verdict: str


@dataclass(frozen=True)
class Timed:
    """Fastest run of a method that is accurate enough."""

    method: str
    tolerance: float
    error: float
    seconds: float
    rhs: int


class Stopwatch:
    """Measures medians of repeated calls."""

    def __init__(self, repeats: int, longest_s: float) -> None:
        """Set the maximum number of repeats, and the time (s) after which no repeat begins."""
        self.repeats, self.longest_s = repeats, longest_s

    def __call__(self, work: Callable[[], Any]) -> float:
        """Return the median time of a call (s). A first call is not counted."""
        work()
        times: list[float] = []
        while len(times) < self.repeats and (len(times) < 3 or sum(times) < self.longest_s):
            start = time.perf_counter()
            work()
            times.append(time.perf_counter() - start)
        return median(times)


def cheapest(
    trial: Trial, reference: Reference, method: str, level: float, watch: Stopwatch, ladder: Sequence[float]
) -> Timed | None:
    """Return the run of a method at the loosest tolerance whose error is at most `level`, or None if there is none."""
    for tolerance in ladder:
        walk = trial.prepare(method, tolerance, BUDGET)
        run = walk()
        if not run.state.size:
            continue
        error = float(np.max(np.abs(run.state - reference.first.state)))
        if error <= level:
            return Timed(method, tolerance, error, watch(walk), run.rhs_evaluations)
    return None


def against(work: str, ours: Timed | None, peer: Timed | None, bar: float, stretch: float) -> Line:
    """Build the line that compares our run with another program's."""
    aim = f"{bar:g} x (stretch {stretch:g} x)"
    if ours is None or peer is None:
        who = "we" if ours is None else "the peer"
        return Line(work, f"{who} did not reach the error", aim, MISSED if ours is None else "no comparison")
    ratio = peer.seconds / ours.seconds
    measured = f"{ratio:.3g} x: {spoken(ours)} against {spoken(peer)}"
    return Line(work, measured, aim, STRETCH if ratio >= stretch else MET if ratio >= bar else MISSED)


def spoken(run: Timed) -> str:
    """Describe the method, time and error of a run."""
    return f"{run.method} {1e3 * run.seconds:.3g} ms at {run.error:.1e}"


def at_most(work: str, value: float, unit: str, bar: float, stretch: float) -> Line:
    """Build the line of a value that should be at most a bar."""
    aim = f"{bar:g} {unit} (stretch {stretch:g})"
    return Line(work, f"{value:.3g} {unit}", aim, STRETCH if value <= stretch else MET if value <= bar else MISSED)


def rigid_lines(watch: Stopwatch) -> Iterator[Line]:
    """Measure ten rigid steps: the time that a given error costs, and the smallest error that is reached."""
    trial = printed_trial()
    reference = reference_for(trial)
    ours = cheapest(trial, reference, "dop853", 1e-9, watch, LADDER)
    for name, peer, bar, stretch in (
        ("NumPy right-hand side", USER_SCRIPT, 300, 600),
        ("our compiled right-hand side", "scipy-dop853", 100, 250),
    ):
        found = cheapest(trial, reference, peer, 1e-9, watch, LADDER)
        yield against(f"ten rigid steps at 1e-9, against SciPy DOP853 with {name}", ours, found, bar, stretch)
    errors = []
    for tolerance in (1e-12, 1e-13, 1e-14):
        run = trial.prepare("dop853", tolerance, BUDGET)()
        errors.append(float(np.max(np.abs(run.state - reference.first.state))))
    known = f" (reference {reference.first.method}, second {reference.second.method}: {reference.agreement:.1e})"
    line = at_most("ten rigid steps, smallest error", min(errors), "", 1e-13, 1e-14)
    yield replace(line, measured=line.measured.strip() + known)


def contact_peers(trial: ContactTrial, reference: Reference, watch: Stopwatch) -> dict[str, Timed | None]:
    """Time SciPy's stiff solvers on the contact walk, each at an error that it can reach."""
    return {peer: cheapest(trial, reference, peer, level, watch, LADDER[2:]) for peer, level in PEER_LEVELS.items()}


def contact_lines(
    trial: ContactTrial, reference: Reference, watch: Stopwatch, peers: dict[str, Timed | None]
) -> Iterator[Line]:
    """Compare the contact walk with SciPy's stiff solvers."""
    for (peer, found), bar, stretch in zip(peers.items(), (30, 8), (70, 20), strict=True):
        level = PEER_LEVELS[peer]
        ours = cheapest(trial, reference, "radau5", level, watch, LADDER)
        yield against(f"contact walker, 7 s at {level:g}, against {peer}", ours, found, bar, stretch)


def kneed_lines(watch: Stopwatch) -> Iterator[Line]:
    """Compare the time of a step of the kneed walker with that of the compass at the same error, in both models."""
    walkers = (ONE_DEGREE, load(Path("kneed"), ()).config)
    for work, level, method, bar, trial_of in (
        ("rigid step at 1e-9", 1e-9, "dop853", 3.0, rigid_trial_of),
        ("step of a contact walk at 2e-6", 2e-6, "radau5", 2.5, contact_trial_of),
    ):
        trials: list[Trial] = [trial_of(config) for config in walkers]
        one, other = (cheapest(trial, reference_for(trial), method, level, watch, LADDER) for trial in trials)
        if one is None or other is None:
            yield Line(f"{work}, kneed against compass", "the error was not reached", f"{bar:g} x", MISSED)
            continue
        line = at_most(f"{work}, kneed against compass", other.seconds / one.seconds, "x", bar, 0.5 * (1.0 + bar))
        yield replace(line, measured=f"{line.measured}: {spoken(other)} against {spoken(one)}, ten steps each")


def printed_trial() -> RigidTrial:
    """Build the trial of ten steps of the paper's compass at one degree, from the start that eq. 11 prints."""
    walker = rigid_walker(ONE_DEGREE, "corrected")
    start = (-2.0 * walker.slope - PRINTED_START[0], *PRINTED_START)
    return RigidTrial(walker, start, STEPS, compass(ONE_DEGREE, "corrected"))


def rigid_trial_of(config: Config) -> RigidTrial:
    """Build the trial of ten rigid steps that start near the gait of a config."""
    walker = rigid_walker(config, "corrected")
    start = scale_rates(walker, chosen_gait(config).state, START_RATE_FACTOR, START_RATE_FACTOR)
    return RigidTrial(walker, start, STEPS, compass_or_none(config, "corrected"))


def contact_trial_of(config: Config) -> ContactTrial:
    """Build the trial of ten steps with the contact of a config, from its rigid fixed point."""
    gait = chosen_gait(config)
    return contact_trial(config, tuple(gait.state), gait.step_length, STEPS)


def chosen_gait(config: Config) -> RigidGait:
    """Return the rigid gait of a config, which must have one."""
    gait = find_gaits(rigid_walker(config, "corrected"), config.seed).gait
    assert gait is not None, "there is a gait"
    return gait


def newton_lines(watch: Stopwatch) -> Iterator[Line]:
    """Time Newton's method from the small-slope seed to the fixed point at 1 degree."""
    search = Search(rigid_walker(ONE_DEGREE, "corrected"))
    seed, slope = seeds(search.walker)[0], float(search.walker.slope)
    looking = map_over_slope(search.walker, SEARCH_TOLERANCES)

    def solve() -> None:
        _, z = SlopeBranch(looking, seed).follow(slope)
        assert z is not None, "the gait can be followed"
        assert isinstance(gait_near(search.step_map, z, slope, Effort(1e-14, rounding=1e3)), Cycle), "and solved"

    yield at_most("fixed point at 1 deg from the small-slope seed", 1e3 * watch(solve), "ms", 1.0, 0.3)


def family_lines(watch: Stopwatch) -> Iterator[Line]:
    """Time families over slope: the rigid model's up to period 16, the contact model's up to its first flip."""
    config, undoubled = load().config, load(None, ["continuation.periods=1"]).config
    rigid = FamilyQuestion(config, parameter_of("slope_rad", config), ValueSpan(1e-4, 0.1))
    yield at_most("rigid branches to period 16", watch(lambda: branches_of("rigid", rigid)), "s", 5.0, 2.5)
    contact = FamilyQuestion(undoubled, parameter_of("slope_deg", undoubled), ValueSpan(0.2, 4.2))
    seconds = watch(lambda: branches_of("contact", contact))
    yield at_most("contact branch from 0.2 deg to beyond its first flip", seconds, "s", 60.0, 30.0)


def branches_of(model: str, asked: FamilyQuestion) -> None:
    """Follow the branches of a model."""
    search = search_of(model, asked, Silent())
    assert search is not None, "there is a gait to begin from"
    search.branches()


def rhs_lines(times: dict[str, float]) -> Iterator[Line]:
    """Compare the times of all right-hand sides, and that of the assembled compass with that of Appendix A."""
    typed, rigid, contact = times["Appendix A"], times["rigid"], times["contact"]
    yield at_most("right-hand side, rigid", rigid, "ns", 40, 20)
    yield at_most("right-hand side, contact", contact, "ns", 100, 60)
    work = "right-hand side assembled from parts, against Appendix A's closed form"
    yield at_most(work, rigid / typed, "x", 1.5, 1)


def batch_lines(watch: Stopwatch) -> Iterator[Line]:
    """Measure walks in lanes on one core, and basins of attraction on two."""
    trial = printed_trial()
    reference = reference_for(trial)
    many = 2_000
    seen, fates = Attractors().capture(many, STEPS), new_fates(many)
    memory, legs = new_lane_memory(RTOL, ATOL), two_legs(trial.walker)
    seconds = watch(lambda: walk_lanes(legs, memory, seen, np.array([trial.start] * many), fates))
    error = float(np.max(np.abs(seen.last - reference.first.state[1:])))
    alone = cheapest(trial, reference, "dop853", 1e-6, watch, LADDER)
    script = cheapest(trial, reference, USER_SCRIPT, 1e-6, watch, LADDER)
    rate = many * STEPS / seconds
    others = [f"{name} {STEPS / run.seconds:.3g}" for name, run in (("one by one", alone), ("SciPy", script)) if run]
    bar = MET if rate >= 1e6 and error <= 1e-6 else MISSED
    said = f"{rate:.3g} steps/s at {error:.1e} ({', '.join(others)})"
    yield Line("rigid steps in lanes, one core, at 1e-6", said, "1e+06 steps/s", bar)
    yield basin_line("basin, rigid, 1,000 x 1,000", 20.0, "basin.cells=[1000,1000]")
    yield basin_line("basin, contact, 200 x 200", 120.0, "basin.model=contact", "basin.cells=[200,200]")


def basin_line(work: str, bar: float, *sets: str) -> Line:
    """Measure a basin of the paper's walker at one degree, computed by the command with two processes, and by SciPy."""
    with tempfile.TemporaryDirectory() as folder:
        loaded = load(None, ["slope_deg=1", *sets])
        place = RunFolder(Path(folder), loaded.run_name)
        execute(loaded.config, "fixedpoint", place)
        report = execute(loaded.config, "basin", place, Options(jobs=2))
    line = at_most(f"{work}, two processes", report.wall_s, "s", bar, bar / 2.0)
    peer = peer_walks_per_s(loaded.config, report.summary)
    rates = f"{report.summary['trajectories_per_s']:.3g} walks/s (SciPy, one process: {peer:.3g})"
    return replace(line, measured=f"{line.measured}, {rates}")


def peer_walks_per_s(config: Config, basin: dict[str, Any]) -> float:
    """Return how many starts of a basin's window SciPy simulates per second, each for PEER_STEPS steps or until it
    falls.
    """
    walker = rigid_walker(config, config.equations)
    script, trial = compass(config, config.equations), contact_trial_of(ONE_DEGREE)
    scene = contact_scene(config, trial.ground.frame.leg_length, trial.ground.frame.leg_length)

    def fallen(_t: float, x: Any) -> float:
        return math.cos(x[1] + walker.slope) - FALLEN_HIP

    ending: Any = fallen
    ending.terminal = True
    generator = np.random.default_rng(config.seed)
    began = time.perf_counter()
    for _ in range(PEER_STARTS):
        drawn = {name: float(generator.uniform(*sides)) for name, sides in basin["window"].items()} | basin["held"]
        start = state_on_section(walker, [drawn[name] for name in COORDINATES])
        if basin["model"] == "rigid":
            walk_as_a_script(script, start, PEER_STEPS, RTOL, ATOL, BUDGET, ends=(ending,))
        else:
            start = start_state(scene, start)
            replace(trial, start=start, steps=PEER_STEPS).prepare("scipy-radau", MAP_RTOL, BUDGET)()
    return PEER_STARTS / (time.perf_counter() - began)


def memory_line() -> Line:
    """Measure how much more memory 10,000 strides take than 100."""
    trial = printed_trial()
    peaks = []
    for strides in (100, 10_000):
        tracemalloc.start()
        replace(trial, steps=2 * strides).prepare("dop853", 1e-8, 10**9)()
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    a_step = (peaks[1] - peaks[0]) / (2 * 9_900)
    # each step stores a time and the states before and after its heel strike
    allowed = 8 * (1 + 4 + 4)
    measured = f"{a_step:.0f} bytes a step more, its time and states are {allowed}"
    return Line(
        "memory, 10,000 strides without stored states", measured, "flat", MET if round(a_step) <= allowed else MISSED
    )


def process_line(repeats: int) -> Line:
    """Measure the time that command line, config and stored results add for a user who types one command."""
    simulate, bare = whole_process_times(repeats)
    work = "`walkerlab simulate` as a whole process, against one that imports, calls one kernel and writes one file"
    line = at_most(work, simulate / bare, "x", 1.5, 1.2)
    return replace(line, measured=f"{line.measured}: {simulate:.2f} s against {bare:.2f} s")


def join_rows(trial: ContactTrial, reference: Reference, watch: Stopwatch) -> list[list[str]]:
    """Tabulate error and work of solvers whose steps end at switching points of the force law, and of solvers whose
    steps do not.
    """
    smooth = replace(trial, ground=trial.ground._replace(frame=trial.ground.frame._replace(locate_switching=False)))
    rows = []
    for tolerance in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        cells = [f"{tolerance:.0e}"]
        for one in (trial, smooth):
            walk = one.prepare("radau5", tolerance, BUDGET)
            run = walk()
            error = float(np.max(np.abs(run.state - reference.first.state))) if run.state.size else None
            cells += [run.outcome if error is None else f"{error:.1e}", str(run.rhs_evaluations)]
            cells.append(f"{1e3 * watch(walk):.3g}")
        rows.append(cells)
    return rows


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Format a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def environment(radau: Timed | None) -> str:
    """Describe the machine, and its speed: the time of SciPy's Radau for the contact walk."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    on = f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}, {libraries}."
    if radau is None:
        return on
    slower = radau.seconds / RADAU_WHERE_BARS_WERE_SET_S
    return (
        f"{on} SciPy's Radau took {radau.seconds:.2f} s for the contact walk of the table, and "
        f"{RADAU_WHERE_BARS_WERE_SET_S} s on the machine that the bars in seconds and nanoseconds were set on: "
        f"times here are {slower:.1f} times as long as there. The verdicts make no allowance for it."
    )


def conclusion(lines: Sequence[Line]) -> str:
    """Count the bars that were met, and list those that were missed."""
    missed = [line.work for line in lines if line.verdict == MISSED]
    met = sum(line.verdict in (MET, STRETCH) for line in lines)
    said = f"{met} of {len(lines)} bars met"
    return f"{said}." if not missed else f"{said}; missed: {'; '.join(missed)}."


def all_lines(
    watch: Stopwatch,
    trial: ContactTrial,
    reference: Reference,
    peers: dict[str, Timed | None],
    sides: dict[str, float],
    repeats: int,
) -> Iterator[Line]:
    """Measure every claim in order."""
    yield from rigid_lines(watch)
    yield from kneed_lines(watch)
    yield from newton_lines(watch)
    yield from contact_lines(trial, reference, watch, peers)
    yield from rhs_lines(sides)
    yield memory_line()
    yield process_line(repeats)
    yield from family_lines(Stopwatch(3, 10.0))
    yield from batch_lines(watch)


def main() -> None:
    """Measure, print, and write the tables if requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repeats")
    parser.add_argument("--write", action="store_true", help="write the tables into docs/performance.md")
    options = parser.parse_args()
    watch = Stopwatch(3, 0.3) if options.quick else Stopwatch(9, 3.0)
    repeats = 5 if options.quick else 15
    trial = contact_trial_of(ONE_DEGREE)
    reference = reference_for(trial)
    sides = times_ns(repeats)
    lines: list[Line] = []
    peers = contact_peers(trial, reference, watch)
    for line in all_lines(watch, trial, reference, peers, sides, repeats):
        print(f"{line.work}: {line.measured}; {line.verdict}", flush=True)
        lines.append(line)
    parts = {
        "environment": f"{environment(peers['scipy-radau'])}{FEW if options.quick else ''}\n\n{conclusion(lines)}\n",
        "speed": markdown(
            ("work", "measured", "bar", "verdict"), [(one.work, one.measured, one.bar, one.verdict) for one in lines]
        ),
        "left-out": markdown(HEAD, leaving_out_rows(sides, repeats)),
        "joins": markdown(
            ("tolerance", "error, located", "rhs", "ms", "error, stepped over", "rhs", "ms"),
            join_rows(trial, reference, watch),
        ),
    }
    for text in parts.values():
        print(text)
    if options.write:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(PART.sub(lambda part: f"{part[1]}{parts[part[2]]}{part[4]}", page), encoding="utf-8")


if __name__ == "__main__":
    main()
