"""Check that torques between the legs equal those of the rigid model, whichever leg swings."""

from pathlib import Path

import ground_walkers as ground
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from system_rates import gradient_of, rate_of
from test_foot_on_ground import differenced

from walkerlab.config import loader
from walkerlab.physics.ground.walker import LOCKED, RELEASED, changed_forms, new_progress, place_on_ground
from walkerlab.physics.mechanics.rigid_model import STRAIGHT, Mode
from walkerlab.physics.orbits.fixed_point import find_gaits
from walkerlab.physics.solvers.registry import Tolerances
from walkerlab.physics.solvers.system import derivative
from walkerlab.scene.contact import contact_scene, start_state
from walkerlab.scene.rigid import rigid_walker

IN_THE_AIR = (False, False)
RIGID_STEP = 0.3718088  # m
HIP = {"hip": (10.0, 0.4, 1.5)}
SETTINGS = ("walker.hip.spring_N_m_per_rad=10", "walker.hip.damping_N_m_s_per_rad=0.4", "walker.hip.torque_N_m=1.5")
TOLERANCES = Tolerances("radau5", 1e-9, 1e-11, 10**6)
angles = st.tuples(*(st.floats(-0.6, 0.6),) * 2)
rates = st.tuples(*(st.floats(-3.0, 3.0),) * 2)


@given(theta=angles, omega=rates)
def test_pinned_driven_walker_moves_like_the_rigid_one(theta, omega):
    """The roles of the feet decide which leg a torque acts on."""
    config = loader.load(Path("paper"), [*SETTINGS, "walker.foot_radius_m=0"]).config
    rigid, y = rigid_walker(config, "corrected"), np.array((*theta, *omega))
    expected = np.zeros(4)
    derivative(Mode(rigid, STRAIGHT), 0.0, y, expected)
    walker = contact_scene(config, RIGID_STEP).walker
    assert rate_of(place_on_ground(walker, IN_THE_AIR, pinned=True), tuple(y)) == pytest.approx(
        tuple(expected), rel=1e-9
    )


@settings(max_examples=20)
@given(theta=angles, omega=rates, stance=st.sampled_from([0, 1]))
def test_derivatives_of_hip_torques_equal_finite_differences(theta, omega, stance):
    walker = changed_forms(ground.compass(radius=0.01, inertia=0.2), **HIP)
    state = (0.0, 5.0, *theta, 0.2, -0.1, *omega)
    system = place_on_ground(walker, IN_THE_AIR, progress=new_progress(stance))
    expected = differenced(system, state, (1e-5,) * 8)
    assert np.abs(gradient_of(system, state) - expected).max() < 1e-7 * (1.0 + np.abs(expected).max())


def test_hip_torques_act_on_the_thighs_of_a_kneed_walker():
    config = loader.load(Path("kneed")).config
    passive = contact_scene(config, 0.4).walker
    pushed = changed_forms(passive, hip=(0.0, 0.0, 1.0))
    y = (0.0, 5.0, -0.2, 0.2, -0.3, 0.2, *(0.0,) * 6)
    free = (RELEASED, RELEASED)
    for stance in range(2):
        change = np.subtract(
            *(
                rate_of(place_on_ground(w, IN_THE_AIR, free, progress=new_progress(stance)), y)
                for w in (pushed, passive)
            )
        )
        momentum = np.subtract(change[8:10], change[9:7:-1])
        assert momentum[1 - stance] > 0.0 > momentum[stance]
    locked = place_on_ground(pushed, IN_THE_AIR, (RELEASED, LOCKED))
    swing, stance = (locked.form.hinges[0, k] for k in range(2))
    assert (swing, stance) == tuple(locked.form.knees[:, 1])


def test_spring_work_equals_the_drop_of_its_energy():
    """The energy balance counts the energy stored in the spring, as in the rigid model."""
    config = loader.load(Path("paper"), ["slope_deg=3", SETTINGS[0], "contact.terrain=after-mid-swing"]).config
    gait = find_gaits(rigid_walker(config, "corrected")).gait
    scene = contact_scene(config, gait.step_length)
    start = start_state(scene, gait.state)
    touch = scene.walk(start, 2, TOLERANCES).touch_time_s[-1]
    walk = scene.walk(start, 2, TOLERANCES, np.array([0.0, touch]))
    apart = walk.samples.states[:, 2] - walk.samples.states[:, 3]
    assert walk.steps == 2
    assert walk.driven.hip == pytest.approx(5.0 * (apart[0] ** 2 - apart[1] ** 2), rel=1e-5)
    assert abs(walk.driven.hip) > 1e-3


def test_energy_balance_of_a_driven_walk_closes():
    config = loader.load(Path("paper"), ["slope_deg=0.9", *SETTINGS, "contact.terrain=after-mid-swing"]).config
    scene = contact_scene(config, RIGID_STEP)
    start = start_state(scene, (-0.2044455, 0.169539, -0.6057394, -0.861714))
    walk = scene.walk(start, 4, TOLERANCES)
    assert walk.steps == 4
    assert walk.driven.hip > 0.1
    assert walk.energy_balance_residual_J < 1e-6
