"""Tests of the IMPACT law and of STEP, the function by which its damping sets in."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from walkerlab.physics.ground.normal_force import Impact, elastic_energy, normal_force, smooth_step

laws = st.builds(
    Impact,
    stiffness=st.floats(1e2, 1e12),
    exponent=st.floats(1.0, 3.0),
    damping=st.floats(0.0, 1e6),
    full_damping_penetration=st.floats(1e-6, 1e-2),
)
depths = st.floats(1e-9, 1e-1)
rates = st.floats(-10.0, 10.0)


@given(x0=st.floats(-5.0, 5.0), width=st.floats(1e-3, 10.0), h0=st.floats(-5.0, 5.0), h1=st.floats(-5.0, 5.0))
def test_step_function_is_flat_outside_and_smooth_at_its_ends(x0, width, h0, h1):
    def at(fraction):
        return smooth_step(x0 + fraction * width, x0, h0, x0 + width, h1)

    assert at(-0.5) == (h0, 0.0)
    assert at(1.5) == (h1, 0.0)
    rise = abs(h1 - h0)
    for join, height in ((0.0, h0), (1.0, h1)):
        value, slope = at(join)
        assert value == pytest.approx(height, abs=1e-9)
        assert abs(slope) * width <= 1e-9 * (1.0 + rise)
    value, slope = at(0.5)
    assert value == pytest.approx(0.5 * (h0 + h1), abs=1e-9)
    assert slope == pytest.approx(1.5 * (h1 - h0) / width, abs=1e-9 * (1.0 + rise) / width)


def test_step_function_is_the_cubic_with_the_given_end_values_and_flat_ends():
    """Two values and two flat ends are four conditions, which only one cubic meets."""
    x0, h0, x1, h1 = 0.3, -1.0, 1.1, 4.0
    conditions = [[x**3, x**2, x, 1.0] for x in (x0, x1)] + [[3 * x**2, 2 * x, 1.0, 0.0] for x in (x0, x1)]
    cubic = np.linalg.solve(conditions, [h0, h1, 0.0, 0.0])
    for x in np.linspace(x0, x1, 17):
        value, slope = smooth_step(x, x0, h0, x1, h1)
        assert value == pytest.approx(np.polyval(cubic, x), abs=1e-12)
        assert slope == pytest.approx(np.polyval(np.polyder(cubic), x), abs=1e-11)


@given(law=laws, depth=depths, rate=rates)
def test_normal_force_is_never_adhesive(law, depth, rate):
    assert normal_force(law, depth, rate).force >= 0.0


@given(law=laws, depth=depths, rate=rates)
def test_damping_only_dissipates_energy(law, depth, rate):
    """The power (F - k d^e) d' is never negative, even where the clip at zero cuts the damping short."""
    normal = normal_force(law, depth, rate)
    assert (normal.force - normal.spring) * rate >= -1e-12 * normal.spring * abs(rate)


@given(law=laws, depth=depths, rate=rates)
def test_without_damping_the_ground_is_a_spring(law, depth, rate):
    spring = law.stiffness * depth**law.exponent
    normal = normal_force(law._replace(damping=0.0), depth, rate)
    assert normal.force == pytest.approx(spring)
    assert normal.by_rate == 0.0
    assert normal_force(law, depth, 0.0).force == pytest.approx(spring)


def test_elastic_energy_is_the_work_of_the_spring():
    law = Impact(3e8, 2.2, 0.0, 1e-4)
    depth = np.linspace(0.0, 2e-3, 20001)
    force = np.array([0.0, *(normal_force(law, d, 0.0).force for d in depth[1:])])
    work = trapezoid(force, depth)
    assert elastic_energy(law, 2e-3) == pytest.approx(work, rel=1e-7)
    assert elastic_energy(law, -1e-3) == 0.0


@given(law=laws, fraction=st.floats(0.01, 3.0), rate=rates)
def test_derivatives_of_the_normal_force_equal_finite_differences(law, fraction, rate):
    depth = fraction * law.full_damping_penetration
    normal = normal_force(law, depth, rate)
    h = 1e-5 * depth
    pulled = [normal_force(law, depth + step, rate).force == 0.0 for step in (-h, h)]
    assume(not any(pulled) and abs(fraction - 1.0) > 1e-3)  # no switching point of the law between the two points
    by_depth = (normal_force(law, depth + h, rate).force - normal_force(law, depth - h, rate).force) / (2 * h)
    size = (normal.spring + law.damping * abs(rate)) / depth
    assert normal.by_penetration == pytest.approx(by_depth, rel=1e-6, abs=1e-7 * size)
    c = law.damping * min(fraction, 1.0) ** 2 * (3.0 - 2.0 * min(fraction, 1.0))
    assert normal.by_rate == pytest.approx(c, rel=1e-9)
    assert normal.force == pytest.approx(normal.spring + c * rate, rel=1e-9, abs=1e-12 * size * depth)


@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.3])
def test_normal_force_and_its_derivative_are_continuous_at_full_damping(rate):
    law = Impact(4e11, 2.2, 9e4, 1e-4)
    below, above = (normal_force(law, law.full_damping_penetration * (1.0 + s), rate) for s in (-1e-9, 1e-9))
    for one, other in zip(below, above, strict=True):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("rate", [-1.0, 1.0])
def test_force_starts_at_zero_at_first_touch(rate):
    """At zero penetration there is neither elastic force nor damping, so the force does not jump at a touch of any
    speed.
    """
    law = Impact(4e11, 2.2, 9e4, 1e-4)
    forces = [normal_force(law, d, rate).force for d in (1e-7, 1e-8, 1e-9)]
    assert forces == sorted(forces, reverse=True)
    assert forces[-1] < 1e-4 * law.damping * abs(rate)


def test_normal_force_is_the_same_in_adams_and_si_units():
    """Compare the law in N/mm^e and mm with the law in N/m^e and m."""
    k, e, c, d_max = 1e5, 2.2, 90.0, 0.1
    law = Impact(k * 1000.0**e, e, c * 1000.0, d_max / 1000.0)
    depth_mm, rate_mm_s = 0.06, 12.0
    s = depth_mm / d_max
    by_hand = k * depth_mm**e + c * s * s * (3 - 2 * s) * rate_mm_s
    assert normal_force(law, depth_mm / 1000.0, rate_mm_s / 1000.0).force == pytest.approx(by_hand, rel=1e-12)
    assert math.isfinite(by_hand)
