"""Showing a file in the user's browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from walkerlab.cli.console import Console


def open_file(path: Path, console: Console) -> bool:
    """Open a file in the browser; whether there is one that took it, and a note if there is none."""
    import webbrowser

    opened = webbrowser.open(path.resolve().as_uri())
    if not opened:
        console.note(f"no browser was found; the page is {path.resolve()}")
    return opened
