"""Tests of hinge laws derived from SpringDamper, on a cubic spring with quadratic damping that is not compiled."""

import numba
import numpy as np
import pytest
from compass_parts import CompassParts, compass_assembly
from rigid_physics import rates, total_energy
from scipy.integrate import solve_ivp

from walkerlab.physics.compiler import classes_in
from walkerlab.physics.hybrid.rigid_lanes import two_legs
from walkerlab.physics.mechanics.hinges import HIP_ROW, HingeTorque, SpringDamper, hinge_energy, hinge_law, hinge_torque
from walkerlab.physics.mechanics.rigid import rigid_on_level_ground
from walkerlab.physics.mechanics.rigid_model import STRAIGHT, models_in_turn
from walkerlab.physics.orbits.similarity import unit_walker

STATE = np.array([-0.3, 0.2, -0.8, -1.1])
PARTS = compass_assembly(CompassParts(0.8, 0.35, 2.0, 5.0, 0.02, 0.01))


class Cubic(SpringDamper):
    """Hinge law with the torque -k a^3 - c a' |a'|."""

    @classmethod
    def units(cls, energy, time):
        return cls(energy, energy * time**2, energy)


@hinge_torque.case(Cubic)
def cubic_torque(law, angle, rate):
    elastic = law.stiffness * angle**3
    damping = law.damping * abs(rate)
    return HingeTorque(elastic + damping * rate - law.torque, elastic, 3.0 * law.stiffness * angle**2, 2.0 * damping)


@hinge_energy.case(Cubic)
def cubic_energy(law, angle):
    return 0.25 * law.stiffness * angle**4


def walker(stiffness=20.0, damping=0.0, torque=0.0, law=Cubic):
    return rigid_on_level_ground(PARTS, 9.81, True, law).changed(hip=(stiffness, damping, torque))


def test_model_names_its_hinge_law_and_keeps_it_in_copies():
    for model in (walker(), walker().changed(slope=0.1), models_in_turn(walker())[0]):
        assert hinge_law(model, HIP_ROW) == Cubic(20.0, 0.0, 0.0)
        assert isinstance(hinge_law(model, HIP_ROW), Cubic)
    assert type(hinge_law(walker(law=SpringDamper), HIP_ROW)) is SpringDamper


def test_identity_of_a_kernel_contains_the_hinge_law_of_its_models():
    assert Cubic in [*classes_in(numba.typeof(walker()))]
    assert Cubic in [*classes_in((numba.typeof(models_in_turn(walker())),))]
    assert Cubic not in [*classes_in(numba.typeof(walker(law=SpringDamper)))]


def test_energy_is_constant_in_a_swing_with_a_cubic_spring():
    model = walker()
    swing = solve_ivp(lambda _, y: (*y[2:], *rates(model, STRAIGHT, y)), (0.0, 0.4), STATE, rtol=1e-10, atol=1e-12)
    start, end = (total_energy(model, y) for y in (STATE, swing.y[:, -1]))
    assert end == pytest.approx(start, rel=1e-9)
    without = total_energy(walker(stiffness=0.0), STATE)
    assert start - without == pytest.approx(0.25 * 20.0 * (STATE[0] - STATE[1]) ** 4)


def test_similar_walker_of_unit_size_has_similar_torques():
    model = walker(20.0, 0.5, 0.3)
    unit, units = unit_walker(model)
    scaled = np.append(STATE[:2], STATE[2:] * units.time)
    accelerations = np.array(rates(model, STRAIGHT, STATE))
    assert rates(unit, STRAIGHT, scaled) == pytest.approx(accelerations * units.time**2, rel=1e-12)


def test_only_linear_hip_laws_are_simulated_in_lanes():
    assert two_legs(walker()) is None
    assert two_legs(walker(law=SpringDamper)) is not None
