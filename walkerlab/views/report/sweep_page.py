"""Plot a sweep, and write its page."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from walkerlab.errors import ConfigError
from walkerlab.pipeline.headlines import HEADLINES
from walkerlab.pipeline.store import content, files, runs
from walkerlab.pipeline.sweeps.question import SweptStage
from walkerlab.pipeline.sweeps.sweep import Swept
from walkerlab.views.figures import robustness, sweep
from walkerlab.views.figures.stage import draw as draw_figure
from walkerlab.views.figures.stage import paths_of
from walkerlab.views.report.blocks import Gallery, Picture, Section
from walkerlab.views.report.numbers import number
from walkerlab.views.report.page import Page, picture, render
from walkerlab.views.report.tables import Column, table
from walkerlab.views.report.words import words

PAGE = "sweep.html"
MAX_ROWS = 200
"""Maximum number of points that the page lists."""


def draw(swept: Swept, folder: runs.RunFolder, names: Sequence[str] = (), against: str = "") -> tuple[Path, list[Path]]:
    """Plot a sweep, write its page, and return the paths of the page and of the figure's files.

    names    quantities to plot; if empty, `choose` selects them
    against  quantity on the horizontal axis; if empty, the parameters
    Raises ConfigError for an unknown quantity, StorageError if writing fails.
    """
    group = swept.group
    question = swept.question
    check_quantities(group, names)
    if against and against not in question.names:
        check_quantities(group, [against], "--against")
    quantities = [*names] or [name for name in sweep.choose(group, question.names) if name != against]
    special = None if names or against else robustness.sweep_illustration(group, question.names)
    if special is None and quantities:
        special = sweep.illustration(group, question.stage, question.names, quantities, against)
    page = folder.path / PAGE
    paths = []
    pictures = []
    if special is not None:
        pictures = [picture(draw_figure(special, {}, folder.path, swept.path.stem), folder.path)]
        paths = [folder.path / path for path in paths_of(swept.path.stem).values()]
    files.write_atomically(page, render(page_of(swept, pictures, quantities)).encode())
    return page, paths


def check_quantities(group: content.Group, names: Sequence[str], option: str = "--show") -> None:
    """Raise ConfigError if a name is not a quantity of the result."""
    for name in names:
        if not sweep.is_number(group, name):
            listed = ", ".join(key for key in group.variables if sweep.is_number(group, key) and "." not in key)
            raise ConfigError(f"{option} {name} is not a quantity of the result.", f"Choose from {listed}.")


def check_options(stage: str, names: Mapping[str, str], variables: Collection[str]) -> None:
    """Raise ConfigError for an unknown quantity. `names` maps options as typed, such as '--show speed_m_s', to
    quantities.

    A quantity in a block of the summary is not refused, because it may still appear with a later point.
    """
    available = sorted({*variables, *HEADLINES.get(stage, ())} - {"outcome"})
    for option, name in names.items():
        if name not in available and "." not in name:
            listed = ", ".join(quantity for quantity in available if "." not in quantity)
            unknown = f"{option} is not among the quantities of the points computed so far."
            raise ConfigError(unknown, f"Choose from {listed}.")


PARAMETER_COLUMNS = (Column("name"), Column("key"), Column("unit"), Column("values"), Column("meaning", wide=True))


def page_of(swept: Swept, pictures: Sequence[Picture], quantities: Sequence[str]) -> Page:
    """Build the page: the figure, the parameters and the first points."""
    summary = swept.summary
    question = swept.question
    group = swept.group
    outcomes = ", ".join(f"{count} {name}" for name, count in summary["outcomes"].items())
    parameters = [
        (name, f"`{axis.key}`", variable.units, values_summary(axis.values), variable.long_name)
        for name, axis in zip(question.names, question.axes, strict=True)
        for variable in [group.variables[name]]
    ]
    columns = [Column(name, written=format_value, numeric=True) for name in (*question.names, *quantities)]
    columns += [Column("outcome"), Column("reason", wide=True)]
    listed = f"The first {MAX_ROWS} of {len(question)} points are listed. " if len(question) > MAX_ROWS else ""
    where = f"All values of every point are in `{swept.path.name}`, which xarray opens as one Dataset."
    drawing = [Gallery(tuple(pictures))] if pictures else []
    points = table("Points", columns, rows(group, question, quantities), note=f"{listed}{where}")
    section = Section("points", "Results", (*drawing, table("Parameters", PARAMETER_COLUMNS, parameters), points))
    lead = (f"{summary['points']} points: {outcomes}.", *summary_lines(summary))
    return Page(f"{question.stage} over {', '.join(question.names)}", (section,), lead, PAGE)


def summary_lines(summary: Mapping[str, Any]) -> list[str]:
    """Describe how a sweep's walks ended and their numerical error."""
    ended = [str(ending["said"]) for ending in summary.get("endings", ())]
    error = summary.get("numerical_error")
    return ended if error is None else [*ended, words("error.of_sample", error, "points")]


def values_summary(values: Sequence[object]) -> str:
    listed = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in values]
    return ", ".join(listed) if len(listed) <= 8 else f"{len(listed)} values, {listed[0]} to {listed[-1]}"


def rows(group: content.Group, question: SweptStage, quantities: Sequence[str]) -> list[tuple[Any, ...]]:
    """Return table rows of the first points: parameters, quantities, outcome and reason."""
    count = min(len(question), MAX_ROWS)
    places = [question.places(index) for index in range(count)]
    columns: list[list[Any]] = [[axis.values[point[k]] for point in places] for k, axis in enumerate(question.axes)]
    columns += [group[name].ravel()[:count].tolist() for name in (*quantities, "outcome", "reason")]
    return list(zip(*columns, strict=True))


def format_value(value: Any) -> str:
    return number(value, 6) if isinstance(value, float) else str(value)
