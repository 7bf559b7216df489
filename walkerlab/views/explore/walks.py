"""Answer the page's requests, in a worker: summaries of stages, and motions to draw."""

import json
import math
import shlex
import signal
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from pydantic.fields import FieldInfo

from walkerlab.config import fields, files, loader, schema, writer
from walkerlab.errors import ConfigError, WalkerlabError
from walkerlab.pipeline.plan import resolve, results
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.sweeps.question import described
from walkerlab.scene.parameter import Parameter, parameter_of
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections import motion

INITIAL_KEYS: Final = (
    "slope_deg", "walker.", "push_off.impulse_N_s", "contact.stiffness", "contact.damping", "contact.static_friction",
    "contact.dynamic_friction", "contact.stiction_velocity", "contact.terrain",
)  # fmt: skip
"""Keys that the page shows before the user searches, in this order. An entry that ends in a dot stands for a block."""
DRIVE_BLOCKS: Final = ("walker.hip.", "push_off.")
"""Blocks whose keys are hidden while they are zero, until the user searches for them."""
HIDDEN_KEYS: Final = (
    "name", "source", "outputs", "seed", "sweep", "design", "identify", "stability", "tune", "continuation", "basin",
    "robustness",
)  # fmt: skip
"""Keys that do not affect a walk."""
SLIDER_FACTOR: Final = 5.0
"""Factor between a slider's initial value and either end of its range."""
WIDE_SLIDER_FACTOR: Final = 100.0
"""The same factor for the keys in `BY_MAGNITUDE`, of which only the order of magnitude is known."""
BY_MAGNITUDE: Final = ("contact.stiffness", "contact.damping", "velocity", "rtol", "atol", "penetration")
MIN_LOGARITHMIC_RATIO: Final = 100.0
"""Ratio of bounds above which a slider is logarithmic."""
BISECTIONS: Final = 10
"""Number of bisections in the search for the last valid value of a slider."""


def adjustable(start: schema.Config, config: schema.Config) -> Iterator[dict[str, Any]]:
    """Yield a JSON object for each number, choice and switch of a config that affects a walk.

    start   the config before any change, which determines the sliders' ends and the reset values
    config  the config with its changes
    """
    for path, field in fields.leaves(schema.Config, held=config):
        key = ".".join(path)
        if path[0] in HIDDEN_KEYS or key in ("walker.type", "contact.units"):
            continue
        value = fields.value_at(config, path)
        first = fields.value_at(start, path)
        if path == ("slope_rad",):
            key = "slope_deg"
            value = math.degrees(value)
            first = math.degrees(first)
        if value is not None:
            unit, meaning = described(config, key)
            shown = {"key": key, "value": value, "start": first, "unit": unit, "meaning": meaning}
            turned = input_of(key, first, unit, field, start)
            yield shown | {"rank": rank(key, first) if turned else None, "bounds": fields.bounds_of(field)} | turned


def rank(key: str, first: Any) -> int | None:
    """Return the position of a key among those shown before any search, or None if only a search shows it."""
    if (key.startswith(DRIVE_BLOCKS) and not first) or key.startswith(("walker.hip.hinge_law", "walker.knee.")):
        return None
    matches = [key == name or (name[-1] == "." and key.startswith(name)) for name in INITIAL_KEYS]
    return matches.index(True) if any(matches) else None


def input_of(key: str, first: Any, unit: str, field: FieldInfo, start: schema.Config) -> dict[str, Any]:
    """Return the choices or the slider range of a key, or nothing if its value must be typed.

    first  value before any change
    start  config before any change
    """
    if isinstance(first, bool):
        return {"words": [True, False]}
    words = fields.words_of(field.annotation)
    if fields.describe_type(field.annotation) == "word" and len(words) > 1:
        return {"words": words}
    if not isinstance(first, int | float):
        return {}
    limits = {
        name: getattr(item, name) for item in field.metadata for name in ("ge", "gt", "le", "lt") if hasattr(item, name)
    }
    low, high = limits.get("ge", limits.get("gt", -math.inf)), limits.get("le", limits.get("lt", math.inf))
    ordinary = ordinary_size(key, unit, start)
    logarithmic = False
    if first == 0:
        least = 0.0 if low >= 0.0 else -ordinary
        most = ordinary
    else:
        by = WIDE_SLIDER_FACTOR if any(part in key for part in BY_MAGNITUDE) else SLIDER_FACTOR
        least, most = sorted((first / by, first * by))
        logarithmic = first > 0.0 and low >= 0.0 and high > MIN_LOGARITHMIC_RATIO * low
        # A slider that starts close to zero must nevertheless reach the typical size.
        most = max(most, ordinary) if logarithmic else most
    # The bounds of the slope are in radians, but its slider is in degrees.
    if unit != "deg":
        least = max(least, low)
        most = min(most, high)
    parameter = gaits_by(key, start)
    ends = [end if parameter is None else last_allowed(parameter, start, first, end) for end in (least, most)]
    if ends[0] == ends[1]:
        return {}
    if whole := isinstance(first, int):
        ends = [round(end) for end in ends]
    return {"from": ends[0], "to": ends[1], "log": logarithmic, "whole": whole, "gaits": parameter is not None}


def ordinary_size(key: str, unit: str, start: schema.Config) -> float:
    """Return the typical magnitude, for this walker, of a quantity with this unit, or 0 if it is unknown."""
    mass = start.walker.total_mass_kg
    leg = start.walker.leg_length_m
    gravity = start.gravity_m_s2
    speed = math.sqrt(gravity * leg)
    if key.startswith("ground."):
        return 100.0 if unit == "1" else 0.01 * leg
    torque = mass * gravity * leg
    return {
        "deg": 5.0, "m": 0.3 * leg, "kg": 0.5 * mass, "kg m^2": 0.01 * mass * leg**2, "N s": 0.1 * mass * speed,
        "N m": 0.02 * torque, "N m/rad": 0.1 * torque, "N m s/rad": 0.02 * mass * leg * speed,
    }.get(unit, 0.0)  # fmt: skip


@lru_cache(maxsize=1000)  # called again for every key whenever a slider is released
def gaits_by(key: str, start: schema.Config) -> Parameter | None:
    """Return the key as a parameter along which gaits can be followed, or None if no model depends on it."""
    try:
        return parameter_of(key, start)
    except ConfigError:
        return None


def last_allowed(parameter: Parameter, start: schema.Config, first: float, end: float) -> float:
    """Return the value closest to a slider's end that is valid together with the config's other values."""
    if parameter.config_at(start, end) is not None:
        return end
    good = first
    bad = end
    for _ in range(BISECTIONS):
        middle = 0.5 * (good + bad)
        good, bad = (good, middle) if parameter.config_at(start, middle) is None else (middle, bad)
    return good


WALK_STAGES = {"rigid": "simulate", "contact": "contact-sim"}
Answered = tuple[int, dict[str, Any]]
"""HTTP status and JSON object."""
SUPERSEDED: Final[Answered] = 409, {"error": {"message": "superseded by a newer request", "advice": ""}}
MAX_STEPS_SHOWN = 100
"""Maximum number of steps to show, which is enough to see one gait change into another."""
GIVE_WAY = signal.SIGUSR1
"""Signal that makes a worker abandon its request."""


class SupersededError(BaseException):
    """Raised if a newer request is waiting. It is a BaseException, so that no handler mistakes it for a failure."""


class GivingWay(Silent):
    """Progress reporter that abandons a request when a newer one is waiting, but only between two gaits.

    Abandoning it at once could interrupt an import.
    """

    def __init__(self) -> None:
        """Install the handler of the signal that announces a newer request."""
        self._superseded = False
        signal.signal(GIVE_WAY, self._give_way)

    def _give_way(self, *_: object) -> None:
        self._superseded = True

    def advance(self, n: int = 1) -> None:  # noqa: ARG002
        """Raise SupersededError if a newer request is waiting."""
        if self._superseded:
            raise SupersededError


@dataclass(frozen=True)
class ExploredConfig:
    """A config with the changes made on the page."""

    config: str | None  # value of `--config`
    sets: tuple[str, ...]  # values of `--set`
    runs: Path  # folder of all runs
    changes: Mapping[str, Any]  # values by key, applied after `sets`
    models: Sequence[str] = ()  # models whose walks are requested
    called: str | None = None  # name on the page; None for the config's own name

    @property
    def options(self) -> list[str]:
        """Command-line options that reproduce this config."""
        named = [] if self.config is None else ["-c", self.config]
        return [*named, *(part for text in self.all_sets for part in ("--set", text))]

    @property
    def all_sets(self) -> list[str]:
        """All changes to the config, as KEY=VALUE."""
        plain = {key: value if isinstance(value, str) else json.dumps(value) for key, value in self.changes.items()}
        return [*self.sets, *(f"{key}={value}" for key, value in plain.items())]

    @property
    def loaded(self) -> loader.LoadedConfig:
        """The config as it is loaded, with its warnings.

        Raises ConfigError if it is invalid.
        """
        return resolve.resolve(self.config, self.all_sets, None, self.runs).loaded

    def refusal(self, error: WalkerlabError) -> Answered:
        """Describe why the config is invalid, and if possible name the change that made it so."""
        key = next((key for key in self.changes if key in error.message), next(iter(self.changes), None))
        value = None if key is None else self.changes[key]
        return 422, {"error": {"key": key, "value": value, "message": error.message, "advice": error.advice}}


def set_arguments(config: schema.Config) -> tuple[str, ...]:
    """Return the `--set` texts that turn the built-in paper config into `config`."""
    paper = ExploredConfig(None, (), Path(), {}).loaded.config.model_dump(mode="json")
    values = config.model_dump(mode="json").items()
    return tuple(f"{key}={json.dumps(value)}" for key, value in values if key != "name" and value != paper[key])


MEMORY = results.MemoryResults()
"""Results of earlier requests in this process."""


def walk(question: ExploredConfig) -> Answered:
    """Compute the gait and the walks of a config, and the data that the player needs to show them."""
    try:
        loaded = question.loaded
        config = loaded.config
        stages = [WALK_STAGES[model] for model in question.models if model == "rigid" or config.contact is not None]
        # The walks come first, because they store the gait, which then need not be found again.
        answers = {stage: answer_in_memory(config, stage, MEMORY, again=False) for stage in (*stages, "fixedpoint")}
    except ConfigError as error:
        return question.refusal(error)
    commands = [shlex.join(["walkerlab", stage, *question.options]) for stage in ("fixedpoint", *stages)]
    answer: dict[str, Any] = {"command": "\n".join(commands), "warnings": list(loaded.warnings)}
    walks: dict[str, Content] = {}
    for stage in ("fixedpoint", *stages):
        no_answer = answers[stage].no_answer
        answer[stage] = answers[stage].findings
        if no_answer is not None:
            answer[stage]["error"] = no_answer.as_json()
            if stage == "fixedpoint":
                break
        elif stage != "fixedpoint":
            walks[stage] = answers[stage]
    if (player := motion.player(Results(config, walks), MAX_STEPS_SHOWN)) is not None:
        answer["scene"] = player.scene
        tracks = [{"meta": walker.meta, "floats": walker.track.pack()} for walker in player.walkers]
        answer["tracks"] = dict(zip((stage for stage in WALK_STAGES.values() if stage in walks), tracks, strict=True))
    return 200, answer


def numbers(question: ExploredConfig) -> Answered:
    """List the adjustable parameters."""
    try:
        return 200, {"numbers": list(adjustable(replace(question, changes={}).loaded.config, question.loaded.config))}
    except ConfigError as error:
        return question.refusal(error)


def follow_gaits(question: ExploredConfig) -> Answered:
    """Follow gaits over one key, and return values, quantities and stability along the branches of each model.

    The request's changes contain the block `continuation`: key, ends and points. The status is 409 if a newer request
    has arrived.
    """
    try:
        config = question.loaded.config
        answer = answer_in_memory(config, "continuation", MEMORY, again=False, reporter=GivingWay())
    except ConfigError as error:
        return question.refusal(error)
    except SupersededError:
        return SUPERSEDED
    # Attractors also have step periods, but they are not branches.
    branches = [(path, group) for path, group in answer.groups.items() if "step_length" in group.variables]
    curves = [{"model": path.partition("/")[0], **curve(group)} for path, group in branches if is_walkable(group)]
    return 200, {"over": config.continuation.over, "curves": curves}


def is_walkable(branch: Group) -> bool:
    """Whether a branch has a gait in which the ground never has to pull."""
    forces = branch.variables.get("min_normal_force_N")
    return forces is None or bool((forces.values > 0.0).any())


def curve(branch: Group) -> dict[str, list[Any]]:
    """Return quantities along a branch, from the first step of each gait."""
    period = branch["step_period"][:, 0]
    length = branch["step_length"][:, 0]
    multipliers = abs(branch["multiplier_real"] + 1j * branch["multiplier_imag"]).max(axis=1)
    quantities = {
        "value": branch["value"], "stable": branch["stable"], "period_s": period, "step_length_m": length,
        "speed_m_s": length / period, "spectral_radius": multipliers,
    }  # fmt: skip
    return {name: values.tolist() for name, values in quantities.items()}


def config_text(question: ExploredConfig, name: str) -> str:
    """Write the config as YAML that extends its starting point and lists only differences.

    If the starting point has another type of walker, the whole config is written.

    Raises ConfigError if the config is invalid.
    """
    start = files.config_to_extend(question.config)
    base = loader.load(Path(start)).config
    changed = replace(question, changes={**question.changes, "name": name}).loaded.config
    same_type = base.walker.type == changed.walker.type
    return writer.to_extending_yaml(start, base, changed, name) if same_type else writer.to_yaml(changed)
