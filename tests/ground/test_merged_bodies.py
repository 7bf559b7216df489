"""A walker whose locked thigh and shank are one body moves as the one that holds them together."""

import numpy as np
import pytest

from walkerlab.ground.compliant import KneeRules, contact_walker
from walkerlab.ground.energy import total_energy
from walkerlab.ground.friction import Coulomb
from walkerlab.ground.held import NoneBends, NoneHeld, OneBends
from walkerlab.ground.merged import ByKnees, Unmerged, as_fewer, merged_levers, merged_state, place_of, store_whole
from walkerlab.ground.motion import OnGround
from walkerlab.ground.normal_force import NormalLaw
from walkerlab.mechanics.walkers import Arc, Limb, kneed_legs, with_torso
from walkerlab.solvers.in_tuples import derivative

LAW, FRICTION = NormalLaw(4e5, 1.8, 300.0, 1e-3), Coulomb(0.9, 0.7, 0.01, 0.1)
LEGS = kneed_legs(Limb(0.5, 0.8, 0.3, 0.02, 0.01), Limb(0.5, 0.3, 0.2, -0.03, 0.004), 0.7, Arc(0.2, 0.05))
WITH_TORSO = with_torso(LEGS, 0.6, 0.25, 0.02)
BOTH = (True, True)


def walker_of(assembly, **rules):
    """The walker on compliant ground."""
    return contact_walker(assembly, LAW, FRICTION, 9.81, 0.05, KneeRules(**rules))


def state_in_line(walker, locked):
    """A state with both feet in the ground and these knees straight, and which bodies are held in it."""
    n = len(walker.tree.arm_x)
    angles = np.array([-0.21, 0.17, -0.33, 0.11, 0.0][:n])
    rates = np.array([-0.6, -1.1, 0.9, -0.4, 0.0][:n])
    held = np.zeros(n, bool)
    for knee in locked:
        shank, thigh = walker.knees.shanks[knee], walker.knees.thighs[knee]
        angles[shank], rates[shank], held[shank] = angles[thigh], rates[thigh], True
    for body in np.flatnonzero(walker.held.always):
        weights = np.array(walker.held.weights).reshape(n, n)[body]
        angles[body], rates[body], held[body] = weights @ angles, weights @ rates, True
    return (0.1, 0.6, *angles.tolist(), 0.4, -0.3, *rates.tolist()), tuple(held.tolist())


@pytest.mark.parametrize("locked", [(0,), (1,), (0, 1)])
@pytest.mark.parametrize("assembly", [LEGS, WITH_TORSO], ids=["legs", "torso"])
def test_one_body_accelerates_as_the_two_that_are_held_together(assembly, locked):
    walker = walker_of(assembly)
    y, held = state_in_line(walker, locked)
    expected = derivative(OnGround(walker, BOTH, held, (False, False)), 0.0, y)
    fewer = walker.merging.both if len(locked) == 2 else walker.merging.one[locked[0]]
    knees = NoneBends(False) if len(locked) == 2 else OneBends(fewer.thighs, fewer.shanks, False)
    small = as_fewer(walker, fewer, fewer.held, knees)
    z = merged_state(fewer.onto, np.array(y), small.blank)
    always = () if isinstance(fewer.held, NoneHeld) else fewer.held.always
    rate = derivative(OnGround(small, BOTH, always, ()), 0.0, z)
    whole = np.zeros(len(y))
    store_whole(small.merging, rate, whole)
    np.testing.assert_allclose(whole, expected, rtol=1e-10, atol=1e-9)
    assert np.abs(expected).max() > 10.0  # the ground pushes
    assert total_energy(small, BOTH, z) == pytest.approx(total_energy(walker, BOTH, y), rel=1e-12)
    store_whole(small.merging, z, whole)
    np.testing.assert_array_equal(whole, y)


def test_numbers_of_merged_bodies_are_found_where_they_stand():
    walker = walker_of(WITH_TORSO)
    for fewer in (*walker.merging.one, walker.merging.both):
        size = len(fewer.blank)
        places = [place_of(fewer.onto, i, size) for i in range(len(walker.blank))]
        assert sorted(set(places)) == list(range(size))
    onto = walker.merging.both.onto
    levers = tuple(float(x) for x in range(1, len(onto) + 1))
    summed = merged_levers(onto, levers, (9.0,) * 3)
    assert summed == (1.0 + 3.0, 2.0 + 4.0, 5.0)


def test_a_walker_keeps_its_bodies_where_a_stop_keeps_its_angle():
    assert isinstance(walker_of(LEGS).merging, ByKnees)
    assert isinstance(walker_of(LEGS, stop=LAW).merging, Unmerged)
