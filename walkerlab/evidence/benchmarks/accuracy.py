"""Stage `accuracy`: error against run time of every method on every scene, over a ladder of tolerances."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from walkerlab.config.reads import SceneConfig
from walkerlab.config.walkers import is_passive_compass
from walkerlab.evidence.benchmarks.conditions import environment, pinning_left_out, plain_power
from walkerlab.evidence.benchmarks.ladder import (
    LIBRARY_RUN_BUDGET,
    MAX_REPEATS,
    RUN_BUDGET,
    Ascent,
    MethodRow,
    ascend,
    make_row,
    omitted_tolerances,
    unit_name,
)
from walkerlab.evidence.benchmarks.references import End, Reference, WalkEndsError, first_end, second_end
from walkerlab.evidence.benchmarks.trials import USER_SCRIPT, RigidTrial, Trial
from walkerlab.evidence.benchmarks.words import words
from walkerlab.evidence.paper.walker import compass_or_none
from walkerlab.labels import labels_of
from walkerlab.physics.hybrid.recorded_walk import scale_rates
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
from walkerlab.pipeline.store.checkpoint import Checkpoint
from walkerlab.pipeline.store.columns import rows_group
from walkerlab.pipeline.store.content import Content
from walkerlab.scene.rigid import rigid_walker

ERROR_LEVELS = (1e-3, 1e-6, 1e-9)
RIGID_TRIAL_STEPS = 10
CONTACT_STEPS = 10
NEAR_RIGID_STEPS = 4
SLOW_CONTACT_STEPS = 4  # steps of walkers other than the compass; their right-hand sides take several times as long
OMISSION_OFF_COMPASS = {
    "what": "accuracy of the scene contact-near-rigid",
    "why": "only the compass has it",
    "saves": "a minute",
}
START_RATE_FACTOR = 0.98  # factor on the gait's angular velocities, so that no step repeats the previous one


def run(config: SceneConfig, inputs: Mapping[str, Content], progress: Progress, *, checkpoint: Checkpoint) -> Content:
    """Measure every method on every scene, one run after another, because run times are compared."""
    left_out: list[dict[str, Any]] = pinning_left_out(config, "methods")
    if config.contact is not None and not is_passive_compass(config):
        left_out.append(dict(OMISSION_OFF_COMPASS))
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
    """Return an end state from the checkpoint, or compute and keep it.

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
    """Yield the walks for the measurement: rigid, on compliant ground and, for the compass, near the rigid limit."""
    length, state = rigid_start(config, inputs)
    walker = rigid_walker(config)
    start = scale_rates(walker, state, START_RATE_FACTOR, START_RATE_FACTOR)
    yield RigidTrial(walker, start, RIGID_TRIAL_STEPS, compass_or_none(config, config.equations))
    if config.contact is None:
        return
    # contact code is loaded only for scenes that have contact
    from walkerlab.evidence.benchmarks.contact_trials import contact_trial, stiff_ground_trial

    compass = is_passive_compass(config)
    steps = CONTACT_STEPS if compass else SLOW_CONTACT_STEPS
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


def good_enough(rows: Sequence[MethodRow], scene: str, level: float) -> list[MethodRow]:
    """Return each method's fastest run with an error of at most `level` on a scene, fastest method first."""
    fastest: dict[str, MethodRow] = {}
    for row in sorted(rows, key=lambda row: row.wall_s):
        if row.scene == scene and row.error is not None and row.error <= level:
            fastest.setdefault(row.method, row)
    return list(fastest.values())


def best_methods(rows: Sequence[MethodRow], scene: str) -> dict[str, str]:
    """Return the fastest method for each error level that some method reaches."""
    fastest = {plain_power(level): good_enough(rows, scene, level) for level in ERROR_LEVELS}
    return {level: runs[0].method for level, runs in fastest.items() if runs}


def conclusion(rows: Sequence[MethodRow], scene: str) -> str:
    """Return a sentence on the fastest method at each error level and its lead over the best library."""
    levels = []
    for level in ERROR_LEVELS:
        runs = good_enough(rows, scene, level)
        family = runs[0].method.split("-")[0] if runs else ""
        libraries = (
            run
            for run in runs
            if run.method.split("-")[0] != family
            and run.method.startswith(("scipy", "cvode"))
            and run.method != USER_SCRIPT  # the script has its own right-hand side
        )
        levels.append((level, runs[0] if runs else None, next(libraries, None)))
    return words("accuracy.conclusion", scene, levels)
