"""What a question is answered with, in the worker: the stages' summaries and the motion to draw."""

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
from walkerlab.physics import kernel_cache
from walkerlab.pipeline.executor import answer_in_memory
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.resolve import resolve
from walkerlab.pipeline.results import MemoryResults
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.pipeline.workers import tell
from walkerlab.views.explore.numbers import adjustable
from walkerlab.views.report.results import Results
from walkerlab.views.report.sections import motion

STAGES = {"rigid": "simulate", "contact": "contact-sim"}
Answered = tuple[int, dict[str, Any]]
"""Status and object of an answer."""
SUPERSEDED: Final[Answered] = 409, {"error": {"message": "a newer question was asked meanwhile", "advice": ""}}
MAX_STEPS = 100
"""What is shown of a walk: enough for a gait that is left to come to another one."""
GIVE_WAY = signal.SIGUSR1
"""What a worker is sent that is to drop the question that it is at."""


class SupersededError(BaseException):
    """A newer question waits; not to be taken for a failure of what it stops."""


class GivingWay(Silent):
    """The progress of what is dropped as soon as a newer question waits, between two gaits.

    Nowhere else: what a signal interrupts where it arrives, such as an import, may stay half done.
    """

    def __init__(self) -> None:
        """None waits yet."""
        self._superseded = False
        signal.signal(GIVE_WAY, self._give_way)

    def _give_way(self, *_: object) -> None:
        self._superseded = True

    def advance(self, n: int = 1) -> None:  # noqa: ARG002
        """Go on, if nobody waits."""
        if self._superseded:
            raise SupersededError


@dataclass(frozen=True)
class ExploredConfig:
    """A config, changed.

    config   as `--config` has it
    sets     as `--set` has them
    runs     the folder of all runs
    changes  values by key, over the sets
    models   those that walk
    called   as the page calls it; None is the config's name
    """

    config: str | None
    sets: tuple[str, ...]
    runs: Path
    changes: Mapping[str, Any]
    models: Sequence[str] = ()
    called: str | None = None

    @property
    def options(self) -> list[str]:
        """As they are typed after a command."""
        named = [] if self.config is None else ["-c", self.config]
        return [*named, *(part for text in self.all_sets for part in ("--set", text))]

    @property
    def all_sets(self) -> list[str]:
        """Every change as `--set` has it."""
        plain = {key: value if isinstance(value, str) else json.dumps(value) for key, value in self.changes.items()}
        return [*self.sets, *(f"{key}={value}" for key, value in plain.items())]

    @property
    def loaded(self) -> LoadedConfig:
        """The config that is asked about, with what is doubtful of it; ConfigError if it is not usable."""
        return resolve(self.config, self.all_sets, None, self.runs).loaded

    def refused(self, error: WalkerlabError) -> Answered:
        """What is said of a config that is not usable, with the change that is to blame if one is named."""
        key = next((key for key in self.changes if key in error.message), next(iter(self.changes), None))
        value = None if key is None else self.changes[key]
        return 422, {"error": {"key": key, "value": value, "message": error.message, "advice": error.advice}}


def sets_of(config: Config) -> tuple[str, ...]:
    """What makes a config of the built-in paper config, as `--set` has it."""
    paper = ExploredConfig(None, (), Path(), {}).loaded.config.model_dump(mode="json")
    values = config.model_dump(mode="json").items()
    return tuple(f"{key}={json.dumps(value)}" for key, value in values if key != "name" and value != paper[key])


@cache
def memory() -> MemoryResults:
    """Return what this process remembers of earlier questions."""
    return MemoryResults()


def walked(question: ExploredConfig) -> Answered:
    """The gait and the walks, with what a player has to know to show them."""
    try:
        loaded = question.loaded
        config = loaded.config
        wanted = [STAGES[model] for model in question.models if model == "rigid" or config.contact is not None]
        # The walks first: they leave the gait behind, and it is then there without being sought again.
        with kernel_cache.watch_compilation(tell):
            answers = {
                stage: answer_in_memory(config, stage, memory(), again=False) for stage in (*wanted, "fixedpoint")
            }
    except ConfigError as error:
        return question.refused(error)
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
    if (player := motion.player(Results(config, walks), MAX_STEPS)) is not None:
        found["scene"] = player.scene
        tracks = [{"meta": walker.meta, "floats": walker.track.packed()} for walker in player.walkers]
        found["tracks"] = dict(zip((stage for stage in STAGES.values() if stage in walks), tracks, strict=True))
    return 200, found


def numbers(question: ExploredConfig) -> Answered:
    """What can be turned."""
    try:
        return 200, {"numbers": list(adjustable(replace(question, changes={}).loaded.config, question.loaded.config))}
    except ConfigError as error:
        return question.refused(error)


def along(question: ExploredConfig) -> Answered:
    """Gaits over one key: for each model the places, numbers and stability of its branches.

    The question's changes hold the block `continuation`: key, ends and points. Status 409 if a newer question came.
    """
    try:
        config = question.loaded.config
        answer = answer_in_memory(config, "continuation", memory(), again=False, reporter=GivingWay())
    except ConfigError as error:
        return question.refused(error)
    except SupersededError:
        return SUPERSEDED
    # the steps of an attractor have periods, but they are no branch
    branches = [(path, group) for path, group in answer.groups.items() if "step_length" in group.variables]
    curves = [{"model": path.partition("/")[0], **curve(group)} for path, group in branches if walkable(group)]
    return 200, {"over": config.continuation.over, "curves": curves}


def walkable(branch: Group) -> bool:
    """Whether on even one gait of a branch the ground never has to pull."""
    forces = branch.variables.get("min_normal_force_N")
    return forces is None or bool((forces.values > 0.0).any())


def curve(branch: Group) -> dict[str, list[Any]]:
    """The numbers along a branch, of each gait's first step."""
    period, length = branch["step_period"][:, 0], branch["step_length"][:, 0]
    multipliers = abs(branch["multiplier_real"] + 1j * branch["multiplier_imag"]).max(axis=1)
    found = {
        "value": branch["value"], "stable": branch["stable"], "period_s": period, "step_length_m": length,
        "speed_m_s": length / period, "spectral_radius": multipliers,
    }  # fmt: skip
    return {name: values.tolist() for name, values in found.items()}


def as_file(question: ExploredConfig, name: str) -> str:
    """The config as a file that extends the one that was started from and says only what differs; ConfigError.

    It says all where nothing can be extended: for a walker of another type than the paper's that no file holds.
    """
    start, named = config_to_extend(question.config), replace(question, changes={**question.changes, "name": name})
    base, changed = load(Path(start)).config, named.loaded.config
    return (
        to_extending_yaml(start, base, changed, name) if base.walker.type == changed.walker.type else to_yaml(changed)
    )
