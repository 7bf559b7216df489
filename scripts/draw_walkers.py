"""Draw the pictures of docs/walkers.md: the measures of each type of walker; `walkerlab draw` draws your own."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.views.figures.measures import draw_measures

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
PAGE = ROOT / "docs" / "walkers.md"
OWN_PARTS = re.compile(r"```yaml\n(name: own-parts\n.*?)```", re.DOTALL)
# what is zero in a built-in config is given a size, for its measure to be seen
PICTURES: dict[str, tuple[str, tuple[str, ...]]] = {
    "compass": ("paper", ()),
    "straight-legs": ("round-feet", ("walker.leg_mass_ahead_m=0.02", "walker.foot_centre_ahead_m=0.03")),
    "kneed": ("kneed-round-feet", ("walker.shank.mass_ahead_m=0.04", "walker.foot_centre_ahead_m=0.03")),
    "torso": ("torso", ()),
}


def pictures() -> dict[str, bytes]:
    """The pictures of docs/walkers.md, by the name of their file."""
    found = {
        f"walker-{name}.svg": draw_measures(load(Path(file), sets).config.walker, name)
        for name, (file, sets) in PICTURES.items()
    }
    return {**found, "walker-parts.svg": draw_measures(own_parts().walker, "parts")}


def own_parts() -> Config:
    """The config that the page describes a walker's parts by."""
    example = OWN_PARTS.search(PAGE.read_text(encoding="utf-8"))
    assert example is not None, f"{PAGE} has an example named own-parts"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "own-parts.yaml"
        path.write_text(example[1], encoding="utf-8")
        return load(path, ()).config


if __name__ == "__main__":
    for name, picture in pictures().items():
        (IMAGES / name).write_bytes(picture)
