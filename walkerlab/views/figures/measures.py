"""Drawings of a walker's dimensions to scale, labelled with config keys: one upright leg, or each body separately."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from walkerlab.config.walkers import AssembledWalker, CompassWalker, Kneed, StraightLegs
from walkerlab.views.figures.canvas import blank, figure_style, files_of
from walkerlab.views.figures.style import BLACK, BLUE, FIGURE_WIDTH, GREEN, GREY, ORANGE, PALE, POINT, VERMILLION

AnyWalker = CompassWalker | StraightLegs | Kneed | AssembledWalker
Point = tuple[float, float]

FIGURE_HEIGHT = 4.6
"""Nominal height of the figure (in)."""
LABEL_SIZE = 7.5
"""Font size of the labels (pt)."""
SMALL_ARC = 0.02
"""A dimension up to this length (leg lengths) gets a label but no arrow, and a sole up to this radius gets no mark at
its centre."""
FAINT_GREY = "#C8C8C8"
"""Colour of the second leg."""
SOLE_ANGLES = np.linspace(-0.6, 0.6, 41)
SECOND_LEG_ANGLE = -0.3
"""Angle (rad) at which the second leg (or its thigh, if it has a knee) is drawn."""
BENT_ANGLE = -0.75
"""Angle (rad) at which the shank of the second leg is drawn."""
LEFT_OF_LEG = 0.62
"""Distance (leg lengths) between the leg and the labels behind it."""
FIRST_LANE = 0.24
"""Distance (leg lengths) between the leg and the first dimension line ahead of it."""
CHARACTER_WIDTH = 0.0088
"""Width of a character as a fraction of the picture's width."""
LINE_SPACING = 0.0195
"""Height of a line of text as a fraction of the picture's width."""
MIN_LABEL_DISTANCE = 0.05
"""Minimum distance between the centres of labels in a lane, in leg lengths."""
TITLE = 0.4
"""Height of the title of a panel (in)."""
PARTS_ROOM = 1.5
"""Height of a body's panel relative to the body."""


@dataclass(frozen=True)
class Length:
    """A horizontal or vertical dimension (m) between two points, from the config."""

    key: str
    value: float
    start: Point
    end: Point

    @property
    def label(self) -> str:
        return entry(self.key, self.value)


@dataclass(frozen=True)
class UprightLeg:
    """Geometry of one leg, in m. The leg is upright, with its sole at the origin."""

    joints: tuple[Point, ...]  # hip and any knee, from the top down
    centre: Point  # centre of the sole's arc
    radius: float
    lengths: tuple[Length, ...]
    masses: tuple[tuple[tuple[str, ...], Point], ...]  # labels and position of each mass
    top: float  # height of the torso's end, or of the hip

    @property
    def line(self) -> list[Point]:
        """Points of the leg's line from the hip down to where it meets the arc of the sole."""
        above = math.sqrt(max(0.0, self.radius**2 - self.centre[0] ** 2))
        return [*self.joints, (0.0, self.centre[1] - above)]


def entry(key: str, value: float) -> str:
    """Format `key: value` as in a config."""
    return f"{key}: {value:g}"


def mass_labels(walker: Any, prefix: str) -> tuple[str, ...]:
    """Return the labels of a body's mass and, if it has one, of its inertia. The body's config keys start with
    `prefix`."""
    inertia = value_of(walker, f"{prefix}inertia_kg_m2", 0.0)
    mass = entry(f"{prefix}mass_kg", value_of(walker, f"{prefix}mass_kg"))
    return (mass, entry(f"{prefix}inertia_kg_m2", inertia)) if inertia else (mass,)


def value_of(walker: Any, key: str, *otherwise: float) -> float:
    """Return the value at a dotted key of the walker, or `otherwise` if the walker lacks the key."""
    *blocks, last = key.split(".")
    return float(getattr(reduce(getattr, blocks, walker), last, *otherwise))


def measure_leg(walker: CompassWalker | StraightLegs | Kneed) -> UprightLeg:
    """Return the geometry of one upright leg, with its dimensions and masses."""
    radius = walker.foot_radius_m
    top = walker.leg_length_m
    sole = (0.0, 0.0)
    hip = (0.0, top)
    centre = (0.0, radius)
    joints = [(0.0, top)]
    lengths: list[Length] = []
    masses = [(mass_labels(walker, "hip_"), hip)]

    def measured(key: str, start: Point, end: Point) -> None:
        lengths.append(Length(key, value_of(walker, key), start, end))

    if walker.torso is not None:
        top += walker.torso.above_hip_m
        measured("torso.above_hip_m", (0.0, top), hip)
        masses.append((mass_labels(walker, "torso."), (0.0, top)))
    limbs = [("leg_", "hip", hip, sole)]
    if isinstance(walker, Kneed):
        joints.append((0.0, walker.shank.length_m))
        limbs = [("thigh.", "hip", hip, joints[1]), ("shank.", "knee", joints[1], sole)]
    for limb, joint, above, end in limbs:
        if isinstance(walker, CompassWalker):
            mass = (0.0, walker.foot_to_mass_m)
            measured("foot_to_mass_m", mass, sole)
        else:
            below = f"{limb}mass_below_{joint}_m"
            ahead = f"{limb}mass_ahead_m"
            mass = (value_of(walker, ahead), above[1] - value_of(walker, below))
            measured(below, above, mass)
            measured(ahead, (0.0, mass[1]), mass)
        measured(f"{limb}length_m", above, end)
        masses.append((mass_labels(walker, limb), mass))
    if isinstance(walker, StraightLegs | Kneed):
        centre = (walker.foot_centre_ahead_m, radius)
        measured("foot_centre_ahead_m", (0.0, radius), centre)
    measured("foot_radius_m", centre, (centre[0], 0.0))
    return UprightLeg(tuple(joints), centre, radius, tuple(lengths), tuple(masses), top)


def draw_measures(walker: AnyWalker, name: str, kind: str = "svg") -> bytes:
    """Draw the walker's dimensions, and return the bytes of a file of this kind (svg, pdf, png). Equal walkers and
    names give equal bytes."""
    with figure_style():
        figure = draw_parts(walker) if isinstance(walker, AssembledWalker) else draw_upright(walker)
        return files_of(figure, name, f"Dimensions of a walker of type {walker.type}", [kind])[0]


def draw_upright(walker: CompassWalker | StraightLegs | Kneed) -> Figure:
    """Draw an upright leg with its dimensions, and the other leg faintly behind it. If the legs differ, each has a
    panel, with that of the first leg above.
    """
    legs = [measure_leg(each) for each in dict.fromkeys((walker, walker.second))]
    views = [frame_leg(leg) for leg in legs]
    heights = [FIGURE_WIDTH * (view.top - view.bottom) / view.width for view in views]
    titles = len(legs) > 1
    figure = blank(sum(heights) + titles * len(legs) * TITLE)
    panels = figure.subplots(len(legs), 1, squeeze=False, height_ratios=heights)[:, 0]
    for index, (axes, leg, view) in enumerate(zip(panels, legs, views, strict=True)):
        draw_panel(axes, leg, legs[-1 - index], view)
        if titles:
            axes.set_title(f"leg {index + 1}", fontsize=LABEL_SIZE)
    return figure


@dataclass(frozen=True)
class View:
    """Part of the plane (m) in which a leg and all of its labels fit, and the positions of the labels."""

    labels: list[tuple[str, str, Point]]  # text, colour and position of each label behind the leg
    heights: list[float]  # height of each of these labels
    lanes: list[list[Length]]  # vertical dimension lines in front of the leg, one list per lane
    ahead: list[int]  # number of characters that fit in each lane
    left: float
    width: float
    bottom: float
    top: float


def frame_leg(leg: UprightLeg) -> View:
    length = leg.joints[0][1]
    labels, lanes = arrange_labels(leg)
    # Text has a fixed size, so it takes a fixed fraction of the width, however long the walker is.
    behind = letters([words for words, *_ in labels])
    ahead = [letters([dimension.label for dimension in lane]) for lane in lanes]
    width = (LEFT_OF_LEG + FIRST_LANE) * length / (1.0 - CHARACTER_WIDTH * (behind + sum(ahead)))
    width = max(width, (leg.top + 0.3 * length) * FIGURE_WIDTH / FIGURE_HEIGHT)
    left = -LEFT_OF_LEG * length - CHARACTER_WIDTH * behind * width
    sizes = [LINE_SPACING * width * len(words.split("\n")) for words, *_ in labels]
    heights = spread([spot[1] for *_, spot in labels], sizes, 0.0)
    return View(labels, heights, lanes, ahead, left, width, -0.16 * length, max(leg.top, *heights) + 0.1 * length)


def draw_panel(axes: Axes, leg: UprightLeg, other: UprightLeg, view: View) -> None:
    """Draw an upright leg on the ground with its dimensions, and the other leg faintly behind it."""
    length = leg.joints[0][1]
    ends = (view.left, view.left + view.width)
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=ends, ylim=(view.bottom, view.top))
    axes.fill_between(ends, -0.02 * length, 0.0, facecolor=PALE, edgecolor=GREY, hatch="////", linewidth=0.0)
    axes.plot(ends, [0.0, 0.0], color=BLACK, linewidth=0.8)
    y = -0.1 * length
    axes.annotate("", xy=(0.25 * length, y), xytext=(-0.25 * length, y), arrowprops={"arrowstyle": "-|>"})
    axes.text(0.28 * length, y, "walking direction", va="center", fontsize=LABEL_SIZE)
    # The other leg is behind this one and off the ground. Its knee, if it has one, is bent.
    second = [leg.joints[0]]
    angles = (SECOND_LEG_ANGLE, BENT_ANGLE)[: len(other.joints)]
    for angle, above, below in zip(angles, other.joints, other.line[1:], strict=True):
        second.append(rotate(angle, above, below, second[-1]))
    draw_leg(axes, second, rotate(angles[-1], other.joints[-1], other.centre, second[-2]), other.radius, FAINT_GREY)
    draw_leg(axes, leg.line, leg.centre, leg.radius, BLACK)
    axes.plot([0.0, 0.0], [length, leg.top], color=BLACK, linewidth=2.0)
    x = FIRST_LANE * length
    for lane, wide in zip(view.lanes, view.ahead, strict=True):
        for dimension in lane:
            draw_length(axes, dimension, x, CHARACTER_WIDTH * view.width)
        x += CHARACTER_WIDTH * wide * view.width
    axes.plot(*np.transpose([spot for _, spot in leg.masses]), "o", markersize=8, color=GREEN, zorder=5)
    for dimension in leg.lengths:
        if dimension.start[1] == dimension.end[1]:
            axes.plot(*np.transpose([dimension.start, dimension.end]), color=VERMILLION, linewidth=1.5)
    x = -LEFT_OF_LEG * length
    for (words, colour, spot), height in zip(view.labels, view.heights, strict=True):
        axes.plot([x, spot[0]], [height, spot[1]], color=colour, linewidth=0.5, zorder=1)
        axes.text(x, height, f"{words} ", color=colour, fontsize=LABEL_SIZE, ha="right", va="center")
    if leg.radius > SMALL_ARC * length:
        axes.plot(*leg.centre, marker="+", markersize=8, color=BLUE, zorder=5)


def arrange_labels(leg: UprightLeg) -> tuple[list[tuple[str, str, Point]], list[list[Length]]]:
    """Return the labels behind the leg (text, colour, position), and the vertical dimensions by lane."""
    length = leg.joints[0][1]
    lanes = list[list[Length]]()
    labels = [("\n".join(words), GREEN, spot) for words, spot in leg.masses]
    for dimension in (dimension for dimension in leg.lengths if dimension.value):
        level = dimension.start[1] == dimension.end[1]
        if level or dimension.value <= SMALL_ARC * length:
            labels.append((dimension.label, VERMILLION if level else BLUE, dimension.end))
        elif free := [lane for lane in lanes if all(fit_in_lane(dimension, second, length) for second in lane)]:
            free[0].append(dimension)
        else:
            lanes.append([dimension])
    return labels, lanes


def letters(texts: Sequence[str]) -> int:
    """Return the number of characters in the longest line of `texts`, plus a margin of two."""
    return max((len(line) + 2 for text in texts for line in text.split("\n")), default=0)


def fit_in_lane(dimension: Length, second: Length, length: float) -> bool:
    """Whether two dimensions fit in one lane without overlapping, including their labels."""
    between = 0.5 * abs(dimension.start[1] + dimension.end[1] - second.start[1] - second.end[1])
    # The factor is slightly below one half, so that dimensions may meet end to end.
    return between > max(0.499 * (dimension.value + second.value), MIN_LABEL_DISTANCE * length)


def spread(heights: Sequence[float], sizes: Sequence[float], lowest: float = -math.inf) -> list[float]:
    """Return the heights of labels, as close as possible to `heights` but raised where the labels below need room."""
    spread_heights = list(heights)
    for place in sorted(range(len(spread_heights)), key=spread_heights.__getitem__):
        spread_heights[place] = max(spread_heights[place], lowest + 0.5 * sizes[place])
        lowest = spread_heights[place] + 0.5 * sizes[place]
    return spread_heights


def draw_leg(axes: Axes, line: Sequence[Point], centre: Point, radius: float, colour: str) -> None:
    """Draw a leg from the hip through any knee to the sole, with the arc of the sole."""
    axes.plot(*np.transpose(line), color=colour, linewidth=2.0, zorder=2)
    axes.plot(*np.transpose(line[:-1]), linestyle="none", marker="o", markersize=6, color=colour, mfc="white", zorder=4)
    across, up = np.subtract(line[-1], line[-2])
    draw_sole(axes, centre, radius, np.arctan2(across, -up) + SOLE_ANGLES, colour)
    if radius == 0.0:  # a point foot, which may be ahead of the leg's line
        axes.plot(*np.transpose([line[-1], centre]), color=colour, linewidth=2.0, zorder=2)


def draw_sole(axes: Axes, centre: Point, radius: float, angles: NDArray[np.float64], colour: str) -> None:
    x, y = centre
    axes.plot(x + radius * np.sin(angles), y - radius * np.cos(angles), color=colour, linewidth=2.0)


def rotate(angle: float, origin: Point, point: Point, moved_to: Point) -> Point:
    """Rotate a point about `origin` by `angle` (rad), then shift it by `moved_to` minus `origin`."""
    (across, up), s, c = np.subtract(point, origin), np.sin(angle), np.cos(angle)
    return float(moved_to[0] + c * across - s * up), float(moved_to[1] + s * across + c * up)


def draw_length(axes: Axes, measure: Length, x: float, letter: float) -> None:
    """Draw a vertical dimension line at `x`, with its label to the right."""
    for point in (measure.start, measure.end):
        axes.plot([point[0], x], [point[1], point[1]], color=GREY, linewidth=0.5, linestyle=":", zorder=1)
    high = measure.start[1]
    low = measure.end[1]
    axes.annotate("", xy=(x, high), xytext=(x, low), arrowprops={"arrowstyle": "<|-|>", "color": BLUE})
    axes.text(x + letter, 0.5 * (high + low), measure.label, color=BLUE, fontsize=LABEL_SIZE, va="center")


def draw_parts(walker: AssembledWalker) -> Figure:
    """Draw all bodies, each in its own frame. If the legs are equal, only the second is drawn."""
    # Imported here, because only walkers of parts need their mechanics for a drawing.
    from walkerlab.scene.rigid import level_walker

    alike = () if level_walker(walker, gravity=1.0).legs_differ else walker.legs[0]
    shown = [body for body in walker.bodies if body.name not in alike]
    figure = blank(FIGURE_HEIGHT)
    for axes, body in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        axes.set(aspect="equal", title="\n".join([f"name: {body.name}", *mass_labels(body, "")]), xlabel="ahead (m)")
        axes.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
        axes.axvline(0.0, color=GREY, linewidth=0.6, zorder=0)
        marks = list(marks_of(walker, body.name, body.centre_m))
        bones = [spot for words, _, marker, spot in marks if marker == "o" and not words.startswith("centre_m")]
        for foot in walker.feet:
            if foot.body == body.name:
                bones.append((foot.centre_m[0], foot.centre_m[1] - foot.radius_m))
                draw_sole(axes, foot.centre_m, foot.radius_m, SOLE_ANGLES, BLACK)
        axes.plot(*np.transpose(bones), color=BLACK, linewidth=2.0, zorder=1)
        points = np.array([*bones, *(spot for *_, spot in marks)])
        (left, low), (_, high) = points.min(axis=0), points.max(axis=0)
        tall = PARTS_ROOM * max(high - low, 0.1 * walker.leg_length_m)
        wide = tall * (FIGURE_WIDTH / len(shown) - 0.7) / (FIGURE_HEIGHT - 1.0)
        low = 0.5 * (low + high - tall)
        axes.set(ylim=(low, low + tall), xlim=(left - 0.25 * wide, left + 0.75 * wide))
        line = tall * 1.35 * LABEL_SIZE * POINT / (FIGURE_HEIGHT - 1.0)
        heights = spread([spot[1] for *_, spot in marks], [line * len(words.split("\n")) for words, *_ in marks])
        for (words, colour, marker, spot), height in zip(marks, heights, strict=True):
            axes.plot(*spot, marker=marker, markersize=8, color=colour, linestyle="none", zorder=3)
            aside = points[:, 0].max() + 0.1 * wide
            axes.plot([spot[0], aside], [spot[1], height], color=colour, linewidth=0.5, zorder=2)
            axes.text(aside, height, f" {words}".replace("\n", "\n "), color=colour, fontsize=LABEL_SIZE, va="center")
    figure.axes[0].set_ylabel("up (m)")
    return figure


def marks_of(walker: AssembledWalker, body: str, centre: Point) -> Iterator[tuple[str, str, str, Point]]:
    """Yield the points that the config defines on a body: label, colour, marker and position (m)."""

    def spot(point: Point) -> str:
        return f"[{point[0]:g}, {point[1]:g}]"

    for hinge in walker.hinges:
        called = f"{hinge.name}{', locks' if hinge.locks else ''}\n"
        if hinge.parent == body:
            yield f"{called}parent_point_m: {spot(hinge.parent_point_m)}", BLUE, "o", hinge.parent_point_m
        if hinge.child == body:
            yield f"{called}child_point_m: {spot(hinge.child_point_m)}", BLUE, "o", hinge.child_point_m
    yield f"centre_m: {spot(centre)}", GREEN, "o", centre
    for particle in walker.particles:
        if particle.body == body:
            words = f"particle {particle.name}\nat_m: {spot(particle.at_m)}\n{entry('mass_kg', particle.mass_kg)}"
            yield words, VERMILLION, "D", particle.at_m
    for foot in walker.feet:
        if foot.body == body:
            words = f"foot\ncentre_m: {spot(foot.centre_m)}\n{entry('radius_m', foot.radius_m)}"
            yield words, ORANGE, "s", foot.centre_m
