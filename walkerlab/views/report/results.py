"""The input of all sections: a run's stored results, its figures, and what is missing."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

from walkerlab.config.schema import Config
from walkerlab.pipeline.headlines import claims
from walkerlab.pipeline.store.content import Content, Group
from walkerlab.scene.omissions import LeftOut
from walkerlab.views.report.blocks import Picture, Section


@dataclass(frozen=True, eq=False)
class Results:
    """Results of a run and what is missing, as used by the report."""

    config: Config
    stored: Mapping[str, Content] = field(default_factory=dict)  # up-to-date results by stage
    pictures: tuple[Picture, ...] = ()  # embedded figures of `plot`
    absent: tuple[LeftOut, ...] = ()  # missing results, with reasons
    pending: tuple[LeftOut, ...] = ()  # results still being computed, or not yet when the command was stopped
    failed: frozenset[str] = frozenset()  # stages that were run and failed

    @property
    def departures(self) -> Sequence[str] | None:
        """Differences between this scene and that of the paper: none if both are equal, None if they were
        not compared.
        """
        departures: Sequence[str] | None = self.summary("compare").get("departures")
        return departures

    @property
    def claims(self) -> Sequence[Mapping[str, Any]]:
        """Values claimed by a study for this scene, with verdicts. It is empty for other scenes."""
        return claims(self.summary("compare"))

    def summary(self, stage: str) -> Mapping[str, Any]:
        """Return the summary of a stage's result, or an empty one if there is no result."""
        return self.stored[stage].summary if stage in self.stored else {}

    def group(self, stage: str, path: str) -> Group | None:
        """Return a group of a stage's result, or None if it does not exist."""
        result = self.stored.get(stage)
        return None if result is None else result.groups.get(path)


SectionMaker = Callable[[Results], Section | None]


def stage_section(stage: str, needed: str = "") -> Callable[[Callable[..., Section | None]], SectionMaker]:
    """Pass a stage's summary to the decorated function. There is no section if the summary is empty or lacks the key
    `needed`.
    """

    def section_of(make: Callable[..., Section | None]) -> SectionMaker:
        @wraps(make)
        def section(results: Results) -> Section | None:
            summary = results.summary(stage)
            return make(results, summary) if (summary.get(needed) if needed else summary) else None

        return section

    return section_of
