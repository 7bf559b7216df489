"""Orders and limits of series that are known exactly, and what a setting changes."""

from dataclasses import replace

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.orbits.contact_gait import with_scaled_laws
from walkerlab.orbits.rigid_limit import (
    ALL,
    STICTION,
    ContactFactors,
    Distance,
    extrapolated,
    observed_orders,
    series_of,
)
from walkerlab.scene.contact import contact_scene


def distances(periods, ratio):
    """Settings each `ratio` times as rigid as the one before."""
    return [
        Distance(ContactFactors("made up", ratio**i, 1.0, 1.0, 1.0), period, 0.3, 0.0, 0.0, 0.0, 0.0)
        for i, period in enumerate(periods)
    ]


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("ratio", [2.0, 10.0])
def test_the_order_and_the_limit_of_a_power_law_are_found(order, ratio):
    made = distances([0.7 + 0.01 * ratio ** (-order * i) for i in range(6)], ratio)
    assert observed_orders(made) == pytest.approx(np.full(4, order), rel=1e-4)
    limit = extrapolated(made)
    assert limit is not None
    assert limit.period == pytest.approx(0.7, abs=1e-9)
    assert limit.uncertainty < 1e-9


def test_a_series_that_does_not_converge_has_no_limit():
    assert extrapolated(distances([0.7, 0.71, 0.73, 0.77], 2.0)) is None
    assert extrapolated(distances([0.7, 0.71], 2.0)) is None


def test_changes_below_the_numerical_error_do_not_spoil_the_limit():
    made = distances([0.7 + 0.01 * 2.0**-i for i in range(6)], 2.0)
    rounded = [replace(made[-1], period=made[-1].period + noise, numerical_period=1e-6) for noise in (3e-7, -5e-7)]
    assert extrapolated([*made, *rounded]) == extrapolated(made)


@pytest.mark.parametrize("name", [ALL, STICTION])
def test_a_series_begins_at_the_configs_own_contact(name):
    walker = contact_scene(load().config, 0.37).walker
    assert with_scaled_laws(walker, *series_of(name)[0][2:]) == walker


def test_full_damping_stays_where_the_static_penetration_is():
    walker = contact_scene(load().config, 0.37).walker
    changed = with_scaled_laws(walker, *series_of(ALL)[4][2:])
    before, after = walker.normal, changed.normal
    static = [(196.2 / law.stiffness) ** (1.0 / law.exponent) for law in (before, after)]
    ratio = after.full_damping_penetration / before.full_damping_penetration
    assert ratio == pytest.approx(static[1] / static[0])
