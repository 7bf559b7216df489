"""The page of a sweep: one file, like the report."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from walkerlab.report.page import environment

PROLOGUE = re.compile(r"^.*?(?=<svg)", re.DOTALL)


@dataclass(frozen=True)
class SweepPage:
    """What stands on it; all texts are plain but the figure, which is an SVG of this program.

    parameters  for each its name, key, unit, meaning and values
    rows        of the table, with `head`; `left_out` more are in the file
    """

    title: str
    finding: str
    figure: str | None
    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    left_out: int
    file: str
    parameters: Sequence[tuple[str, str, str, str, str]]


def render(page: SweepPage) -> str:
    """The page's HTML."""
    figure = None if page.figure is None else Markup(PROLOGUE.sub("", page.figure, count=1))
    return environment().get_template("sweep.html.j2").render(page=page, figure=figure)
