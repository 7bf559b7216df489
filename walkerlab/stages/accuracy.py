"""Error against run time: every method on every scene of the config, over a ladder of tolerances."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.schema import Config
from walkerlab.scene.references import Reference, WalkEndsError, reference_for
from walkerlab.scene.rigid import rigid_walker
from walkerlab.scene.trials import RigidTrial, Trial, TrialRun
from walkerlab.solvers.registry import METHODS
from walkerlab.stages.progress import Progress
from walkerlab.store.content import Content, Group, Variable

BUDGET = 200_000  # right-hand sides of one run of ours
LIBRARY_BUDGET = 25_000  # of a library's, whose walk in Python costs a hundred times as much for each
WARM_UP_BUDGET = 2_000  # right-hand sides after which everything is compiled and loaded
LONG_LIBRARY_RUN = 12_000  # right-hand sides of a library's run that is the last of its ladder
REPEATS, REPEAT_TIME_S = 7, 0.3
OWN_LADDER = tuple(10.0**-digits for digits in range(3, 13))
LIBRARY_LADDER = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
LEVELS = (1e-3, 1e-6, 1e-9)
RIGID_STEPS, CONTACT_STEPS, NEAR_RIGID_STEPS = 10, 10, 4
OFF_THE_GAIT = 0.98  # of the gait's angular velocities, so that no step repeats the one before


@dataclass(frozen=True)
class Row:
    """One method at one tolerance."""

    scene: str
    method: str
    tolerance: float
    outcome: str
    error: float | None  # largest difference of the end state from the reference; None if the end was not reached
    wall_s: float  # median of the repeats
    least_wall_s: float
    repeats_of_wall_s: int  # how many the median is of
    rhs_evaluations: int
    accepted: int
    rejected: int


def run(config: Config, inputs: Mapping[str, Content], progress: Progress) -> Content:
    """Measure every method on every scene."""
    rows: list[Row] = []
    not_run: list[dict[str, Any]] = []
    references: dict[str, Reference] = {}
    left_out = []
    for trial in scenes(config, inputs):
        progress.start(f"accuracy: {trial.name}", len(trial.methods))
        try:
            references[trial.name] = reference_for(trial)
        except WalkEndsError as problem:
            left_out.append({"what": f"accuracy of the scene {trial.name}", "why": str(problem)})
            continue
        for method in trial.methods:
            measured, left = climb(trial, method, references[trial.name])
            rows += measured
            not_run += left
            progress.advance()
    summary = {**summary_of(rows, not_run, references), "left_out": left_out}
    groups = {f"{scene}/rows": rows_group([row for row in rows if row.scene == scene]) for scene in references}
    return Content(groups, summary, timed=("best", "conclusions"))


def scenes(config: Config, inputs: Mapping[str, Content]) -> Iterator[Trial]:
    """The walks to measure by: rigid, and with a contact block the contact as it is and near the rigid limit."""
    state = inputs["fixedpoint"].summary["state"] if config.start == "fixed-point" else config.start
    start = (state[0], state[1], OFF_THE_GAIT * state[2], OFF_THE_GAIT * state[3])
    yield RigidTrial(rigid_walker(config, config.equations), start, RIGID_STEPS)
    if config.contact is None:
        return
    # contact code is loaded only for scenes that have contact
    from walkerlab.scene.contact_trials import contact_trial, near_rigid_trial

    length = float(inputs["fixedpoint"].summary["step_length_m"]) if "fixedpoint" in inputs else None
    given = tuple(float(x) for x in state)
    yield contact_trial(config, given, length, CONTACT_STEPS)
    yield near_rigid_trial(config, given, length, NEAR_RIGID_STEPS)


def climb(trial: Trial, method: str, reference: Reference) -> tuple[list[Row], list[dict[str, Any]]]:
    """One method over its ladder of tolerances, until a run takes too much; and what was not run, and why."""
    own = method in METHODS and METHODS[method].compiled
    ladder, budget = (OWN_LADDER, BUDGET) if own else (LIBRARY_LADDER, LIBRARY_BUDGET)
    longest = budget if own else LONG_LIBRARY_RUN
    trial.prepare(method, ladder[0], WARM_UP_BUDGET)()
    rows: list[Row] = []
    for index, tolerance in enumerate(ladder):
        row = measure(trial, method, tolerance, budget, reference)
        rows.append(row)
        if row.rhs_evaluations >= longest:
            why = f"{row.outcome} with {row.rhs_evaluations} right-hand sides at {tolerance:g} already"
            left = ladder[index + 1 :]
            return rows, [{"scene": trial.name, "method": method, "tolerance": rtol, "why": why} for rtol in left]
    return rows, []


def measure(trial: Trial, method: str, tolerance: float, budget: int, reference: Reference) -> Row:
    """Run once to warm up, then as often as time allows."""
    walk = trial.prepare(method, tolerance, budget)
    first_s, result = timed(walk)
    walls = [first_s] if first_s > REPEAT_TIME_S else []
    while len(walls) < REPEATS and (not walls or sum(walls) + walls[-1] <= REPEAT_TIME_S):
        walls.append(timed(walk)[0])
    error = float(np.max(np.abs(result.state - reference.state))) if result.state.size else None
    return Row(
        trial.name,
        method,
        tolerance,
        result.outcome,
        error,
        median(walls),
        min(walls),
        len(walls),
        result.rhs_evaluations,
        result.accepted,
        result.rejected,
    )


def timed(walk: Callable[[], TrialRun]) -> tuple[float, TrialRun]:
    """Seconds that a walk takes, and its result."""
    start = time.perf_counter()
    result = walk()
    return time.perf_counter() - start, result


def summary_of(
    rows: Sequence[Row], not_run: list[dict[str, Any]], references: Mapping[str, Reference]
) -> dict[str, Any]:
    """What the command prints."""
    return {
        "rows": [asdict(row) for row in rows],
        "repeats": REPEATS,
        "budgets": {"own": BUDGET, "library": LIBRARY_BUDGET},
        "reference": {
            name: {
                "method": reference.method,
                "second_method": reference.second_method,
                "agreement": reference.agreement,
                "state": reference.state.tolist(),
            }
            for name, reference in references.items()
        },
        "best": {scene: best_methods(rows, scene) for scene in references},
        "conclusions": {scene: conclusion(rows, scene) for scene in references},
        "not_run": not_run,
        "environment": {"processor": platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()},
    }


def good_enough(rows: Sequence[Row], scene: str, level: float) -> dict[str, Row]:
    """For each method that reaches an error of `level` on a scene, its fastest run that does."""
    best: dict[str, Row] = {}
    for row in rows:
        if row.scene != scene or row.error is None or row.error > level:
            continue
        if row.method not in best or row.wall_s < best[row.method].wall_s:
            best[row.method] = row
    return best


def best_methods(rows: Sequence[Row], scene: str) -> dict[str, str]:
    """The fastest method for each level of error that some method reaches."""
    found = {}
    for level in LEVELS:
        candidates = good_enough(rows, scene, level)
        if candidates:
            found[f"{level:.0e}".replace("e-0", "e-")] = min(candidates.values(), key=lambda row: row.wall_s).method
    return found


def conclusion(rows: Sequence[Row], scene: str) -> str:
    """One sentence: which method is fastest at which error, and by how much over the best library's."""
    parts = []
    for level in LEVELS:
        candidates = sorted(good_enough(rows, scene, level).values(), key=lambda row: row.wall_s)
        if not candidates:
            parts.append(f"no method reaches {level:.0e}")
            continue
        first = candidates[0]
        others = [row for row in candidates if row.method.split("-")[0] != first.method.split("-")[0]]
        library = [row for row in others if row.method.startswith(("scipy", "cvode"))]
        text = f"at {level:.0e}, {first.method} is fastest with {1e3 * first.wall_s:.3g} ms"
        if library:
            text += f", {library[0].wall_s / first.wall_s:.3g} times faster than {library[0].method}"
        parts.append(text)
    return f"{scene}: " + "; ".join(parts) + "."


def rows_group(rows: Sequence[Row]) -> Group:
    """The rows of one scene; the error is masked where the end was not reached."""

    def numbers(name: str) -> NDArray[Any]:
        return np.array([getattr(row, name) for row in rows])

    reached = np.array([row.error is not None for row in rows], np.int8)
    error = np.array([0.0 if row.error is None else row.error for row in rows])
    row_axis = ("row",)
    return Group(
        {
            "row": Variable(np.arange(len(rows)), row_axis, "1", "row"),
            "method": Variable(np.array([row.method for row in rows], dtype=object), row_axis, "1", "method"),
            "outcome": Variable(np.array([row.outcome for row in rows], dtype=object), row_axis, "1", "outcome"),
            "tolerance": Variable(numbers("tolerance"), row_axis, "1", "relative tolerance"),
            "reached": Variable(reached, row_axis, "1", "whether the end state was reached"),
            "error": Variable(error, row_axis, "1", "largest difference of the end state from the reference, SI units"),
            "wall_s": Variable(numbers("wall_s"), row_axis, "s", "median run time", timing=True),
            "least_wall_s": Variable(numbers("least_wall_s"), row_axis, "s", "least run time", timing=True),
            "repeats": Variable(numbers("repeats_of_wall_s"), row_axis, "1", "timed repeats", timing=True),
            "rhs_evaluations": Variable(numbers("rhs_evaluations"), row_axis, "1", "right-hand sides"),
            "accepted": Variable(numbers("accepted"), row_axis, "1", "accepted steps"),
            "rejected": Variable(numbers("rejected"), row_axis, "1", "rejected steps"),
        }
    )
