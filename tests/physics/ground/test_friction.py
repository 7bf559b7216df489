"""Tests of ADAMS's Coulomb law, a friction law that creeps."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from walkerlab.physics.ground.friction import Coulomb, Frictionless, friction_coefficient


@st.composite
def friction_laws(draw):
    static = draw(st.floats(0.0, 2.0))
    stiction = draw(st.floats(1e-5, 1.0))
    return Coulomb(static, static * draw(st.floats(0.0, 1.0)), stiction, stiction * draw(st.floats(1.01, 100.0)))


slips = st.floats(-20.0, 20.0)
PAPER = Coulomb(0.9, 0.7, 0.1, 1.0)


def coefficient(law, slip):
    return friction_coefficient(law, slip)[0]


@given(law=friction_laws(), slip=slips)
def test_friction_is_odd(law, slip):
    mu, slope = friction_coefficient(law, slip)
    back, back_slope = friction_coefficient(law, -slip)
    assert back == pytest.approx(-mu, abs=1e-15)
    assert back_slope == pytest.approx(slope, rel=1e-9, abs=1e-12)


@given(law=friction_laws(), slip=slips)
def test_friction_opposes_slip(law, slip):
    assert coefficient(law, slip) * slip <= 0.0
    assert abs(coefficient(law, slip)) <= law.static * (1.0 + 1e-12)


@given(law=friction_laws())
def test_friction_peaks_at_the_stiction_velocity_and_falls_to_the_dynamic_value(law):
    assert coefficient(law, 0.0) == pytest.approx(0.0, abs=1e-15)
    assert coefficient(law, law.stiction_velocity) == pytest.approx(-law.static)
    for faster in (1.0, 2.0, 1e3):
        assert coefficient(law, faster * law.friction_velocity) == pytest.approx(-law.dynamic)
    rising = [abs(coefficient(law, v)) for v in np.linspace(0.0, law.stiction_velocity, 20)]
    falling = [abs(coefficient(law, v)) for v in np.linspace(law.stiction_velocity, law.friction_velocity, 20)]
    assert np.all(np.diff(rising) >= -1e-15)
    assert np.all(np.diff(falling) <= 1e-15)


def test_friction_halfway_between_stiction_and_friction_velocity_is_the_mean_coefficient():
    assert coefficient(PAPER, 0.55) == pytest.approx(-0.8)
    assert coefficient(PAPER, 0.05) == pytest.approx(-0.9 * (3 * 0.5 - 0.5**3) / 2)


@given(law=friction_laws(), fraction=st.floats(-1.5, 1.5))
def test_derivative_of_friction_equals_finite_differences(law, fraction):
    slip = fraction * law.friction_velocity
    h = 1e-4 * min(law.stiction_velocity, law.friction_velocity - law.stiction_velocity)
    assume(all(abs(abs(slip) - join) > 2 * h for join in (law.stiction_velocity, law.friction_velocity)))
    differenced = (coefficient(law, slip + h) - coefficient(law, slip - h)) / (2 * h)
    steepest = 1.5 * law.static / min(law.stiction_velocity, law.friction_velocity - law.stiction_velocity)
    assert friction_coefficient(law, slip)[1] == pytest.approx(differenced, abs=1e-6 * steepest + 1e-9)


@pytest.mark.parametrize("join", [PAPER.stiction_velocity, PAPER.friction_velocity])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_friction_and_its_derivative_are_continuous_at_switching_points(join, side):
    below, above = (friction_coefficient(PAPER, side * join * (1.0 + s)) for s in (-1e-9, 1e-9))
    assert below == pytest.approx(above, abs=1e-6)


@given(slip=slips)
def test_smooth_ground_has_no_friction(slip):
    assert friction_coefficient(Frictionless(), slip) == (0.0, 0.0)
