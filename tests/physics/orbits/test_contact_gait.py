"""Check the contact gait by long walks, energy and momentum, which Newton's method does not use."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config import loader
from walkerlab.outcome import Outcome
from walkerlab.physics.orbits import contact_gait as search
from walkerlab.physics.orbits.contact_gait import GaitAnswer, solve_gait_on
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.newton import NotConverged
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.scene.contact import ContactScene, contact_gait, contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

# state and step length of the rigid gait at one degree
RIGID_STATE = (-0.2044455, 0.1695390, -0.6057394, -0.8617140)
RIGID_STEP = 0.3718088


def config_at_one_degree(*sets: str):
    """Return the paper's config at one degree with some keys changed."""
    return loader.load(Path("paper"), ["slope_deg=1", *sets], None).config


def answer_of(*sets: str) -> GaitAnswer:
    """Return the result of the search for the contact gait of such a config."""
    return contact_gait(config_at_one_degree(*sets), RIGID_STEP, RIGID_STATE)


@pytest.fixture(scope="module")
def gait():
    """Return the gait on the paper's ground."""
    return answer_of().gait


def test_energy_losses_add_up_to_the_lost_height(gait):
    assert gait.step.dissipated_J.sum() == pytest.approx(gait.step.driven.gravity, rel=1e-7)


def test_long_walk_on_matching_pads_settles_on_the_gait(gait):
    config = config_at_one_degree("contact.pad_pitch=own")
    scene: ContactScene = contact_scene(config, RIGID_STEP, gait.step.length_m)
    walk = scene.walk(start_state(scene, RIGID_STATE), 40, Tolerances("radau5", 1e-8, 1e-10, 10**8))
    assert walk.touch_time_s.size == 40
    assert walk.periods_s[-1] == pytest.approx(gait.step.period_s, abs=1e-7)
    assert walk.lengths_m[-1] == pytest.approx(gait.step.length_m, abs=1e-7)
    assert walk.slip_m[-2] == pytest.approx(gait.step.slip_m, abs=1e-7)


def test_contact_gait_is_stable_with_a_largest_multiplier_of_0_54(gait):
    assert gait.stable
    assert abs(gait.multipliers[0]) == pytest.approx(0.54, abs=0.01)
    # Three disturbances vanish within one step, because the stance foot holds height and angle.
    assert np.all(np.abs(gait.multipliers[3:]) < 1e-6)


def test_gait_that_walking_does_not_reach_is_continued_from_rigid_ground():
    config = loader.load(Path("paper"), ["slope_deg=4"], None).config
    rigid = find_gaits(rigid_walker(config, "corrected"), config.seed).gait
    assert rigid is not None
    answer = contact_gait(config, rigid.step_length, rigid.state)
    assert answer.reason.startswith("followed")
    assert answer.gait.stable
    assert answer.gait.step.period_s == pytest.approx(rigid.period, rel=0.02)


@pytest.mark.parametrize(
    ("sets", "word"),
    [
        (("contact.friction=none",), "friction"),
        (("contact.static_friction=0", "contact.dynamic_friction=0"), "friction"),
        (("contact.static_friction=0.05", "contact.dynamic_friction=0.04"), "start"),
    ],
)
def test_ground_without_a_gait_is_explained(sets, word):
    answer = answer_of(*sets)
    assert answer.gait is None
    assert word in answer.reason
    assert answer.advice


def test_failed_search_states_its_reason(gait, monkeypatch):
    backward = replace(gait, steps=(replace(gait.step, length_m=-0.1),))
    monkeypatch.setattr(search, "gait_near", lambda *_: backward)
    said = solve_gait_on(None, None, 1)
    assert said == "it led to a walk that does not advance, with steps of -0.1 m"
    singular = NotConverged(Outcome.WALKED, singular=True)
    monkeypatch.setattr(search, "gait_near", lambda *_: singular)
    said = answer_of().reason
    assert "its matrix is singular" in said
    assert "rejected" not in said
