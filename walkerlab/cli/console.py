"""Messages and progress on stderr: moving bars on a terminal, elsewhere a line now and then."""

from __future__ import annotations

import bisect
import contextlib
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

SILENCE_S = 8.0
"""Off a terminal, something is said of what runs at least as often."""

ENOUGH_DONE, ENOUGH_S = 0.1, 3.0
"""Share of the parts and time after which their rate tells the time that is left: the first parts are no sample."""


class Console:
    """The reporter of the command line: a `pipeline.progress.Progress`."""

    def __init__(self, quiet: bool = False, verbose: bool = False, open_page: bool = False) -> None:
        """Say nothing but warnings if `quiet`, and details too if `verbose`; show the first page with `open_page`."""
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

    def begin(self, stage: str, place: str, expected_s: float | None = None) -> StageLine:
        """Begin a stage: a bar on a terminal, elsewhere a line."""
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

    def ended(self, line: StageLine, said: str) -> None:
        """A stage has ended."""
        with self._lock:
            if line in self.running:
                self.running.remove(line)
            if not self.running:
                if self._live is not None:
                    self._live.stop()
                if self._pulse is not None:
                    self._pulse.set()
                self._live = self._pulse = None
        if said:
            self.note(said)

    def drawn(self, summary: Mapping[str, Any], folder: Path) -> None:
        """Tell once of a page that is there while the rest is being computed, and show it if that was asked for."""
        page = summary.get("html")
        if page is None or self._drawn:
            return
        self._drawn = True
        path = (folder / str(page)).resolve()
        self.note(f"page: {path} (partial; updated as results come in)")
        if self.open_page:
            self.shown = self.show(path)

    def show(self, page: Path | str) -> bool:
        """Open a file or an address in the user's browser; whether one took it, and a note if there is none."""
        # Imported here: few pages are shown.
        import webbrowser

        place = page if isinstance(page, str) else page.resolve()
        opened = webbrowser.open(place if isinstance(place, str) else place.as_uri())
        if not opened:
            self.note(f"no browser was found; the page is {place}")
        return opened

    def refresh(self) -> None:
        """Draw the bars anew, where there are any."""
        if self._live is not None:
            self._live.refresh()

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

    def _say(self, text: str) -> None:
        with self._lock, contextlib.suppress(BrokenPipeError):
            self._said_at = time.monotonic()
            if self._live is not None:
                self._live.console.print(text, markup=False, highlight=False, soft_wrap=True)
            else:
                print(text, file=sys.stderr, flush=True)

    def _talk(self, end: threading.Event) -> None:
        """Say how far the running stages are whenever nothing was said for a while."""
        while not end.wait(0.5):
            if time.monotonic() - self._said_at >= SILENCE_S:
                self._say("; ".join(line.said() for line in self._lines()))

    def _lines(self) -> Iterator[StageLine]:
        with self._lock:
            yield from tuple(self.running)

    def _show_bars(self) -> None:
        if self._live is not None:
            return
        # Imported here: no bar, no rich.
        from rich.console import Console as Terminal
        from rich.live import Live

        self._live = Live(get_renderable=self._bars, console=Terminal(stderr=True), transient=True)
        self._live.start()

    def _bars(self) -> Table:
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        bars = Table.grid(padding=(0, 1))
        for line in self._lines():
            bar = ProgressBar(line.total, line.done, width=20, pulse=line.total is None)
            bars.add_row(Text(line.work()), bar, Text(line.pace()))
        return bars


class StageLine:
    """One stage that runs: what it is at, and how far."""

    def __init__(self, console: Console, stage: str, place: str, expected_s: float | None) -> None:
        """It has begun."""
        self.console, self.stage, self.place, self.expected_s = console, stage, place, expected_s
        self.label, self.kernel = stage, ""
        self.total: int | None = None
        self.done = 0
        self.progress: list[tuple[int, float]] = []  # parts done, and when: s of computing
        self.compiled_s = 0.0  # of the piece of work that runs
        self.compiling_since = 0.0
        self.began = self.work_began = time.monotonic()

    def start(self, label: str, total: int | None = None) -> None:
        """Begin a piece of work."""
        self.label, self.total, self.done, self.progress = label, total, 0, []
        self.work_began, self.compiled_s = time.monotonic(), 0.0
        self.console.detail(label if total is None else f"{label} ({total})")
        self.console.refresh()

    def advance(self, n: int = 1) -> None:
        """Count parts as done."""
        self.done += n
        self.progress.append((self.done, self.computed_s()))

    def note(self, text: str) -> None:
        """Say one line."""
        self.console.note(text)

    def compiling(self, kernel: str) -> None:
        """Tell compiling from computing."""
        now = time.monotonic()
        if self.kernel and not kernel:
            self.compiled_s += now - self.compiling_since
            self.console.detail(f"{self.stage}: compiled {self.kernel} in {now - self.compiling_since:.1f} s")
        self.kernel, self.compiling_since = kernel, now
        self.console.refresh()

    def end(self, said: str) -> None:
        """The stage has ended."""
        self.console.ended(self, said)

    def work(self) -> str:
        """What the stage is at."""
        label = self.label if self.label.startswith(self.stage) else f"{self.stage}: {self.label}"
        return f"{label}: compiling {self.kernel}, kept for later runs" if self.kernel else label

    def pace(self) -> str:
        """How far it is, and how long it will take."""
        elapsed = time.monotonic() - self.began
        parts = [f"{self.done} of {self.total}"] if self.total is not None and self.total > 1 else []
        left = self.seconds_left()
        parts.append(f"{elapsed:.0f} s")
        parts += [] if left is None else [f"about {left:.0f} s left"]
        return ", ".join(parts)

    def computed_s(self) -> float:
        """How long the piece of work has run, compiling left out."""
        now = time.monotonic()
        compiled = self.compiled_s + (now - self.compiling_since if self.kernel else 0.0)
        return now - self.work_began - compiled

    def seconds_left(self) -> float | None:
        """By the rate of the later half of what is done, or by how long the stage took the last time.

        It comes down while a part is at work. None until enough is known, and where it takes longer than that.
        """
        computed = self.computed_s()
        if self.total and self.done >= ENOUGH_DONE * self.total and computed >= ENOUGH_S:
            half = bisect.bisect_left(self.progress, (self.done // 2,))
            done, at = self.progress[half - 1] if half else (0, 0.0)
            latest = self.progress[-1][1]
            left = (latest - at) / (self.done - done) * (self.total - self.done) - (computed - latest)
        else:
            left = 0.0 if self.expected_s is None else self.expected_s - (time.monotonic() - self.began)
        return left if left > 0.0 else None

    def said(self) -> str:
        """All of it on one line."""
        return f"{self.work()} ({self.pace()})"
