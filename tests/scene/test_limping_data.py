"""Tests of identifying legs that differ, from walks by a plain integration of both swings."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from measured_plain_walk import measure_limp, measure_limping_angles
from plain_unequal_walk import Leg, Segment, Walker

from walkerlab.api.memory import run_in_memory
from walkerlab.config.identify import Identify
from walkerlab.config.loader import load
from walkerlab.physics.estimation.measurements import MeasuredWalk, split_into_steps
from walkerlab.scene.identification import identify_walk
from walkerlab.views.report.sections.identification import describe_limp_of_legs

MASS = "walker.leg_2.leg_mass_kg"
HEAVIER = 0.31


def compass_leg(mass):
    return Leg((Segment(1.0, mass, 0.5, 0.0, 0.0),), 0.0)


@cache
def gait(*sets):
    return run_in_memory("fixedpoint", load(Path("paper"), sets).config).summary


@cache
def measured(heavier, level, seed=1):
    """Simulate and measure a walk of the paper's walker with a heavier leg 2. Leg 1 swings first."""
    plain = Walker((compass_leg(5.0), compass_leg(5.0 + heavier)), 10.0, 0.0174)
    start = np.array(gait(f"{MASS}={5.0 + heavier}")["state"]) * [1.0, 1.0, 1.004, 1.004]
    rng = np.random.default_rng(seed)
    if level == "steps":
        return MeasuredWalk(*measure_limp(plain, start, rng, 21))
    times, angles = measure_limping_angles(plain, start, rng)
    touches = np.append(0.0, np.cumsum(plain.stride(start, [0.0] * 10)[0][:, 0]))
    return split_into_steps(times, angles, touches)


def begun(walk, leg, stated=None):
    """Return twenty steps of a walk in which `leg` swings first. `stated` is the leg that the data name, if any."""
    part = slice(leg - 1, leg + 19)
    return MeasuredWalk(walk.periods_s[part], walk.lengths_m[part], first_leg=stated)


def identify(walk, *keys, sets=(), **options):
    config = load(Path("paper"), sets).config
    return identify_walk(config, walk, gait(*sets), Identify(fit=dict.fromkeys(keys), **options))


def sentences(result):
    rows = ([vars(row) for row in each] for each in (result.leg_differences, result.other_differences))
    names = ("leg_differences", "other_leg_differences", "first_leg")
    return " ".join(describe_limp_of_legs(dict(zip(names, (*rows, vars(result.first_leg)), strict=True))))


@pytest.mark.parametrize("leg", [1, 2])
def test_steps_show_the_heavier_leg_and_which_leg_begins(leg):
    result = identify(begun(measured(HEAVIER, "steps"), leg), MASS)
    (difference,) = result.leg_differences
    assert abs(difference.value - HEAVIER) < 2.0 * difference.standard_error < 0.05
    assert result.first_leg.leg == leg
    assert result.first_leg.by == "likelihood"
    assert result.verdict.usable
    assert f"it is leg {leg}, as the walk shows" in sentences(result)


def test_angles_show_the_heavier_leg():
    result = identify(measured(HEAVIER, "angles"), MASS, level="angles")
    (difference,) = result.leg_differences
    assert abs(difference.value - HEAVIER) < 2.0 * difference.standard_error < 0.02


def test_answer_names_the_heavier_leg():
    result = identify(begun(measured(HEAVIER, "steps"), 1, stated=1), MASS)
    (difference,) = result.leg_differences
    error = difference.standard_error
    assert sentences(result) == f"The legs differ: leg 2 is {difference.value:.3f} ± {error:.3f} kg heavier."


def test_data_that_do_not_say_which_leg_begins_give_both_answers():
    result = identify(begun(measured(HEAVIER, "steps"), 1), MASS, "walker.hip_mass_kg")
    assert result.first_leg.by == "guess"
    by_leg = sorted((result.leg_differences[0].value, result.other_differences[0].value))
    # If leg 2 is taken for the first leg, all masses of the walk are multiplied by 5 / 5.31.
    assert by_leg == pytest.approx([5.0 * 5.0 / (5.0 + HEAVIER) - 5.0, HEAVIER], abs=0.1)
    text = sentences(result)
    assert "heavier" in text
    assert "lighter" in text
    assert "The data do not say which leg swings first" in text


def test_walk_of_equal_legs_is_not_called_a_limp():
    result = identify(begun(measured(0.0, "steps"), 1), MASS)
    (difference,) = result.leg_differences
    assert abs(difference.value) < 3.0 * difference.standard_error
    assert sentences(result) == ""


@pytest.mark.parametrize(("heavier", "leg"), [(HEAVIER, 1), (HEAVIER, 2), (-0.8, 1)])
def test_fitting_equal_legs_to_a_limp_suggests_the_option_that_explains_it(heavier, leg):
    result = identify(begun(measured(heavier, "steps"), leg), "slope_deg")
    assert result.verdict.fit in ("fits-but", "misfit")
    assert any(f"--fit {MASS}" in reason for reason in result.verdict.reasons)


def test_equal_steps_do_not_suggest_different_legs():
    result = identify(begun(measured(0.0, "steps"), 1), "slope_deg")
    assert not any("leg_2" in reason for reason in result.verdict.reasons)


def test_error_of_a_leg_difference_includes_the_covariance_of_both_estimates():
    result = identify(begun(measured(HEAVIER, "steps"), 1, stated=1), MASS, "walker.leg_mass_kg")
    first, second = (next(each for each in result.estimates if each.key == key) for key in ("walker.leg_mass_kg", MASS))
    (difference,) = result.leg_differences
    assert difference.value == pytest.approx(second.value - first.value)
    covariance = result.information.covariance
    assert difference.standard_error**2 == pytest.approx(covariance[0, 0] + covariance[1, 1] - 2.0 * covariance[0, 1])
