"""Write the gallery of the documentation: a report of each built-in walker, and a sweep whose gaits are animated.

    python scripts/make_gallery.py SITE/gallery [--runs RUNS] [--only sweep]

Results are kept in the folder of runs and reused.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

import walkerlab
from walkerlab.views.report.blocks import Player, Walker
from walkerlab.views.report.page import environment, source
from walkerlab.views.report.sections.motion import STILL_VIEW_OF_RIGID, stills, view, weight
from walkerlab.views.report.tracks import Track, track_in

TEMPLATE = Path(__file__).with_name("gallery.html.j2")
WALKERS = ("paper", "simplest", "round-feet", "kneed", "kneed-round-feet", "torso")
SLOPES, HIPS = "0.5:8:16", "5:30:6"
SAMPLES_A_SECOND = 50.0


def gait_of(point: Any, slope_deg: float, hip_kg: float) -> dict[str, Any]:
    """Return what the page shows for one point of the sweep: a sentence about the gait, and one stride of it."""
    if str(point.status.item()) != "answered":
        return {"text": str(point.reason.item())}
    stable = "stable" if float(point.spectral_radius) < 1.0 else "unstable"
    text = (
        f"Steps of {float(point.step_length_m):.4f} m in {float(point.period_s):.4f} s; the largest multiplier is "
        f"{float(point.spectral_radius):.3f}, so the gait is {stable}."
    )
    start = [float(value) for value in point.state]
    walk = walkerlab.simulate(walkerlab.compass(hip_mass_kg=hip_kg), slope_deg, strides=1, start=start)
    track = track_in(walk.content["trajectory"])
    if track is None:
        return {"text": text}
    shown = walker(f"Gait at {slope_deg:g} deg with a hip of {hip_kg:g} kg", track, walk.summary["touch_times_s"])
    return {
        "text": text,
        "slope_rad": walk.summary["slope_rad"],
        "meta": shown.meta,
        "floats": shown.track.pack(),
        "track": track,
    }


def walker(name: str, track: Track, strikes: Sequence[float]) -> Walker:
    """Return a gait in the form that the player animates."""
    return Walker(
        name=name,
        style="rigid",
        track=track.thin(1.0 / SAMPLES_A_SECOND),
        strikes=tuple(round(time, 6) for time in strikes),
        stills=stills(track, list(strikes)),
    )


def sweep_page(runs: Path) -> str:
    """Write the page of the sweep over slope and hip mass."""
    swept = walkerlab.sweep("fixedpoint", {"slope_deg": SLOPES, "walker.hip_mass_kg": HIPS}, runs=runs)
    slopes, hips = ([float(value) for value in swept[name]] for name in ("slope_deg", "hip_mass_kg"))
    gaits = [
        [gait_of(swept.isel(slope_deg=i, hip_mass_kg=j), slopes[i], hips[j]) for j in range(len(hips))]
        for i in range(len(slopes))
    ]
    start = (slopes.index(3.0), hips.index(10.0))
    tracks = {"simulate": gaits[start[0]][start[1]]["track"]}
    slope = gaits[start[0]][start[1]]["slope_rad"]
    first = Player(
        title="The gait.",
        caption="One stride of the rigid model, to scale, downhill to the right; straight legs walk through the ground "
        "as they pass.",
        alt="A compass walker that walks down the slope.",
        walkers=(walker("Gait", tracks["simulate"], ()),),
        slope_rad=slope,
        leg_m=1.0,
        foot_radii_m=(0.0, 0.0),
        torso_m=0.0,
        ordinary_force=weight(tracks),
        closeup_m=STILL_VIEW_OF_RIGID,
        pads=(),
        ground=(),
        view=view(tuple(tracks.values()), slope, margin=0.1),
    )
    for gait in (gait for row in gaits for gait in row):
        gait.pop("track", None)
    page = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True).from_string(
        TEMPLATE.read_text(encoding="utf-8")
    )
    return page.render(
        style=Markup(source("style.css")),
        script=Markup(source("player.js")),
        player=Markup(environment().get_template("blocks/player.html.j2").render(block=first, anchor="gait")),
        gaits=Markup(json.dumps(gaits).replace("<", "\\u003c")),
        sliders=(("slope", "deg", slopes), ("hip mass", "kg", hips)),
        start=start,
        command=f"walkerlab sweep --over slope_deg={SLOPES} --over walker.hip_mass_kg={HIPS} --stage fixedpoint",
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Write all pages."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="where the pages go")
    parser.add_argument("--runs", type=Path, default=Path("runs"))
    parser.add_argument("--only", choices=("sweep", *WALKERS), help="write only this page")
    options = parser.parse_args(arguments)
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in (each for each in WALKERS if options.only in (None, each)):
        run = walkerlab.run("report", name, runs=options.runs).artifact
        assert run is not None, "a report is stored"
        (options.folder / name).mkdir(exist_ok=True)
        for page in run.parent.glob("report*.html"):
            shutil.copy(page, options.folder / name)
    if options.only in (None, "sweep"):
        (options.folder / "slope-and-hip-mass.html").write_text(sweep_page(options.runs), encoding="utf-8")


if __name__ == "__main__":
    main()
