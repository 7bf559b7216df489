"""Robustness of a gait in both models: the disturbances it survives, and the parameters that affect it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any, Final

import numpy as np

from walkerlab.config.contact import Footholds
from walkerlab.config.drives import drives_of
from walkerlab.config.reads import RobustnessConfig
from walkerlab.config.walkers import contact_required_error
from walkerlab.errors import ConfigError, NoAnswer
from walkerlab.labels import Label
from walkerlab.physics.hybrid.recorded_walk import as_state
from walkerlab.physics.hybrid.walk_record import rough_heights
from walkerlab.physics.orbits.family_search import CONTACT, RIGID
from walkerlab.physics.orbits.gradients import GAIT_QUANTITIES, Gradient, gait_quantities, relative_gradient
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS, RigidMap
from walkerlab.physics.orbits.robustness import (
    DISTURBANCES,
    INDICATORS,
    LARGEST,
    GaitOnMap,
    largest_disturbance,
    rough_walks,
    sensitivity,
    steps_on_rough_ground,
)
from walkerlab.physics.solvers.system import Floats
from walkerlab.pipeline.progress import Progress, track
from walkerlab.pipeline.run.work import WorkUnit, complete
from walkerlab.pipeline.run.workers import map_in_order
from walkerlab.pipeline.stages.rigid_groups import groups as groups_of_walk
from walkerlab.pipeline.store.content import Content, Group, Variable, rows_group
from walkerlab.pipeline.store.files import Checkpoint
from walkerlab.scene.parameter import parameter_keys, parameter_of
from walkerlab.scene.rigid import rigid_scene
from walkerlab.scene.subject import ModelUnderTest, find_model_gait, model_reads, refuse_unread

Rows = list[dict[str, Any]]

WALKS_AT_ONCE: Final = 25
STEPS_DRAWN: Final = 8
MAX_STEPS: Final = {RIGID: 2_000_000, CONTACT: 40_000}
"""Maximum total number of steps of all walks on ground of one roughness, by model."""
PUSH_REACTIONS: Final = ("normal_impulse_N_s", "min_normal_force_N")
"""Names of the ground reactions during and after a push, in the order in which `RigidMap.ground_after_push` returns
them."""
UNITS: Final = {"floor-drop": "m", "hip-push": "N s"}
INDICATOR_UNITS: Final = dict(zip(INDICATORS, ("s", "m", "m/s"), strict=True))
MODEL: Final = {"model": Label("", "model that walks")}
LEG: Final = {"leg": Label("1", "leg that swings in the disturbed step; absent if both legs are equal")}
NO_NEIGHBOURS: Final = Gradient(None, None, "neighbouring walks end early, or the config rejects their parameters")
LABELS: Final[dict[str, dict[str, Label]]] = {
    "gait_sensitivity_norm": {
        "disturbance": Label("", "disturbance of the first step"),
        "indicator": Label("", "measured quantity of the steps"),
        "value": Label("SI", "gait sensitivity norm, in the indicator's unit per unit of the disturbance"),
        "direct": Label("SI", "change of the disturbed step itself"),
        "error": Label("SI", "error of the norm, from difference quotients with two step sizes"),
    },
    "largest_step": {
        "down_m": Label("m", "largest step down that the gait survives"),
        "up_m": Label("m", "largest step up that the gait survives"),
    },
    "largest_push": {
        "forward_N_s": Label("N s", "largest push forward at the hip that the gait survives"),
        "backward_N_s": Label("N s", "largest push backward at the hip that the gait survives"),
        **{
            f"{way}_{name}": Label(unit, f"{what} of the largest push {way}; negative where the ground would pull")
            for way in ("forward", "backward")
            for name, unit, what in (
                (PUSH_REACTIONS[0], "N s", "normal impulse of the ground at the instant"),
                (PUSH_REACTIONS[1], "N", "minimum of the ground's normal force in the steps after the instant"),
            )
        },
    },
    "rough_ground": {
        "roughness_m": Label("m", "standard deviation of the footholds' heights"),
        "mean_steps": Label("1", "mean number of steps to failure, or a lower bound"),
        "walks": Label("1", "walks"),
        "capped": Label("1", "walks stopped at the maximum number of steps"),
        "method": Label("", "how the mean was estimated"),
    },
    "sensitivity": {
        "of": Label("", "quantity of the gait"),
        "to": Label("", "parameter of the config"),
        "value": Label("SI", "derivative, in the units of quantity and parameter"),
    },
}
"""Labels of the columns of each table in the answer, in addition to the model."""


def run(
    config: RobustnessConfig,
    inputs: Mapping[str, Content],
    progress: Progress,
    *,
    checkpoint: Checkpoint,
    jobs: int = 1,
) -> Content:
    """Study the robustness of the gait of each model.

    checkpoint  results of the disturbances and walks that an earlier run computed
    jobs        maximum number of processes

    Raises ConfigError for an invalid request.

    Raises NoAnswer with partial results for an unstable gait, which has no sensitivity norm.
    """
    refuse(config)
    answer: dict[str, Any] = {"gaits": [], **{name: [] for name in LABELS}}
    unstable = []
    steps = {}
    for subject in subjects(config, inputs, progress):
        gait = subject.gait_on_map()
        # With the rigid model, gradients and largest disturbances take less time than the start of a process.
        jobs_but_for_walks = jobs if subject.model == CONTACT else 1
        numbers = gait_quantities(gait)
        assert numbers is not None, "a gait has quantities"
        answer["gaits"].append({"model": subject.model, **numbers})
        keys = parameters_read(subject, config.robustness.to)
        answer["sensitivity"] += sensitivities(subject, keys, numbers, progress, jobs_but_for_walks)
        # An unstable gait survives no disturbance.
        if numbers["spectral_radius"] >= 1.0:
            unstable.append(subject.model)
            continue
        gaits = gait.split_by_leg()
        answer["gait_sensitivity_norm"] += [row for each in gaits for row in norms(row_of(subject, each), each)]
        rough_walks = [*rough_ground_units(subject, config)]
        label = f"robustness: {subject.model} model"
        units = [*single_disturbance_units(subject, config, len(gaits)), *rough_walks]
        processes = jobs if rough_walks else jobs_but_for_walks
        # All kernels are compiled by now, because the gait's quantities have been computed.
        done, _ = complete(units, checkpoint, label, progress, processes, compiled=True)
        target = {"steps": config.robustness.steps}
        for each in gaits:
            (down,), (up,), (forward, *ahead), (backward, *behind), *done = done
            row = row_of(subject, each)
            answer["largest_step"].append({**row, "down_m": down, "up_m": up, **target})
            pushes = {**row, "forward_N_s": forward, "backward_N_s": backward, **target}
            for way, reactions in (("forward", ahead), ("backward", behind)):
                pushes |= zip((f"{way}_{name}" for name in PUSH_REACTIONS), reactions or (None, None), strict=True)
            answer["largest_push"].append(pushes)
        every = np.array([count for batch in done for count in batch])
        steps[subject.model] = every.reshape(-1, config.robustness.walks)
        answer["rough_ground"] += rough_rows(subject.model, config, steps[subject.model])
    groups = {
        name: rows_group(answer[name], MODEL | (LEG if "leg" in answer[name][0] else {}) | labels)
        for name, labels in LABELS.items()
        if answer[name]
    }
    if steps and config.robustness.roughness_m:
        groups |= {"rough_steps": rough_steps(config, steps), **rough_walk(config, inputs)}
    content = Content(groups, {**answer, "steps": config.robustness.steps})
    if unstable:
        reason = f"the gait of the {' and the '.join(unstable)} model is unstable: it has no sensitivity norm"
        advice = "Choose a slope with a stable gait: `walkerlab continuation` shows where they are."
        raise NoAnswer(reason, advice, content)
    return content


def refuse(config: RobustnessConfig) -> None:
    """Raise ConfigError for an invalid `robustness` block."""
    block = config.robustness
    if block.model in (CONTACT, "both") and config.contact is None:
        raise contact_required_error(f"robustness.model: {block.model}", config.walker, "Add one, or choose rigid.")
    for index, key in enumerate(block.to or ()):
        parameter_of(key, config, ("robustness", "to", index))
        refuse_unread("robustness.to", key, config, models_of(config))
    half = 0.5 * config.walker.leg_length_m
    for roughness in block.roughness_m:
        if roughness > half:
            raise ConfigError(
                f"robustness.roughness_m: {roughness:g} m is more than half the leg length ({half:g} m), and no "
                "step survives that.",
                "The unit is metres: write 1 mm as 0.001.",
            )


def subjects(config: RobustnessConfig, inputs: Mapping[str, Content], progress: Progress) -> Iterator[ModelUnderTest]:
    progress.start("robustness: gaits")
    for model in models_of(config):
        yield find_model_gait(model, config, inputs["fixedpoint"].summary, progress.note)


def models_of(config: RobustnessConfig) -> tuple[str, ...]:
    model = config.robustness.model or (RIGID if config.contact is None else "both")
    return (RIGID, CONTACT) if model == "both" else (model,)


def row_of(subject: ModelUnderTest, gait: GaitOnMap) -> dict[str, Any]:
    """Return the first cells of a row: the model and, if the legs differ, the leg that swings in the disturbed step."""
    return {"model": subject.model} | ({"leg": gait.leg} if gait.step_map.stride > 1 else {})


def norms(beginning: Mapping[str, Any], gait: GaitOnMap) -> Iterator[dict[str, Any]]:
    """Yield a row with the sensitivity norm for each disturbance and indicator."""
    for disturbance in DISTURBANCES:
        answer = sensitivity(gait, disturbance)
        units = gait.units
        disturbance_unit = UNITS[disturbance]
        if answer is None:
            continue
        to_pure = gait.unit_of(disturbance) / np.array((units.time, units.length, units.length / units.time))
        for k, (indicator, unit) in enumerate(INDICATOR_UNITS.items()):
            yield {
                **beginning,
                "disturbance": disturbance,
                "indicator": indicator,
                "value": float(answer.norm[k]),
                "direct": float(answer.direct[k]),
                "unit": f"{unit}/({disturbance_unit})" if " " in disturbance_unit else f"{unit}/{disturbance_unit}",
                "scaled": float(answer.norm[k] * to_pure[k]),
                "error": float(answer.error[k]),
            }


def single_disturbance_units(subject: ModelUnderTest, config: RobustnessConfig, legs: int) -> Iterator[WorkUnit]:
    """Yield the work units that search for the largest change of the floor and hip push, for both signs and each
    leg."""
    for leg in range(legs):
        for disturbance, sign in LARGEST.values():
            run = partial(single_of, subject, leg, disturbance, sign, config.robustness.steps)
            yield WorkUnit(f"{subject.model} {disturbance} {sign:g}{f' leg {leg + 1}' * (legs > 1)}", 1, run)


def single_of(subject: ModelUnderTest, leg: int, disturbance: Any, sign: float, steps: int) -> list[float]:
    """Return the largest disturbance of one sign that the gait survives. For a hip push in the rigid model, add the
    ground reactions.
    """
    size = largest_disturbance(subject.quick_by_leg()[leg], disturbance, sign, steps)
    gait = subject.gait_on_map().split_by_leg()[leg]
    if disturbance == "hip-push" and isinstance(gait.step_map, RigidMap):
        return [size, *gait.step_map.ground_after_push(gait.z, gait.p, sign * size, steps, gait.swing)]
    return [size]


def rough_ground_units(subject: ModelUnderTest, config: RobustnessConfig) -> Iterator[WorkUnit]:
    """Yield the work units of walks on rough ground, in batches."""
    block = config.robustness
    most = cap(subject.model, config)
    for roughness in block.roughness_m:
        for first in range(0, block.walks, WALKS_AT_ONCE):
            walks = range(first, min(first + WALKS_AT_ONCE, block.walks))
            run = partial(count_steps_on_rough_ground, subject, roughness, config.seed, walks, most)
            yield WorkUnit(f"{subject.model} rough {roughness:g} {first}", len(walks), run)


def cap(model: str, config: RobustnessConfig) -> int:
    """Return the maximum number of steps of a walk on rough ground."""
    return min(config.robustness.max_steps, max(1, MAX_STEPS[model] // config.robustness.walks))


def count_steps_on_rough_ground(
    subject: ModelUnderTest, roughness: float, seed: int, walks: range, most: int
) -> list[float]:
    """Count the steps of walks on rough ground, which depends only on the seed and the number of the walk."""
    gait, *_ = subject.quick_by_leg()
    return [float(steps_on_rough_ground(gait, roughness, (seed, walk), most)) for walk in walks]


def rough_steps(config: RobustnessConfig, steps: Mapping[str, Floats]) -> Group:
    roughness = np.array(config.robustness.roughness_m)
    caps = np.array([cap(model, config) for model in steps])
    about = "steps that a walk took, at most cut_off_at"
    variables = {
        "model": Variable(np.array([*steps]), ("model",), "", "model that walks"),
        "roughness_m": Variable(roughness, ("roughness",), "m", "standard deviation of the heights"),
        "cut_off_at": Variable(caps, ("model",), "1", "step limit of a walk"),
        "steps": Variable(np.array([*steps.values()]), ("model", "roughness", "walk"), "1", about),
    }
    return Group(variables)


def rough_walk(config: RobustnessConfig, inputs: Mapping[str, Content]) -> dict[str, Group]:
    """Sample the first steps of the rigid model on the roughest ground, for a figure."""
    gait = inputs["fixedpoint"].summary
    _, *heights = rough_heights(max(config.robustness.roughness_m), (config.seed, 0), STEPS_DRAWN).tolist()
    scene = rigid_scene(config, Footholds(heights_m=tuple(heights)), ("states",))
    length = float(gait["step_length_m"])
    walk = scene.walk(as_state(gait["state"]), STEPS_DRAWN, EXACT_STEPS, sampled=True, step_length=length)
    return {f"rough_walk/{name}": group for name, group in groups_of_walk(scene, walk).items()}


def rough_rows(model: str, config: RobustnessConfig, steps: Floats) -> Rows:
    """Summarise the step counts `steps` (roughness, walk) in one row for each roughness of the ground."""
    most = cap(model, config)
    rows = []
    for roughness, counts in zip(config.robustness.roughness_m, steps, strict=True):
        measures = {name: value for name, value in asdict(rough_walks(counts, most)).items() if value is not None}
        rows.append({"model": model, "roughness_m": roughness, **measures, "cut_off_at": most})
    return rows


def sensitivities(
    subject: ModelUnderTest, keys: Sequence[str], numbers: Mapping[str, float], progress: Progress, jobs: int
) -> Rows:
    """Return rows of derivatives in order of decreasing relative effect. Parameters with value 0 come last."""
    label = f"robustness: gradients of the {subject.model} model"
    rows = list[dict[str, Any]]()
    results = map_in_order([partial(gradients_of, subject, key) for key in keys], jobs)
    for key, gradients in track(progress, label, len(keys), zip(keys, results, strict=True)):
        parameter = parameter_of(key, subject.config)
        value = parameter.value_in(subject.config)
        for name, gradient in (gradients or dict.fromkeys(numbers, NO_NEIGHBOURS)).items():
            if name in numbers:
                share = None if gradient.value is None else relative_gradient(gradient.value, value, numbers[name])
                details: dict[str, Any] = {} if gradient.value is None else {"error": float(gradient.error or 0.0)}
                details |= {} if share is None else {"relative": share}
                details |= {"why": gradient.why} if gradient.why else {}
                unit = GAIT_QUANTITIES[name] + ("" if parameter.unit == "1" else f" per {parameter.unit}")
                row = {"model": subject.model, "of": name, "to": key, "value": gradient.value, "unit": unit}
                rows.append(row | details)
    return sorted(rows, key=lambda row: (row["value"] is None, "relative" not in row, -abs(row.get("relative", 0.0))))


def gradients_of(subject: ModelUnderTest, key: str) -> dict[str, Gradient]:
    """Return the derivatives with respect to one key. For a passive walker, omit that of the cost of transport."""
    # The cost of transport of a passive walker is the sine of the slope, whatever the walker's parameters are.
    omitted = () if drives_of(subject.config) else ("cost_of_transport",)
    names = [name for name in GAIT_QUANTITIES if name not in omitted]
    return subject.gradients(parameter_of(key, subject.config), names)


def parameters_read(subject: ModelUnderTest, requested: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """Return the dotted keys of the parameters that the model reads. If `requested` is given, consider only those."""
    selection = parameter_keys(subject.config) if requested is None else requested
    return tuple(key for key in selection if model_reads(subject.model, subject.config, key))
