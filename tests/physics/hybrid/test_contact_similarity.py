"""Check that a walk on compliant ground does not depend on its position, its first leg or its units."""

import math

import numpy as np
import pytest
from contact_walks import FIXED_POINT, RIGID_STEP, faster, scene_of, settings, walked

from walkerlab.physics.ground.terrain import checkerboard
from walkerlab.physics.hybrid.contact_result import walk_contact
from walkerlab.physics.hybrid.contact_state import JudgedGround
from walkerlab.scene.contact import start_state


def test_walk_does_not_depend_on_its_start_along_the_slope():
    scene, here = scene_of(), walked()
    start = np.array(start_state(scene, FIXED_POINT))
    start[0] += 64.0
    lanes = tuple(lane + 64.0 for lane in scene.ground.terrain.lanes)
    ground = JudgedGround(checkerboard(scene.pitch_m, lanes), scene.ground.frame)
    there = walk_contact(scene.walker, ground, False, 1, tuple(start.tolist()), settings(), 10, None)
    np.testing.assert_allclose(there.touch_time_s, here.touch_time_s, atol=1e-6)
    np.testing.assert_allclose(there.touch_along_m - 64.0, here.touch_along_m, atol=1e-6)
    assert there.outcome is here.outcome


def test_walk_does_not_depend_on_the_leg_that_swings_first():
    scene, one = scene_of(), walked()
    y = start_state(scene, FIXED_POINT)
    exchanged = (y[0], y[1], y[3], y[2], y[4], y[5], y[7], y[6])
    ground = JudgedGround(checkerboard(scene.pitch_m, scene.ground.terrain.lanes[::-1]), scene.ground.frame)
    other = walk_contact(scene.walker, ground, False, 0, exchanged, settings(), 10, None)
    np.testing.assert_allclose(other.touch_time_s, one.touch_time_s, atol=1e-6)
    np.testing.assert_allclose(other.touch_along_m, one.touch_along_m, atol=1e-6)


LENGTH, MASS, GRAVITY = 2.5, 0.3, 1.62 / 9.81
FORCE, TIME = MASS * GRAVITY, math.sqrt(LENGTH / GRAVITY)


def twin(static, dynamic):
    """Return the paper's walker on the Moon, with other leg length, masses and gravity, and the contact scaled to
    match.
    """
    speed = LENGTH / TIME
    return (
        f"walker.leg_length_m={LENGTH}",
        f"walker.foot_to_mass_m={0.5 * LENGTH}",
        f"walker.leg_mass_kg={5.0 * MASS}",
        f"walker.hip_mass_kg={10.0 * MASS}",
        f"walker.foot_radius_m={0.001 * LENGTH}",
        f"gravity_m_s2={9.81 * GRAVITY}",
        "contact.units=si",
        f"contact.stiffness={1e5 * 1000**2.2 * FORCE / LENGTH**2.2!r}",
        f"contact.damping={90e3 * FORCE / speed!r}",
        f"contact.full_damping_penetration={1e-4 * LENGTH!r}",
        f"contact.stiction_velocity={0.1 * speed!r}",
        f"contact.friction_velocity={1.0 * speed!r}",
        f"contact.static_friction={static}",
        f"contact.dynamic_friction={dynamic}",
    )


@pytest.mark.parametrize(
    ("factor", "mu"),
    [(1.0, (0.9, 0.7)), (0.9, (0.9, 0.7)), (0.95, (0.9, 0.7)), (1.0, (0.3, 0.2)), (1.0, (0.05, 0.04))],
    ids=["walks", "falls", "trips", "slips", "slides"],
)
def test_walker_and_a_scaled_copy_take_the_same_steps(factor, mu):
    friction = (f"contact.static_friction={mu[0]}", f"contact.dynamic_friction={mu[1]}")
    walk = walked(*friction, start=faster(factor), tolerance=1e-8)
    start = faster(factor)
    scaled = (start[0], start[1], start[2] / TIME, start[3] / TIME)
    other = walked(*twin(*mu), start=scaled, step=LENGTH * RIGID_STEP, tolerance=1e-8)
    assert other.outcome is walk.outcome
    np.testing.assert_allclose(other.touch_time_s / TIME, walk.touch_time_s, atol=1e-6)
    np.testing.assert_allclose(other.touch_along_m / LENGTH, walk.touch_along_m, atol=1e-6)
    assert other.end_time_s / TIME == pytest.approx(walk.end_time_s, abs=1e-5)
