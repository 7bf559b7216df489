"""What the figures of families of gaits share: the branches of a result, and how they are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION
from walkerlab.store.content import Group

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType

STAGE: Final = "continuation"
NEED: Final = Need(STAGE, "branches", ("model", "period", "from", "to"), "no branch was found")
MODELS: Final = {"rigid": BLUE, "contact": ORANGE}
MARKS: Final = {"flip": ("o", VERMILLION), "fold": ("s", BLACK), "torus": ("D", PURPLE)}
STYLES: Final[dict[bool, LineStyleType]] = {True: "-", False: (0.0, (2.2, 1.6))}
OTHER: Final = GREEN
"""Of gaits that are not born of the gait of one step."""


@dataclass(frozen=True)
class Drawn:
    """A branch with its model."""

    model: str
    number: int
    group: Group

    @property
    def period(self) -> int:
        """Steps of its gaits."""
        return int(self.group.attrs["period"])

    @property
    def colour(self) -> str:
        """Of the model; of other gaits than those of one step and its cascade, their own."""
        period = self.period
        return MODELS[self.model] if period & (period - 1) == 0 else OTHER


def branches_of(results: Results) -> Iterator[Drawn]:
    """Every branch of a result."""
    groups = results[STAGE].groups
    for model in MODELS:
        number = 0
        while (group := groups.get(f"{model}/branch_{number}")) is not None:
            yield Drawn(model, number, group)
            number += 1


def label_of(results: Results) -> str:
    """The parameter with its unit, as an axis says it."""
    summary = results[STAGE].summary
    name, unit = str(summary["over"]), str(summary["unit"])
    words = {"slope_deg": "slope", "slope_rad": "slope"}.get(name, name)
    return f"{words} ({unit})" if unit not in ("", "1") else words


def stretches(stable: NDArray[Any]) -> Iterator[tuple[slice, bool]]:
    """Runs of points of one stability, each with the first point of the next."""
    bounds = [0, *(int(index) + 1 for index in np.flatnonzero(np.diff(stable.astype(int)))), stable.size]
    for begin, end in pairwise(bounds):
        yield slice(begin, min(end + 1, stable.size)), bool(stable[begin])


def draw_branch(axes: Axes, branch: Drawn, values: NDArray[np.float64]) -> None:
    """A quantity of every step of a branch, solid where it is stable."""
    group = branch.group
    width = 1.5 if branch.period == 1 else 1.0
    for part, stable in stretches(group["stable"]):
        for column in range(values.shape[1]):
            axes.plot(
                group["value"][part], values[part, column], color=branch.colour, linestyle=STYLES[stable],
                linewidth=width if stable else 0.6 * width, zorder=4 if stable else 3,
            )  # fmt: skip


def mark_bifurcations(axes: Axes, results: Results, branch: Drawn, values: NDArray[np.float64]) -> set[str]:
    """The bifurcations of a branch on its curves; which kinds there are."""
    rows = results[STAGE].groups.get(f"{branch.model}/bifurcations")
    kinds: set[str] = set()
    if rows is None:
        return kinds
    for row in np.flatnonzero(rows["branch"] == branch.number):
        kind, value = str(rows["kind"][row]), float(rows["value"][row])
        marker, colour = MARKS[kind]
        nearest = int(np.argmin(np.abs(branch.group["value"] - value)))
        for column in range(values.shape[1]):
            axes.plot(
                value, at(branch.group["value"], values[:, column], value, nearest), marker=marker, markersize=3.0,
                color=colour, markeredgewidth=0.0, zorder=6,
            )  # fmt: skip
        kinds.add(kind)
    return kinds


def at(value: NDArray[np.float64], quantity: NDArray[np.float64], where: float, nearest: int) -> float:
    """A quantity at a value of the parameter, linear between the neighbours about it; else that of the nearest point."""
    for index in (nearest - 1, nearest):
        if 0 <= index < value.size - 1:
            one, other = value[index], value[index + 1]
            if min(one, other) <= where <= max(one, other) and one != other:
                share = (where - one) / (other - one)
                return float(quantity[index] + share * (quantity[index + 1] - quantity[index]))
    return float(quantity[nearest])


def entries(models: set[str], kinds: set[str], others: bool, attractor: bool) -> list[Artist]:
    """What the legend has."""
    found: list[Artist] = [
        Line2D([], [], color=colour, linewidth=1.5, label=f"{model} model") for model, colour in MODELS.items()
        if model in models
    ]  # fmt: skip
    if others:
        found.append(Line2D([], [], color=OTHER, linewidth=1.0, label="other gaits"))
    found.append(Line2D([], [], color=BLACK, linewidth=0.9, linestyle=STYLES[False], label="unstable"))
    if attractor:
        found.append(Line2D([], [], color=BLACK, linestyle="none", marker=",", label="attractor"))
    for kind, (marker, colour) in MARKS.items():
        if kind in kinds:
            found.append(Line2D([], [], color=colour, linestyle="none", marker=marker, markersize=4, label=kind))
    return found
