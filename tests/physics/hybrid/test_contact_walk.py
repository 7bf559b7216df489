"""Compare walks on compliant ground with measurements by other programs and with laws that hold for any walk."""

import math

import numpy as np
import pytest
from contact_walks import (
    FIXED_POINT,
    RIGID_PERIOD,
    RIGID_STEP,
    faster,
    scene_of,
    walked,
)
from hypothesis import given
from hypothesis import settings as examples
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from walkerlab.outcome import Outcome
from walkerlab.physics.ground.terrain import STANCE_FOOT
from walkerlab.physics.ground.walker import feet_motion, place_on_ground
from walkerlab.physics.hybrid.contact_state import farthest_slide
from walkerlab.physics.solvers.scipy_methods import jacobian_matrix, right_hand_side
from walkerlab.scene.contact import start_state

RADIUS = 0.001
OWN_PITCH = "contact.pad_pitch=0.36123"
SLIPPERY = ("contact.static_friction=0.3", "contact.dynamic_friction=0.2")
GLASSY = ("contact.static_friction=0.05", "contact.dynamic_friction=0.04")
STICKY = ("contact.stiction_velocity=1", "contact.friction_velocity=10")
NEAR_RIGID = (
    "contact.stiffness=1e9",
    "contact.damping=9e5",
    "contact.stiction_velocity=0.1",
    "contact.friction_velocity=1",
)


# ---- measured by two other programs ---------------------------------------------------------------------------------


def test_tenth_step_on_compliant_ground_is_slower_and_shorter_than_the_rigid_gait():
    walk = walked()
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s.shape == (10,)
    assert walk.periods_s[-1] == pytest.approx(0.711, abs=5e-4)
    assert walk.lengths_m[-1] == pytest.approx(0.361, abs=5e-4)


def test_lower_stiction_velocity_brings_the_walk_closer_to_the_rigid_one():
    walk = walked(*STICKY)
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s[-1] == pytest.approx(0.7045, abs=1e-4)
    assert walk.lengths_m[-1] == pytest.approx(0.3712, abs=5e-4)


@pytest.mark.parametrize(("factor", "steps"), [(0.90, 1), (0.95, 5)])
def test_start_that_is_too_slow_stumbles(factor, steps):
    walk = walked(start=faster(factor))
    assert walk.outcome in (Outcome.FELL, Outcome.OFF_PAD)
    assert walk.periods_s.size == steps


@pytest.mark.parametrize("factor", [1.05, 1.10])
def test_start_that_is_too_fast_settles_on_the_same_gait(factor):
    walk = walked("contact.terrain=checkerboard", OWN_PITCH, start=faster(factor), steps=24)
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s[-1] == pytest.approx(walked(OWN_PITCH, steps=40).periods_s[-1], abs=1e-5)


def test_pads_at_the_rigid_pitch_trip_the_walker_after_twelve_steps():
    walk = walked(steps=20)
    assert walk.outcome is Outcome.OFF_PAD
    assert walk.periods_s.size == 12
    lag = 12 * RIGID_STEP - walk.touch_along_m[-1]
    assert lag / RIGID_STEP == pytest.approx(0.3, abs=0.05)


def test_pads_at_the_pitch_of_the_contact_gait_allow_endless_walking():
    walk = walked(OWN_PITCH, steps=40)
    assert walk.outcome is Outcome.WALKED
    assert np.ptp(walk.periods_s[-10:]) < 1e-6


def test_steeper_slopes_scuff_earlier_and_allow_fewer_steps():
    start = (-0.3233886, 0.2186688, -0.3773739, -1.0923836)
    walk = walked("slope_deg=3", start=start, step=0.5354454, steps=12)
    assert walk.outcome is Outcome.OFF_PAD
    # After the eighth step, the foot misses the edge of the pad by a tenth of a millimetre.
    assert 8 <= walk.periods_s.size <= 9


def test_slippery_ground_shortens_five_steps_and_then_trips_the_walker():
    walk = walked(*SLIPPERY)
    assert walk.outcome is Outcome.OFF_PAD
    assert walk.periods_s.size == 5
    assert walk.lengths_m[-1] == pytest.approx(0.34, abs=2e-3)


def test_stance_foot_slides_away_at_once_on_glassy_ground():
    walk = walked(*GLASSY)
    assert walk.outcome is Outcome.SLID
    assert walk.periods_s.size == 0


def slid_foot(tolerance, start):
    scene, walk = scene_of(*GLASSY), walked(*GLASSY, start=start, tolerance=tolerance)
    assert walk.outcome is Outcome.SLID
    begin = feet_motion(scene.walker.whole, start_state(scene, start))[STANCE_FOOT]
    end = feet_motion(scene.walker.whole, walk.end_state)[STANCE_FOOT]
    # The ball has also rolled by its radius times the change of the leg angle.
    turned = walk.end_state[2 + STANCE_FOOT] - start[STANCE_FOOT]
    return abs(end.along - begin.along + RADIUS * turned), end.height, farthest_slide(scene.ground.terrain)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8])
def test_walk_ends_when_its_loaded_stance_foot_slides_too_far(tolerance):
    away, height, farthest = slid_foot(tolerance, (*FIXED_POINT[:2], 0.0, 0.0))
    assert height < -1e-5
    # The event is located to 1e-12 s, and the foot moves at a few m/s.
    assert away == pytest.approx(farthest, abs=1e-11)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8])
def test_walk_ends_when_its_stance_foot_lands_too_far_away(tolerance):
    away, height, farthest = slid_foot(tolerance, FIXED_POINT)
    assert away > farthest
    assert height == pytest.approx(0.0, abs=1e-11)


def test_nearly_rigid_contact_gives_almost_the_rigid_gait():
    """Stiffness and damping are 10^4 times larger, the stiction velocity is 0.1 mm/s, and the feet are points as in the
    rigid model.
    """
    walk = walked(*NEAR_RIGID, "walker.foot_radius_m=0")
    assert walk.outcome is Outcome.WALKED
    np.testing.assert_allclose(walk.periods_s, RIGID_PERIOD, atol=1e-4)
    np.testing.assert_allclose(walk.lengths_m, RIGID_STEP, atol=2e-5)


@pytest.mark.parametrize("slope", ["slope_deg=1", "slope_rad=0.01755"])
def test_adams_start_of_table_2_does_not_lead_to_walking(slope):
    walk = walked(slope, start=(-0.2021, 0.1670, -1.02, -3.20))
    assert walk.outcome in (Outcome.LIFTED_OFF, Outcome.OFF_PAD, Outcome.FELL)
    assert walk.periods_s.size == 0
    assert walk.end_time_s < 0.5
    assert walk.outcome.answered
    assert len(walk.outcome.advice) > 20


# ---- accuracy and energy ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sets", [(), STICKY, NEAR_RIGID, SLIPPERY], ids=["paper", "sticky", "near-rigid", "slippery"])
def test_energy_balance_closes(sets):
    walk = walked(*sets)
    assert walk.energy_balance_residual_J < 1e-6
    assert walk.dissipated_J[0] > 0.0
    assert walk.dissipated_J[1] > 0.0


def test_potential_energy_lost_downhill_equals_the_ground_losses():
    """In a steady gait, each step loses as much energy as gravity supplies along the slope."""
    walk = walked(OWN_PITCH, steps=40, interval=0.01)
    weight_along = 20.0 * 9.81 * math.sin(math.radians(1.0))
    lost = walk.samples.dissipated_J.sum(axis=1)
    # Read both in the middle of a swing, where little is lost, twenty steps apart.
    late, early = (np.interp(walk.touch_time_s[i] + 0.35, walk.samples.time_s, lost) for i in (-2, -22))
    way = walk.touch_along_m[-2] - walk.touch_along_m[-22]
    assert late - early == pytest.approx(weight_along * way, rel=1e-5)


def test_touch_times_converge_with_the_tolerance():
    reference = walked(tolerance=1e-10).touch_time_s
    errors = {tol: np.abs(walked(tolerance=tol).touch_time_s - reference).max() for tol in (1e-5, 1e-6, 1e-7)}
    assert errors[1e-5] < 1e-4
    assert errors[1e-6] < 1e-6
    assert errors[1e-7] < 1e-7


def test_single_support_agrees_with_scipy_radau():
    """SciPy integrates the same motion from the start until just before the swing foot leaves its pad."""
    scene = scene_of()
    system = place_on_ground(scene.walker, (True, True))
    start = np.array(start_state(scene, FIXED_POINT))

    def fun(t, y):
        rate = np.zeros(8)
        right_hand_side(system, t, y, rate)
        return rate

    def jac(t, y):
        J = np.zeros((8, 8))
        jacobian_matrix(system, t, y, J)
        return J

    samples = walked(steps=1, interval=0.02, tolerance=1e-9).samples
    chosen = samples.time_s < 0.21
    assert samples.has_ground[chosen].all()
    peer = solve_ivp(
        fun, (0.0, 0.2), start, method="Radau", jac=jac, rtol=1e-10, atol=1e-12, t_eval=samples.time_s[chosen]
    )
    np.testing.assert_allclose(samples.states[chosen], peer.y.T, atol=1e-6)
    np.testing.assert_allclose(samples.states[chosen][-1], peer.y[:, -1], atol=1e-7)


def test_scipy_radau_gives_the_same_steps():
    peer, own = walked(method="scipy-radau", steps=3), walked(steps=3)
    assert peer.outcome is own.outcome is Outcome.WALKED
    np.testing.assert_allclose(peer.touch_time_s, own.touch_time_s, atol=1e-6)
    np.testing.assert_allclose(peer.touch_along_m, own.touch_along_m, atol=1e-6)


def test_repeated_walk_is_bitwise_equal():
    one, other = walked(steps=4), walked.__wrapped__(steps=4)
    np.testing.assert_array_equal(one.touch_time_s, other.touch_time_s)
    assert one.end_state == other.end_state


def test_exhausted_budget_ends_the_walk_with_advice():
    walk = walked(budget=2000)
    assert walk.outcome is Outcome.BUDGET_EXHAUSTED
    assert not walk.outcome.answered
    assert 2000 <= walk.work[0] < 2100


# ---- the parts a scene can leave out ---------------------------------------------------------------------------------


def test_walk_continues_on_a_plane_that_ignores_scuffing():
    """The walk runs in Python with SciPy's method, so nothing is compiled."""
    plane = walked("contact.terrain=after-mid-swing", method="scipy-radau", steps=3)
    pads = walked(method="scipy-radau", steps=3)
    assert plane.outcome is Outcome.WALKED
    np.testing.assert_allclose(plane.touch_time_s, pads.touch_time_s, atol=1e-5)


def test_walker_cannot_walk_on_smooth_ground():
    walk = walked("contact.friction=none", method="scipy-radau", steps=2)
    assert walk.outcome is Outcome.SLID
    assert walk.dissipated_J[1] == 0.0


def test_pinned_first_step_equals_the_rigid_one_until_release():
    """The hinge is the centre of the ball, so compare with the rigid walk of a walker whose legs are shorter by the
    radius.
    """
    walk = walked("contact.stance=pinned", "walker.foot_radius_m=0", method="scipy-radau", steps=2)
    assert walk.outcome is Outcome.WALKED
    assert walk.periods_s[0] == pytest.approx(RIGID_PERIOD, abs=2e-6)
    assert walk.lengths_m[0] == pytest.approx(RIGID_STEP, abs=2e-6)
    assert walk.periods_s[1] > RIGID_PERIOD + 1e-3  # From here on the ground is compliant.


@examples(max_examples=25)
@given(
    theta_2=st.floats(0.05, 0.6),
    w_1=st.floats(-4.0, 4.0),
    w_2=st.floats(-5.0, 3.0),
    friction=st.sampled_from([(), SLIPPERY, STICKY]),
)
def test_any_start_ends_with_a_known_outcome(theta_2, w_1, w_2, friction):
    start = (-2.0 * math.radians(1.0) - theta_2, theta_2, w_1, w_2)
    walk = walked.__wrapped__(*friction, start=start, steps=4, budget=300_000)
    assert walk.outcome not in (Outcome.SOLVER_FAILED, Outcome.REJECTED)
    assert np.all(np.isfinite(walk.end_state))
    assert np.all(np.diff(walk.touch_time_s) > 0.0)
    if walk.outcome.answered:
        assert walk.energy_balance_residual_J < 1e-4
    if walk.outcome is Outcome.WALKED:
        assert walk.periods_s.size == 4


BOUNCING = (
    "contact.stiffness=154987",
    "contact.damping=1783.13",
    "contact.full_damping_penetration=4.95809",
    "contact.stiction_velocity=258.249",
    "contact.friction_velocity=1278.15",
    "contact.exponent=2.15",
    "walker.foot_radius_m=0.03671",
)


def test_foot_left_on_the_surface_by_an_event_does_not_stall_the_walk():
    """Feet with little damping bounce many times, and rounding decides on which side of the surface an event leaves
    them.
    """
    walk = walked(*BOUNCING, steps=4, budget=300_000)
    assert walk.outcome is Outcome.WALKED
    assert walk.energy_balance_residual_J < 1e-6
