"""What a stage tells of its progress, and the runner of its doings; how it is shown is the caller's affair."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

R = TypeVar("R")


class Progress(Protocol):
    """What a stage may call while it runs."""

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a piece of work of `total` parts, if their number is known; ends the one before."""

    def advance(self, n: int = 1) -> None:
        """Count `n` more parts as done."""

    def note(self, text: str) -> None:
        """Say one line about the work."""


def each_told(progress: Progress, label: str, total: int, done: Iterable[R], n: int = 1) -> Iterator[R]:
    """What is done, a piece of work of `total` parts, each worth `n` of them once the next is asked for."""
    progress.start(label, total)
    for one in done:
        yield one
        progress.advance(n)


class StageReporter(Progress, Protocol):
    """What the runner calls besides, of a stage that runs."""

    def compiling(self, kernel: str) -> None:
        """Say that a kernel is being compiled; '' once it is there and the computing goes on."""

    def end(self, said: str) -> None:
        """End the stage with one line about it; '' if it has failed, which others will tell."""


class Reporter(Protocol):
    """Whom the runner tells."""

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> StageReporter:
        """Begin a stage, perhaps beside others.

        place       which of how many it is, and why it runs anew, in words; '' if it is the only one and new
        expected_s  how long it took the last time, if that is known
        """

    def drawn(self, summary: Mapping[str, Any], folder: Path) -> None:
        """Say that something can be looked at in a run's folder while the rest is still being computed."""

    def note(self, text: str) -> None:
        """Say one line."""

    def warn(self, text: str) -> None:
        """Say one line that the user should not miss."""


class Silent:
    """A reporter that says nothing, of stages too."""

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> Silent:  # noqa: ARG002
        """Say nothing of a stage either."""
        return self

    def note(self, *_told: Any, **_named: Any) -> None:
        """Let it go untold."""

    start = advance = warn = compiling = end = drawn = note
