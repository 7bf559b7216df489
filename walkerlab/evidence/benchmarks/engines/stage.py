"""Stage `engines`: error against run time in other engines, for the walkers that they support.

The engines first integrate our contact law, then their native contact.
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from walkerlab import __version__
from walkerlab.config.reads import ContactConfig, SceneConfig
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.evidence.benchmarks.conditions import environment, pinning_omissions, plain_power
from walkerlab.evidence.benchmarks.engines import experiments
from walkerlab.evidence.benchmarks.engines.experiments import EngineOnScene, OwnProcess, TaskLost
from walkerlab.evidence.benchmarks.engines.registry import EXTRA, PHYSICS_ENGINES, installed
from walkerlab.evidence.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW, EngineRow, SwingRow, TuningRow
from walkerlab.evidence.benchmarks.words import words
from walkerlab.exchange.engine_scene import EngineScene, contact_target, engine_scene
from walkerlab.exchange.planar import SMALLEST_BALL_M
from walkerlab.labels import labels_of
from walkerlab.physics.ground.knees import IdealLock
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.hybrid.contact_state import knees_at_start
from walkerlab.physics.solvers.system import State
from walkerlab.pipeline.progress import Progress
from walkerlab.pipeline.stages.walk import rigid_start, step_asymmetry
from walkerlab.pipeline.store.content import Content, rows_group
from walkerlab.scene.contact import knee_rules
from walkerlab.scene.parts import assembly_of


def supported_scene(
    config: ContactConfig, rigid_step_length_m: float, rigid_state: State, asymmetry: float = 0.0
) -> EngineScene:
    """Return the scene of a config for engines, as `engine_scene` does.

    Raises ConfigError for a walker that other engines do not support.
    """
    assembly = assembly_of(config.walker)
    if assembly.couplings:
        raise ConfigError(
            "engines: a torso held on the bisector is a constraint that the engine models do not support.",
            "Choose a walker without a torso.",
        )
    if assembly.knees and not isinstance(knee_rules(config.walker).stop, IdealLock):
        raise ConfigError(
            "engines: the engine models do not support a knee's compliant stop.", "Choose walker.knee.lock: ideal."
        )
    points = [foot.radius_m < SMALLEST_BALL_M for foot in assembly.feet]
    if any(points) and not all(points):
        raise ConfigError(
            "engines: a small ball replaces the point foot, so the two feet need ground at different heights.",
            f"Set the radius of the point foot to {SMALLEST_BALL_M:g} m, or make both feet points.",
        )
    scene = engine_scene(config, rigid_step_length_m, rigid_state, asymmetry)
    return scene.lock_knees(knees_at_start(scene.ours, STANCE_FOOT, scene.start))


RATIO_LEVELS = (1e-3, 1e-5)
THREE_DIGITS = 5e-4  # largest relative error of a value with three correct digits


@dataclass
class EngineFindings:
    """Results of the stage, to which rows are added one by one."""

    rows: list[EngineRow] = field(default_factory=list)
    swings: list[SwingRow] = field(default_factory=list)
    tuning: list[TuningRow] = field(default_factory=list)
    left_out: list[dict[str, str]] = field(default_factory=list)

    def add(self, findings: "EngineFindings") -> None:
        for name in ("rows", "swings", "tuning", "left_out"):
            getattr(self, name).extend(getattr(findings, name))


def run(config: SceneConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1) -> Content:
    """Measure all installed engines, `jobs` at a time.

    Raises NoAnswer if no engine is installed, or if our walk ends too early.
    """
    engines = installed()
    findings = EngineFindings(left_out=[*missing_engines(), *pinning_omissions(config, "engines")])
    if not engines:
        raise NoAnswer("engines: no engine is installed", f"Install them: {EXTRA}")
    rigid = inputs["fixedpoint"].summary if "fixedpoint" in inputs else None
    scene = supported_scene(config, *rigid_start(config, inputs), step_asymmetry(config, inputs))
    truth = experiments.make_truth(scene)
    if truth is None:
        raise NoAnswer(
            "engines: under ADAMS's contact law, the walk ends too early",
            "Start closer to a gait (start: fixed-point).",
        )
    progress.start(f"engines: {scene.name}", len(engines) + 1)
    findings.rows += experiments.our_rows(scene, truth, __version__)
    progress.advance()
    pairs = [EngineOnScene(engine, scene, truth, OwnProcess()) for engine in engines]
    for measured in measure_all(pairs, jobs):
        findings.add(measured)
        progress.advance()
    return make_content(findings, scene.name, truth, rigid)


def measure_all(pairs: Sequence[EngineOnScene], jobs: int) -> Iterator[EngineFindings]:
    """Yield the results of each engine, `jobs` engines at a time. An interruption kills the running engines."""
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        try:
            yield from pool.map(measure, pairs)
        except BaseException:
            for pair in pairs:
                pair.process.abandon()
            raise


def missing_engines() -> list[dict[str, str]]:
    return [
        {"what": f"engine {engine.name}", "why": f"not installed: {engine.install_line}"}
        for engine in PHYSICS_ENGINES.values()
        if not engine.is_installed
    ]


def measure(pair: EngineOnScene) -> EngineFindings:
    findings = EngineFindings()
    name = pair.engine.name
    target = contact_target(pair.scene)
    with pair.process:
        findings.swings, lost = pair.swings()
        findings.left_out += [{"what": f"a swing in {name}", "why": failure.reason} for failure in lost]
        findings.rows += pair.same_law()
        if target is None:
            findings.left_out.append({"what": f"own contact of {name}", "why": "the ground has no friction"})
            return findings
        for contact in pair.engine.adapter().CONTACTS:
            tuned = pair.tune(contact, target)
            if isinstance(tuned, TaskLost):
                findings.left_out.append({"what": f"contact {contact} of {name}", "why": tuned.reason})
                continue
            own, rows = tuned
            findings.tuning += rows
            findings.rows += pair.own_law(contact, own)
    return findings


def make_content(
    findings: EngineFindings, scene: str, truth: experiments.Truth, rigid: Mapping[str, Any] | None
) -> Content:
    """Build the groups and the summary of the stage's result.

    rigid  summary of `fixedpoint`, or None if neither the start nor the pads need a gait
    """
    rows = findings.rows
    stored = (("rows", EngineRow, rows), ("swings", SwingRow, findings.swings), ("tuning", TuningRow, findings.tuning))
    groups = {name: rows_group(table, labels_of(kind)) for name, kind, table in stored if table}
    engines = [engine for engine in installed() if any(row.engine == engine.name for row in rows)]
    reference = {
        "until_s": truth.until_s,
        "agreement": truth.agreement,
        "period_s": float(truth.walk.periods_s[-1]),
        "step_length_m": float(truth.walk.lengths_m[-1]),
        "steps": truth.walk.steps,
        "outcome": truth.walk.outcome.label,
    }
    if rigid is not None:
        reference |= {f"rigid_{key}": rigid[key] for key in ("period_s", "step_length_m")}
    summary = {
        "rows": [asdict(row) for row in rows],
        "swings": [asdict(row) for row in findings.swings],
        "tuning": [{**asdict(row), "residual": row.residual} for row in findings.tuning],
        "reference": {scene: reference},
        "versions": {engine.name: engine.version for engine in engines},
        "cannot_express": {engine.name: list(engine.adapter().CANNOT_EXPRESS) for engine in engines},
        "closest": {scene: closest(rows)},
        "three_digits_step_s": {scene: three_digits(rows, truth)},
        "convergence": {scene: convergence(rows)},
        "integrators": {
            engine.name: {name: asdict(integrator) for name, integrator in engine.adapter().INTEGRATORS.items()}
            for engine in engines
        },
        "contacts": {engine.name: dict(engine.adapter().CONTACTS) for engine in engines},
        "ratios": {scene: ratios(rows)},
        "conclusions": {scene: conclusions(rows, truth)},
        "environment": environment(),
        "left_out": findings.left_out,
    }
    return Content(groups, summary, timed=("ratios", "conclusions", "environment"))


def series_by_name(rows: Sequence[EngineRow], experiment: str) -> dict[str, list[EngineRow]]:
    """Return the rows of an experiment that start on the gait, from coarse to fine, by engine and integrator."""
    series: dict[str, list[EngineRow]] = {}
    for row in rows:
        if row.experiment == experiment and row.engine != OURS and row.start == 1.0:
            series.setdefault(f"{row.engine} {row.integrator}", []).append(row)
    return series


def ratios(rows: Sequence[EngineRow]) -> dict[str, dict[str, float]]:
    """Return the run time of each engine with our contact law, divided by ours, for each error level both reach."""
    by_engine: dict[str, list[EngineRow]] = {}
    for row in rows:
        if row.experiment == SAME_LAW and row.start == 1.0:
            by_engine.setdefault(row.engine, []).append(row)
    ours = by_engine.pop(OURS, [])
    factors: dict[str, dict[str, float]] = {}
    for level in RATIO_LEVELS:
        ours_s = experiments.least_wall(ours, level)
        for engine, runs in by_engine.items():
            engine_s = experiments.least_wall(runs, level)
            if ours_s is not None and engine_s is not None:
                factors.setdefault(plain_power(level), {})[engine] = engine_s / ours_s
    return factors


def closest(rows: Sequence[EngineRow]) -> dict[str, Any] | None:
    """Return the native contact whose walk at the finest step is closest to that of ADAMS's law, or None if no walk was
    completed."""
    finest = [series[-1] for series in series_by_name(rows, OWN_LAW).values()]
    reached = [row for row in finest if row.error is not None and row.steps == experiments.OWN_TOUCHES]
    if not reached:
        return None
    best = min(reached, key=lambda row: float(row.error or 0.0))
    return {"engine": best.engine, "contact": best.integrator, "step_s": best.step_s, "period_error_s": best.error}


def three_digits(rows: Sequence[EngineRow], truth: experiments.Truth) -> dict[str, dict[str, float]]:
    """Return the largest step (s) that gives three correct digits of the last period, by experiment and series name."""
    # With our contact law, correct digits are counted against the reference. Native contact has no reference, so they
    # are counted against its finest run.
    steps: dict[str, dict[str, float]] = {SAME_LAW: {}, OWN_LAW: {}}
    exact = float(np.diff(truth.touches_s)[-1])
    for experiment in steps:
        for name, runs in series_by_name(rows, experiment).items():
            step = largest_good_step(runs, experiment, exact if experiment == SAME_LAW else runs[-1].period_s)
            if step is not None:
                steps[experiment][name] = step
    return steps


def largest_good_step(runs: Sequence[EngineRow], experiment: str, target: float | None) -> float | None:
    """Return the largest step (s) up to which all runs have three correct digits, or None if there is no such step."""
    good = None
    if target is None:
        return None
    for row in reversed(runs):
        if row.outcome != "walked" or row.period_s is None or abs(row.period_s / target - 1.0) > THREE_DIGITS:
            break
        good = row.step_s
    # On native contact the finest run is the target itself, so its digits prove nothing.
    finest_only = experiment == OWN_LAW and good == runs[-1].step_s
    return None if finest_only else good


def convergence(rows: Sequence[EngineRow]) -> dict[str, dict[str, float]]:
    """Return the effect of the last refinement of each series, by experiment and name of the series.

    With our contact law it is the factor by which the error fell, and with native contact the change of the period (s).
    """
    effects: dict[str, dict[str, float]] = {SAME_LAW: {}, OWN_LAW: {}}
    for experiment, by_name in effects.items():
        for name, runs in series_by_name(rows, experiment).items():
            if len(runs) < 2 or not runs[-2].error or not runs[-1].error:
                continue
            change = abs(float(runs[-1].period_s or 0.0) - float(runs[-2].period_s or 0.0))
            by_name[name] = runs[-2].error / runs[-1].error if experiment == SAME_LAW else change
    return effects


def conclusions(rows: Sequence[EngineRow], truth: experiments.Truth) -> dict[str, str]:
    same, own = (series_by_name(rows, experiment) for experiment in (SAME_LAW, OWN_LAW))
    sizes = three_digits(rows, truth)
    changes = convergence(rows)
    shares = ratios(rows)
    by_level = {label: shares.get(label, {}) for label in map(plain_power, RATIO_LEVELS)}
    engines = list(dict.fromkeys(runs[0].engine for runs in same.values()))
    falling = {name: by for name, by in changes[SAME_LAW].items() if same[name][-1].tolerance is None}
    finest = [runs[-1] for runs in own.values()]
    settled = [name for name in changes[OWN_LAW] if experiments.has_settled(*own[name][-2:])]
    period = float(truth.walk.periods_s[-1])
    goal = plain_power(experiments.ERROR_GOAL)
    return {
        SAME_LAW: words("engines.same_law", by_level, engines, sizes[SAME_LAW], falling, goal),
        OWN_LAW: words("engines.own_law", closest(rows), finest, period, changes[OWN_LAW], settled, sizes[OWN_LAW]),
    }
