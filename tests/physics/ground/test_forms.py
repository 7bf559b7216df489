"""Check that a locked leg moves in the same way in both forms: as one body, and as two bodies held together."""

import numpy as np
import pytest
from system_rates import rate_of

import walkerlab.physics.ground.motion  # noqa: F401, the equations, which are found by the system's type
from walkerlab.physics.ground.compliant import KneeRules, contact_walker
from walkerlab.physics.ground.energy import total_energy
from walkerlab.physics.ground.friction import Coulomb
from walkerlab.physics.ground.normal_force import Impact
from walkerlab.physics.ground.walker import (
    LOCKED,
    RELEASED,
    floating_state,
    locked_knees,
    place_on_ground,
    to_form,
    to_full,
)
from walkerlab.physics.mechanics.parts import Assembly, BallFoot, Body, Revolute
from walkerlab.scene.parts import Arc, Limb, add_torso, kneed_legs

LAW, FRICTION = Impact(4e5, 1.8, 300.0, 1e-3), Coulomb(0.9, 0.7, 0.01, 0.1)
LEGS = kneed_legs(Limb(0.5, 0.8, 0.3, 0.02, 0.01), Limb(0.5, 0.3, 0.2, -0.03, 0.004), 0.7, Arc(0.2, 0.05))
WITH_TORSO = add_torso(LEGS, 0.6, 0.25, 0.02)
BOTH = (True, True)
KNEES = [(LOCKED, RELEASED), (RELEASED, LOCKED), (LOCKED, LOCKED)]


def walker_of(assembly, **rules):
    """Build the walker on compliant ground."""
    return contact_walker(assembly, LAW, FRICTION, 9.81, 0.05, KneeRules(**rules))


def state_in_line(walker, knee):
    """Return a state with both feet in the ground, locked knees straight and a torso on the bisector."""
    whole, n = walker.whole, int(walker.whole.bodies)
    angles = np.array([-0.21, 0.17, -0.33, 0.11, 0.0][:n])
    rates = np.array([-0.6, -1.1, 0.9, -0.4, 0.0][:n])
    for (shank, thigh), doing in zip(whole.knees, knee, strict=True):
        if doing == LOCKED:
            angles[shank], rates[shank] = angles[thigh], rates[thigh]
    for body in np.flatnonzero(np.diagonal(whole.E[0])[:n] == 0.0):
        angles[body], rates[body] = whole.E[0, body, :n] @ angles, whole.E[0, body, :n] @ rates
    return np.array([0.1, 0.6, *angles, 0.4, -0.3, *rates])


@pytest.mark.parametrize("knee", KNEES)
@pytest.mark.parametrize("assembly", [LEGS, WITH_TORSO], ids=["legs", "torso"])
def test_merged_body_accelerates_like_two_locked_bodies(assembly, knee):
    walker = walker_of(assembly)
    y = state_in_line(walker, knee)
    # A walker with stops keeps all bodies, and the shank follows the thigh.
    expected = rate_of(place_on_ground(walker_of(assembly, stop=LAW), BOTH, knee), y)
    one = place_on_ground(walker, BOTH, knee)
    z = to_form(one.form, y)
    assert z.size == y.size - 2 * sum(doing == LOCKED for doing in knee)
    whole = to_full(one.form, rate_of(one, z), y.size)
    np.testing.assert_allclose(whole, expected, rtol=1e-10, atol=1e-9)
    assert np.abs(expected).max() > 10.0  # makes sure that the ground pushes
    assert total_energy(one, z) == pytest.approx(total_energy(place_on_ground(walker, BOTH), y), rel=1e-12)
    np.testing.assert_array_equal(floating_state(one.form, z, y.size), y)


@pytest.mark.parametrize("knee", [(RELEASED, RELEASED), *KNEES])
@pytest.mark.parametrize("assembly", [LEGS, WITH_TORSO], ids=["legs", "torso"])
def test_energies_of_a_pinned_form_equal_those_of_the_floating_form(assembly, knee):
    walker = walker_of(assembly)
    y, n = state_in_line(walker, knee), int(walker.whole.bodies)
    pinned = place_on_ground(walker, BOTH, knee, pinned=True)
    z = to_form(pinned.form, [*y[2 : 2 + n], *y[4 + n :]])
    afloat = floating_state(pinned.form, z, y.size)
    assert total_energy(pinned, z) == pytest.approx(total_energy(place_on_ground(walker, BOTH), afloat), rel=1e-12)


def test_state_of_a_reduced_form_is_part_of_the_full_state():
    walker = walker_of(WITH_TORSO)
    for knee in KNEES:
        form = walker.forms[0, locked_knees(knee)]
        z = np.arange(4.0 + 2 * form.bodies)
        np.testing.assert_array_equal(to_form(form, to_full(form, z, walker.size)), z)


def test_levers_of_merged_bodies_are_summed():
    walker = walker_of(WITH_TORSO)
    whole, straight = walker.whole, walker.forms[0, 3]
    expected = np.zeros(3)
    np.add.at(expected, straight.onto[:5], whole.foot_x[0, :5])
    np.testing.assert_allclose(straight.foot_x[0, :3], expected, rtol=1e-14)


def test_equations_of_a_free_walker_have_no_weight_term():
    assert not hasattr(walker_of(LEGS).whole, "weight")


def test_too_many_bodies_are_rejected():
    names = [f"link {k}" for k in range(9)]
    joints = (Revolute(f"hinge {k}", names[k], (0.0, 0.0), names[k + 1], (0.0, 1.0)) for k in range(8))
    feet = tuple(BallFoot(name, name, (0.0, 0.0), 0.0) for name in (names[0], names[-1]))
    chain = Assembly(tuple(Body(name, 1.0, (0.0, 0.5)) for name in names), tuple(joints), feet=feet)
    with pytest.raises(ValueError, match="at most 8 bodies; this assembly has 9"):
        walker_of(chain)
