"""How each picture of the docs is drawn, and how to notice that it is out of date.

The words of each figure are stored next to it in docs/images/NAME.words. They come from the same drawing code on small
results, which take seconds, so that a check need not compute the results of the picture itself. For a screenshot, a
digest of the files that it shows is stored instead.
"""

from __future__ import annotations

import contextlib
import doctest
import hashlib
import html
import inspect
import io
import re
import runpy
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import matplotlib
from matplotlib.figure import Figure

from walkerlab import api
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.pipeline.store.hdf5 import GroupOnDisk
from walkerlab.views.cli.exports import gif
from walkerlab.views.figures import robustness
from walkerlab.views.figures import sweep as sweep_figures
from walkerlab.views.figures.canvas import Drawing, as_file
from walkerlab.views.figures.stage import FIGURES
from walkerlab.views.figures.stick_diagram import film_times, pictures, read_sticks

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
TEXT = re.compile(r"<text\b[^>]*>(.*?)</text>", re.DOTALL)
TAG = re.compile(r"<[^>]*>")
NUMBER = re.compile(r"[−-]?\d[\d.,]*(?:e[+-]?\d+)?[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]*")
YAML = re.compile(r"^```yaml\n# (\S+)\.yaml\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PYTHON = re.compile(r"^```pycon\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PAGE = ROOT / "walkerlab" / "views"


@dataclass(frozen=True)
class FigurePicture:
    """A figure of a stage's result."""

    figure: str  # name in `FIGURES`
    stage: str
    config: str = "paper"
    settings: Mapping[str, Any] = field(default_factory=dict)  # changes of the config
    small: Mapping[str, Any] = field(default_factory=dict)  # further changes for results that take seconds
    others: tuple[str, ...] = ()  # further stages whose results the figure shows

    def draw(self, runs: Path, settings: Mapping[str, Any]) -> Drawing:
        stages = (self.stage, *self.others)
        results = {stage: cast(Stored, api.run(stage, self.config, dict(settings), runs).content) for stage in stages}
        return next(figure for figure in FIGURES if figure.name == self.figure).render(results)

    def write(self, path: Path, runs: Path) -> None:
        path.write_bytes(self.draw(runs, self.settings).png)

    def words(self, runs: Path) -> str:
        """Return the words of the figure as today's code draws it from small results, one text a line."""
        return words_of(self.draw(runs, {**self.settings, **self.small}).svg.decode())


@dataclass(frozen=True)
class SweepPicture:
    """The figure of a sweep."""

    stage: str
    over: Mapping[str, Any]  # values of each parameter
    few: Mapping[str, Any]  # values for a sweep that takes seconds
    config: str = "paper"
    settings: Mapping[str, Any] = field(default_factory=dict)  # changes of the config
    small: Mapping[str, Any] = field(default_factory=dict)  # further changes for a sweep that takes seconds
    zip: bool = False  # whether the n-th values form the n-th point; otherwise all combinations are points
    show: tuple[str, ...] = ()  # quantities; the default are those that sweeps of the stage show

    def draw(self, runs: Path, over: Mapping[str, Any], settings: Mapping[str, Any]) -> Drawing:
        folder = runs / hashlib.sha256(repr((self.stage, over)).encode()).hexdigest()[:8]
        api.sweep(self.stage, over, self.config, dict(settings), folder, zip=self.zip)
        (path,) = folder.rglob("sweep-*.h5")
        group = GroupOnDisk(path)
        names = [key.rpartition(".")[2] for key in over]
        figure = robustness.sweep_illustration(group, names)
        return (figure or sweep_figures.illustration(group, self.stage, names, self.show)).render({})

    def write(self, path: Path, runs: Path) -> None:
        path.write_bytes(self.draw(runs, self.over, self.settings).png)

    def words(self, runs: Path) -> str:
        """Return the words of the figure as today's code draws it from a small sweep."""
        return words_of(self.draw(runs, self.few, {**self.settings, **self.small}).svg.decode())


@dataclass(frozen=True)
class Film:
    """Walks of both models in one film, as `walkerlab animate RUN --model both` draws them."""

    config: str = "paper"
    rate: int = 25  # frames per second

    def frames(self, runs: Path) -> Iterator[Any]:
        contact, rigid = (
            read_sticks(cast(Stored, api.run(stage, self.config, None, runs).content))
            for stage in ("contact-sim", "simulate")
        )
        terrain = api.run("contact-sim", self.config, None, runs).content.groups.get("terrain")
        return pictures(contact, film_times(contact, None, self.rate, 1.0), terrain, rigid)

    def write(self, path: Path, runs: Path) -> None:
        path.write_bytes(gif(self.frames(runs), self.rate))

    def words(self, runs: Path) -> str:
        """Return the words of the first frame."""
        frames = self.frames(runs)
        next(frames)
        # A frame is an array of pixels. The figure, which has the words, is a local of the generator.
        return words_of(as_file(inspect.getgeneratorlocals(frames)["figure"], "svg", "film", "").decode())


@dataclass(frozen=True)
class ExamplePicture:
    """The picture that the last Python example of a page saves, for a walk of the first config on the page."""

    page: str

    def figure(self, runs: Path) -> Figure:
        text = (ROOT / "docs" / self.page).read_text(encoding="utf-8")
        name, config = cast(re.Match[str], YAML.search(text)).groups()
        path = runs / f"{name}.yaml"
        path.write_text(config, encoding="utf-8")
        api.run("simulate", path, None, runs)
        code = doctest.script_from_examples(PYTHON.findall(text)[-1])
        with contextlib.chdir(runs):
            names: dict[str, Any] = {}
            exec(code.replace('"runs/', f'"{runs}/'), names)
        return cast(Figure, names["figure"])

    def write(self, path: Path, runs: Path) -> None:
        self.figure(runs)
        (runs / path.name).replace(path)

    def words(self, runs: Path) -> str:
        """Return the words of the figure as the example draws it today."""
        file = io.BytesIO()
        with matplotlib.rc_context({"svg.fonttype": "none"}):
            self.figure(runs).savefig(file, format="svg")
        return words_of(file.getvalue().decode())


@dataclass(frozen=True)
class Screenshot:
    """A picture that a script takes."""

    script: str  # file in scripts/ whose `main` writes the picture
    shows: tuple[Path, ...]  # files that decide what the picture shows

    def write(self, path: Path, runs: Path) -> None:  # noqa: ARG002
        cast(Callable[[Path], None], runpy.run_path(str(ROOT / "scripts" / self.script))["main"])(path)

    def content(self, runs: Path) -> bytes:  # noqa: ARG002
        return b"".join(file.read_bytes() for file in sorted(self.shows))

    def words(self, runs: Path) -> str:
        """Return the digest of the files that the picture shows."""
        return f"sha256 of what it shows: {hashlib.sha256(self.content(runs)).hexdigest()}\n"


@dataclass(frozen=True)
class ModelPicture(Screenshot):
    """Picture of the paper's walker in MuJoCo."""

    def content(self, runs: Path) -> bytes:
        """Return the model of the walker without numbers and comments, and the script."""
        path, *_ = api.export_model(runs / "picture.xml", name="paper", strides=2)
        model = re.sub(r"<!--.*?-->", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        return super().content(runs) + NUMBER.sub("#", model).encode()


STOPWATCH = {
    "identify.data": str(ROOT / "docs" / "downloads" / "stopwatch.csv"),
    "identify.fit": {"slope_deg": None, "walker.hip_mass_kg": None},
}
FEW_WALKS = {
    "robustness.walks": 2,
    "robustness.max_steps": 20,
    "robustness.steps": 2,
    "robustness.roughness_m": [0.002],
}
PICTURES: dict[str, FigurePicture | SweepPicture | Film | ExamplePicture | Screenshot] = {
    "figure-06.png": FigurePicture("figure-06", "contact-sim"),
    "ground-forces.png": FigurePicture("ground-forces", "contact-sim"),
    "figure-13.png": FigurePicture(
        "figure-13",
        "continuation",
        settings={"continuation.over": "slope_deg", "continuation.from": 0.01, "continuation.to": 5.7},
        small={"continuation.from": 4.3, "continuation.to": 4.8, "continuation.periods": 2, "continuation.points": 10},
    ),
    "figure-13-kneed.png": FigurePicture(
        "figure-13",
        "continuation",
        "kneed",
        {
            "continuation.over": "slope_deg",
            "continuation.from": 1,
            "continuation.to": 8,
            "continuation.periods": 1,
            "continuation.model": "both",
        },
        {"continuation.from": 5.8, "continuation.to": 6.6, "continuation.points": 5},
    ),
    "figure-13-leg-mass.png": FigurePicture(
        "figure-13",
        "continuation",
        "prosthesis",
        {
            "continuation.over": "walker.leg_2.leg_mass_kg",
            "continuation.from": 2,
            "continuation.to": 7,
            "continuation.model": "rigid",
        },
        {"continuation.from": 3.9, "continuation.to": 4.1, "continuation.points": 5},
    ),
    "figure-13-kneed-cascade.png": FigurePicture(
        "figure-13",
        "continuation",
        "kneed",
        {"continuation.over": "slope_deg", "continuation.from": 5, "continuation.to": 8},
        {"continuation.from": 6.0, "continuation.to": 6.1, "continuation.periods": 1, "continuation.points": 5},
    ),
    "figure-15.png": FigurePicture("figure-15", "basin", small={"basin.cells": [12, 12]}),
    "figure-16.png": FigurePicture(
        "figure-16",
        "continuation",
        settings={
            "continuation.over": "slope_deg",
            "continuation.from": 3,
            "continuation.to": 5.7,
            "continuation.periods": 1,
            "continuation.second": {"over": "walker.hip_mass_kg", "from": 1, "to": 30},
        },
        small={
            "continuation.from": 4.2,
            "continuation.to": 4.41,
            "continuation.points": 5,
            "continuation.second": {"over": "walker.hip_mass_kg", "from": 9.9, "to": 10.1},
        },
    ),
    "figure-17.png": SweepPicture(
        "robustness",
        {"slope_deg": "0.5:4:15"},
        {"slope_deg": [3]},
        "slope-3deg",
        {"robustness.roughness_m": [], "robustness.to": ["slope_deg"]},
        {"robustness.steps": 2, "robustness.to": []},
    ),
    "figure-18.png": FigurePicture(
        "figure-18",
        "robustness",
        "slope-3deg",
        {"robustness.to": ["slope_deg"], "robustness.max_steps": 100},
        FEW_WALKS,
    ),
    "rigid-limit-level.png": FigurePicture("figure-12", "tune", "level", small={"tune.cells": 2}),
    "push-off-or-hip.png": SweepPicture(
        "robustness",
        {
            "slope_deg": [0.1, 0.25, 0.5, 0.75, 1, 1.5, 2, 2.5, 3, 3.5, 4, *[0] * 15],
            "push_off.impulse_N_s": [*[0] * 11, 0.5, 1, 2, 3, 4, 5, 6, 7, 8, *[0] * 6],
            "walker.hip.torque_N_m": [*[0] * 20, 0.1, 0.25, 0.5, 1, 1.4, 1.7],
        },
        {
            "slope_deg": [1, 0, 0],
            "push_off.impulse_N_s": [0, 4, 0],
            "walker.hip.torque_N_m": [0, 0, 1],
        },
        "level",
        {"robustness.model": "rigid", "robustness.roughness_m": [], "robustness.to": ["slope_deg"]},
        {"robustness.steps": 2},
        zip=True,
    ),
    "recorded-walk.png": FigurePicture(
        "figure-07",
        "simulate",
        settings={"recording.file": str(ROOT / "docs" / "downloads" / "film.csv"), "strides": 4},
        others=("contact-sim", "recorded-walk"),
    ),
    "identified-steps.png": FigurePicture("identified-steps", "identify", settings=STOPWATCH),
    "identified-trade-off.png": FigurePicture("identified-trade-off", "identify", settings=STOPWATCH),
    "sweep-slope-hip-mass.png": SweepPicture(
        "fixedpoint",
        {"slope_deg": "0.5:8:31", "walker.hip_mass_kg": "5:30:6"},
        {"slope_deg": "3:6:6", "walker.hip_mass_kg": "5:10:6"},
        show=("period_s", "spectral_radius"),
    ),
    "walk.gif": Film(),
    "angles.png": ExamplePicture("tutorial.md"),
    "mujoco.png": ModelPicture("mujoco_picture.py", (ROOT / "scripts" / "mujoco_picture.py",)),
    "explore.png": Screenshot(
        "picture_of_explore.py",
        (
            *(PAGE / "explore" / "templates").iterdir(),
            *(PAGE / "report" / "templates" / name for name in ("style.css", "player.js", "blocks/player.html.j2")),
        ),
    ),
    "page.png": Screenshot(
        "picture_of_page.py",
        tuple(PAGE / "report" / "templates" / name for name in ("page.html.j2", "style.css", "blocks/player.html.j2")),
    ),
}
"""How the pictures in docs/images are drawn. A picture of a longer computation is not listed here, but has its command
in the caption.
"""


def words_of(svg: str) -> str:
    """Return the texts of an SVG that contain letters, sorted, with # for each number.

    >>> words_of("<text x='1'>slope (rad)</text><text>0.25</text><text><tspan>step 12</tspan></text>")
    'slope (rad)\\nstep #\\n'
    """
    texts = (NUMBER.sub("#", html.unescape(TAG.sub("", text))).strip() for text in TEXT.findall(svg))
    return "".join(f"{text}\n" for text in sorted({text for text in texts if re.search(r"[^\W\d_]", text)}))


def words_file(name: str) -> Path:
    """Return the path of the file with the words of a picture."""
    return (IMAGES / name).with_suffix(".words")


def write_pictures(runs: Path, names: Iterable[str] = PICTURES) -> None:
    """Draw pictures and write their words. Computing the results takes minutes, unless the folder of runs has them."""
    for name in names:
        PICTURES[name].write(IMAGES / name, runs)
        words_file(name).write_text(PICTURES[name].words(runs), encoding="utf-8")


def stale_pictures(runs: Path) -> Iterator[Path]:
    """Yield each picture whose words differ from those that are drawn today."""
    for name, picture in PICTURES.items():
        if words_file(name).read_text(encoding="utf-8") != picture.words(runs):
            yield IMAGES / name
