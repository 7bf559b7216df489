"""Draw the measures of walkers to scale, as docs/walkers.md shows them for each type.

python scripts/draw_walkers.py                          # the pictures of docs/walkers.md
python scripts/draw_walkers.py my.yaml --to mine.svg    # your own walker
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from walkerlab.config.loader import load
from walkerlab.config.schema import Config
from walkerlab.figures.measures import drawn

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
PAGE = ROOT / "docs" / "walkers.md"
OWN_PARTS = re.compile(r"```yaml\n(name: own-parts\n.*?)```", re.DOTALL)
# what is zero in a built-in config is given a size, for its measure to be seen
PICTURES: dict[str, tuple[str, tuple[str, ...]]] = {
    "compass": ("paper", ()),
    "straight-legs": ("round-feet", ("walker.leg_mass_ahead_m=0.02", "walker.foot_centre_ahead_m=0.03")),
    "kneed": ("kneed-round-feet", ("walker.shank.mass_ahead_m=0.04",)),
    "torso": ("torso", ()),
}


def pictures() -> dict[str, bytes]:
    """The pictures of docs/walkers.md, by the name of their file."""
    found = {
        f"walker-{name}.svg": drawn(load(Path(file), sets).config.walker, name)
        for name, (file, sets) in PICTURES.items()
    }
    return {**found, "walker-parts.svg": drawn(own_parts().walker, "parts")}


def own_parts() -> Config:
    """The config that the page describes a walker's parts by."""
    example = OWN_PARTS.search(PAGE.read_text(encoding="utf-8"))
    assert example is not None, f"{PAGE} has an example named own-parts"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "own-parts.yaml"
        path.write_text(example[1], encoding="utf-8")
        return load(path, ()).config


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw one walker or all of the page's; the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("config", nargs="?", help="a config's file or built-in name; default: those of the page")
    parser.add_argument("--to", type=Path, default=Path("walker.svg"), help="file of the picture")
    options = parser.parse_args(arguments)
    if options.config is not None:
        options.to.write_bytes(drawn(load(Path(options.config), ()).config.walker, options.to.stem))
        return 0
    for name, picture in pictures().items():
        (IMAGES / name).write_bytes(picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
