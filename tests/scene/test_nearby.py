"""Tests of the nearest gait for a walker without one: on another slope, or with feet ahead of the shanks."""

import math
import re
import shlex
from pathlib import Path

import pytest

from walkerlab.config.loader import load
from walkerlab.errors import add_run_options
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.scene.gait_suggestions import find_slopes_with_gaits, round_inward, suggest_gaits
from walkerlab.scene.rigid import rigid_walker

KNEED = (
    "walker={type: kneed, thigh: {length_m: 0.40, mass_kg: 2.345, mass_below_hip_m: 0.2}, "
    "shank: {length_m: 0.42, mass_kg: 1.013, mass_below_knee_m: 0.21, mass_ahead_m: 0.02}, hip_mass_kg: 5, "
    "foot_radius_m: 0.15}"
)
MCGEER = (
    "walker={type: kneed, thigh: {length_m: 0.46, mass_kg: 2.345, mass_below_hip_m: 0.2, inertia_kg_m2: 0.02}, "
    "shank: {length_m: 0.54, mass_kg: 1.013, mass_below_knee_m: 0.24, inertia_kg_m2: 0.02}, hip_mass_kg: 10, "
    "foot_radius_m: 0.2}"
)


def config(*sets, base=None):
    return load(base, sets).config


def gait_of(found):
    return find_gaits(rigid_walker(found, found.equations)).gait


@pytest.mark.parametrize("degrees", [2, 3, 4, 5])
def test_slopes_with_stable_gaits_are_found_for_a_kneed_walker_that_has_none(degrees):
    one = config(KNEED, f"slope_deg={degrees}", base=Path("kneed"))
    assert gait_of(one) is None
    low, high = (math.degrees(value) for value in find_slopes_with_gaits(one).stable)
    for inside in (low + 0.05, high - 0.05):
        assert gait_of(config(KNEED, f"slope_deg={inside}", base=Path("kneed"))).stable
    beyond = gait_of(config(KNEED, f"slope_deg={low - 0.05}", base=Path("kneed")))
    assert beyond is None or not beyond.stable


@pytest.mark.parametrize("slope", ["slope_deg=40", "slope_rad=0.7"])
def test_suggested_command_finds_a_stable_gait(slope):
    said = add_run_options(suggest_gaits(config(slope)), lambda _: f" --set {slope}")
    command = re.search("`(.*)`", said)[1]
    sets = [word for word in shlex.split(command) if "=" in word]
    assert said.startswith("A stable gait exists at least from ")
    assert gait_of(config(*sets)).stable


@pytest.mark.parametrize("degrees", [1.4, 2.5, 4.0])
def test_advice_for_a_kneed_walker_without_a_gait_is_to_move_its_feet_ahead(degrees):
    sets = (MCGEER, f"slope_deg={degrees}")
    assert gait_of(config(*sets, base=Path("kneed"))) is None
    advice = add_run_options(suggest_gaits(config(*sets, base=Path("kneed"))), lambda _: " -c mcgeer.yaml")
    command = re.search("`walkerlab fixedpoint -c mcgeer.yaml --set (walker.foot_centre_ahead_m=[0-9.]+)`", advice)[1]
    assert gait_of(config(*sets, command, base=Path("kneed"))).stable
    assert advice.count("--set") <= 2


def test_no_slow_command_is_suggested_without_a_nearby_gait():
    one = config(MCGEER, "slope_deg=3", "walker.shank.mass_kg=100", "walker.thigh.mass_kg=0.001", base=Path("kneed"))
    advice = suggest_gaits(one)
    assert "walker.foot_centre_ahead_m" in advice
    assert "kneed-round-feet" in advice
    assert "--set" not in advice


def test_no_nearby_gait_is_suggested_on_level_ground():
    assert suggest_gaits(config("slope_deg=0")) == ""


def test_ends_of_a_range_of_slopes_are_rounded_inwards():
    assert round_inward(0.40001, 4.1399) == pytest.approx((0.401, 4.13), abs=1e-12)
    assert round_inward(4.1391, 4.1395) == (4.1391, 4.1395)
