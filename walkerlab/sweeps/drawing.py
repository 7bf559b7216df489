"""The figure and the page of a sweep, beside its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkerlab.errors import ConfigError
from walkerlab.figures.canvas import Drawing
from walkerlab.figures.sweep import choose, is_number
from walkerlab.figures.sweep import draw as drawn_figure
from walkerlab.report.page import SweepPage, render_sweep
from walkerlab.report.words import words
from walkerlab.store.content import Group
from walkerlab.store.files import make_folder, write_atomically
from walkerlab.store.runfolder import RunFolder
from walkerlab.sweeps.question import Question
from walkerlab.sweeps.result import parameter_values
from walkerlab.sweeps.sweep import Swept

PAGE = "sweep.html"
MOST_ROWS = 200
"""Points that the page lists."""


@dataclass(frozen=True)
class Files:
    """What was drawn."""

    page: Path
    figures: tuple[Path, ...]


def draw(swept: Swept, folder: RunFolder, names: Sequence[str] = ()) -> Files:
    """Draw a sweep and write its page.

    names  the numbers to draw; none are those that say most

    Raises ConfigError for a number that is not there, StorageError if the system refuses.
    """
    group, question = swept.group, swept.question
    refuse_unknown(group, question.dims, names)
    shown = list(names) or choose(group, question.dims, question.names)
    figure = drawn_figure(group, question.stage, question.names, question.dims, shown) if shown else None
    stem = swept.path.stem
    paths = []
    if figure is not None:
        make_folder(folder.figures)
        for data, kind in ((figure.svg, "svg"), (figure.png, "png")):
            paths.append(folder.figures / f"{stem}.{kind}")
            write_atomically(paths[-1], data)
    page = folder.path / PAGE
    write_atomically(page, render_sweep(page_of(swept, group, figure, shown)).encode())
    return Files(page, tuple(paths))


def refuse_unknown(group: Group, dims: tuple[str, ...], names: Sequence[str]) -> None:
    """Raise ConfigError for a name that is no number of the result."""
    for name in names:
        if not is_number(group, name, dims):
            there = ", ".join(one for one in group.variables if is_number(group, one, dims) and "." not in one)
            raise ConfigError(f"--show {name}: no such number in the result.", f"There are {there}.")


def page_of(swept: Swept, group: Group, figure: Drawing | None, shown: Sequence[str]) -> SweepPage:
    """What the page says."""
    summary, question = swept.summary, swept.question
    outcomes = ", ".join(f"{count} {name}" for name, count in summary["outcomes"].items())
    return SweepPage(
        title=f"{question.stage} over {', '.join(question.names)}",
        finding=" ".join([f"{summary['points']} points: {outcomes}.", *said_of(summary)]),
        figure=None if figure is None else figure.svg.decode(),
        caption="" if figure is None else figure.caption,
        head=(*question.names, *shown, "outcome", "said"),
        rows=rows(group, question, shown),
        left_out=max(0, len(question) - MOST_ROWS),
        file=swept.path.name,
        parameters=tuple(
            (name, axis.key, group.variables[name].units, group.variables[name].long_name, spoken(axis.values))
            for name, axis in zip(question.names, question.axes, strict=True)
        ),
    )


def said_of(summary: Mapping[str, Any]) -> list[str]:
    """What a sweep says beside its numbers: what ended its walks, and how far their numbers are off."""
    ended = [str(one["said"]) for one in summary.get("endings", ())]
    error = summary.get("numerical_error")
    return ended if error is None else [*ended, words("error.of_sample", error, "points")]


def spoken(values: Sequence[object]) -> str:
    """Values in few words."""
    listed = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in values]
    return ", ".join(listed) if len(listed) <= 8 else f"{len(listed)} values, {listed[0]} to {listed[-1]}"


def rows(group: Group, question: Question, shown: Sequence[str]) -> list[list[str]]:
    """The first points as rows of text."""
    count = min(len(question), MOST_ROWS)
    columns = [[parameter_values(question, place)[question.places(i)[place]] for i in range(count)]
               for place in range(len(question.names))]  # fmt: skip
    columns += [group[name].ravel()[:count].tolist() for name in (*shown, "outcome", "said")]
    return [[cell(value) for value in row] for row in zip(*columns, strict=True)]


def cell(value: object) -> str:
    """A value in a table."""
    if isinstance(value, float):
        return "–" if value != value else f"{value:.6g}"
    return str(value)
