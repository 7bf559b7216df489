"""Check that the measures detect errors."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.drives import Hip
from walkerlab.config.loader import load
from walkerlab.evidence.paper.appendix_a import compass, impact
from walkerlab.evidence.verification.catalogue import config_of, package_cases, scale_config, to_twin
from walkerlab.evidence.verification.judge import time_difference
from walkerlab.evidence.verification.starts import (
    RigidMasses,
    energy_gain,
    feet_off_the_slope,
    prepare_start,
)
from walkerlab.evidence.verification.verdict import Measure, finite
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.mechanics.hinges import HINGE_LAWS, HingeTorque, SpringDamper, hinge_energy, hinge_torque
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.orbits.rigid_map import EXACT_STEPS
from walkerlab.physics.orbits.similarity import Units, unit_walker
from walkerlab.scene.parts import assembly_of
from walkerlab.scene.rigid import rigid_walker

CASE = next(case for case in package_cases() if case.name == "paper").model_copy(update={"model": "rigid"})
PAPER = config_of(CASE)
COMPASS = compass(PAPER, "corrected")
MASSES = RigidMasses(assembly_of(PAPER.walker, rigid=True), PAPER.slope_rad)


@pytest.fixture(scope="module")
def judged_walk():
    start = prepare_start(PAPER, CASE)
    return start.walk(CASE, start.tolerances(CASE))


@pytest.fixture(scope="module")
def walk(judged_walk):
    return judged_walk.record


def test_heel_strike_conserves_angular_momentum(walk):
    assert MASSES.momentum_change(MASSES.poses(walk.before), MASSES.poses(walk.after)) < 1e-14


@pytest.mark.parametrize("index", [2, 3])
def test_slightly_wrong_heel_strike_does_not_conserve_momentum(walk, index):
    wrong = walk.after.copy()
    wrong[:, index] *= 1.0 + 1e-6
    assert MASSES.momentum_change(MASSES.poses(walk.before), MASSES.poses(wrong)) > 1e-8


def test_walks_without_a_heel_strike_do_not_count_as_equal(judged_walk):
    none = replace(judged_walk, touches=np.zeros(0))
    assert time_difference("a walk", none, judged_walk, CASE, 1e-9) == []
    (found,) = time_difference("itself", judged_walk, judged_walk, CASE, 1e-9)
    assert found.value == 0.0


def test_momentum_is_conserved_with_leg_inertia():
    heavy = COMPASS._replace(leg_inertia=0.7)
    before = np.array([[0.21, -0.245, -0.4, -1.1]])
    after = np.array([impact(heavy, *before[0])])
    walker = PAPER.walker.model_copy(update={"leg_inertia_kg_m2": 0.7})
    masses = RigidMasses(assembly_of(walker, rigid=True), PAPER.slope_rad)
    assert masses.momentum_change(masses.poses(before), masses.poses(after)) < 1e-14


def test_energy_gained_at_a_heel_strike_is_detected(walk):
    before, after = MASSES.poses(walk.before), MASSES.poses(walk.after)
    assert energy_gain(before, after) == 0.0
    assert energy_gain(after, MASSES.poses(walk.before[:, [1, 0, 3, 2]])) > 0.0
    assert after[0].kinetic < before[0].kinetic


def test_measure_that_is_nan_or_infinite_fails():
    assert not Measure("x", math.nan, 1.0).ok
    assert not Measure("x", finite(math.inf), 1.0).ok
    assert Measure("x", 0.0, 0.0).ok


def test_scaling_a_walker_to_another_size_and_back_restores_it():
    by = to_twin(PAPER)
    back = Units(1.0 / by.length, 1.0 / by.mass, 1.0 / by.time)
    again = scale_config(scale_config(PAPER, by), back)
    assert again.walker.leg_length_m == pytest.approx(PAPER.walker.leg_length_m)
    assert again.gravity_m_s2 == pytest.approx(PAPER.gravity_m_s2)
    one, other = again.contact.to_si(), PAPER.contact.to_si()
    assert vars(one) == pytest.approx(vars(other))


class QuadraticDamper(SpringDamper):
    """A hinge law whose damping has a unit of its own: N m s^2/rad^2."""

    @classmethod
    def units(cls, energy, time):
        return cls(energy, energy * time**2, energy)


@hinge_torque.case(QuadraticDamper)
def quadratic_torque(law, angle, rate):
    elastic, damping = law.stiffness * angle, law.damping * abs(rate)
    return HingeTorque(elastic + damping * rate - law.torque, elastic, law.stiffness, 2.0 * damping)


@hinge_energy.case(QuadraticDamper)
def quadratic_energy(law, angle):
    return 0.5 * law.stiffness * angle * angle


def test_twin_of_a_walker_scales_hinge_parameters_by_the_units_of_their_law(monkeypatch):
    monkeypatch.setitem(HINGE_LAWS.laws, "quadratic", QuadraticDamper)
    legs = "walker.leg_2={knee: {damping_N_m_s_per_rad: 0.03}}"
    config = load(Path("kneed"), ["walker.hip.spring_N_m_per_rad=0.2", "walker.knee.damping_N_m_s_per_rad=0.02", legs])
    walker = config.config.walker
    law = {"hip": walker.hip.model_copy(update={"hinge_law": "quadratic"})}
    config = config.config.model_copy(update={"walker": walker.model_copy(update=law)})
    by = to_twin(config)
    twin = scale_config(config, by)
    assert twin.walker.knee.stop_damping == pytest.approx(walker.knee.stop_damping * by.energy * by.time)
    own, twins = (unit_walker(rigid_walker(each))[0] for each in (config, twin))
    assert np.count_nonzero(own["laws"]) == 2
    np.testing.assert_allclose(twins["laws"], own["laws"], rtol=1e-12)
    np.testing.assert_allclose(twins.exchanged["laws"], own.exchanged["laws"], rtol=1e-12)


@pytest.mark.parametrize("name", ["paper", "round-feet", "kneed", "torso"])
def test_driven_walker_and_its_scaled_copy_are_equal_in_dimensionless_units(name):
    hip = (f"walker.hip.{number}=0.01" for number in Hip.model_fields if number != "hinge_law")
    sets = (*hip, "push_off.impulse_N_s=0.1")
    config = load(Path(name), sets).config
    own, twins = (
        unit_walker(rigid_walker(each, "corrected"))[0] for each in (config, scale_config(config, to_twin(config)))
    )
    for field in own.dtype.names:
        np.testing.assert_allclose(twins[field], own[field], rtol=1e-12, atol=1e-15, err_msg=field)


@pytest.mark.parametrize(("name", "changes"), [
    ("round-feet", ("walker.leg_2={leg_length_m: 0.4005, foot_radius_m: 0.11, foot_centre_ahead_m: 0.002}",)),
    ("paper", ("push_off={impulse_N_s: 0.2, leg_2: {impulse_N_s: 0.4}}", "walker.leg_2={leg_mass_kg: 5.2}")),
    ("one-knee", ()),
])  # fmt: skip
def test_momentum_is_conserved_when_either_of_two_different_legs_lands(name, changes):
    config = load(Path(name), changes).config
    walker = rigid_walker(config)
    walk = take_walk(walker, EXACT_STEPS, find_gaits(walker).gait.state, 4)
    masses = RigidMasses(assembly_of(config.walker, rigid=True), config.slope_rad)
    before, after = masses.poses(walk.before), masses.poses(walk.after, first=1)
    pushes = float(walker.push_off), float(walker.exchanged.push_off)
    assert masses.momentum_change(before, after, pushes) < 1e-13
    assert masses.momentum_change(before, masses.poses(walk.after), pushes) > 1e-6
    assert feet_off_the_slope(before) < 1e-12
