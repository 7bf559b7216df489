"""Show messages and progress on stderr, with bars on a terminal and otherwise with a line now and then."""

import bisect
import contextlib
import sys
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkerlab.errors import escape_controls

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

MAX_SILENCE_S = 8.0
"""Maximum time (s) without a message while a stage runs and stderr is not a terminal."""

MIN_DONE_FRACTION = 0.1
"""The remaining time is predicted only after this fraction of the parts, because the first parts are not typical."""
MIN_COMPUTED_S = 3.0
"""The remaining time is predicted only after this computing time (s)."""


class Console:
    """Reporter of the command line, which implements `pipeline.progress.Reporter`."""

    def __init__(self, quiet: bool = False, verbose: bool = False, open_page: bool = False) -> None:
        self.quiet = quiet
        self.verbose = verbose
        self.open_page = open_page
        self.running: list[StageLine] = []
        self.shown = False
        self._drawn = False
        self._live: Live | None = None
        self._said_at = time.monotonic()
        self._pulse: threading.Event | None = None
        self._lock = threading.RLock()

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> "StageLine":
        line = StageLine(self, stage, place, expected_s)
        with self._lock:
            self.running.append(line)
        if not self.quiet:
            if sys.stderr.isatty():
                self._show_bars()
            else:
                self.note(f"{stage}: starts ({place})" if place else f"{stage}: starts")
                if self._pulse is None:
                    self._pulse = threading.Event()
                    threading.Thread(target=self._talk, args=(self._pulse,), daemon=True).start()
        return line

    def ended(self, line: "StageLine", message: str) -> None:
        with self._lock:
            if line in self.running:
                self.running.remove(line)
            if not self.running:
                if self._live is not None:
                    self._live.stop()
                if self._pulse is not None:
                    self._pulse.set()
                self._live = self._pulse = None
        if message:
            self.note(message)

    def announce_page(self, summary: Mapping[str, Any], folder: Path) -> None:
        """Announce a partial page once, and open it if requested."""
        page = summary.get("html")
        if page is None or self._drawn:
            return
        self._drawn = True
        path = (folder / str(page)).resolve()
        self.note(f"page: {path} (partial; updated as results come in)")
        if self.open_page:
            self.shown = self.show(path)

    def show(self, page: Path | str) -> bool:
        """Open a file or address in a browser, and return whether a browser was found."""
        # Imported here, because most commands show no page.
        import webbrowser

        place = page if isinstance(page, str) else page.resolve()
        opened = webbrowser.open(place if isinstance(place, str) else place.as_uri())
        if not opened:
            self.note(f"no browser was found; the page is {place}")
        return opened

    def refresh(self) -> None:
        if self._live is not None:
            self._live.refresh()

    def note(self, text: str) -> None:
        if not self.quiet:
            self._say(text)

    def detail(self, text: str) -> None:
        if self.verbose and not self.quiet:
            self._say(text)

    def warn(self, text: str) -> None:
        self._say(f"warning: {text}")

    def _say(self, text: str) -> None:
        text = escape_controls(text)
        with self._lock, contextlib.suppress(BrokenPipeError):
            self._said_at = time.monotonic()
            if self._live is not None:
                self._live.console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                print(text, file=sys.stderr, flush=True)

    def _talk(self, end: threading.Event) -> None:
        """Report the running stages whenever nothing has been printed for a while."""
        while not end.wait(0.5):
            if time.monotonic() - self._said_at >= MAX_SILENCE_S:
                self._say("; ".join(line.describe() for line in tuple(self.running)))

    def _show_bars(self) -> None:
        if self._live is not None:
            return
        # Imported here, because only progress bars need rich.
        from rich.console import Console as Terminal
        from rich.live import Live

        self._live = Live(get_renderable=self._bars, console=Terminal(stderr=True), transient=True)
        self._live.start()

    def _bars(self) -> "Table":
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        bars = Table.grid(padding=(0, 1))
        for line in tuple(self.running):
            bar = ProgressBar(line.total, line.done, width=20, pulse=line.total is None)
            bars.add_row(Text(line.work()), bar, Text(line.pace()))
        return bars


class StageLine:
    """A running stage, with its current work and progress."""

    def __init__(self, console: Console, stage: str, place: str, expected_s: float | None) -> None:
        self.console = console
        self.stage = stage
        self.place = place
        self.expected_s = expected_s
        self.label = stage
        self.total: int | None = None
        self.done = 0
        self.progress: list[tuple[int, float]] = []  # completed parts and computing time (s), after each advance
        self.began = self.work_began = time.monotonic()

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a piece of work. `total` is the number of its parts, or None if that is unknown."""
        self.label = label
        self.total = total
        self.done = 0
        self.progress = []
        self.work_began = time.monotonic()
        self.console.detail(label if total is None else f"{label} ({total})")
        self.console.refresh()

    def advance(self, n: int = 1) -> None:
        self.done += n
        self.progress.append((self.done, time.monotonic() - self.work_began))

    def note(self, text: str) -> None:
        self.console.note(text)

    def end(self, message: str) -> None:
        self.console.ended(self, message)

    def work(self) -> str:
        return self.label if self.label.startswith(self.stage) else f"{self.stage}: {self.label}"

    def pace(self) -> str:
        parts = [f"{self.done} of {self.total}"] if self.total is not None and self.total > 1 else []
        parts.append(f"{time.monotonic() - self.began:.0f} s")
        if (remaining := self.seconds_left()) is not None:
            parts.append(f"about {remaining:.0f} s left")
        return ", ".join(parts)

    def seconds_left(self) -> float | None:
        """Predict the remaining time (s) from the rate so far or the last duration of the stage, or return
        None if both are unknown.
        """
        computed = time.monotonic() - self.work_began
        if self.total and self.done >= MIN_DONE_FRACTION * self.total and computed >= MIN_COMPUTED_S:
            # The first parts also load and compile code, so only the later half counts.
            half = bisect.bisect_left(self.progress, (self.done // 2,))
            done, start = self.progress[half - 1] if half else (0, 0.0)
            latest = self.progress[-1][1]
            remaining = (latest - start) / (self.done - done) * (self.total - self.done) - (computed - latest)
        else:
            remaining = 0.0 if self.expected_s is None else self.expected_s - (time.monotonic() - self.began)
        return remaining if remaining > 0.0 else None

    def describe(self) -> str:
        return f"{self.work()} ({self.pace()})"
