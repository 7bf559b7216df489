"""What is seen: the walk, moving, with a foot in close-up and three views on one clock; and the figures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from walkerlab.report.blocks import MAIN, Gallery, Pad, PageBlock, Paragraph, Player, Section, Walker
from walkerlab.report.outcomes import CONTACT, MODELS, RIGID, WALKED, ends
from walkerlab.report.results import Results
from walkerlab.report.tracks import Array, Track, sampling_gap, track_of
from walkerlab.report.words import words

MAX_STEPS = 10
STYLES = {RIGID: "rigid", CONTACT: "contact"}
DEEPEST_IN_VIEW = 5.0
"""Height of the close-up in largest penetrations that are not an impact's."""
STILL_VIEW_OF_RIGID = 4e-3
"""Height of the close-up of a foot that does not sink in, leg lengths."""


def section(results: Results) -> Section | None:
    """The player; None if no motion was stored."""
    found = {stage: track_of(results.stored[stage]) for stage in MODELS if stage in results.stored}
    end = first_steps(results)
    tracks = {stage: track.until(end) for stage, track in found.items() if track is not None}
    return Section("motion", "The walk", (player(results, tracks),)) if tracks else None


def player(results: Results, tracks: dict[str, Track]) -> PageBlock:
    """The walkers on their ground."""
    config, gap = results.config, sampling_gap(results.config)
    length = config.walker.leg_length_m
    torso = config.walker.torso
    steps = {MODELS[stage].lower(): len(results.stored[stage].summary["step_periods_s"]) for stage in tracks}
    return Player(
        title="The walk.",
        caption=words("motion.caption", max(steps.values()), MAX_STEPS),
        alt=words("motion.alt", steps, math.degrees(config.slope_rad)),
        walkers=tuple(walker(results, stage, track, gap) for stage, track in tracks.items()),
        slope_rad=config.slope_rad,
        leg_m=length,
        foot_radius_m=config.walker.foot_radius_m,
        torso_m=0.0 if torso is None else torso.above_hip_m,
        ordinary_force=weight(tracks),
        closeup_m=closeup(tracks, length),
        pads=pads(results),
        view=view(tuple(tracks.values()), config.slope_rad, margin=0.1 * length),
    )


def first_steps(results: Results) -> float:
    """When the first steps are over (s), of the model that takes longest; they are what is shown."""
    touches = [results.summary(stage).get("touch_times_s", []) for stage in MODELS]
    return max((times[MAX_STEPS - 1] for times in touches if len(times) >= MAX_STEPS), default=math.inf)


def walker(results: Results, stage: str, track: Track, gap: float) -> Walker:
    """A model's motion and how it ended."""
    summary = results.stored[stage].summary
    strikes = [time for time in summary["touch_times_s"] if time <= track.end + 1e-9]
    ended = "" if summary["outcome"] == WALKED else ends(summary["outcome"])
    return Walker(
        name=MODELS[stage],
        style=STYLES[stage],
        track=track.thinned(gap),
        strikes=tuple(round(time, 6) for time in strikes),
        stills=stills(track, strikes),
        ends=ended,
    )


def stills(track: Track, strikes: list[float]) -> tuple[tuple[tuple[int, int], ...], ...]:
    """Postures to be seen at once, each a line from foot over hip to foot (mm): both feet down, and mid-step."""
    times: Any = np.array([0.0, *strikes])
    wanted = np.unique(np.concatenate((times, 0.5 * (times[:-1] + times[1:]), [track.end])))
    rows = np.clip(np.searchsorted(track["t"], wanted), 0, track["t"].size - 1)
    names = ["f0", "k0", "h", "k1", "f1"] if "kx0" in track.channels else ["f0", "h", "f1"]
    return tuple(tuple(point(track, name, int(row)) for name in names) for row in rows)


def point(track: Track, name: str, row: int) -> tuple[int, int]:
    """A joint in mm, y downwards."""
    joint, leg = name[0], name[1:]
    return round(1000 * float(track[f"{joint}x{leg}"][row])), -round(1000 * float(track[f"{joint}y{leg}"][row]))


def weight(tracks: dict[str, Track]) -> float:
    """A force to scale arrows by (N): what the ground carries most of the time; any number if forces are unknown."""
    loads = [float(np.median(track["n0"] + track["n1"])) for track in tracks.values() if "n0" in track.channels]
    return max((load for load in loads if load > 0.0), default=1.0)


def closeup(tracks: dict[str, Track], length: float) -> float:
    """Height of the close-up (m): some penetrations of a foot that stands."""
    track = tracks.get(CONTACT)
    if track is None or "p0" not in track.channels:
        return STILL_VIEW_OF_RIGID * length
    depths = np.concatenate((track["p0"], track["p1"]))
    loaded = depths[depths > 0.0]
    return DEEPEST_IN_VIEW * float(np.quantile(loaded, 0.98)) if loaded.size else STILL_VIEW_OF_RIGID * length


def pads(results: Results) -> tuple[Pad, ...]:
    """The pads that the contact model walks on; none on a plane."""
    terrain = results.group(CONTACT, "terrain")
    if terrain is None or "left_m" not in terrain.variables:
        return ()
    columns = (terrain["left_m"].tolist(), terrain["right_m"].tolist(), terrain["leg"].tolist())
    return tuple((round(left, 4), round(right, 4), int(leg)) for left, right, leg in zip(*columns, strict=True))


def view(tracks: tuple[Track, ...], slope: float, margin: float) -> tuple[int, int, int, int]:
    """Left, top, width and height (mm, y downwards) of what the walkers pass through on the tilted slope."""
    along: Array = np.concatenate([track[name] for track in tracks for name in ("fx0", "hx", "fx1")])
    above: Array = np.concatenate([track[name] for track in tracks for name in ("fy0", "hy", "fy1")])
    right = along * math.cos(slope) + above * math.sin(slope)
    down = along * math.sin(slope) - above * math.cos(slope)
    left, top = right.min() - margin, down.min() - margin
    width, height = right.max() + margin - left, down.max() + margin - top
    return math.floor(1000 * left), math.floor(1000 * top), math.ceil(1000 * width), math.ceil(1000 * height)


def figures(results: Results) -> Section | None:
    """The figures of the walks and gaits."""
    shown = tuple(picture for picture in results.pictures if picture.page == MAIN)
    if not shown:
        return None
    blocks: list[PageBlock] = [Gallery(shown)]
    if results.of_the_paper:
        blocks.insert(0, Paragraph(words("figures.numbered")))
    return Section("figures", "Figures", tuple(blocks))
