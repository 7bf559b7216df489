"""A walker's measures to scale, named as the config names them: one leg upright, or every part in its own frame."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from walkerlab.config.walkers import CompassWalker, Kneed, PartsWalker, StraightLegs
from walkerlab.figures.canvas import blank, files_of, styled
from walkerlab.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PALE, VERMILLION

AnyWalker = CompassWalker | StraightLegs | Kneed | PartsWalker
Point = tuple[float, float]

HEIGHT, SMALL = 4.6, 7.5
"""Of the figure, in; of its letters, pt."""
SMALL_ARC = 0.02
"""Radius of a sole, in leg lengths, too small to show what belongs to its centre."""
FAINT = "#C8C8C8"
"""Colour of the other leg."""
ARC = np.linspace(-0.6, 0.6, 41)
BEHIND, BENT = -0.3, -0.75
"""Angles (rad) of the other leg, and of its shank."""
FIRST_LANE, LANE, LEFT = 0.24, 0.72, -0.62
"""Where measures of height stand, one beside the other, and where masses are named; leg lengths ahead of the hip."""


@dataclass(frozen=True)
class Length:
    """A length of the config, between two points at one height or above one another (m)."""

    key: str
    value: float
    start: Point
    end: Point


@dataclass(frozen=True)
class UprightLeg:
    """One leg upright over its sole, which is at the origin; lengths in m.

    joints  the leg's line from the hip down, without the sole
    centre  of the sole's arc
    masses  what the config says of each, and where it is
    top     height of the torso's end, or of the hip
    """

    joints: tuple[Point, ...]
    centre: Point
    radius: float
    lengths: tuple[Length, ...]
    masses: tuple[tuple[tuple[str, ...], Point], ...]
    top: float


def said(key: str, value: float) -> str:
    """A key with its value, as a config has them."""
    return f"{key}: {value:g}"


def weighing(walker: Any, prefix: str) -> tuple[str, ...]:
    """The words of a body's mass, with its inertia if it has one; its keys begin with the prefix."""
    inertia = value_of(walker, f"{prefix}inertia_kg_m2", 0.0)
    mass = said(f"{prefix}mass_kg", value_of(walker, f"{prefix}mass_kg"))
    return (mass, said(f"{prefix}inertia_kg_m2", inertia)) if inertia else (mass,)


def value_of(walker: Any, key: str, *otherwise: float) -> float:
    """What a config's walker has under a dotted key; otherwise ..., if that is given."""
    *blocks, last = key.split(".")
    return float(getattr(reduce(getattr, blocks, walker), last, *otherwise))


def upright(walker: CompassWalker | StraightLegs | Kneed) -> UprightLeg:
    """What is drawn of a walker of a type."""
    radius, top, sole = walker.foot_radius_m, walker.leg_length_m, (0.0, 0.0)
    hip, centre, joints = (0.0, top), (0.0, radius), [(0.0, top)]
    lengths: list[Length] = []
    masses = [(weighing(walker, "hip_"), hip)]

    def measured(key: str, start: Point, end: Point) -> None:
        lengths.append(Length(key, value_of(walker, key), start, end))

    if walker.torso is not None:
        top += walker.torso.above_hip_m
        measured("torso.above_hip_m", (0.0, top), hip)
        masses.append((weighing(walker, "torso."), (0.0, top)))
    limbs = [("leg_", "hip", hip, sole)]
    if isinstance(walker, Kneed):
        joints.append((0.0, walker.shank.length_m))
        limbs = [("thigh.", "hip", hip, joints[1]), ("shank.", "knee", joints[1], sole)]
    for limb, joint, above, end in limbs:
        if isinstance(walker, CompassWalker):
            mass = (0.0, walker.foot_to_mass_m)
            measured("foot_to_mass_m", mass, sole)
        else:
            below, ahead = f"{limb}mass_below_{joint}_m", f"{limb}mass_ahead_m"
            mass = (value_of(walker, ahead), above[1] - value_of(walker, below))
            measured(below, above, mass)
            measured(ahead, (0.0, mass[1]), mass)
        measured(f"{limb}length_m", above, end)
        masses.append((weighing(walker, limb), mass))
    if isinstance(walker, StraightLegs):
        centre = (walker.foot_centre_ahead_m, radius)
        measured("foot_centre_ahead_m", (0.0, radius), centre)
    measured("foot_radius_m", centre, (centre[0], 0.0))
    return UprightLeg(tuple(joints), centre, radius, tuple(lengths), tuple(masses), top)


def drawn(walker: AnyWalker, name: str, kind: str = "svg") -> bytes:
    """The walker's measures as SVG, PDF or PNG; the same walker and name give the same bytes."""
    title = f"The measures of a walker of type {walker.type}"
    with styled():
        figure = of_parts(walker) if isinstance(walker, PartsWalker) else of_type(walker)
        return files_of(figure, name, title, [kind])[0]


def of_type(walker: CompassWalker | StraightLegs | Kneed) -> Figure:
    """One leg upright on the slope with its measures, the other one pale behind it."""
    leg = upright(walker)
    length, centre = leg.joints[0][1], leg.centre
    # the joints, and where the leg's line meets its sole's arc
    line = [*leg.joints, (0.0, centre[1] - math.sqrt(max(0.0, leg.radius**2 - centre[0] ** 2)))]
    figure = blank(HEIGHT)
    axes = figure.add_subplot()
    axes.set_axis_off()
    left, right = ends = (-1.15 * length, 1.35 * length)
    axes.set(aspect="equal", xlim=ends, ylim=(-0.16 * length, leg.top + 0.1 * length))
    axes.fill_between(ends, -0.02 * length, 0.0, facecolor=PALE, edgecolor=GREY, hatch="////", linewidth=0.0)
    axes.plot([left, right], [0.0, 0.0], color=BLACK, linewidth=0.8)
    y = -0.1 * length
    axes.annotate("", xy=(0.25 * length, y), xytext=(-0.25 * length, y), arrowprops={"arrowstyle": "-|>"})
    axes.text(0.28 * length, y, "walking direction", va="center", fontsize=SMALL)
    # the other leg, off the ground behind, its knee bent if it has one
    other, angles = [leg.joints[0]], (BEHIND, BENT)[: len(leg.joints)]
    for angle, above, below in zip(angles, leg.joints, line[1:], strict=True):
        other.append(turned(angle, above, below, other[-1]))
    draw_leg(axes, other, turned(angles[-1], leg.joints[-1], centre, other[-2]), leg.radius, FAINT)
    draw_leg(axes, line, centre, leg.radius, BLACK)
    axes.plot([0.0, 0.0], [length, leg.top], color=BLACK, linewidth=2.0)
    draw_lengths(axes, leg.lengths, length)
    for words, (x, height) in leg.masses:
        axes.plot(x, height, marker="o", markersize=8, color=GREEN, zorder=5)
        axes.plot([LEFT * length, x], [height, height], color=GREEN, linewidth=0.5, zorder=1)
        name(axes, LEFT * length, height, "\n".join(words) + " ", GREEN, ha="right", va="center")
    if leg.radius > SMALL_ARC * length:
        axes.plot(*centre, marker="+", markersize=8, color=BLUE, zorder=5)
    elif leg.radius:
        name(axes, LEFT * length, 0.03 * length, said("foot_radius_m", leg.radius) + " ", BLUE, ha="right")
    return figure


def name(axes: Axes, x: float, y: float, words: str, colour: str, **aligned: Any) -> None:
    """Small words at a point."""
    axes.text(x, y, words, color=colour, fontsize=SMALL, **aligned)


def draw_leg(axes: Axes, line: Sequence[Point], centre: Point, radius: float, colour: str) -> None:
    """A leg's line from the hip over its knee down to its sole, and the sole's arc."""
    axes.plot(*np.transpose(line), color=colour, linewidth=2.0, zorder=2)
    axes.plot(*np.transpose(line[:-1]), linestyle="none", marker="o", markersize=6, color=colour, mfc="white", zorder=4)
    across, up = np.subtract(line[-1], line[-2])
    around = np.arctan2(across, -up) + ARC
    axes.plot(centre[0] + radius * np.sin(around), centre[1] - radius * np.cos(around), color=colour, linewidth=2.0)


def turned(angle: float, origin: Point, point: Point, moved_to: Point) -> Point:
    """A point after a turn (rad) about an origin that has moved."""
    (across, up), s, c = np.subtract(point, origin), np.sin(angle), np.cos(angle)
    return float(moved_to[0] + c * across - s * up), float(moved_to[1] + s * across + c * up)


def draw_lengths(axes: Axes, lengths: Sequence[Length], leg_length: float) -> None:
    """Measures from a point to one below it, each in the first lane that has room; others ahead of the leg's line.

    Those too small to show are left out.
    """
    lanes: list[list[tuple[float, float]]] = []
    for measure in lengths:
        words, (_, high), (_, low) = said(measure.key, measure.value), measure.start, measure.end
        if high == low and measure.value:
            axes.annotate("", xy=measure.end, xytext=measure.start, arrowprops={"arrowstyle": "-", "color": VERMILLION})
            name(axes, -0.03 * leg_length, high + 0.025 * leg_length, words, VERMILLION, ha="right")
        if high == low or measure.value <= SMALL_ARC * leg_length:
            continue
        free = (number for number, taken in enumerate(lanes) if all(high <= b or low >= a for a, b in taken))
        number = next(free, len(lanes))
        if number == len(lanes):
            lanes.append([])
        lanes[number].append((high, low))
        x = (FIRST_LANE + number * LANE) * leg_length
        for point in (measure.start, measure.end):
            axes.plot([point[0], x], [point[1], point[1]], color=GREY, linewidth=0.5, linestyle=":", zorder=1)
        axes.annotate("", xy=(x, high), xytext=(x, low), arrowprops={"arrowstyle": "<|-|>", "color": BLUE})
        name(axes, x + 0.015 * leg_length, 0.5 * (high + low), words, BLUE, va="center")


def of_parts(walker: PartsWalker) -> Figure:
    """Every body of the second leg, and those of neither, each in its own frame."""
    shown = [body for body in walker.bodies if body.name not in walker.legs[0]]
    figure = blank(HEIGHT)
    for axes, body in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        axes.set_aspect("equal", adjustable="datalim")
        axes.set(title="\n".join([f"name: {body.name}", *weighing(body, "")]), xlabel="ahead (m)")
        axes.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
        axes.axvline(0.0, color=GREY, linewidth=0.6, zorder=0)
        marks = list(marks_of(walker, body.name, body.centre_m))
        axes.plot(*np.transpose([at for *_, at in marks]), color=BLACK, linewidth=2.0, zorder=1)
        above: dict[Point, bool] = {}  # of the last words at a point: the next ones go to its other side
        for number, (words, colour, marker, at) in enumerate(marks):
            axes.plot(*at, marker=marker, markersize=8, color=colour, linestyle="none", zorder=3)
            above[at] = not above[at] if at in above else number % 2 == 1
            aside = (12.0, 18.0 if above[at] else -14.0)
            axes.annotate(words, at, aside, textcoords="offset points", color=colour, fontsize=SMALL, va="center")
        for foot in walker.feet:
            if foot.body == body.name and foot.radius_m:
                x, y = foot.centre_m
                axes.plot(x + foot.radius_m * np.sin(ARC), y - foot.radius_m * np.cos(ARC), color=BLACK, linewidth=2.0)
        axes.margins(x=0.6, y=0.25)
    figure.axes[0].set_ylabel("up (m)")
    return figure


def marks_of(walker: PartsWalker, body: str, centre: Point) -> Iterator[tuple[str, str, str, Point]]:
    """What a config says of points of a body: words, colour, marker and place (m)."""

    def at(point: Point) -> str:
        return f"[{point[0]:g}, {point[1]:g}]"

    for hinge in walker.hinges:
        called = f"{hinge.name}{', locks' if hinge.locks else ''}\n"
        if hinge.parent == body:
            yield f"{called}parent_point_m: {at(hinge.parent_point_m)}", BLUE, "o", hinge.parent_point_m
        if hinge.child == body:
            yield f"{called}child_point_m: {at(hinge.child_point_m)}", BLUE, "o", hinge.child_point_m
    yield f"centre_m: {at(centre)}", GREEN, "o", centre
    for particle in walker.particles:
        if particle.body == body:
            words = f"particle {particle.name}\nat_m: {at(particle.at_m)}\n{said('mass_kg', particle.mass_kg)}"
            yield words, VERMILLION, "D", particle.at_m
    for foot in walker.feet:
        if foot.body == body:
            yield f"foot\ncentre_m: {at(foot.centre_m)}\n{said('radius_m', foot.radius_m)}", ORANGE, "s", foot.centre_m
