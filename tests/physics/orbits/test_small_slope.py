"""Compare the small-slope theory with published numbers and with gaits on small slopes."""

import numpy as np
import pytest

from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, assembled
from walkerlab.physics.orbits.fixed_point import find_gaits as find_gaits_of_model
from walkerlab.physics.orbits.small_slope import LONG_PERIOD, SHORT_PERIOD, symmetric_half_period
from walkerlab.physics.orbits.small_slope import linear_modes as linear_modes_of_model
from walkerlab.physics.orbits.small_slope import seeds as seeds_of_model


def find_gaits(walker, *rest, **options):
    return find_gaits_of_model(assembled(walker), *rest, **options)


def seeds(walker, *rest, **options):
    return seeds_of_model(assembled(walker), *rest, **options)


def linear_modes(walker, *rest, **options):
    return linear_modes_of_model(assembled(walker), *rest, **options)


PAPER = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, 0.0174, CORRECTED)
# almost all mass at the hip, the rest in the feet
SIMPLEST = RigidWalker(1.0, 1e-9, 1e-9, 10.0, 0.0, 1.0, 0.0, CORRECTED)


def test_simplest_walker_has_the_published_long_period_gait():
    # Garcia et al. 1998: stance angle 0.970956 gamma^(1/3), period 3.812092
    long, _ = seeds(SIMPLEST)
    assert long.period == pytest.approx(3.812092, abs=1e-6)
    assert (long.z[0] + long.slope) / np.cbrt(long.slope) == pytest.approx(0.970956, abs=1e-6)


def test_simplest_walker_has_the_published_short_period():
    # Garcia et al. 1998: half the period of the swing leg, pi
    _, short = seeds(SIMPLEST)
    assert short.period == pytest.approx(np.pi, abs=1e-6)


def test_half_of_the_long_period_of_massless_legs_solves_tan_h_equals_minus_3_tanh_h():
    # A swing leg without mass is a driven pendulum, for which tan h = -3 tanh h.
    half = symmetric_half_period(linear_modes(SIMPLEST))
    assert np.tan(half) == pytest.approx(-3.0 * np.tanh(half), rel=1e-6)


@pytest.mark.parametrize("sign", [CORRECTED, AS_PRINTED])
@pytest.mark.parametrize(("name", "power"), [(LONG_PERIOD, 1 / 3), (SHORT_PERIOD, 1.0)])
def test_gaits_at_small_slopes_scale_as_in_theory(name, power, sign):
    walker = PAPER._replace(c21_sign=sign)
    seed = next(seed for seed in seeds(walker) if seed.name == name)
    errors = []
    for slope in (1e-6, 1e-7):
        gait = next(gait for gait in find_gaits(walker._replace(slope=slope)).gaits if name in gait.found_by)
        from_normal = np.array([1.0, 0.0, 0.0])
        predicted = (seed.z + seed.slope * from_normal) * (slope / seed.slope) ** power
        found = gait.state[1:] + slope * from_normal
        errors.append(np.abs(found / predicted - 1.0).max())
        assert gait.period == pytest.approx(seed.period, rel=1e-3)
    assert errors[0] < 2e-3
    # The next terms of the expansion are smaller by two powers of the angles.
    assert errors[1] < 0.3 * errors[0]


def test_seed_does_not_depend_on_the_slope_of_the_walker():
    flat, steep = seeds(PAPER._replace(slope=0.0)), seeds(PAPER._replace(slope=0.3))
    assert [(seed.slope, *seed.z) for seed in flat] == [(seed.slope, *seed.z) for seed in steep]
