"""The walk as stick figures, of all models that walked, in one picture."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walkerlab.config.schema import Config
from walkerlab.report.blocks import Player, Section, Walker
from walkerlab.report.outcomes import CONTACT, MODELS, RIGID
from walkerlab.report.results import Results
from walkerlab.store.content import Content, Group

FRAMES_A_SECOND = 40
MOST_FRAMES = 400
MOST_STEPS = 10

Array = NDArray[np.float64]


def section(results: Results) -> Section | None:
    """The player; None if no motion was stored."""
    tracks = {stage: track for stage in (RIGID, CONTACT) if (track := track_of(results, stage)) is not None}
    if not tracks:
        return None
    end = min(max(track[0][-1] for track in tracks.values()), first_steps(results))
    frames = min(MOST_FRAMES, max(2, math.ceil(end * frame_rate(results.config)) + 1))
    instants = np.linspace(0.0, end, frames)
    walkers = tuple(walker(results, stage, track, instants) for stage, track in tracks.items())
    player = Player(
        title="The walk.",
        caption=caption(results, tuple(tracks)),
        walkers=walkers,
        instants=tuple(round(float(instant), 3) for instant in instants),
        slope_deg=round(math.degrees(results.config.slope_rad), 3),
        view=view(walkers, results.config.slope_rad, margin=round(100 * results.config.walker.leg_length_m)),
    )
    return Section("motion", "The walk", (player,))


def frame_rate(config: Config) -> float:
    """Frames a second: as many a pendulum time for every size of walker."""
    return FRAMES_A_SECOND * math.sqrt(config.gravity_m_s2 / 9.81 / config.walker.leg_length_m)


def first_steps(results: Results) -> float:
    """When the first steps are over (s), of the model that takes longest; they are what is shown."""
    ends = []
    for stage in (RIGID, CONTACT):
        summary = results.summary(stage)
        periods = [] if summary is None else summary["step_periods_s"]
        if len(periods) >= MOST_STEPS:
            ends.append(sum(periods[:MOST_STEPS]))
    return max(ends) if ends else math.inf


def track_of(results: Results, stage: str) -> tuple[Array, Array] | None:
    """Times (s) and, for each, foot of leg 0, hip and foot of leg 1 along and above the slope (m); None if unknown."""
    result = results.stored.get(stage)
    trajectory = results.group(stage, "trajectory")
    if result is None or trajectory is None or "angle" not in trajectory.variables or trajectory["time"].size < 2:
        return None
    if "hip_along_m" in trajectory.variables:
        points = seen_points(trajectory)
    else:
        points = points_from_angles(results.config, result, trajectory)
    return trajectory["time"], points


def seen_points(trajectory: Group) -> Array:
    """Hip and feet as they were stored."""
    feet, heights = trajectory["foot_along_m"], trajectory["foot_height_m"]
    hip = (trajectory["hip_along_m"], trajectory["hip_height_m"])
    return np.column_stack((feet[:, 0], heights[:, 0], *hip, feet[:, 1], heights[:, 1]))


def points_from_angles(config: Config, result: Content, trajectory: Group) -> Array:
    """Hip and feet of legs that stand on points, from their angles and the steps' lengths (eqs. A.1 to A.3)."""
    length, slope = config.walker.leg_length_m, config.slope_rad
    steps: Any = np.concatenate(([0.0], np.cumsum(result.summary["step_lengths_m"])))
    tilted = trajectory["angle"] + slope
    row = np.arange(tilted.shape[0])
    stance = tilted[row, trajectory["stance_leg"]]
    foothold = steps[np.minimum(trajectory["step"], steps.size - 1)]
    hip = (foothold - length * np.sin(stance), length * np.cos(stance))
    feet = [(hip[0] + length * np.sin(tilted[:, leg]), hip[1] - length * np.cos(tilted[:, leg])) for leg in (0, 1)]
    return np.column_stack((*feet[0], *hip, *feet[1]))


def walker(results: Results, stage: str, track: tuple[Array, Array], instants: Array) -> Walker:
    """A model's motion at the instants of the player, up to where it ended."""
    times, points = track
    walked = instants[instants <= times[-1] + 1e-9]
    columns = [np.interp(walked, times, column) for column in points.T]
    frames = tuple(tuple(round(1000 * value) for value in frame) for frame in np.column_stack(columns).tolist())
    summary = results.stored[stage].summary
    stills = still_frames(summary["step_periods_s"], walked)
    ended = "" if summary["outcome"] == "walked" else f"ends as {summary['outcome']}"
    return Walker(MODELS[stage], "rigid" if stage == RIGID else "contact", frames, stills, ended)


def view(walkers: tuple[Walker, ...], slope: float, margin: int) -> tuple[int, int, int, int]:
    """Left, top, width and height (mm, y downwards) of what the walkers pass through on the tilted slope."""
    points = np.array([frame for one in walkers for frame in one.frames], dtype=np.float64).reshape(-1, 2)
    along, above = points.T
    right = along * math.cos(slope) + above * math.sin(slope)
    down = along * math.sin(slope) - above * math.cos(slope)
    left, top = math.floor(right.min()) - margin, math.floor(down.min()) - margin
    return left, top, math.ceil(right.max()) + margin - left, math.ceil(down.max()) + margin - top


def still_frames(periods: list[float], instants: Array) -> tuple[int, ...]:
    """The frames that are shown at once: both feet down, and the middle of each step; the end in any case."""
    strikes = np.concatenate(([0.0], np.cumsum(periods)))
    middles = 0.5 * (strikes[:-1] + strikes[1:])
    wanted = np.append(np.concatenate((strikes, middles)), instants[-1])
    nearest = {int(np.abs(instants - time).argmin()) for time in wanted if time <= instants[-1] + 1e-9}
    return tuple(sorted(nearest))


def caption(results: Results, stages: tuple[str, ...]) -> str:
    """What one looks at."""
    steps = max(len(results.stored[stage].summary["step_periods_s"]) for stage in stages)
    shown = f"The first {MOST_STEPS} steps" if steps > MOST_STEPS else "All of the walk"
    return (
        f"{shown}, to scale, at the start, in the middle and at the end of each step; the walker goes downhill, "
        "to the right. The leg that swings first is drawn solid in the moving picture, the other dashed."
    )
