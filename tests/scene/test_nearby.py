"""Where a walker without a gait has one: along the slope, and on the way from a built-in walker."""

import math
import re
import shlex
from pathlib import Path

import pytest

from walkerlab.config.loader import load
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.scene.nearby import between, gaits_on_other_slopes, nearby, way_from_built_in
from walkerlab.scene.rigid import rigid_walker

KNEED = (
    "walker={type: kneed, thigh: {length_m: 0.40, mass_kg: 2.345, mass_below_hip_m: 0.2}, "
    "shank: {length_m: 0.42, mass_kg: 1.013, mass_below_knee_m: 0.21, mass_ahead_m: 0.02}, hip_mass_kg: 5, "
    "foot_radius_m: 0.15}"
)


def config(*sets, base=None):
    return load(base, sets).config


def gait_of(found):
    return find_gaits(rigid_walker(found, found.equations)).gait


@pytest.mark.parametrize("degrees", [2, 3, 4, 5])
def test_a_kneed_walker_is_told_of_its_steeper_slopes(degrees):
    one = config(KNEED, f"slope_deg={degrees}", base=Path("kneed"))
    assert gait_of(one) is None
    low, high = (math.degrees(value) for value in gaits_on_other_slopes(one).stable)
    for inside in (low + 0.05, high - 0.05):
        assert gait_of(config(KNEED, f"slope_deg={inside}", base=Path("kneed"))).stable
    beyond = gait_of(config(KNEED, f"slope_deg={low - 0.05}", base=Path("kneed")))
    assert beyond is None or not beyond.stable


@pytest.mark.parametrize("slope", ["slope_deg=40", "slope_rad=0.7"])
def test_the_command_that_is_told_finds_a_stable_gait(slope):
    said = nearby(config(slope), f" --set {slope}")
    command = re.search("`(.*)`", said)[1]
    sets = [word for word in shlex.split(command) if "=" in word]
    assert said.startswith("A stable gait exists from ")
    assert gait_of(config(*sets)).stable


def test_the_way_from_a_built_in_walker_has_a_gait_as_far_as_is_said():
    one = config(KNEED, "slope_deg=3", base=Path("kneed"))
    begin, met = way_from_built_in(one)
    assert begin.walker.type == "kneed"
    assert 0.0 < met.whole[1] < 1.0
    assert gait_of(between(begin, one, 0.95 * met.whole[1])) is not None
    assert between(begin, one, 1.0).walker == one.walker


def test_uphill_nothing_is_sought():
    assert nearby(config("slope_deg=0")) == ""
