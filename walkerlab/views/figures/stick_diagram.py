"""Walkers drawn to scale on their slope: stick diagrams of one gait cycle (figures 2 and 6), and animations."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from walkerlab.labels import CONTACT_STAGE, RIGID_STAGE
from walkerlab.outcome import outcome_of
from walkerlab.pipeline.store.artifact import Identified
from walkerlab.pipeline.store.content import FAR_EDGE_M, Group, ground_levels
from walkerlab.views.figures import illustration, walks
from walkerlab.views.figures.canvas import add_legend, blank, entry, figure_style
from walkerlab.views.figures.style import BLACK, GREY, LEGS, PURPLE, VERMILLION

CYCLE = 2
"""Steps per gait cycle."""
POSTURES_BETWEEN = 5
"""Number of postures drawn between two heel strikes."""
FAINT_WIDTH = 0.8
"""Line width (pt) of legs between heel strikes."""
BOLD_WIDTH = 2.2
"""Line width (pt) of legs at heel strikes."""
HEADROOM = 0.19
"""Free space above the walker (leg lengths)."""
FOOTROOM = 0.13
"""Free space below the walker (leg lengths)."""
SIDEROOM = 0.12
"""Free space on either side of the walker (leg lengths)."""
ARC = np.linspace(-0.6, 0.6, 25)
ARC_MIDDLE = np.zeros(1)
"""Angles (rad) of points on a sole, measured from the leg's line: all points drawn (`ARC`), and the middle one."""
SMALL_FOOT = 0.01
"""Foot radius (leg lengths) below which a sole is drawn as a point."""
AXES: Final[dict[str, Any]] = {"aspect": "equal", "xlabel": "horizontal position (m)", "ylabel": "height (m)"}
ROOM_BELOW = 0.36
"""Space (inches) for landing times below the lowest foot."""
SIDE_INCHES = 0.7
"""Space (inches) for axis labels at the side."""
ROOM_ABOVE = 1.05
"""Space (inches) for the legend."""
MAX_ASPECT = 0.68
"""Maximum height of the axes relative to their width."""


@dataclass(frozen=True, eq=False)
class Sticks:
    """Joint positions of a walker in m, along the slope (positive downhill) and normal to it."""

    time: walks.Array  # (samples,) s
    hip: walks.Array  # (samples, 2)
    feet: walks.Array  # (samples, leg, 2)
    strikes: walks.Array  # (steps,) times of the heel strikes, s
    landings: walks.Array  # (1 + steps, 2) positions of the first stance foot and of each landing
    slope: float  # rad
    knees: walks.Array | None = None  # (samples, leg, 2); None for straight legs
    radii: tuple[float, float] = (0.0, 0.0)  # radius of each sole's arc, m; `feet` has the lowest points of the soles
    head: walks.Array | None = None  # (samples, 2) centre of mass of the torso; None if there is no torso
    ground: walks.Array | None = None  # (points, 2) outline of the ground; None on even ground
    pushes: bool = False  # whether the trailing foot pushes off when the other one lands
    ending: str = ""  # outcome of the walk if it failed, such as fell; otherwise empty

    def pushing(self, time: float) -> int | None:
        """Return the leg whose push-off is shown at a time (s), or None if no push-off is shown."""
        step = int(np.searchsorted(self.strikes, time, side="right")) - 1
        late = step < 0 or time - self.strikes[step] > PUSH_SHOWN_S
        return None if late or not self.pushes else 1 - step % 2

    @property
    def top(self) -> walks.Array:
        """Highest point that is drawn (samples, 2): the torso's centre of mass or, without a torso, the hip."""
        return self.hip if self.head is None else self.head

    @property
    def leg_length(self) -> float:
        """Maximum distance between a foot and the hip (m)."""
        return float(np.linalg.norm(self.feet - self.hip[:, None], axis=2).max())

    @property
    def has_soles(self) -> bool:
        return max(self.radii) > SMALL_FOOT * self.leg_length

    def leg(self, leg: int) -> walks.Array:
        """Return a leg's line (samples, points, 2) from the hip, through the knee if there is one, to the
        middle of the sole."""
        joints = [self.hip] if self.knees is None else [self.hip, self.knees[:, leg]]
        return np.stack([*joints, self.arc(leg, joints[-1], ARC_MIDDLE)[:, 0]], axis=1)

    def sole(self, leg: int) -> walks.Array:
        """Return the arc of a leg's sole (samples, points, 2)."""
        return self.arc(leg, self.hip if self.knees is None else self.knees[:, leg], ARC)

    def arc(self, leg: int, above: walks.Array, angles: walks.Array) -> walks.Array:
        """Return points of a sole's arc (samples, angles, 2), at angles (rad) from the line through its centre.

        The line starts at the joint `above` (samples, 2), which is the knee or the hip.
        """
        centre = self.feet[:, leg] + np.array([0.0, self.radii[leg]])
        down = (centre - above) / np.linalg.norm(centre - above, axis=1, keepdims=True)
        ahead = np.stack((-down[:, 1], down[:, 0]), axis=1)
        around = np.cos(angles)[:, None] * down[:, None] + np.sin(angles)[:, None] * ahead[:, None]
        return np.asarray(centre[:, None] + self.radii[leg] * around)

    def project(self, points: walks.Array) -> walks.Array:
        """Convert points in the slope's frame (..., 2) to horizontal and vertical position (m)."""
        s, c = math.sin(self.slope), math.cos(self.slope)
        along = points[..., 0]
        normal = points[..., 1]
        return np.stack((c * along + s * normal, c * normal - s * along), axis=-1)

    def postures(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return indices of samples in the first cycle: those at its start and at heel strikes, and some in between."""
        strikes = np.concatenate(([self.time[0]], self.strikes[:CYCLE]))
        between = [np.linspace(a, b, POSTURES_BETWEEN + 2)[1:-1] for a, b in pairwise(strikes)]
        # A walk that ends within its first cycle is drawn up to its end.
        if strikes.size <= CYCLE:
            between.append(np.linspace(strikes[-1], self.time[-1], POSTURES_BETWEEN + 2)[1:])
        at_strikes = np.abs(self.time[:, None] - strikes).argmin(axis=0)
        return at_strikes, np.abs(self.time[:, None] - np.concatenate(between)).argmin(axis=0)


def read_sticks(result: Identified, under: str = "") -> Sticks:
    """Read the joint positions of a stored walk, whose groups have the prefix `under`."""
    config = result.identity.config_slice
    trajectory = result[f"{under}trajectory"]
    walker = config["walker"]
    steps = result.groups.get(f"{under}steps", Group({}))
    strikes = walks.touch_times(steps)

    def joints(name: str) -> walks.Array:
        return np.stack((trajectory[f"{name}_along_m"], trajectory[f"{name}_height_m"]), axis=-1)

    slope = float(config["slope_rad"])
    hip = joints("hip")
    head = None
    if "torso_angle" in trajectory.variables:
        tilted = trajectory["torso_angle"] + slope
        head = hip + walker["torso"]["above_hip_m"] * np.stack((-np.sin(tilted), np.cos(tilted)), axis=-1)
    knees = joints("knee") if "knee_along_m" in trajectory.variables else None
    radii = sole_radii(walker)
    if result.identity.stage != CONTACT_STAGE and walker["type"] == "compass":
        radii = 0.0, 0.0  # a compass has point feet in the rigid model, whatever its feet are in the contact model
    levels = ground_levels(steps)
    pushes = config["push_off"]["impulse_N_s"] != 0.0
    outcome = None if under else outcome_of(str(result.summary.get("outcome")))
    ending = outcome.label if outcome is not None and outcome.stumbled else ""
    landings = np.append(0.0, steps["touch_along_m"] if strikes.size else strikes)
    heights = np.zeros(landings.size)
    outline = None
    if levels is not None:
        begins, heights = levels
        outline = np.column_stack((np.append(begins, begins[-1] + FAR_EDGE_M).repeat(2)[1:-1], heights.repeat(2)))
    landings = np.column_stack((landings, heights))
    return Sticks(
        trajectory["time"], hip, joints("foot"), strikes, landings, slope, knees, radii, head, outline, pushes, ending
    )  # fmt: skip


def sole_radii(walker: Mapping[str, Any]) -> tuple[float, float]:
    """Return the radius (m) of each foot of a stored walker."""
    if "feet" in walker:
        first, second = (float(foot["radius_m"]) for foot in walker["feet"])
        return first, second
    radius = float(walker["foot_radius_m"])
    other = (walker.get("leg_2") or {}).get("foot_radius_m")
    return radius, radius if other is None else float(other)


def stick_diagram(sticks: Sticks) -> tuple[Figure, Axes]:
    """Draw the first gait cycle to scale, without the ground."""
    at_strikes, between = sticks.postures()
    rows = np.concatenate((at_strikes, between))
    seen = np.concatenate((sticks.hip[rows, None], sticks.top[rows, None], sticks.feet[rows]), axis=1)
    left, bottom, right, top = frame_view(sticks.project(seen).reshape(-1, 2), sticks.leg_length)
    widen = max(0.0, 0.5 * ((top - bottom) / MAX_ASPECT - (right - left)))
    left, right = left - widen, right + widen
    figure = blank(0.0)
    across = figure.get_figwidth() - SIDE_INCHES
    bottom = min(bottom, sticks.project(seen)[..., 1].min() - ROOM_BELOW * (right - left) / across)
    figure.set_figheight(ROOM_ABOVE + across * (top - bottom) / (right - left))
    axes = figure.add_subplot()
    axes.set(xlim=(left, right), ylim=(bottom, top), **AXES)
    draw_postures(axes, sticks, between, FAINT_WIDTH)
    draw_postures(axes, sticks, at_strikes, BOLD_WIDTH)
    shown = slice(0, int(rows.max()) + 1)
    axes.plot(*sticks.project(sticks.hip[shown]).T, color=BLACK, linewidth=0.7, linestyle=":", zorder=2)
    annotate(axes, sticks, sticks.top[shown])
    return figure, axes


def frame_view(points: walks.Array, length: float) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top (m) of a view around points (points, 2), with margins relative to `length`."""
    left, bottom = points.min(axis=0) - np.array([SIDEROOM, FOOTROOM]) * length
    right, top = points.max(axis=0) + np.array([SIDEROOM, HEADROOM]) * length
    return left, bottom, right, top


def draw_postures(axes: Axes, sticks: Sticks, rows: NDArray[np.int64], width: float) -> None:
    """Draw legs, soles and torso at the given samples. The legs differ in colour, line style and foot marker."""
    hip = sticks.project(sticks.hip[rows])
    for leg, look in enumerate(LEGS):
        lines = sticks.project(sticks.leg(leg)[rows])
        dots: dict[str, Any] = {"marker": look.marker, "markevery": [*range(1, lines.shape[1])]}
        style: dict[str, Any] = {**look.line, "linewidth": width, "zorder": look.order + width}
        axes.plot(*lines.T, **style, **dots, markersize=2.0 + width)
        if sticks.has_soles:
            axes.plot(*sticks.project(sticks.sole(leg)[rows]).T, **{**style, "linestyle": "-"})
    if sticks.head is not None:
        torso = np.stack((hip, sticks.project(sticks.head[rows])), axis=1)
        axes.plot(*torso.T, color=BLACK, linewidth=width, zorder=7)
    axes.plot(*hip.T, linestyle="none", marker="o", markersize=3.0 + width, color=BLACK, zorder=8)


def annotate(axes: Axes, sticks: Sticks, path: walks.Array) -> None:
    """Label the landings with their times. Above `path` (samples, 2), draw an arrow in the walking direction, labelled
    with the slope.
    """
    length = sticks.leg_length
    times = np.concatenate(([0.0], sticks.strikes[:CYCLE]))
    for landing, time in zip(sticks.landings[: CYCLE + 1], times, strict=True):
        x, y = sticks.project(landing - np.array([0.0, 0.03 * length]))
        arrow = {"arrowstyle": "-|>", "color": GREY, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate(
            f"{time:.3g} s" if time else "start", (x, y), xytext=(0.0, -9.0), textcoords="offset points",
            arrowprops=arrow, ha="center", va="top", fontsize=matplotlib.rcParams["xtick.labelsize"],
        )  # fmt: skip
    height = path[:, 1].max() + 0.09 * length
    middle = 0.5 * (path[0, 0] + path[-1, 0])
    half = 0.22 * length
    tail, head = sticks.project(np.array([[middle - half, height], [middle + half, height]]))
    axes.annotate("", xy=tuple(head), xytext=tuple(tail), arrowprops={"arrowstyle": "-|>", "color": BLACK})
    slope = f"walking direction, slope {sticks.slope:.4g} rad = {math.degrees(sticks.slope):.3g}°"
    axes.annotate(slope, tuple(0.5 * (head + tail)), xytext=(0.0, 7.0), textcoords="offset points", ha="center")


def draw_slope(axes: Axes, sticks: Sticks) -> None:
    """Draw the ground, hatched below: a plane or, if it is uneven, a level around each foothold."""
    left, right = axes.get_xlim()
    depth = 0.02 * sticks.leg_length
    ends = np.array([left, right])
    top = -math.tan(sticks.slope) * ends
    if sticks.ground is not None:
        ends, top = sticks.project(sticks.ground).T
    axes.plot(ends, top, color=BLACK, linewidth=0.9, zorder=2.5)
    axes.fill_between(ends, top - depth, top, facecolor="white", edgecolor=GREY, hatch="////", linewidth=0.0, zorder=1)


def entries(sticks: Sticks) -> list[Artist]:
    """Return the legend entries for the legs, the hip and, if there is one, the torso."""
    legs = [entry(look.label, **look.line | {"linewidth": 1.6}, marker=look.marker) for look in LEGS]
    strike = entry("at heel strike", color=GREY, linewidth=BOLD_WIDTH)
    between = entry("between", color=GREY, linewidth=FAINT_WIDTH)
    hip = entry("hip", color=BLACK, linewidth=0.7, linestyle=":", marker="o", markersize=4.0)
    torso = [] if sticks.head is None else [entry("torso", color=BLACK, linewidth=1.6)]
    return [*legs, strike, between, hip, *torso]


PAD_HEIGHT = 0.028
"""Thickness of a drawn pad (leg lengths). In the model, pads have no thickness."""
PADS: Final[tuple[dict[str, Any], ...]] = tuple(
    {"facecolor": "white", "edgecolor": look.colour, "hatch": hatch, "linewidth": 0.7}
    for look, hatch in zip(LEGS, ("////", "||||"), strict=True)
)
"""Style of the pads in each leg's lane."""


def draw_pads(axes: Axes, sticks: Sticks, pads: Group) -> list[Artist]:
    """Draw the visible pads of both lanes, and return their legend entries."""
    bottom = -PAD_HEIGHT * sticks.leg_length
    left, right = axes.get_xlim()
    for begin, end, leg in zip(pads["left_m"], pads["right_m"], pads["leg"], strict=True):
        outline = sticks.project(np.array([[begin, 0.0], [end, 0.0], [end, bottom], [begin, bottom]]))
        if outline[:, 0].max() > left and outline[:, 0].min() < right:
            axes.add_patch(Polygon(outline, closed=True, zorder=1.5, **PADS[int(leg) - 1]))
    return [Patch(label=f"pad of leg {leg + 1}", **look) for leg, look in enumerate(PADS)]


def draw_ground(axes: Axes, sticks: Sticks, pads: Group | None) -> list[Artist]:
    """Draw the pads or, without pads, the ground, and return the legend entries."""
    if pads is not None:
        return draw_pads(axes, sticks, pads)
    draw_slope(axes, sticks)
    return []


def draw_cycle(stage: str, results: illustration.Results) -> illustration.Drawn:
    """Draw one gait cycle of a stage's walk on its pads or plane (figures 2 and 6)."""
    result = results[stage]
    sticks = read_sticks(result)
    pads = result.groups.get("terrain")
    figure, axes = stick_diagram(sticks)
    add_legend(figure, [*entries(sticks), *draw_ground(axes, sticks, pads)])
    strikes = sticks.strikes[:CYCLE]
    steps = zip(np.diff(strikes, prepend=0.0), np.diff(sticks.landings[: CYCLE + 1, 0]), strict=True)
    caption_values = list(steps), strikes.size == CYCLE, sticks.head is not None
    if stage == RIGID_STAGE:
        return figure, caption_values
    pitch = None if pads is None else result.summary["pitch_m"]
    return figure, (*caption_values, max(sticks.radii), result.identity.config_slice["contact"]["terrain"], pitch)


FILM_NEEDS = {
    stage: illustration.Need(stage, walks.TRAJECTORY, (*walks.STATE_VARIABLES, *walks.JOINTS), walks.NO_STATES)
    for stage in (RIGID_STAGE, CONTACT_STAGE)
}
"""Variables that an animation needs. None belongs to the group `steps`, because a walk can end in its first step."""
FIGURES = tuple(
    illustration.paper_figure(number, (FILM_NEEDS[stage], walks.STEPS_TAKEN[stage]), partial(draw_cycle, stage))
    for number, stage in ((2, RIGID_STAGE), (6, CONTACT_STAGE))
)

PUSH_SHOWN_S = 0.08
"""Time for which an animation shows a push-off (s)."""
PUSH_SHARE = 0.3
"""Length of the mark of a push-off relative to the leg."""
FILM_SIZE = (6.4, 3.6)
"""Size of a frame (inches). Video formats require an even number of pixels along both sides."""
FILM_DPI = 100
"""Resolution of a frame, pixels per inch."""
STEPS_SHOWN = 4
RELIEF_HEIGHT = 0.04
"""Maximum height of the magnified ground profile (leg lengths)."""
RELIEF_DEPTH = 0.075
"""Distance of the magnified ground profile below the ground (leg lengths)."""


def film_times(sticks: Sticks, steps: int | None, rate: int, slower: float) -> walks.Array:
    """Return the times (s) of an animation's frames. The last frame of a fall lasts a second, so that it can be seen.

    steps   number of steps shown, from the first; None shows the first four or, if the walker falls, the last four and
            the fall
    rate    frames per second
    slower  slow-motion factor
    """
    begin = 0
    shown = STEPS_SHOWN if steps is None else steps
    if steps is None and sticks.ending:
        begin = max(0, sticks.strikes.size - STEPS_SHOWN)
        shown = sticks.strikes.size + 1
    strikes = np.append(0.0, sticks.strikes)
    to_its_end = shown >= strikes.size
    end = float(sticks.time[-1] if to_its_end else strikes[shown])
    times = np.arange(strikes[begin], end, 1.0 / (rate * slower))
    return np.append(times, np.full(rate, end)) if sticks.ending and to_its_end else times


def draw_relief(axes: Axes, sticks: Sticks) -> None:
    """Draw the profile of the ground again, below the ground and magnified until it can be seen, and print the
    factor."""
    if sticks.ground is None or not (roughest := float(np.abs(sticks.ground[:, 1]).max())):
        return
    room = RELIEF_HEIGHT * sticks.leg_length / roughest
    ten = 10.0 ** math.floor(math.log10(room))
    times = ten * next(digit for digit in (5.0, 2.0, 1.0) if digit * ten <= room)
    if times <= 1.0:
        return
    relief = sticks.ground * [1.0, times] - [0.0, RELIEF_DEPTH * sticks.leg_length]
    axes.plot(*sticks.project(relief).T, color=VERMILLION, linewidth=0.9)
    corner: dict[str, Any] = {"transform": axes.transAxes, "va": "top", "ha": "right"}
    axes.text(0.99, 0.97, f"below: ground heights × {times:g}", color=VERMILLION, **corner)


def moving_lines(sticks: Sticks, at: walks.Array) -> list[walks.Array]:
    """Return lines (times, points, 2) in the picture's plane: both legs, then their soles and the torso, if any."""
    lines = [sticks.leg(leg) for leg in range(2)]
    if sticks.has_soles:
        lines += [sticks.sole(leg) for leg in range(2)]
    if sticks.head is not None:
        lines.append(np.stack((sticks.hip, sticks.head), axis=1))
    # Linear interpolation suffices, because both sides of a heel strike are samples, so that no interval contains a
    # jump.
    flat = [line.reshape(line.shape[0], -1) for line in lines]
    places = [np.stack([np.interp(at, sticks.time, column) for column in line.T], axis=1) for line in flat]
    return [sticks.project(place.reshape(at.size, -1, 2)) for place in places]


def pictures(
    sticks: Sticks, at: walks.Array, pads: Group | None = None, other: Sticks | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Yield an RGB frame (height, width, 3) for each time `at` (s).

    other  walk of the rigid model, drawn in grey behind that of the contact model
    """
    lines = moving_lines(sticks, at)
    looks: list[dict[str, Any]] = [{"color": look.colour, "linestyle": look.style} for look in LEGS]
    looks = [*looks, *({"color": look.colour} for look in LEGS if sticks.has_soles), {"color": BLACK}][: len(lines)]
    behind = [] if other is None else moving_lines(other, at)
    shown = np.concatenate([line.reshape(-1, 2) for line in (*lines, *behind)])
    with figure_style():
        figure = Figure(figsize=FILM_SIZE, dpi=FILM_DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        left, bottom, right, top = frame_view(shown, sticks.leg_length)
        axes.set(xlim=(left, right), ylim=(bottom, top), **AXES)
        draw_ground(axes, sticks, pads)
        draw_relief(axes, sticks)
        grey = [axes.plot([], [], color=GREY, alpha=0.6, linewidth=4.5)[0] for _ in behind]
        parts = [axes.plot([], [], **look, linewidth=2.2)[0] for look in looks]
        (hip,) = axes.plot([], [], linestyle="none", marker="o", markersize=6.0, color=BLACK)
        (push,) = axes.plot([], [], color=PURPLE, linewidth=5.0, solid_capstyle="round", zorder=9)
        clock = axes.text(0.01, 0.97, "", transform=axes.transAxes, va="top")
        if other is not None:
            names = "contact model in colour, rigid model in grey"
            axes.text(0.99, 0.97, names, transform=axes.transAxes, va="top", ha="right")
        for index, time in enumerate(at):
            for line, places in zip((*grey, *parts), (*behind, *lines), strict=True):
                line.set_data(*places[index].T)
            hip.set_data(*lines[0][index, :1].T)
            leg = sticks.pushing(float(time))
            leg_line = lines[leg or 0][index]
            mark = np.stack((leg_line[-1], leg_line[-1] + PUSH_SHARE * (leg_line[0] - leg_line[-1])))
            push.set_data(*(([], []) if leg is None else mark.T))
            over = sticks.ending and time >= sticks.time[-1]
            clock.set_text(f"{time:.2f} s: {sticks.ending}" if over else f"{time:.2f} s")
            canvas.draw()  # type: ignore[no-untyped-call]
            yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()  # type: ignore[no-untyped-call]
