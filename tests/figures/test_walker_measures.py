"""The pictures of walkers' measures: they name what a config names, lie where it says, and are those of the docs."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from walkerlab.cli.console import Console
from walkerlab.cli.exports import Target, draw_walker
from walkerlab.config.walkers import Kneed, PartsWalker, StraightLegs
from walkerlab.figures.measures import drawn, of_parts, upright

ROOT = Path(__file__).parents[2]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "draw_walkers.py"))
WORDS = re.compile(r"<text[^>]*>(.*?)</text>", re.DOTALL)
KNEED = Kneed(type="kneed", foot_radius_m=0.1, shank={"mass_ahead_m": 0.03}, thigh={"mass_ahead_m": 0.02})


def words(picture):
    return sorted(WORDS.findall(picture.decode()))


@pytest.fixture(scope="module")
def pictures():
    return SCRIPT["pictures"]()


def test_pictures_of_the_docs_are_current(pictures):
    """Their words, that is: the shapes of letters and lines depend on the version of matplotlib."""
    assert {name: words((SCRIPT["IMAGES"] / name).read_bytes()) for name in pictures} == {
        name: words(picture) for name, picture in pictures.items()
    }


def test_every_picture_stands_in_the_docs(pictures):
    page = SCRIPT["PAGE"].read_text(encoding="utf-8")
    assert [name for name in pictures if f"images/{name}" not in page] == []


def test_every_length_of_the_walker_is_named_with_its_value():
    shown = drawn(KNEED, "kneed").decode()
    for limb, keys in (("thigh", ("mass_below_hip_m",)), ("shank", ("mass_below_knee_m",))):
        for key in ("length_m", "mass_kg", "mass_ahead_m", *keys):
            assert f"{limb}.{key}: {getattr(getattr(KNEED, limb), key):g}" in shown


@pytest.mark.parametrize("walker", [KNEED, StraightLegs(type="straight-legs", foot_centre_ahead_m=0.02)])
def test_measures_are_as_long_as_they_say(walker):
    for measure in upright(walker).lengths:
        gaps = np.abs(np.subtract(measure.end, measure.start))
        assert np.abs(gaps - abs(measure.value)).min() < 1e-12


def test_a_config_of_ones_own_is_drawn_by_its_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text("extends: kneed\nname: mine\nwalker: {hip_mass_kg: 0.75}\n")
    path = draw_walker(Path("mine.yaml"), Target(None, None), Console(quiet=True))
    assert path.name == "mine-walker.svg"
    assert "hip_mass_kg: 0.75" in path.read_text()
    assert draw_walker(Path("kneed"), Target("png", Path("it")), Console()).read_bytes().startswith(b"\x89PNG")


def test_words_of_two_parts_at_one_point_stand_on_either_side_of_it():
    legs = ("leg 1", "leg 2")
    walker = PartsWalker(
        type="parts",
        bodies=[{"name": name, "mass_kg": 5, "centre_m": [0, -0.5]} for name in legs],
        hinges=[
            {"name": "hip", "parent": legs[1], "parent_point_m": [0, 0], "child": legs[0], "child_point_m": [0, 0]}
        ],
        particles=[{"name": "hip", "mass_kg": 10, "body": legs[1], "at_m": [0, 0]}],
        feet=[{"body": name, "centre_m": [0, -1]} for name in legs],
        legs=[[name] for name in legs],
        leg_length_m=1.0,
    )
    (axes,) = of_parts(walker).axes
    sides = [text.xyann[1] > 0.0 for text in axes.texts if text.xy == (0.0, 0.0)]
    assert sorted(sides) == [False, True]
