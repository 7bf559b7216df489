"""Stage `engines`: our law in other engines' integrators, then their own contact; error against run time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from walkerlab import __version__
from walkerlab.benchmarks.conditions import environment, hinge_left_out, plain_power
from walkerlab.benchmarks.engines import experiments
from walkerlab.benchmarks.engines.experiments import EngineOnScene
from walkerlab.benchmarks.engines.process import OwnProcess, TaskLost
from walkerlab.benchmarks.engines.registry import ENGINES, EXTRA, installed
from walkerlab.benchmarks.engines.rows import OURS, OWN_LAW, SAME_LAW, EngineRow, SwingRow, TuningRow
from walkerlab.benchmarks.engines.scenes import scenes
from walkerlab.benchmarks.words import words
from walkerlab.config.reads import SceneConfig
from walkerlab.errors import NoAnswer
from walkerlab.labels import labels_of
from walkerlab.pipeline.progress import Progress
from walkerlab.stages.walk import rigid_start
from walkerlab.store.columns import rows_group
from walkerlab.store.content import Content

LEVELS = (1e-3, 1e-5)
THREE_DIGITS = 5e-4  # relative


@dataclass
class EngineFindings:
    """Results of the stage, collected row by row."""

    rows: list[EngineRow] = field(default_factory=list)
    swings: list[SwingRow] = field(default_factory=list)
    tuning: list[TuningRow] = field(default_factory=list)
    truths: dict[str, experiments.Truth] = field(default_factory=dict)
    left_out: list[dict[str, str]] = field(default_factory=list)

    def add(self, other: EngineFindings) -> None:
        for name in ("rows", "swings", "tuning", "left_out"):
            getattr(self, name).extend(getattr(other, name))


def run(config: SceneConfig, inputs: Mapping[str, Content], progress: Progress, jobs: int = 1) -> Content:
    """Measure every installed engine on every scene, `jobs` at a time; raises NoAnswer if none is installed."""
    engines = installed()
    found = EngineFindings(left_out=[*not_installed(), *hinge_left_out(config, "engines")])
    if not engines:
        raise NoAnswer("engines: no engine is installed", f"Install them: {EXTRA}")
    rigid = inputs["fixedpoint"].summary if "fixedpoint" in inputs else None
    for scene in scenes(config, *rigid_start(config, inputs)):
        truth = experiments.truth_of(scene)
        if truth is None:
            why = "the walk under ADAMS's law ends too early to be compared"
            found.left_out.append({"what": f"engines on the scene {scene.name}", "why": why})
            continue
        found.truths[scene.name] = truth
        progress.start(f"engines: {scene.name}", len(engines) + 1)
        found.rows += experiments.our_rows(scene, truth, __version__)
        progress.advance()
        each = [EngineOnScene(engine, scene, truth, OwnProcess()) for engine in engines]
        for measured in side_by_side(each, jobs):
            found.add(measured)
            progress.advance()
    if not found.truths:
        raise NoAnswer("engines: no scene walks under ADAMS's law", "Start closer to a gait (start: fixed-point).")
    return content(found, rigid)


def side_by_side(each: Sequence[EngineOnScene], jobs: int) -> Iterator[EngineFindings]:
    """Yield each engine's results, `jobs` engines at a time; an interruption kills the running engines."""
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        try:
            yield from pool.map(measure, each)
        except BaseException:
            for one in each:
                one.process.abandon()
            raise


def not_installed() -> list[dict[str, str]]:
    """List missing engines, with the command that installs each."""
    return [
        {"what": f"engine {engine.name}", "why": f"not installed: {engine.install_line}"}
        for engine in ENGINES.values()
        if not engine.is_installed
    ]


def measure(one: EngineOnScene) -> EngineFindings:
    found, name = EngineFindings(), one.engine.name
    target = experiments.target_of(one.scene)
    with one.process:
        found.swings, lost = one.swings()
        found.left_out += [{"what": f"a swing in {name}", "why": other.why} for other in lost]
        found.rows += one.same_law()
        if target is None:
            found.left_out.append({"what": f"own contact of {name}", "why": "the ground has no friction"})
            return found
        for contact in one.engine.adapter().CONTACTS:
            tuned = one.tuned(contact, target)
            if isinstance(tuned, TaskLost):
                found.left_out.append({"what": f"contact {contact} of {name}", "why": tuned.why})
                continue
            own, rows = tuned
            found.tuning += rows
            found.rows += one.own_law(contact, own)
    return found


def content(found: EngineFindings, rigid: Mapping[str, Any] | None) -> Content:
    """Build groups and summary.

    rigid  summary of `fixedpoint`, if the start or the pads depend on it
    """
    rows, truths = found.rows, found.truths
    stored = (("rows", EngineRow, rows), ("swings", SwingRow, found.swings), ("tuning", TuningRow, found.tuning))
    groups = {name: rows_group(table, labels_of(kind)) for name, kind, table in stored if table}
    engines = [engine for engine in installed() if any(row.engine == engine.name for row in rows)]
    of_rigid = {f"rigid_{key}": rigid[key] for key in ("period_s", "step_length_m")} if rigid is not None else {}
    summary = {
        "rows": [asdict(row) for row in rows],
        "swings": [asdict(row) for row in found.swings],
        "tuning": [{**asdict(row), "residual": row.residual} for row in found.tuning],
        "reference": {
            name: {
                "until_s": truth.until_s,
                "agreement": truth.agreement,
                "period_s": float(truth.walk.periods_s[-1]),
                "step_length_m": float(truth.walk.lengths_m[-1]),
                "steps": truth.walk.steps,
                "outcome": truth.walk.outcome.label,
                **of_rigid,
            }
            for name, truth in truths.items()
        },
        "versions": {engine.name: engine.version for engine in engines},
        "cannot_express": {engine.name: list(engine.adapter().CANNOT_EXPRESS) for engine in engines},
        "closest": {name: closest(rows, name) for name in truths},
        "three_digits_step_s": {name: three_digits(rows, name, truth) for name, truth in truths.items()},
        "convergence": {name: convergence(rows, name) for name in truths},
        "integrators": {
            engine.name: {name: asdict(one) for name, one in engine.adapter().INTEGRATORS.items()} for engine in engines
        },
        "contacts": {engine.name: dict(engine.adapter().CONTACTS) for engine in engines},
        "ratios": {name: ratios(rows, name) for name in truths},
        "conclusions": {name: conclusions(rows, name, truth) for name, truth in truths.items()},
        "environment": environment(),
        "left_out": found.left_out,
    }
    return Content(groups, summary, timed=("ratios", "conclusions", "environment"))


def series_of(rows: Sequence[EngineRow], scene: str, experiment: str) -> dict[str, list[EngineRow]]:
    """Rows of an experiment started on the gait, by engine and integrator (or contact), from coarse to fine."""
    series: dict[str, list[EngineRow]] = {}
    for row in rows:
        if row.scene == scene and row.experiment == experiment and row.engine != OURS and row.start == 1.0:
            series.setdefault(f"{row.engine} {row.integrator}", []).append(row)
    return series


def ratios(rows: Sequence[EngineRow], scene: str) -> dict[str, dict[str, float]]:
    """Run time of each engine over ours on the same law, for each error level that both reach."""
    ours = [row for row in rows if row.scene == scene and row.experiment == SAME_LAW and row.engine == OURS]
    by_engine: dict[str, list[EngineRow]] = {}
    for series in series_of(rows, scene, SAME_LAW).values():
        by_engine.setdefault(series[0].engine, []).extend(series)
    found: dict[str, dict[str, float]] = {}
    for level in LEVELS:
        own = experiments.least_wall(ours, level)
        for engine, runs in by_engine.items():
            theirs = experiments.least_wall(runs, level)
            if own is not None and theirs is not None:
                found.setdefault(plain_power(level), {})[engine] = theirs / own
    return found


def closest(rows: Sequence[EngineRow], scene: str) -> dict[str, Any] | None:
    """Contact whose finest walk comes closest to ADAMS's law; None if no walk reaches the end."""
    finest = [series[-1] for series in series_of(rows, scene, OWN_LAW).values()]
    reached = [row for row in finest if row.error is not None and row.steps == experiments.OWN_TOUCHES]
    if not reached:
        return None
    best = min(reached, key=lambda row: float(row.error or 0.0))
    return {"engine": best.engine, "contact": best.integrator, "step_s": best.step_s, "period_error_s": best.error}


def three_digits(rows: Sequence[EngineRow], scene: str, truth: experiments.Truth) -> dict[str, dict[str, float]]:
    """Largest step (s) with three correct digits of the last period, by experiment and name.

    Digits are relative to the reference on the same law, and to the finest run on an engine's own.
    """
    found: dict[str, dict[str, float]] = {SAME_LAW: {}, OWN_LAW: {}}
    exact = float(np.diff(truth.touches_s)[-1])
    for experiment in found:
        for name, mine in series_of(rows, scene, experiment).items():
            wanted = exact if experiment == SAME_LAW else mine[-1].period_s
            step = largest_good_step(mine, experiment, wanted)
            if step is not None:
                found[experiment][name] = step
    return found


def largest_good_step(mine: Sequence[EngineRow], experiment: str, wanted: float | None) -> float | None:
    """Largest step, going up from the finest, with three correct digits; None without a coarser step to confirm it."""
    good = None
    if wanted is None:
        return None
    for row in reversed(mine):
        if row.outcome != "walked" or row.period_s is None or abs(row.period_s / wanted - 1.0) > THREE_DIGITS:
            break
        good = row.step_s
    finest_only = experiment == OWN_LAW and good == mine[-1].step_s
    return None if finest_only else good


def convergence(rows: Sequence[EngineRow], scene: str) -> dict[str, dict[str, float]]:
    """Effect of the last refinement, by experiment and name.

    On the same law the factor by which the error shrinks, on own contact the change of the period (s).
    """
    found: dict[str, dict[str, float]] = {SAME_LAW: {}, OWN_LAW: {}}
    for experiment, by_name in found.items():
        for name, mine in series_of(rows, scene, experiment).items():
            if len(mine) < 2 or not mine[-2].error or not mine[-1].error:
                continue
            fine, coarse = mine[-1], mine[-2]
            divided = float(coarse.error or 0.0) / float(fine.error or 1.0)
            changed = abs(float(fine.period_s or 0.0) - float(coarse.period_s or 0.0))
            by_name[name] = divided if experiment == SAME_LAW else changed
    return found


def conclusions(rows: Sequence[EngineRow], scene: str, truth: experiments.Truth) -> dict[str, str]:
    """A paragraph for each experiment."""
    same, own = (series_of(rows, scene, experiment) for experiment in (SAME_LAW, OWN_LAW))
    sizes, changes, shares = three_digits(rows, scene, truth), convergence(rows, scene), ratios(rows, scene)
    reached = {label: shares.get(label, {}) for label in map(plain_power, LEVELS)}
    engines = list(dict.fromkeys(runs[0].engine for runs in same.values()))
    falling = {name: by for name, by in changes[SAME_LAW].items() if same[name][-1].tolerance is None}
    finest, settled = (
        [runs[-1] for runs in own.values()],
        [name for name in changes[OWN_LAW] if experiments.has_settled(*own[name][-2:])],
    )
    best, period = closest(rows, scene), float(truth.walk.periods_s[-1])
    return {
        SAME_LAW: words(
            "engines.same_law", reached, engines, sizes[SAME_LAW], falling, plain_power(experiments.EXACT_ENOUGH)
        ),
        OWN_LAW: words("engines.own_law", best, finest, period, changes[OWN_LAW], settled, sizes[OWN_LAW]),
    }
