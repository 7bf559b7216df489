"""Figures of families of gaits: 13 (bifurcations), 14 (multipliers) and 16 (regions in a plane of two parameters)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count, cycle, pairwise
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.typing import LineStyleType
from numpy.typing import NDArray

from walkerlab.labels import axis_label
from walkerlab.pipeline.store.content import Group
from walkerlab.views.figures.canvas import add_legend, entry, figure_style, is_narrow, label_of, panels, settle
from walkerlab.views.figures.illustration import Drawn, Need, Results, paper_figure
from walkerlab.views.figures.maps import Kind, draw_kinds
from walkerlab.views.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION


def draw_unit_circle(multipliers: Sequence[complex]) -> Figure:
    """Draw a gait's multipliers and the unit circle, inside which all multipliers of a stable gait lie."""
    with figure_style(4.0):
        figure, axes = panels(4.0)
        axes.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=GREY))
        axes.axhline(color=GREY, linewidth=0.5)
        axes.axvline(color=GREY, linewidth=0.5)
        for multiplier in multipliers:
            colour = BLUE if abs(multiplier) < 1.0 else VERMILLION
            axes.plot(multiplier.real, multiplier.imag, "o", color=colour, markeredgecolor=BLACK)
        extent = 1.1 * max(1.0, *map(abs, multipliers))
        ends = (-extent, extent)
        axes.set(xlim=ends, ylim=ends, aspect="equal", xlabel="real part", ylabel="imaginary part")
        axes.set_title(f"Multipliers; the largest has magnitude {max(map(abs, multipliers)):.3g}")
        settle(figure)
    return figure


CONTINUATION_STAGE: Final = "continuation"
NEED: Final = Need(CONTINUATION_STAGE, "branches", ("model", "period", "from", "to"), "no branch was found")
MODEL_COLOURS: Final = {"rigid": BLUE, "contact": ORANGE}
BIFURCATION_MARKS: Final = {"flip": ("o", VERMILLION), "fold": ("s", BLACK), "torus": ("D", PURPLE)}
STYLES: Final[dict[bool, LineStyleType]] = {True: "-", False: (0.0, (2.2, 1.6))}
POINTS_FROM_FLIP: Final = 16
"""Number of points plotted between a flip and the first gait computed on the branch that starts there."""
OTHER_GAITS: Final = GREEN
"""Colour of gaits outside the period-doubling cascade of the one-step gait."""


@dataclass(frozen=True)
class DrawnBranch:
    """A branch of gaits of a model, or a bifurcation curve over two parameters."""

    model: str
    group: Group

    @property
    def period(self) -> int:
        """Steps per gait."""
        return int(self.group.attrs["period"])

    @property
    def is_other(self) -> bool:
        """Whether the branch is outside the cascade, because its period is not a power of two."""
        return self.period & (self.period - 1) != 0

    @property
    def colour(self) -> str:
        return OTHER_GAITS if self.is_other else MODEL_COLOURS[self.model]


def branches_of(results: Results, name: str = "branch") -> Iterator[DrawnBranch]:
    """Yield the branches or curves (`name`) of each model, in the order in which they were followed."""
    for model in MODEL_COLOURS:
        for number in count():
            if (group := results[CONTINUATION_STAGE].groups.get(f"{model}/{name}_{number}")) is None:
                break
            yield DrawnBranch(model, group)


def parameter_of(results: Results) -> str:
    """Return the axis label of the parameter, with its unit."""
    summary = results[CONTINUATION_STAGE].summary
    return label_of(axis_label(str(summary["over"])), str(summary["unit"]))


@dataclass(frozen=True)
class Curve:
    """A quantity of every step along a branch, with the branch's bifurcations."""

    value: NDArray[np.float64]  # (points,) parameter values
    quantity: NDArray[np.float64]  # (points, steps) values of the quantity
    stable: NDArray[np.bool_]  # (points - 1,) whether the gaits between neighbouring points are stable
    marks: tuple[tuple[int, str], ...]  # index and kind of each bifurcation


def curve_of(group: Group, name: str) -> Curve:
    """Read a quantity along a branch and at its bifurcations.

    The branch counts as stable between two points if the gaits at both points are stable.
    """
    value = group["value"]
    quantity = group[name]
    stable = group["stable"].astype(bool)
    if "mark_after" not in group.variables:
        return Curve(value, quantity, stable[:-1] & stable[1:], ())
    order = np.argsort(group["mark_after"].astype(int), kind="stable")
    places = group["mark_after"].astype(int)[order] + 1
    value = np.insert(value, places, group["mark_value"][order])
    quantity = np.insert(quantity, places, group[f"mark_{name}"][order], axis=0)
    # A bifurcation counts as stable, so that stable stretches reach up to it.
    known = np.insert(stable, places, True)
    on_mark = np.insert(np.zeros(stable.size, bool), places, True)
    # If no gait was computed between two neighbouring bifurcations, the stability there is unknown, so that stretch
    # counts as unstable.
    between = known[:-1] & known[1:] & ~(on_mark[:-1] & on_mark[1:])
    marks = zip(np.flatnonzero(on_mark).tolist(), group["mark_kind"][order].astype(str).tolist(), strict=True)
    return Curve(value, quantity, between, tuple(marks))


def draw_branch(axes: Axes, branch: DrawnBranch, name: str) -> set[str]:
    """Plot a quantity of every step along a branch, mark the branch's bifurcations, and return their kinds.

    Lines are solid where gaits are stable, otherwise dashed.
    """
    curve = curve_of(branch.group, name)
    width = 1.5 if branch.period == 1 else 1.0
    bounds = [0, *(int(index) + 1 for index in np.flatnonzero(np.diff(curve.stable))), curve.stable.size]
    for begin, end in pairwise(bounds):
        if begin == end:
            continue
        stable = bool(curve.stable[begin])
        thick, order = (width, 4) if stable else (0.6 * width, 3)
        stretch = stretch_of(curve, begin, end)
        axes.plot(*stretch, color=branch.colour, linestyle=STYLES[stable], linewidth=thick, zorder=order)
    for place, kind in curve.marks:
        marker, colour = BIFURCATION_MARKS[kind]
        mark: dict[str, Any] = {"marker": marker, "markersize": 2.6, "color": colour, "markeredgewidth": 0.0}
        values = np.full(curve.quantity.shape[1], curve.value[place])
        axes.plot(values, curve.quantity[place], linestyle="none", **mark, zorder=6)
    return {kind for _, kind in curve.marks}


def stretch_of(curve: Curve, begin: int, end: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the parameter values and quantities to plot between the points `begin` and `end` of a branch."""
    # Near the flip at which a branch begins, the values of the steps separate as the square root of the distance. A
    # straight line to the first computed gait would show a sharp corner.
    value = curve.value[begin : end + 1]
    quantity = curve.quantity[begin : end + 1]
    if begin or (0, "flip") not in curve.marks:
        return value, quantity
    root = np.linspace(0.0, 1.0, POINTS_FROM_FLIP, endpoint=False)
    parting = quantity[0] + root[:, None] * (quantity[1] - quantity[0])
    first = value[0] + root**2 * (value[1] - value[0])
    return np.concatenate([first, value[1:]]), np.concatenate([parting, quantity[1:]])


def clouds(results: Results) -> Iterator[tuple[str, Group]]:
    attractors = ((model, results[CONTINUATION_STAGE].groups.get(f"{model}/attractor")) for model in MODEL_COLOURS)
    return ((model, group) for model, group in attractors if group is not None)


ATTRACTOR_QUANTITIES: Final = {"step_period": "step period", "stance_angle": "stance angle"}
MARGIN: Final = 0.06
"""Margin around the stable gaits, relative to their span. Beyond it, unstable branches are cut off."""
MIN_PANEL_SPAN: Final = 0.05
"""Panel (b) spans at least this fraction of the full range, and a vertical axis at least this fraction of its largest
magnitude."""
MIN_LABEL_DISTANCE: Final = 0.04
"""Minimum distance between the labels of gaits born in folds, as a fraction of the axis."""
MAX_DETAIL_FRACTION: Final = 0.8
"""Bifurcations get a separate panel if their range is less than this fraction of the full range."""
POINTS_BETWEEN: Final = 16
"""Number of points per interval of a branch at which multipliers are plotted and extremes of a quantity are sought."""


def draw_branches(results: Results) -> Drawn:
    """Plot step period and stance angle over the full range (left) and around the bifurcations, if any (right)."""
    summary = results[CONTINUATION_STAGE].summary
    branches = list(branches_of(results))
    settled = list(clouds(results))
    close = closer_view(results)
    parts = {"(a) full range": None} | ({"(b) bifurcations": close} if close else {})
    if is_narrow():
        figure, stack = panels(5.6 * len(parts), 2 * len(parts))
        both = stack.reshape(len(parts), 2).T
    else:
        figure, both = panels(5.6, 2, len(parts), squeeze=False)
    births = births_in(branches, close) if close else []
    kinds: set[str] = set()
    for row, (name, words) in zip(both, ATTRACTOR_QUANTITIES.items(), strict=True):
        for axes, shown in zip(row, parts.values(), strict=True):
            for model, cloud in settled:
                values = np.broadcast_to(cloud["value"][:, None], cloud[name].shape)
                colour = BLACK if model == "rigid" else GREY
                axes.plot(values.ravel(), cloud[name].ravel(), ",", color=colour, alpha=0.5, zorder=2, rasterized=True)
            kinds.update(*(draw_branch(axes, branch, name) for branch in branches))
            axes.set(xlabel=parameter_of(results), ylabel=label_of(words, branches[0].group.variables[name].units))
            if shown is not None:
                axes.set_xlim(*shown)
                label_births(axes, births)
            axes.set_ylim(*bounds(results, name, shown))
    for axes, title in zip(both[0], parts, strict=True):
        axes.set_title(title if close else "")
    models = {branch.model: MODEL_COLOURS[branch.model] for branch in branches}
    key: list[Artist] = [entry(f"{model} model", color=colour, linewidth=1.5) for model, colour in models.items()]
    if any(branch.is_other for branch in branches):
        key.append(entry("other gaits", color=OTHER_GAITS, linewidth=1.0))
    key.append(entry("unstable", color=BLACK, linewidth=0.9, linestyle=STYLES[False]))
    if settled:
        key.append(entry("attractor", color=BLACK, linestyle="none", marker=".", markersize=3))
    marks = {kind: mark for kind, mark in BIFURCATION_MARKS.items() if kind in kinds}
    for kind, (marker, colour) in marks.items():
        key.append(entry(kind, color=colour, linestyle="none", marker=marker, markersize=4))
    add_legend(figure, key)
    cascades = [item for item in summary["cascades"] if item["period"] == 1 and "accumulates_at" in item]
    return figure, (summary["first_doubling"], cascades, births, "" if summary["unit"] == "1" else summary["unit"])


def births_in(branches: Sequence[DrawnBranch], shown: tuple[float, float]) -> list[tuple[float, int]]:
    """List (parameter value, steps) of the gaits that are born in folds. Of gaits whose labels would overlap, list only
    the one with the fewest steps.
    """
    others = [(branch.period, curve_of(branch.group, "step_period")) for branch in branches if branch.is_other]
    folds = [
        (period, float(curve.value[place])) for period, curve in others for place, kind in curve.marks if kind == "fold"
    ]
    births: list[tuple[float, int]] = []
    for period, value in sorted(folds):
        apart = all(abs(value - other) > MIN_LABEL_DISTANCE * (shown[1] - shown[0]) for other, _ in births)
        if shown[0] <= value <= shown[1] and apart:
            births.append((value, period))
    return sorted(births)


def label_births(axes: Axes, births: Sequence[tuple[float, int]]) -> None:
    """Label gaits born in folds above the axes, because those that are stable only in a narrow window are hard to
    see."""
    if births:
        above = axes.secondary_xaxis("top")
        above.set_xticks([value for value, _ in births], [str(period) for _, period in births])
        above.set_xlabel("steps per gait born in a fold")


def closer_view(results: Results) -> tuple[float, float] | None:
    """Return the parameter range around the bifurcations and any attractor, or None if it is nearly the full range."""
    summary = results[CONTINUATION_STAGE].summary
    values = [item["value"] for item in summary["bifurcations"]]
    if not values:
        return None
    # Attractors go on beyond the last bifurcation, up to the value at which they are lost.
    ends = [item["to"] for item in summary["attractors"]] or [summary["to"]]
    least = min(values)
    most = max(*ends, max(values))
    room = max(MARGIN * (most - least), 0.5 * (MIN_PANEL_SPAN * (summary["to"] - summary["from"]) - (most - least)))
    close = max(least - room, summary["from"]), min(most + room, summary["to"])
    return close if close[1] - close[0] < MAX_DETAIL_FRACTION * (summary["to"] - summary["from"]) else None


def bounds(results: Results, name: str, close: tuple[float, float] | None) -> tuple[float, float]:
    """Return axis limits that fit the stable gaits shown and, if the full range is shown, all one-step gaits."""
    shown: list[NDArray[Any]] = [cloud[name].ravel() for _, cloud in clouds(results)]
    for branch in branches_of(results):
        curve = curve_of(branch.group, name)
        value, quantity = (interpolate(values) for values in (curve.value, curve.quantity))
        is_stable = np.append(np.repeat(curve.stable, POINTS_BETWEEN), curve.stable[-1:])
        if close is not None:
            is_stable &= (value >= close[0]) & (value <= close[1])
        shown.append(quantity[is_stable | (close is None and branch.period == 1)].ravel())
    values = np.concatenate(shown)
    if values.size == 0:
        values = np.concatenate([branch.group[name].ravel() for branch in branches_of(results)])
    least = MIN_PANEL_SPAN * float(np.abs(values).max())
    room = max(MARGIN * float(np.ptp(values)), 0.5 * (least - float(np.ptp(values))))
    return float(values.min()) - room, float(values.max()) + room


def interpolate(along: NDArray[Any]) -> NDArray[np.float64]:
    """Interpolate values at the points of a branch, with `POINTS_BETWEEN` points per interval."""
    # Imported here, because no other figure needs it.
    from scipy.interpolate import PchipInterpolator

    count = len(along)
    if count == 1:
        return np.asarray(along)
    fine = np.linspace(0.0, count - 1.0, POINTS_BETWEEN * (count - 1) + 1)
    return np.asarray(PchipInterpolator(np.arange(count), along)(fine))


def multipliers_of(branch: DrawnBranch) -> NDArray[np.complex128]:
    """Return densely sampled multipliers along a branch (points, multipliers), largest first."""
    # The coefficients of the polynomial with these zeros are interpolated, because multipliers have kinks where two
    # meet.
    known = branch.group["multiplier_real"] + 1j * branch.group["multiplier_imag"]
    roots = np.array([np.roots(row) for row in interpolate(np.array([np.poly(row).real for row in known]))])
    return np.take_along_axis(roots, np.argsort(-np.abs(roots), axis=1), axis=1)


GAITS: Final = {"rigid": (BLUE, GREEN, PURPLE, BLACK), "contact": (ORANGE, VERMILLION, GREY)}
"""Colours of each model's one-step gaits, in the order in which they were found. `DASHES` has their line styles."""
DASHES: Final = ("-", "--", "-.", ":")
DOTS: Final[dict[str, Any]] = {"linestyle": "none", "marker": "o", "markersize": 1.2, "markeredgewidth": 0.0}
PLANE_HALF_WIDTH: Final = 1.6
"""Half the width of the visible part of the complex plane. Multipliers of unstable gaits may lie far outside."""


def draw_multipliers(results: Results) -> Drawn:
    """Plot multipliers in the complex plane (left) and their magnitudes over the parameter (right)."""
    (figure, (left, right)), largest = panels(3.6, 1, 2), 0.0
    branches = list(branches_of(results))
    shortest = min((branch.period for branch in branches), default=1)  # 2 steps if the legs differ
    drawn = [branch for branch in branches if branch.period == shortest]
    looks = {model: cycle(zip(colours, DASHES, strict=False)) for model, colours in GAITS.items()}
    key = []
    for branch in drawn:
        value = interpolate(branch.group["value"])
        multipliers = multipliers_of(branch)
        colour, dash = next(looks[branch.model])
        left.plot(multipliers.real.ravel(), multipliers.imag.ravel(), color=colour, **DOTS)
        last = multipliers[int(np.argmax(value))]
        left.plot(last.real, last.imag, linestyle="none", marker=">", markersize=4, color=colour)
        look: dict[str, Any] = {"color": colour, "linestyle": dash, "linewidth": 1.2}
        right.plot(value, np.abs(multipliers), **look)
        least, most = np.quantile(branch.group["step_period"], (0.0, 1.0))
        key.append(entry(f"{branch.model} model, steps of {least:.3g} to {most:.3g} s", **look))
        largest = max(largest, float(np.abs(multipliers).max()))
    left.add_patch(Circle((0.0, 0.0), 1.0, fill=False, edgecolor=GREY, linewidth=0.8))
    left.set(xlim=(-PLANE_HALF_WIDTH, PLANE_HALF_WIDTH), ylim=(-PLANE_HALF_WIDTH, PLANE_HALF_WIDTH), aspect="equal")
    left.set(xlabel="real part", ylabel="imaginary part", title="(a) in the complex plane")
    right.axhline(1.0, color=GREY, linewidth=0.8)
    right.set(xlabel=parameter_of(results), ylabel="magnitude", title="(b) over the parameter")
    right.set_ylim(0.0, 2.0 * PLANE_HALF_WIDTH)
    end = entry("largest parameter value", color=BLACK, linestyle="none", marker=">", markersize=4)
    add_legend(figure, [*key, end])
    found: dict[tuple[str, str], list[float]] = {}
    for item in results[CONTINUATION_STAGE].summary["bifurcations"]:
        if item["period"] == shortest:
            found.setdefault((item["model"], item["kind"]), []).append(item["value"])
    bifurcations = {which: sorted(values) for which, values in found.items()}
    return figure, (bifurcations, largest if largest > PLANE_HALF_WIDTH else None)


CURVES_NEED: Final = Need(
    CONTINUATION_STAGE, "curves", ("model", "period"), "no curves over two parameters (continuation.second)"
)
CURVE_COLOURS: Final = {"rigid": BLACK, "contact": ORANGE}
CURVE_STYLES: Final[dict[str, LineStyleType]] = {"flip": "-", "fold": (0.0, (3.0, 1.5))}
WIDTHS: Final = {1: 1.4, 2: 1.0}
MIN_CURVE_WIDTH: Final = 0.6
DOUBLED: Final = {1: "#DCE9F5", 2: "#A9CCE8", 4: "#6CA6D4", 8: "#3B7DB5", 16: "#1F5488"}
OTHER_PERIOD, APERIODIC, NO_WALKING = "#B5DDC0", "#F2C7A0", "#F4F4F4"


def draw_plane(results: Results) -> Drawn:
    """Colour the plane by attractor, and plot the bifurcation curves in it. Their style shows model, kind and
    period."""
    figure, axes = panels(4.4)
    regions = results[CONTINUATION_STAGE].groups.get("rigid/regions")
    key: list[Artist] = []
    shares = []
    if regions is not None:
        mesh = partial(axes.pcolormesh, regions["value"], regions["second"], shading="nearest", rasterized=True)
        found = region_kinds(regions)
        key = draw_kinds(lambda numbers, **look: mesh(numbers.T, **look), found)
        shares = [(name, where.mean()) for _, name, where in found]
    looks: dict[tuple[str, str], dict[str, Any]] = {}
    for curve in branches_of(results, "curve"):
        kind = str(curve.group.attrs["kind"])
        look = looks[curve.model, kind] = {"color": CURVE_COLOURS[curve.model], "linestyle": CURVE_STYLES[kind]}
        width = WIDTHS.get(curve.period, MIN_CURVE_WIDTH)
        axes.plot(curve.group["value"], curve.group["second"], **look, linewidth=width)
        second = curve.group.variables["second"]
        axes.set_ylabel(label_of(axis_label(second.long_name), second.units))
    axes.set_xlabel(parameter_of(results))
    order = sorted(looks, key=lambda look: (list(CURVE_COLOURS).index(look[0]), look[1]))
    add_legend(figure, [*key, *(entry(f"{kind}s, {model} model", **looks[model, kind]) for model, kind in order)])
    kinds = sorted({kind for _, kind in looks}, key=list(BIFURCATION_MARKS).index)
    return figure, (kinds, [model for model in CURVE_COLOURS if any(model == name for name, _ in looks)], shares)


def region_kinds(regions: Group) -> list[Kind]:
    """Return colour, name and cells of each kind of attractor that occurs."""
    period = regions["period"]
    kinds = [(colour, f"{n} step{'s' if n > 1 else ''}", period == n) for n, colour in DOUBLED.items()]
    kinds += [
        (OTHER_PERIOD, "other number of steps", (period > 0) & ~np.isin(period, list(DOUBLED))),
        (APERIODIC, "aperiodic", period == 0),
        (NO_WALKING, "no walking", period < 0),
    ]
    return [kind for kind in kinds if kind[2].any()]


FIGURE_13 = paper_figure(13, (NEED,), draw_branches)
FIGURE_14 = paper_figure(14, (NEED,), draw_multipliers)
FIGURE_16 = paper_figure(16, (CURVES_NEED,), draw_plane)
FIGURES = (FIGURE_13, FIGURE_14, FIGURE_16)
