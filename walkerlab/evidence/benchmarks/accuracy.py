"""Stage `accuracy`: error and run time of every method on every scene, over a ladder of tolerances."""

import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from typing import Annotated, Any

import numpy as np

from walkerlab.config.reads import SceneConfig
from walkerlab.config.walkers import is_passive_compass
from walkerlab.evidence.benchmarks.conditions import environment, pinning_omissions, plain_power
from walkerlab.evidence.benchmarks.references import End, Reference, WalkEndsError, first_end, second_end
from walkerlab.evidence.benchmarks.trials import (
    USER_SCRIPT,
    RigidTrial,
    Trial,
    TrialRun,
    contact_trial,
    stiff_ground_trial,
)
from walkerlab.evidence.benchmarks.words import words
from walkerlab.evidence.paper.appendix_a import compass_or_none
from walkerlab.labels import Label, labels_of
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import scale_rates
from walkerlab.physics.solvers.registry import METHODS
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
from walkerlab.pipeline.store.content import Content, rows_group
from walkerlab.pipeline.store.files import Checkpoint, Numbers
from walkerlab.scene.omissions import omission
from walkerlab.scene.rigid import rigid_walker

# The run sizes below are numbers of right-hand-side evaluations.
RUN_BUDGET = 200_000  # limit of a compiled run, so that hopeless runs end
# The steps of a library run in Python, so a right-hand side takes a hundred times as long.
LIBRARY_RUN_BUDGET = 20_000  # limit of a run with a library
LAST_RUN_SIZE = 12_000  # a library is not run at tighter tolerances once a run reaches this size
WARM_UP_BUDGET = 2_000  # enough right-hand sides to compile and load everything
MAX_REPEATS = 7
REPEAT_TIME_S = 0.2  # time for all repeats of a run
OWN_LADDER = tuple(10.0**-digits for digits in range(3, 13))
LIBRARY_LADDER = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
OUTCOME_LABELS = tuple(outcome.label for outcome in Outcome)
ERROR_LABEL = Label("1", "largest difference of the end state from the reference, SI units", absent=0.0)


@dataclass(frozen=True)
class MethodRun:
    tolerance: float
    result: TrialRun
    walls_s: tuple[float, ...]

    def pack(self) -> Numbers:
        """Convert the run to numbers for a checkpoint. `unpack` converts them back."""
        run = self.result
        counts = run.rhs_evaluations, run.accepted, run.rejected
        state = run.state.tolist()
        return [self.tolerance, OUTCOME_LABELS.index(run.outcome), *counts, len(state), *state, *self.walls_s]

    @classmethod
    def unpack(cls, numbers: Numbers) -> "MethodRun":
        tolerance, outcome, *counts, size = numbers[:6]
        end = 6 + int(size)
        run = TrialRun(OUTCOME_LABELS[int(outcome)], np.array(numbers[6:end]), *map(int, counts))
        return cls(tolerance, run, tuple(numbers[end:]))


@dataclass(frozen=True)
class Ascent:
    """Runs of one method on one scene, from loose to tight tolerance."""

    trial: Trial
    method: str
    ladder: tuple[float, ...]  # all tolerances, including those that were not run
    runs: tuple[MethodRun, ...]


@dataclass(frozen=True)
class MethodRow:
    scene: str
    method: Annotated[str, Label("1", "method")]
    tolerance: Annotated[float, Label("1", "relative tolerance")]
    outcome: Annotated[str, Label("1", "outcome")]
    error: Annotated[float | None, ERROR_LABEL]
    against: Annotated[str, Label("1", "method of the reference end state")]  # always another method
    within_reference: bool  # whether the error is below the reference's uncertainty
    wall_s: Annotated[float, Label("s", "median run time", timing=True)]
    least_wall_s: Annotated[float, Label("s", "shortest run time", timing=True)]
    largest_wall_s: Annotated[float, Label("s", "longest run time", timing=True)]
    repeats_of_wall_s: Annotated[int, Label("1", "timed repeats", timing=True, name="repeats")]
    rhs_evaluations: Annotated[int, Label("1", "right-hand sides")]
    accepted: Annotated[int, Label("1", "accepted steps")]
    rejected: Annotated[int, Label("1", "rejected steps")]

    @property
    def reached(self) -> Annotated[int, Label("1", "whether the end state was reached")]:
        """1 if the run reached the end state, so that its error is known, otherwise 0."""
        return int(self.error is not None)


def unit_name(*parts: object) -> str:
    """Name a measurement in a checkpoint. Run times of different machines differ, so the name contains the machine."""
    return "/".join(map(str, (platform.node(), *parts)))


def ascend(trial: Trial, method: str, checkpoint: Checkpoint) -> Ascent:
    """Run a method at tighter and tighter tolerances until it is too expensive. Runs in the checkpoint are reused."""
    compiled = method in METHODS and METHODS[method].compiled
    ladder = OWN_LADDER if compiled else LIBRARY_LADDER
    budget = RUN_BUDGET if compiled else LIBRARY_RUN_BUDGET
    last = RUN_BUDGET if compiled else LAST_RUN_SIZE
    trial.prepare(method, ladder[0], WARM_UP_BUDGET)()
    runs: list[MethodRun] = []
    for tolerance in ladder:
        unit = unit_name(trial.name, method, tolerance)
        if unit not in checkpoint.kept:
            checkpoint.keep(unit, measure(trial, method, tolerance, budget).pack())
        runs.append(MethodRun.unpack(checkpoint.kept[unit]))
        if runs[-1].result.rhs_evaluations >= last:
            break
    return Ascent(trial, method, ladder, tuple(runs))


def measure(trial: Trial, method: str, tolerance: float, budget: int) -> MethodRun:
    """Time a walk up to `MAX_REPEATS` times within `REPEAT_TIME_S`."""
    # The first walk also loads data into caches. It counts only if it is so long that this does not matter.
    walk = trial.prepare(method, tolerance, budget)
    first_s, result = time_walk(walk)
    walls = [first_s] if first_s > REPEAT_TIME_S else []
    while len(walls) < MAX_REPEATS and (not walls or sum(walls) + walls[-1] <= REPEAT_TIME_S):
        walls.append(time_walk(walk)[0])
    return MethodRun(tolerance, result, tuple(walls))


def time_walk(walk: Callable[[], TrialRun]) -> tuple[float, TrialRun]:
    start = time.perf_counter()
    result = walk()
    return time.perf_counter() - start, result


def make_row(ascent: Ascent, run: MethodRun, reference: Reference) -> MethodRow:
    end = reference.reference_for(ascent.method)
    result = run.result
    error = float(np.max(np.abs(result.state - end.state))) if result.state.size else None
    return MethodRow(
        scene=ascent.trial.name,
        method=ascent.method,
        tolerance=run.tolerance,
        outcome=result.outcome,
        error=error,
        against=end.method,
        within_reference=error is not None and error <= reference.agreement,
        wall_s=median(run.walls_s),
        least_wall_s=min(run.walls_s),
        largest_wall_s=max(run.walls_s),
        repeats_of_wall_s=len(run.walls_s),
        rhs_evaluations=result.rhs_evaluations,
        accepted=result.accepted,
        rejected=result.rejected,
    )


def omitted_tolerances(ascent: Ascent) -> list[dict[str, Any]]:
    """List the tolerances that were not run, with the reason."""
    last = ascent.runs[-1]
    why = f"already {last.result.outcome} with {last.result.rhs_evaluations} right-hand sides at {last.tolerance:g}"
    return [
        {"scene": ascent.trial.name, "method": ascent.method, "tolerance": rtol, "why": why}
        for rtol in ascent.ladder[len(ascent.runs) :]
    ]


ERROR_LEVELS = (1e-3, 1e-6, 1e-9)
RIGID_TRIAL_STEPS = 10
CONTACT_TRIAL_STEPS = 10
NEAR_RIGID_STEPS = 4
SLOW_CONTACT_STEPS = 4  # for walkers other than the compass, whose right-hand sides take several times as long
OMISSION_OFF_COMPASS = omission("accuracy of the scene contact-near-rigid", "only the compass has it", "a minute")
START_RATE_FACTOR = 0.98  # factor applied to the gait's velocities, because on the gait itself all steps are the same


def run(config: SceneConfig, inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint) -> Content:
    """Measure every method on every scene. Run times are compared, so no two runs take place at once."""
    left_out: list[dict[str, Any]] = pinning_omissions(config, "methods")
    if config.contact is not None and not is_passive_compass(config):
        left_out.append(OMISSION_OFF_COMPASS)
    references: dict[str, Reference] = {}
    ascents: list[Ascent] = []
    trials = [*trials_of_scene(config, inputs)]
    progress.start("accuracy", sum(len(trial.methods) for trial in trials))
    for trial in trials:
        try:
            second = resumed_end(trial, "second end", second_end, checkpoint)
            references[trial.name] = Reference(resumed_end(trial, "first end", first_end, checkpoint), second)
        except WalkEndsError as problem:
            left_out.append(omitted_scene(trial, problem))
            progress.advance(len(trial.methods))
            continue
        for method in trial.methods:
            ascents.append(ascend(trial, method, checkpoint))
            progress.advance()
    rows = [make_row(ascent, run, references[ascent.trial.name]) for ascent in ascents for run in ascent.runs]
    not_run = [entry for ascent in ascents for entry in omitted_tolerances(ascent)]
    summary = {**summarise(rows, not_run, references), "left_out": left_out}
    groups = {
        f"{scene}/rows": rows_group([row for row in rows if row.scene == scene], labels_of(MethodRow))
        for scene in references
    }
    return Content(groups, summary, timed=("best", "conclusions", "environment"))


def resumed_end(trial: Trial, name: str, compute: Callable[[Trial], End], checkpoint: Checkpoint) -> End:
    """Return an end state from the checkpoint, or compute it and add it there.

    Raises WalkEndsError if the walk ends early.
    """
    unit = unit_name(trial.name, name)
    if unit not in checkpoint.kept:
        checkpoint.keep(unit, compute(trial).pack())
    return End.unpack(checkpoint.kept[unit])


def omitted_scene(trial: Trial, why: WalkEndsError) -> dict[str, Any]:
    start = f"started with velocities scaled by {START_RATE_FACTOR}, " if isinstance(trial, RigidTrial) else ""
    return {"what": f"accuracy of the scene {trial.name}", "why": f"{start}{why}"}


def trials_of_scene(config: SceneConfig, inputs: Mapping[str, Content]) -> Iterator[Trial]:
    """Yield the walks to measure: in the rigid model, on compliant ground and, for a compass, on near-rigid ground."""
    length, state = rigid_start(config, inputs)
    walker = rigid_walker(config)
    start = scale_rates(walker, state, START_RATE_FACTOR, START_RATE_FACTOR)
    yield RigidTrial(walker, start, RIGID_TRIAL_STEPS, compass_or_none(config, config.equations))
    if config.contact is None:
        return
    compass = is_passive_compass(config)
    steps = CONTACT_TRIAL_STEPS if compass else SLOW_CONTACT_STEPS
    yield contact_trial(config, state, length, steps, step_asymmetry(config, inputs))
    if compass:
        yield stiff_ground_trial(config, state, length, NEAR_RIGID_STEPS)


def summarise(
    rows: Sequence[MethodRow], not_run: list[dict[str, Any]], references: Mapping[str, Reference]
) -> dict[str, Any]:
    return {
        "rows": [asdict(row) for row in rows],
        "repeats": MAX_REPEATS,
        "rigid_velocity_factor": START_RATE_FACTOR,
        "budget": RUN_BUDGET,
        "library_budget": LIBRARY_RUN_BUDGET,
        "reference": {
            name: {
                "method": reference.first.method,
                "second_method": reference.second.method,
                "agreement": reference.agreement,
                "state": reference.first.state,
                "from_outside": reference.from_outside,
                "tolerance": reference.first.tolerance,
                "rhs_evaluations": reference.first.rhs_evaluations,
            }
            for name, reference in references.items()
        },
        "best": {scene: best_methods(rows, scene) for scene in references},
        "conclusions": {scene: conclusion(rows, scene) for scene in references},
        "not_run": not_run,
        "environment": environment(),
    }


def fastest_runs(rows: Sequence[MethodRow], scene: str, level: float) -> list[MethodRow]:
    """Return the fastest run of each method on a scene with an error of at most `level`, the fastest method first."""
    fastest: dict[str, MethodRow] = {}
    for row in sorted(rows, key=lambda row: row.wall_s):
        if row.scene == scene and row.error is not None and row.error <= level:
            fastest.setdefault(row.method, row)
    return list(fastest.values())


def best_methods(rows: Sequence[MethodRow], scene: str) -> dict[str, str]:
    """Return the fastest method for each error level that some method reaches."""
    fastest = {plain_power(level): fastest_runs(rows, scene, level) for level in ERROR_LEVELS}
    return {level: runs[0].method for level, runs in fastest.items() if runs}


def conclusion(rows: Sequence[MethodRow], scene: str) -> str:
    """Return a sentence on which method is fastest at each error level, and by how much it beats the best library."""
    levels = []
    for level in ERROR_LEVELS:
        runs = fastest_runs(rows, scene, level)
        family = runs[0].method.split("-")[0] if runs else ""
        libraries = (
            run
            for run in runs
            if run.method.split("-")[0] != family
            and run.method.startswith(("scipy", "cvode"))
            and run.method != USER_SCRIPT  # the script does not use the compiled right-hand side
        )
        levels.append((level, runs[0] if runs else None, next(libraries, None)))
    return words("accuracy.conclusion", scene, levels)
