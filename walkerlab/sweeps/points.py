"""The points of a sweep: each a config that the schema accepts, each with the key of its result."""

from __future__ import annotations

from collections.abc import Iterator

from walkerlab.config.loader import LoadedConfig
from walkerlab.config.problems import SHOWN_PROBLEMS
from walkerlab.config.schema import Config
from walkerlab.errors import ConfigError
from walkerlab.stages.graph import Graph
from walkerlab.stages.in_memory import Keys
from walkerlab.sweeps.question import Question


class Points:
    """The configs and keys of a question's points, made when they are asked for: a million are never held at once."""

    def __init__(self, question: Question, loaded: LoadedConfig, graph: Graph) -> None:
        """Check nothing yet."""
        self.question = question
        self.loaded = loaded
        self._keys = Keys(graph)

    def __len__(self) -> int:
        """How many there are."""
        return len(self.question)

    def config(self, index: int) -> Config:
        """One point's config; ConfigError if it is none."""
        return self.loaded.variant(self.question.settings(index))

    def keys(self, config: Config) -> dict[str, str]:
        """The stage keys of a point and of what it needs."""
        return self._keys.of(config, self.question.stage)

    @property
    def code_digest(self) -> str:
        """The digest of the stage's code."""
        return self._keys.code_digest(self.question.stage)

    def checked_keys(self) -> list[bytes]:
        """The stage key of every point (32 bytes each), in order.

        Raises ConfigError that names the points that are no configs, with their values.
        """
        found: list[bytes] = []
        problems: list[str] = []
        for index in range(len(self)):
            try:
                found.append(bytes.fromhex(self.keys(self.config(index))[self.question.stage]))
            except ConfigError as error:
                problems.append(f"at {self.question.said(index)}: {error.message}")
                if len(problems) == SHOWN_PROBLEMS:
                    problems.append("and perhaps more")
                    break
        if problems:
            raise ConfigError("\n".join(dict.fromkeys(problems)), "Nothing was run; leave these values out.")
        return found

    def unread(self) -> Iterator[str]:
        """The parameters that the stage and what it needs do not read: all of their values give one result."""
        base = self.config(0)
        for number, axis in enumerate(self.question.axes):
            changed = self._with_one_changed(number)
            if changed is not None and self.keys(changed) == self.keys(base):
                yield axis.key

    def _with_one_changed(self, number: int) -> Config | None:
        """The first point's config with the last value of one parameter; None if that is no config or no change."""
        settings = self.question.settings(0)
        axis = self.question.axes[number]
        if axis.values[-1] == axis.values[0]:
            return None
        settings[number] = axis.setting(len(axis.values) - 1)
        try:
            return self.loaded.variant(settings)
        except ConfigError:
            return None
