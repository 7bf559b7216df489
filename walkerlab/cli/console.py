"""Messages and progress on stderr; a bar only on a terminal."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID


class Console:
    """The reporter of the command line; see `stages.progress`."""

    def __init__(self, quiet: bool = False, verbose: bool = False) -> None:
        """Say nothing but warnings if `quiet`, and details too if `verbose`."""
        self.quiet = quiet
        self.verbose = verbose
        self._bar: Bar | None = None
        self._task: TaskID | None = None

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a piece of work: a bar on a terminal, elsewhere a line if verbose."""
        self.finish()
        if not self.quiet and sys.stderr.isatty():
            self._begin_bar(label, total)
        else:
            self.detail(label if total is None else f"{label} ({total})")

    def advance(self, n: int = 1) -> None:
        """Count parts as done."""
        if self._bar is not None and self._task is not None:
            self._bar.advance(self._task, n)

    def note(self, text: str) -> None:
        """Say one line, unless quiet."""
        if not self.quiet:
            self._say(text)

    def detail(self, text: str) -> None:
        """Say one line if verbose."""
        if self.verbose and not self.quiet:
            self._say(text)

    def warn(self, text: str) -> None:
        """Say one line, quiet or not."""
        self._say(f"warning: {text}")

    def finish(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = self._task = None

    def _say(self, text: str) -> None:
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            print(text, file=sys.stderr, flush=True)

    def _begin_bar(self, label: str, total: int | None) -> None:
        # Imported here: no bar, no rich.
        from rich.console import Console as Terminal
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
        )
        self._bar = Progress(*columns, console=Terminal(stderr=True), transient=True)
        self._task = self._bar.add_task(label, total=total)
        self._bar.start()
