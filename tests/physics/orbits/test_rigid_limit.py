"""Tests of the order and limit of series for which both are known, and of the effect of settings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.physics.orbits.contact_gait import scale_laws
from walkerlab.physics.orbits.contact_map import AdaptivePads
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.rigid_limit import (
    ALL_POINT_SERIES,
    ALL_SERIES,
    SERIES_EFFORT,
    STICTION_SERIES,
    ContactFactors,
    Distance,
    apply_setting,
    extrapolate,
    observed_orders,
    series_settings,
    solver_settings,
)
from walkerlab.physics.orbits.step_map import Cycle, gait_near
from walkerlab.scene.contact import contact_scene, gait_off_pads
from walkerlab.scene.rigid import rigid_walker


def distances(periods, ratio):
    """Return the distances of settings from the rigid limit. Each is `ratio` times as rigid as the one before."""
    return [
        Distance(ContactFactors("made up", ratio**i, 1.0, 1.0, 1.0), period, 0.3, 0.0, 0.0, 0.0, 0.0)
        for i, period in enumerate(periods)
    ]


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("ratio", [2.0, 10.0])
def test_order_and_limit_of_a_power_law_are_recovered(order, ratio):
    made = distances([0.7 + 0.01 * ratio ** (-order * i) for i in range(6)], ratio)
    assert observed_orders(made) == pytest.approx(np.full(4, order), rel=1e-4)
    limit = extrapolate(made)
    assert limit is not None
    assert limit.period == pytest.approx(0.7, abs=1e-9)
    assert limit.uncertainty < 1e-9


def test_series_that_does_not_converge_has_no_limit():
    assert extrapolate(distances([0.7, 0.71, 0.73, 0.77], 2.0)) is None
    assert extrapolate(distances([0.7, 0.71], 2.0)) is None


def test_changes_below_the_numerical_error_do_not_spoil_the_limit():
    made = distances([0.7 + 0.01 * 2.0**-i for i in range(6)], 2.0)
    last = made[-1]
    rounded = [replace(last, period_s=last.period_s + noise, numerical_period_s=1e-6) for noise in (3e-7, -5e-7)]
    assert extrapolate([*made, *rounded]) == extrapolate(made)


@pytest.mark.parametrize("name", [ALL_SERIES, STICTION_SERIES])
def test_first_setting_of_a_stiffness_series_leaves_the_walker_unchanged(name):
    walker = contact_scene(load().config, 0.37).walker
    assert scale_laws(walker, *series_settings(name)[0][2:]) == walker


def test_full_damping_penetration_scales_with_static_penetration():
    walker = contact_scene(load().config, 0.37).walker
    changed = scale_laws(walker, *series_settings(ALL_SERIES)[4][2:])
    before, after = walker.normal, changed.normal
    static = [(196.2 / law.stiffness) ** (1.0 / law.exponent) for law in (before, after)]
    ratio = after.full_damping_penetration / before.full_damping_penetration
    assert ratio == pytest.approx(static[1] / static[0])


def test_gait_with_push_off_converges_to_the_rigid_one_in_first_order():
    """The pulse must shorten as the ground stiffens. With a pulse of constant duration there is no gait nearby."""
    config = load(Path("level"), ["contact.terrain=after-mid-swing", "walker.foot_radius_m=1e-6"]).config
    rigid = find_gaits(rigid_walker(config, config.equations)).gait
    scene, found = contact_scene(config, rigid.step_length), gait_off_pads(config, rigid.step_length, rigid.state)

    def off(walker, gait):
        pads = AdaptivePads(lambda _: walker, scene.ground, solver_settings(1e-10), rigid.step_length)
        near = gait_near(pads, gait.z, 0.0, SERIES_EFFORT)
        return near, abs(near.step.period_s - rigid.period) if isinstance(near, Cycle) else np.inf

    gait, distances = found.gait, []
    for setting in series_settings(ALL_POINT_SERIES)[1:5]:
        gait, distance = off(apply_setting(scene.walker, setting), gait)
        distances.append(distance)
    orders = np.log(np.divide(distances[:-1], distances[1:])) / np.log(np.sqrt(10.0))
    assert orders == pytest.approx(1.0, abs=0.06)
    assert distances[-1] < 2e-4
    assert not isinstance(off(scale_laws(scene.walker, *series_settings(ALL_POINT_SERIES)[4][2:]), gait)[0], Cycle)


def test_push_off_is_shortened_only_in_the_series_to_the_rigid_limit():
    walker = contact_scene(load(Path("level")).config, 0.4).walker
    for name, shortened in ((ALL_SERIES, True), (STICTION_SERIES, False)):
        durations = [apply_setting(walker, one).whole.push_off_duration for one in series_settings(name)]
        assert durations[0] == 0.005
        assert (np.diff(durations) < 0.0).all() == shortened
