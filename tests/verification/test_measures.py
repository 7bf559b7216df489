"""The measures themselves notice what is wrong."""

import math

import numpy as np
import pytest

from walkerlab.hybrid.recorded_walk import as_state, take_walk
from walkerlab.orbits.fixed_point import find_gaits
from walkerlab.paper.appendix_a import impact
from walkerlab.scene.rigid import compass, rigid_scene, rigid_walker
from walkerlab.verification.catalogue import config_of, shipped
from walkerlab.verification.rigid_case import Prepared, energy_won, kinetic, momentum_change
from walkerlab.verification.scaling import Scale, scaled, to_twin
from walkerlab.verification.verdict import Finding, finite

PAPER = config_of(next(case for case in shipped() if case.name == "paper"))
WALKER = rigid_walker(PAPER, "corrected")
COMPASS = compass(PAPER, "corrected")


@pytest.fixture(scope="module")
def walk():
    return take_walk(WALKER, rigid_scene(PAPER).method, as_state(find_gaits(WALKER).gait.state), 4)


def test_a_heel_strike_keeps_momentum(walk):
    assert momentum_change(COMPASS, walk.before, walk.after) < 1e-14


@pytest.mark.parametrize("index", [2, 3])
def test_a_heel_strike_that_is_a_little_wrong_does_not(walk, index):
    wrong = walk.after.copy()
    wrong[:, index] *= 1.0 + 1e-6
    assert momentum_change(COMPASS, walk.before, wrong) > 1e-8


def test_momentum_with_leg_inertia_is_kept_too():
    heavy = COMPASS._replace(leg_inertia=0.7)
    before = np.array([[0.21, -0.245, -0.4, -1.1]])
    after = np.array([impact(heavy, *before[0])])
    assert momentum_change(heavy, before, after) < 1e-14


def test_energy_won_at_a_heel_strike_is_seen(walk):
    ready = Prepared(WALKER, COMPASS, walk.start, 200.0)
    assert energy_won(ready, walk.before, walk.after) == 0.0
    assert energy_won(ready, walk.after, walk.before[:, [1, 0, 3, 2]]) > 0.0
    assert kinetic(COMPASS, walk.after[0]) < kinetic(COMPASS, walk.before[0])


def test_what_is_no_number_fails():
    assert not Finding("x", math.nan, 1.0).ok
    assert not Finding("x", finite(math.inf), 1.0).ok
    assert Finding("x", 0.0, 0.0).ok


def test_a_twin_there_and_back_is_the_walker():
    by = to_twin(PAPER)
    back = Scale(1.0 / by.length, 1.0 / by.mass, 1.0 / by.gravity)
    again = scaled(scaled(PAPER, by), back)
    assert again.walker.leg_length_m == pytest.approx(PAPER.walker.leg_length_m)
    assert again.gravity_m_s2 == pytest.approx(PAPER.gravity_m_s2)
    one, other = again.contact.in_si(), PAPER.contact.in_si()
    assert vars(one) == pytest.approx(vars(other))
