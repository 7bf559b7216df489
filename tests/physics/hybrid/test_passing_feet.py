"""Check which foot the ground carries after the feet pass each other in the air, in the ground, or on its surface."""

import numpy as np
import pytest
from contact_walks import scene_of

from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import place_on_ground
from walkerlab.physics.hybrid.contact_state import HEIGHT, PASSING, PER_FOOT, new_walk_state
from walkerlab.physics.hybrid.contact_transitions import apply_event
from walkerlab.physics.hybrid.endings import GOES_ON
from walkerlab.scene.contact import start_state

SWING_FOOT = 1 - STANCE_FOOT
FORWARD, BACK = True, False
AIR, GROUND, SURFACE = 0.01, -1e-5, 1e-12  # m, heights of both feet


class Feet:
    """Upright legs side by side at one height. They move up or down with the whole walker."""

    def __init__(self, terrain, height, rising=True, in_air=None):
        self.scene = scene_of(f"contact.terrain={terrain}")
        self.y = np.array(start_state(self.scene, (0.0, 0.0, 0.0, 0.0)))
        self.y[1] += height
        self.y[5] += 0.1 if rising else -0.1
        self.known = new_walk_state(self.scene.walker, self.scene.ground, STANCE_FOOT, 1, tuple(self.y))
        self.known.sides[[HEIGHT, PER_FOOT + HEIGHT]] = 1 if (height > 0.0 if in_air is None else in_air) else -1

    def event(self, event):
        system = place_on_ground(self.scene.walker, self.known.has_ground)
        assert apply_event(system, None, self.known, event, 0.0, tuple(self.y)) == GOES_ON
        return self

    def passing(self, forward, carried):
        """Let the swing foot, carried by the ground or not, move ahead of the stance foot or fall behind it."""
        self.known.has_ground[SWING_FOOT] = carried
        stance_foot_ahead = 1 if STANCE_FOOT == 1 else -1
        self.known.sides[PASSING] = stance_foot_ahead if forward else -stance_foot_ahead
        return self.event(PASSING)

    def lifting(self):
        return self.event(SWING_FOOT * PER_FOOT + HEIGHT)

    @property
    def carried(self):
        assert self.known.has_ground[STANCE_FOOT] == 1  # This holds however the feet pass, even in the air.
        return bool(self.known.has_ground[SWING_FOOT])


@pytest.mark.parametrize("carried", [False, True])
def test_foot_that_passes_in_the_air_has_ground_afterwards_only_if_it_is_ahead(carried):
    assert Feet("after-mid-swing", AIR).passing(FORWARD, carried).carried
    assert not Feet("after-mid-swing", AIR).passing(BACK, carried).carried


@pytest.mark.parametrize("forward", [FORWARD, BACK])
@pytest.mark.parametrize("carried", [False, True])
def test_foot_that_passes_below_the_surface_changes_support_only_when_it_lifts(forward, carried):
    feet = Feet("after-mid-swing", GROUND).passing(forward, carried)
    assert feet.carried == carried
    assert feet.lifting().carried == forward


@pytest.mark.parametrize("taken_for_above", [False, True])
@pytest.mark.parametrize("height", [-SURFACE, 0.0, SURFACE])
@pytest.mark.parametrize("carried", [False, True])
def test_rising_foot_on_the_surface_counts_as_above_it(carried, height, taken_for_above):
    for forward in (FORWARD, BACK):
        rising = Feet("after-mid-swing", height, rising=True, in_air=taken_for_above)
        assert rising.passing(forward, carried).carried == forward
        sinking = Feet("after-mid-swing", height, rising=False, in_air=taken_for_above)
        assert sinking.passing(forward, carried).carried == carried


@pytest.mark.parametrize("height", [AIR, SURFACE, GROUND])
@pytest.mark.parametrize("forward", [FORWARD, BACK])
def test_passing_does_not_change_the_support_on_pads_and_ordinary_ground(forward, height):
    for carried in (False, True):
        assert Feet("checkerboard", height).passing(forward, carried).carried == carried
    assert Feet("plane", height).passing(forward, carried=True).carried
