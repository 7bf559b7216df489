"""Build the player of animated walks, with the close-up of a foot and three synchronised plots, and the section of
figures."""

import math
from typing import Any

import numpy as np

from walkerlab.config.drives import push_offs
from walkerlab.labels import CONTACT_STAGE, RIGID_STAGE
from walkerlab.pipeline.store.content import ground_levels
from walkerlab.views.report.blocks import MAIN, Gallery, Pad, Paragraph, Player, Results, Section, Walker
from walkerlab.views.report.tracks import Array, Track, sampling_gap, track_in
from walkerlab.views.report.words import MODEL_NAMES, WALKED_LABEL, ends, words

MAX_SHOWN_STEPS = 10
WALKER_STYLES = {RIGID_STAGE: "rigid", CONTACT_STAGE: "contact"}
OVERLAY_STYLES = {"identified": "rigid", "measured": "contact"}
CLOSEUP_DEPTHS = 5.0
"""Height of the close-up, relative to the largest penetration outside impacts."""
STILL_VIEW_OF_RIGID = 4e-3
"""Height of the close-up (leg lengths) if feet do not sink in."""


def section(results: Results) -> Section | None:
    return Section.create("motion", "The walk", (player(results),))


def player(results: Results, most: int = MAX_SHOWN_STEPS) -> Player | None:
    """Animate the first steps of the walks of both models, or return None if no motion was stored."""
    touches = [results.summary(stage).get("touch_times_s", []) for stage in MODEL_NAMES]
    # The animation ends when the slower model has taken `most` steps.
    end = max((times[most - 1] for times in touches if len(times) >= most), default=math.inf)
    tracks = {stage: track.cut(end) for stage in MODEL_NAMES if (track := track_in(results.group(stage, "trajectory")))}
    if not tracks:
        return None
    config = results.config
    torso = config.walker.torso
    length = config.walker.leg_length_m
    steps = {MODEL_NAMES[stage].lower(): len(results.summary(stage)["step_periods_s"]) for stage in tracks}
    return Player(
        title="The walk.",
        caption=words("motion.caption", max(steps.values()), most, any(push_offs(config.push_off))),
        alt=words("motion.alt", steps, math.degrees(config.slope_rad)),
        walkers=tuple(walker(results, stage, track) for stage, track in tracks.items()),
        slope_rad=config.slope_rad,
        leg_m=length,
        foot_radii_m=config.walker.foot_radii_m,
        torso_m=0.0 if torso is None else torso.above_hip_m,
        ordinary_force=weight(tracks),
        closeup_m=closeup(tracks.get(CONTACT_STAGE), length),
        pads=pads(results),
        ground=ground(results),
        view=view(tuple(tracks.values()), config.slope_rad, margin=0.1 * length),
    )


def overlay(results: Results) -> Player | None:
    """Animate the measured walk over the identified one, or return None if no angles were measured."""
    motions = {style: results.group("identify", f"{name}_motion") for name, style in OVERLAY_STYLES.items()}
    tracks = {style: track for style, motion in motions.items() if (track := track_in(motion)) is not None}
    identified_motion = motions["rigid"]
    if identified_motion is None or not tracks:
        return None
    slope, leg, radius = (float(identified_motion.attrs[name]) for name in ("slope_rad", "leg_m", "foot_radius_m"))
    strikes = identified_motion["time"][1:][np.diff(identified_motion["step"]) > 0].round(6).tolist()
    walkers = [
        Walker(f"{name.capitalize()} walk", style, tracks[style], tuple(strikes), stills(tracks[style], strikes))
        for name, style in OVERLAY_STYLES.items()
    ]
    return Player(
        title="The measured walk over the identified one.",
        caption=words("motion.overlay", len(strikes) + 1),
        alt=words("motion.overlay_alt", math.degrees(slope)),
        walkers=tuple(walkers),
        slope_rad=slope,
        leg_m=leg,
        foot_radii_m=(radius, radius),
        closeup_m=STILL_VIEW_OF_RIGID * leg,
        view=view(tuple(tracks.values()), slope, margin=0.1 * leg),
    )


def walker(results: Results, stage: str, track: Track) -> Walker:
    summary = results.summary(stage)
    # Rounding must not drop the strike at which the track was cut.
    strikes = [time for time in summary["touch_times_s"] if time <= track.end + 1e-9]
    return Walker(
        name=MODEL_NAMES[stage],
        style=WALKER_STYLES[stage],
        track=track.thin(sampling_gap(results.config)),
        strikes=tuple(round(time, 6) for time in strikes),
        stills=stills(track, strikes),
        ends="" if summary["outcome"] == WALKED_LABEL else ends(summary["outcome"]),
        pushes=any(push_offs(results.config.push_off)),
    )


def stills(track: Track, strikes: list[float]) -> tuple[tuple[tuple[int, int], ...], ...]:
    """Return postures for stills, at heel strikes and in mid-step. Each is a line from foot to foot (mm, y down)."""
    times: Any = np.array([0.0, *strikes])
    instants = np.unique(np.concatenate((times, 0.5 * (times[:-1] + times[1:]), [track.end])))
    rows = np.clip(np.searchsorted(track["t"], instants), 0, track["t"].size - 1)
    joints = [("fx0", "fy0"), ("kx0", "ky0"), ("hx", "hy"), ("kx1", "ky1"), ("fx1", "fy1")]
    lines = [(track[along], track[height]) for along, height in joints if along in track.channels]
    return tuple(tuple((round(1000 * float(x[row])), -round(1000 * float(y[row]))) for x, y in lines) for row in rows)


def weight(tracks: dict[str, Track]) -> float:
    """Return a typical ground force (N) by which to scale arrows, or 1 if no forces were stored."""
    loads = [float(np.median(track["n0"] + track["n1"])) for track in tracks.values() if "n0" in track.channels]
    return max((load for load in loads if load > 0.0), default=1.0)


def closeup(track: Track | None, length: float) -> float:
    """Return the height of the close-up (m), a few times the penetration of a standing foot of the contact model."""
    if track is None or "p0" not in track.channels:
        return STILL_VIEW_OF_RIGID * length
    depths = np.concatenate((track["p0"], track["p1"]))
    loaded = depths[depths > 0.0]
    return CLOSEUP_DEPTHS * float(np.quantile(loaded, 0.98)) if loaded.size else STILL_VIEW_OF_RIGID * length


def pads(results: Results) -> tuple[Pad, ...]:
    """Return the pads that the contact model walks on, or () on a plane."""
    terrain = results.group(CONTACT_STAGE, "terrain")
    if terrain is None or "left_m" not in terrain.variables:
        return ()
    left, right, leg = (terrain[name].tolist() for name in ("left_m", "right_m", "leg"))
    return tuple((round(pad[0], 4), round(pad[1], 4), int(pad[2]) - 1) for pad in zip(left, right, leg, strict=True))


def ground(results: Results) -> tuple[tuple[float, float], ...]:
    """Return the start along the slope and the height of each ground level (m), or () on even ground."""
    for stage in reversed(MODEL_NAMES):
        steps = results.group(stage, "steps")
        levels = None if steps is None else ground_levels(steps)
        if levels is not None:
            begins, heights = (values.tolist() for values in levels)
            return tuple((round(x, 4), round(height, 6)) for x, height in zip(begins, heights, strict=True))
    return ()


def view(tracks: tuple[Track, ...], slope: float, margin: float) -> tuple[int, int, int, int]:
    """Return left, top, width and height (mm, y down) of the region that the walkers cross, with the slope tilted."""
    along: Array = np.concatenate([track[name] for track in tracks for name in ("fx0", "hx", "fx1")])
    above: Array = np.concatenate([track[name] for track in tracks for name in ("fy0", "hy", "fy1")])
    right = along * math.cos(slope) + above * math.sin(slope)
    down = along * math.sin(slope) - above * math.cos(slope)
    left = right.min() - margin
    top = down.min() - margin
    width, height = right.max() + margin - left, down.max() + margin - top
    return math.floor(1000 * left), math.floor(1000 * top), math.ceil(1000 * width), math.ceil(1000 * height)


def figures(results: Results) -> Section | None:
    main_pictures = tuple(picture for picture in results.pictures if picture.page == MAIN)
    numbered = (Paragraph(words("figures.numbered")),) if results.claims else ()
    return Section("figures", "Figures", (*numbered, Gallery(main_pictures))) if main_pictures else None
