"""What the figures of families of gaits share: the branches of a result, and how they are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from walkerlab.figures.needs import Need, Results
from walkerlab.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION
from walkerlab.labels import with_unit
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
class DrawnBranch:
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


def branches_of(results: Results) -> Iterator[DrawnBranch]:
    """Every branch of a result."""
    groups = results[STAGE].groups
    for model in MODELS:
        number = 0
        while (group := groups.get(f"{model}/branch_{number}")) is not None:
            yield DrawnBranch(model, number, group)
            number += 1


def label_of(results: Results) -> str:
    """The parameter with its unit, as an axis says it."""
    summary = results[STAGE].summary
    name = str(summary["over"])
    return with_unit({"slope_deg": "slope", "slope_rad": "slope"}.get(name, name), str(summary["unit"]))


@dataclass(frozen=True)
class Curve:
    """A quantity of every step along a branch, bifurcations among its points.

    value     (points,) of the parameter
    quantity  (points, steps)
    stable    (points - 1,) whether the gaits between neighbours are
    marks     where the bifurcations are, and of which kind
    """

    value: NDArray[np.float64]
    quantity: NDArray[np.float64]
    stable: NDArray[np.bool_]
    marks: tuple[tuple[int, str], ...]


def curve_of(group: Group, name: str) -> Curve:
    """A quantity along a branch; its stability changes at bifurcations, and else in the middle between neighbours."""
    value, quantity = group["value"], group[name]
    stable = group["stable"].astype(bool)
    if "mark_after" not in group.variables:
        return Curve(value, quantity, stable[:-1] & stable[1:], ())
    places = group["mark_after"].astype(int) + 1
    order = np.argsort(places, kind="stable")
    marked = places[order] + np.arange(places.size)
    value = np.insert(value, places[order], group["mark_value"][order])
    quantity = np.insert(quantity, places[order], group[f"mark_{name}"][order], axis=0)
    on_mark = np.zeros(value.size, bool)
    on_mark[marked] = True
    known = np.insert(stable, places[order], True)  # a bifurcation bounds what is stable and what is not
    between = known[:-1] & known[1:] & ~(on_mark[:-1] & on_mark[1:])
    kinds = tuple(str(kind) for kind in group["mark_kind"][order])
    return Curve(value, quantity, between, tuple(zip((int(place) for place in marked), kinds, strict=True)))


def draw_branch(axes: Axes, branch: DrawnBranch, name: str) -> set[str]:
    """A quantity of every step of a branch, solid where it is stable, with its bifurcations; their kinds."""
    curve = curve_of(branch.group, name)
    width = 1.5 if branch.period == 1 else 1.0
    bounds = [0, *(int(index) + 1 for index in np.flatnonzero(np.diff(curve.stable))), curve.stable.size]
    for begin, end in pairwise(bounds):
        if begin == end:
            continue
        stable = bool(curve.stable[begin])
        axes.plot(
            curve.value[begin : end + 1], curve.quantity[begin : end + 1], color=branch.colour,
            linestyle=STYLES[stable], linewidth=width if stable else 0.6 * width, zorder=4 if stable else 3,
        )  # fmt: skip
    for place, kind in curve.marks:
        marker, colour = MARKS[kind]
        axes.plot(
            np.full(curve.quantity.shape[1], curve.value[place]), curve.quantity[place], linestyle="none",
            marker=marker, markersize=2.6, color=colour, markeredgewidth=0.0, zorder=6,
        )  # fmt: skip
    return {kind for _, kind in curve.marks}


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
        found.append(Line2D([], [], color=BLACK, linestyle="none", marker=".", markersize=3, label="attractor"))
    for kind, (marker, colour) in MARKS.items():
        if kind in kinds:
            found.append(Line2D([], [], color=colour, linestyle="none", marker=marker, markersize=4, label=kind))
    return found
