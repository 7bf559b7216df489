"""Tests of the drawings of walkers: keys, positions of the dimensions, and agreement with the docs."""

import itertools
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from drawn_texts import texts_drawn

from walkerlab.config.loader import load
from walkerlab.config.walkers import Kneed, PartsWalker, StraightLegs
from walkerlab.views.cli.console import Console
from walkerlab.views.cli.exports import Target, draw_walker
from walkerlab.views.figures.canvas import figure_style, settle
from walkerlab.views.figures.measures import draw_measures, draw_parts, draw_upright, measure_leg

ROOT = Path(__file__).parents[3]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "draw_walkers.py"))
WORDS = re.compile(r"<text[^>]*>(.*?)</text>", re.DOTALL)
KNEED = Kneed(
    type="kneed",
    foot_radius_m=0.1,
    foot_centre_ahead_m=0.04,
    shank={"mass_ahead_m": 0.03},
    thigh={"mass_ahead_m": 0.02},
)


def words(picture):
    return sorted(WORDS.findall(picture.decode()))


@pytest.fixture(scope="module")
def pictures():
    return SCRIPT["pictures"]()


def test_pictures_in_the_docs_are_current(pictures):
    """Compare only the words, because shapes of letters and lines depend on the version of matplotlib."""
    assert {name: words((SCRIPT["IMAGES"] / name).read_bytes()) for name in pictures} == {
        name: words(picture) for name, picture in pictures.items()
    }


def test_every_walker_drawing_is_used_in_the_docs(pictures):
    pages = "".join(page.read_text(encoding="utf-8") for page in SCRIPT["PAGE"].parent.glob("*.md"))
    assert [name for name in pictures if f"images/{name}" not in pages] == []


def test_every_length_of_the_walker_is_labelled_with_its_value():
    shown = draw_measures(KNEED, "kneed").decode()
    for limb, keys in (("thigh", ("mass_below_hip_m",)), ("shank", ("mass_below_knee_m",))):
        for key in ("length_m", "mass_kg", "mass_ahead_m", *keys):
            assert f"{limb}.{key}: {getattr(getattr(KNEED, limb), key):g}" in shown
    assert "foot_centre_ahead_m: 0.04" in shown


@pytest.mark.parametrize("walker", [KNEED, StraightLegs(type="straight-legs", foot_centre_ahead_m=0.02)])
def test_dimension_lines_have_the_labelled_length(walker):
    for measure in measure_leg(walker).lengths:
        gaps = np.abs(np.subtract(measure.end, measure.start))
        assert np.abs(gaps - abs(measure.value)).min() < 1e-12


def test_draw_command_draws_a_user_config(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text("extends: kneed\nname: mine\nwalker: {hip_mass_kg: 0.75}\n")
    path = draw_walker(Path("mine.yaml"), Target(None, None), Console(quiet=True))
    assert path.name == "mine-walker.svg"
    assert "hip_mass_kg: 0.75" in path.read_text()
    assert draw_walker(Path("kneed"), Target("png", Path("it")), Console()).read_bytes().startswith(b"\x89PNG")


def test_drawing_prints_the_warnings_of_its_config(tmp_path, capsys):
    (tmp_path / "long.yaml").write_text("walker: {leg_length_m: 1000, foot_to_mass_m: 500}\n")
    draw_walker(tmp_path / "long.yaml", Target("svg", tmp_path / "long.svg"), Console(quiet=True))
    assert "lengths are in m, not in mm" in " ".join(capsys.readouterr().err.split())


OF_TYPES = (
    ("paper", []),
    ("kneed", []),
    ("torso", []),
    ("round-feet", ["walker.foot_centre_ahead_m=0.05", "walker.leg_mass_ahead_m=-0.04"]),
    ("round-feet", ["walker.leg_mass_below_hip_m=0.02", "walker.foot_centre_ahead_m=-0.05"]),
    ("paper", ["walker.foot_to_mass_m=0.02", "walker.foot_radius_m=0.01"]),
    ("kneed", ["walker.thigh.length_m=0.4", "walker.shank.length_m=0.42", "walker.shank.mass_ahead_m=0.02"]),
    ("kneed-round-feet", ["walker.foot_centre_ahead_m=0.05"]),
    ("kneed", ["walker.foot_centre_ahead_m=0.05"]),
    ("kneed", ["walker.thigh.mass_below_hip_m=0.0123", "walker.thigh.mass_ahead_m=0.0312",
               "walker.shank.inertia_kg_m2=0.0123", "walker.shank.mass_below_knee_m=0.4567"]),
)  # fmt: skip


def parts(radius=0.0, at=(0.0, 0.0)):
    """Return the parts of two legs on a hip, with one mass at the hip and one next to it, and with round feet."""
    legs = ("leg 1", "leg 2")
    return PartsWalker(
        type="parts",
        bodies=[{"name": name, "mass_kg": 5, "centre_m": [0, -0.5]} for name in legs],
        hinges=[
            {"name": "hip", "parent": legs[1], "parent_point_m": [0, 0], "child": legs[0], "child_point_m": [0, 0]}
        ],
        particles=[
            {"name": "hip", "mass_kg": 10, "body": legs[1], "at_m": [0, 0]},
            *({"name": f"weight on {name}", "mass_kg": 1, "body": name, "at_m": list(at)} for name in legs),
        ],
        feet=[{"body": name, "centre_m": [0.01, radius - 1.0], "radius_m": radius} for name in legs],
        legs=[[name] for name in legs],
        leg_length_m=1.0,
    )


def figures():
    for name, changed in OF_TYPES:
        yield draw_upright(load(Path(name), changed).config.walker)
    yield from (
        draw_parts(load(Path("parts")).config.walker),
        draw_parts(parts()),
        draw_parts(parts(0.2, (0.0, -0.48))),
    )


@pytest.mark.parametrize("place", range(len(OF_TYPES) + 3))
def test_labels_do_not_overlap_or_leave_the_picture(place):
    with figure_style():
        figure = next(itertools.islice(figures(), place, None))
        settle(figure)
        words = texts_drawn(figure)
    for text, box in words:
        assert box.x0 >= 0.0, text
        assert box.y0 >= 0.0, text
        assert box.x1 <= figure.bbox.width, text
        assert box.y1 <= figure.bbox.height, text
    for (text, box), (other, other_box) in itertools.combinations(words, 2):
        assert not box.overlaps(other_box), (text, other)


LIMPING = (
    ("prosthesis",),
    ("one-knee",),
    ("kneed", "walker.leg_2={shank: {length_m: 0.48, mass_ahead_m: 0.02}, foot_radius_m: 0.1}"),
)


@pytest.mark.parametrize("walker", LIMPING, ids=lambda walker: walker[0])
def test_legs_that_differ_have_a_panel_each_with_their_own_values(walker):
    name, *changed = walker
    config = load(Path(name), changed).config
    with figure_style():
        figure = draw_upright(config.walker)
        settle(figure)
        words = texts_drawn(figure)
    assert [axes.get_title("left") for axes in figure.axes] == ["leg 1", "leg 2"]
    shown = [{text.get_text().strip() for text in axes.texts} for axes in figure.axes]
    mass = {"prosthesis": "leg_mass_kg: 4", "one-knee": "leg_mass_kg: 11.46", "kneed": "shank.length_m: 0.48"}[name]
    assert any(mass in text for text in shown[1])
    assert not any(mass in text for text in shown[0])
    for (text, box), (other, other_box) in itertools.combinations(words, 2):
        assert not box.overlaps(other_box), (text, other)


def test_bodies_of_both_legs_are_drawn_if_they_differ():
    walker = parts()
    first, second = walker.bodies
    limping = walker.model_copy(update={"bodies": (first.model_copy(update={"mass_kg": 4.0}), second)})
    assert len(draw_parts(walker).axes) == 1
    assert [axes.get_title().splitlines()[1] for axes in draw_parts(limping).axes] == ["mass_kg: 4", "mass_kg: 5"]


def test_leg_of_parts_ends_on_its_foot_arc():
    (axes,) = draw_parts(parts(0.2)).axes
    sole, leg = (line for line in axes.lines if line.get_linewidth() == 2.0)
    low = int(np.argmin(sole.get_ydata()))
    assert (leg.get_xdata()[-1], leg.get_ydata()[-1]) == pytest.approx((sole.get_xdata()[low], sole.get_ydata()[low]))
