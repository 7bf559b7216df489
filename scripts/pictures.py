"""Pictures of the docs: how each is drawn, and what shows that it is out of date.

The words of each figure stand next to it in docs/images/NAME.words. They come from the same drawing code on small
results, which take seconds, so that a check need not compute the results of the picture itself. A screenshot has a
digest of the files that it shows instead.
"""

from __future__ import annotations

import hashlib
import html
import re
import runpy
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from walkerlab import api
from walkerlab.pipeline.store.artifact import Stored
from walkerlab.views.figures.canvas import Drawing
from walkerlab.views.figures.registry import FIGURES

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
TEXT = re.compile(r"<text\b[^>]*>(.*?)</text>", re.DOTALL)
TAG = re.compile(r"<[^>]*>")
NUMBER = re.compile(r"[−-]?\d[\d.,]*(?:e[+-]?\d+)?")
PAGE = ROOT / "walkerlab" / "views"


@dataclass(frozen=True)
class FigurePicture:
    """A figure of a stage's result."""

    figure: str  # its name in `FIGURES`
    stage: str
    config: str = "paper"
    settings: Mapping[str, Any] = field(default_factory=dict)  # changes of the config
    small: Mapping[str, Any] = field(default_factory=dict)  # further changes for results that take seconds

    def draw(self, runs: Path, settings: Mapping[str, Any]) -> Drawing:
        result = api.run(self.stage, self.config, dict(settings), runs)
        figure = next(figure for figure in FIGURES if figure.name == self.figure)
        return figure.render({self.stage: cast(Stored, result.content)})

    def write(self, path: Path, runs: Path) -> None:
        path.write_bytes(self.draw(runs, self.settings).png)

    def words(self, runs: Path) -> str:
        """Words of the figure when it is drawn today from small results, one text a line."""
        return words_of(self.draw(runs, {**self.settings, **self.small}).svg.decode())


@dataclass(frozen=True)
class Screenshot:
    """A picture that a script takes."""

    script: str  # in scripts/; its `main` writes the picture
    shows: tuple[Path, ...]  # files that decide what the picture shows

    def write(self, path: Path, runs: Path) -> None:  # noqa: ARG002
        cast(Callable[[], None], runpy.run_path(str(ROOT / "scripts" / self.script))["main"])()
        assert path.is_file(), f"{self.script} writes {path}"

    def words(self, runs: Path) -> str:  # noqa: ARG002
        """Digest of the files that the picture shows."""
        digest = hashlib.sha256(b"".join(file.read_bytes() for file in sorted(self.shows)))
        return f"sha256 of what it shows: {digest.hexdigest()}\n"


PICTURES: dict[str, FigurePicture | Screenshot] = {
    "figure-06.png": FigurePicture("figure-06", "contact-sim"),
    "ground-forces.png": FigurePicture("ground-forces", "contact-sim"),
    "figure-13.png": FigurePicture(
        "figure-13",
        "continuation",
        settings={"continuation.over": "slope_deg", "continuation.from": 0.01, "continuation.to": 5.7},
        small={"continuation.from": 4.3, "continuation.to": 4.8, "continuation.periods": 2, "continuation.points": 10},
    ),
    "figure-15.png": FigurePicture("figure-15", "basin", small={"basin.cells": [12, 12]}),
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
"""How pictures in docs/images are drawn; pictures of longer computations have the command in their caption."""


def words_of(svg: str) -> str:
    """Texts of an SVG that hold letters, sorted, with # for each number.

    >>> words_of("<text x='1'>slope (rad)</text><text>0.25</text><text><tspan>step 12</tspan></text>")
    'slope (rad)\\nstep #\\n'
    """
    texts = (NUMBER.sub("#", html.unescape(TAG.sub("", text))).strip() for text in TEXT.findall(svg))
    return "".join(f"{text}\n" for text in sorted({text for text in texts if re.search(r"[^\W\d_]", text)}))


def words_file(name: str) -> Path:
    """File with the words of a picture."""
    return (IMAGES / name).with_suffix(".words")


def write_pictures(runs: Path, names: Iterable[str] = PICTURES) -> None:
    """Draw pictures and write their words; the results take minutes, unless they are in the folder of runs."""
    for name in names:
        PICTURES[name].write(IMAGES / name, runs)
        words_file(name).write_text(PICTURES[name].words(runs), encoding="utf-8")


def stale_pictures(runs: Path) -> Iterator[Path]:
    """Yield each picture whose words differ from those that are drawn today."""
    for name, picture in PICTURES.items():
        if words_file(name).read_text(encoding="utf-8") != picture.words(runs):
            yield IMAGES / name
