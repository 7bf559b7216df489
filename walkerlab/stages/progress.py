"""What a stage tells of its progress, and the runner of its doings; how it is shown is the caller's affair."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """What a stage may call while it runs."""

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a piece of work of `total` parts, if their number is known; ends the one before."""

    def advance(self, n: int = 1) -> None:
        """Count `n` more parts as done."""

    def note(self, text: str) -> None:
        """Say one line about the work."""


class Reporter(Progress, Protocol):
    """What the runner calls besides."""

    def warn(self, text: str) -> None:
        """Say one line that the user should not miss."""

    def finish(self) -> None:
        """End the piece of work that was begun last, if any."""


class Silent:
    """A reporter that says nothing."""

    def start(self, label: str, total: int | None = None) -> None:
        """Nothing."""

    def advance(self, n: int = 1) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""

    def warn(self, text: str) -> None:
        """Nothing."""

    def finish(self) -> None:
        """Nothing."""
