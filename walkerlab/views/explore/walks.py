"""Answers computed in a worker: summaries of stages, and motions to draw."""

import json
import shlex
import signal
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

from walkerlab.config.files import config_to_extend
from walkerlab.config.loader import LoadedConfig, load
from walkerlab.config.schema import Config
from walkerlab.config.writer import to_extending_yaml, to_yaml
from walkerlab.errors import ConfigError, WalkerlabError
from walkerlab.pipeline.plan.resolve import resolve
from walkerlab.pipeline.plan.results import MemoryResults
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.run.executor import answer_in_memory
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.views.explore.numbers import adjustable
from walkerlab.views.report.blocks import Results
from walkerlab.views.report.sections import motion

WALK_STAGES = {"rigid": "simulate", "contact": "contact-sim"}
Answered = tuple[int, dict[str, Any]]
"""HTTP status and JSON object."""
SUPERSEDED: Final[Answered] = 409, {"error": {"message": "superseded by a newer request", "advice": ""}}
MOST_STEPS_SHOWN = 100
"""Maximum number of steps shown, enough to see one gait change into another."""
GIVE_WAY = signal.SIGUSR1
"""Signal that makes a worker abandon its request."""


class SupersededError(BaseException):
    """Raised when a newer request waits. It is a BaseException, so that no handler mistakes it for a failure."""


class GivingWay(Silent):
    """Progress reporter that abandons a request when a newer one waits, but only between two gaits.

    Acting on the signal immediately might interrupt an import.
    """

    def __init__(self) -> None:
        """Install the handler of the signal that announces a newer request."""
        self._superseded = False
        signal.signal(GIVE_WAY, self._give_way)

    def _give_way(self, *_: object) -> None:
        self._superseded = True

    def advance(self, n: int = 1) -> None:  # noqa: ARG002
        """Raise SupersededError if a newer request waits."""
        if self._superseded:
            raise SupersededError


@dataclass(frozen=True)
class ExploredConfig:
    """A config with changes."""

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
        """All changes of the config, as KEY=VALUE."""
        plain = {key: value if isinstance(value, str) else json.dumps(value) for key, value in self.changes.items()}
        return [*self.sets, *(f"{key}={value}" for key, value in plain.items())]

    @property
    def loaded(self) -> LoadedConfig:
        """The resolved config, with its warnings.

        Raises ConfigError if it is invalid.
        """
        return resolve(self.config, self.all_sets, None, self.runs).loaded

    def refusal(self, error: WalkerlabError) -> Answered:
        """Describe why the config is invalid, and name the change responsible if it can be identified."""
        key = next((key for key in self.changes if key in error.message), next(iter(self.changes), None))
        value = None if key is None else self.changes[key]
        return 422, {"error": {"key": key, "value": value, "message": error.message, "advice": error.advice}}


def sets_of(config: Config) -> tuple[str, ...]:
    """Return the `--set` texts that turn the built-in paper config into `config`."""
    paper = ExploredConfig(None, (), Path(), {}).loaded.config.model_dump(mode="json")
    values = config.model_dump(mode="json").items()
    return tuple(f"{key}={json.dumps(value)}" for key, value in values if key != "name" and value != paper[key])


@cache
def memory() -> MemoryResults:
    """Return the store for the results of earlier requests in this process."""
    return MemoryResults()


def walk(question: ExploredConfig) -> Answered:
    """Compute the gait and the walks, with the data that the player needs."""
    try:
        loaded = question.loaded
        config = loaded.config
        wanted = [WALK_STAGES[model] for model in question.models if model == "rigid" or config.contact is not None]
        # Compute the walks first: they store the gait, so that it need not be found again.
        answers = {stage: answer_in_memory(config, stage, memory(), again=False) for stage in (*wanted, "fixedpoint")}
    except ConfigError as error:
        return question.refusal(error)
    commands = [shlex.join(["walkerlab", stage, *question.options]) for stage in ("fixedpoint", *wanted)]
    found: dict[str, Any] = {"command": "\n".join(commands), "warnings": list(loaded.warnings)}
    walks: dict[str, Content] = {}
    for stage in ("fixedpoint", *wanted):
        said = answers[stage].no_answer
        found[stage] = answers[stage].findings
        if said is not None:
            found[stage]["error"] = {"message": said.message, "advice": said.advice, "exit_code": said.exit_code}
            if stage == "fixedpoint":
                break
        elif stage != "fixedpoint":
            walks[stage] = answers[stage]
    if (player := motion.player(Results(config, walks), MOST_STEPS_SHOWN)) is not None:
        found["scene"] = player.scene
        tracks = [{"meta": walker.meta, "floats": walker.track.pack()} for walker in player.walkers]
        found["tracks"] = dict(zip((stage for stage in WALK_STAGES.values() if stage in walks), tracks, strict=True))
    return 200, found


def numbers(question: ExploredConfig) -> Answered:
    """List the adjustable parameters."""
    try:
        return 200, {"numbers": list(adjustable(replace(question, changes={}).loaded.config, question.loaded.config))}
    except ConfigError as error:
        return question.refusal(error)


def follow_gaits(question: ExploredConfig) -> Answered:
    """Follow gaits over one key: values, quantities and stability along each model's branches.

    The request's changes contain the block `continuation`: key, ends and points. Status 409 if a newer request came.
    """
    try:
        config = question.loaded.config
        answer = answer_in_memory(config, "continuation", memory(), again=False, reporter=GivingWay())
    except ConfigError as error:
        return question.refusal(error)
    except SupersededError:
        return SUPERSEDED
    # Attractors are skipped: they have step periods but are not branches.
    branches = [(path, group) for path, group in answer.groups.items() if "step_length" in group.variables]
    curves = [{"model": path.partition("/")[0], **curve(group)} for path, group in branches if walkable(group)]
    return 200, {"over": config.continuation.over, "curves": curves}


def walkable(branch: Group) -> bool:
    """Whether a branch has a gait in which the ground never has to pull."""
    forces = branch.variables.get("min_normal_force_N")
    return forces is None or bool((forces.values > 0.0).any())


def curve(branch: Group) -> dict[str, list[Any]]:
    """Return quantities along a branch, from the first step of each gait."""
    period = branch["step_period"][:, 0]
    length = branch["step_length"][:, 0]
    multipliers = abs(branch["multiplier_real"] + 1j * branch["multiplier_imag"]).max(axis=1)
    found = {
        "value": branch["value"], "stable": branch["stable"], "period_s": period, "step_length_m": length,
        "speed_m_s": length / period, "spectral_radius": multipliers,
    }  # fmt: skip
    return {name: values.tolist() for name, values in found.items()}


def config_text(question: ExploredConfig, name: str) -> str:
    """Write the config as YAML that extends its starting point and lists only differences.

    If the starting point has another type of walker, the whole config is written.

    Raises ConfigError if invalid.
    """
    start = config_to_extend(question.config)
    named = replace(question, changes={**question.changes, "name": name})
    base = load(Path(start)).config
    changed = named.loaded.config
    alike = base.walker.type == changed.walker.type
    return to_extending_yaml(start, base, changed, name) if alike else to_yaml(changed)
