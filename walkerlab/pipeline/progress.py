"""Interfaces through which stages and the runner report progress. Callers decide how to show it."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

R = TypeVar("R")


class Progress(Protocol):
    """Progress of a running stage."""

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a phase of `total` parts (None if unknown) and end the previous phase."""

    def advance(self, n: int = 1) -> None:
        """Count `n` more parts as done."""

    def note(self, text: str) -> None:
        """Show one line about the work."""


def track(progress: Progress, label: str, total: int, done: Iterable[R], n: int = 1) -> Iterator[R]:
    """Iterate over `done`, advancing `progress` by `n` after each item."""
    progress.start(label, total)
    for item in done:
        yield item
        progress.advance(n)


class StageReporter(Progress, Protocol):
    """Progress of a stage, as the runner reports it."""

    def end(self, said: str) -> None:
        """End the stage with a closing line, or with '' if it failed, since its error is reported elsewhere."""


class Reporter(Protocol):
    """Receives the runner's messages."""

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> StageReporter:
        """Begin a stage, possibly while others run.

        place       the stage's number among those to run and the reason for a rerun, or '' for a single new stage
        expected_s  last run time of the stage (s), if known
        """

    def announce_page(self, summary: Mapping[str, Any], folder: Path) -> None:
        """Announce a partial page in a run's folder while the rest is being computed."""

    def note(self, text: str) -> None:
        """Show one line."""

    def warn(self, text: str) -> None:
        """Show a warning."""


class Silent:
    """Reporter that shows nothing."""

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> "Silent":  # noqa: ARG002
        return self

    def note(self, *_arguments: Any, **_keywords: Any) -> None:
        """Discard the message."""

    start = advance = warn = end = announce_page = note
