"""Compare rigid walks with a reference on which two tools agree, and with SciPy's integration and event finder."""

import numpy as np
import pytest
from printed_compass import ground_reaction, kinetic_energy, potential_energy, swing_foot_height
from scipy.integrate import solve_ivp

from walkerlab.evidence.paper.appendix_a import AS_PRINTED, CORRECTED, RigidWalker, accelerations, assembled, impact
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.recorded_walk import STEPS_AT_ONCE, are_far_from, as_state
from walkerlab.physics.hybrid.recorded_walk import take_walk as take_walk_of_model
from walkerlab.physics.hybrid.rigid_measures import energies as energies_of_model
from walkerlab.physics.hybrid.rigid_measures import reactions as reactions_of_model
from walkerlab.physics.orbits.fixed_point import find_gaits as find_gaits_of_model
from walkerlab.physics.solvers.registry import METHODS, Tolerances


def find_gaits(walker, *rest, **options):
    return find_gaits_of_model(assembled(walker), *rest, **options)


def take_walk(walker, *rest, **options):
    return take_walk_of_model(assembled(walker), *rest, **options)


def energies(walker, *rest, **options):
    return energies_of_model(assembled(walker), *rest, **options)


def reactions(walker, *rest, **options):
    return reactions_of_model(assembled(walker), *rest, **options)


ONE_DEGREE = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, np.deg2rad(1.0), CORRECTED)
PAPER = ONE_DEGREE._replace(slope=0.0174)
X_P = (0.1674, -0.60, -0.84)
GAIT = (-0.2041996085033517, 0.1693996085033517, -0.605819000148935, -0.8610407199844384)


def start_of(walker, z=X_P):
    return (-2 * walker.slope - z[0], *z)


def walked(walker, start, steps, rtol=1e-10, method="dop853", **options):
    return take_walk(walker, Tolerances(method, rtol, 1e-2 * rtol, 10**6), start, steps, **options)


# state after ten steps from x_p at one degree, on which two tools agree to 1e-36
TENTH_STATE = (-0.204388204282412, 0.169481619242526, -0.606147299375954, -0.861660164829674)
TENTH_TIME = 7.025036761059791


@pytest.mark.parametrize(("rtol", "error"), [(1e-6, 1e-6), (1e-10, 1e-10), (1e-13, 1e-13)])
def test_ten_steps_end_at_the_reference_state(rtol, error):
    walk = walked(ONE_DEGREE, start_of(ONE_DEGREE), 10, rtol)
    assert walk.outcome is Outcome.WALKED
    assert walk.final_state == pytest.approx(TENTH_STATE, abs=error)
    assert walk.touch_time_s[-1] == pytest.approx(TENTH_TIME, abs=10 * error)


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if not method.compiled])
def test_scipy_method_reaches_the_same_state_after_three_steps(name):
    walk, ours = (walked(ONE_DEGREE, start_of(ONE_DEGREE), 3, *how) for how in ((1e-10, name), (1e-13,)))
    assert walk.final_state == pytest.approx(ours.final_state, abs=1e-7)
    assert walk.work.rhs_evaluations > 0


def swing_by_scipy(walker, start, feet):
    """Integrate a swing by SciPy's DOP853 until the event function of the feet ends it."""
    return solve_ivp(
        lambda t, y: [y[2], y[3], *accelerations(walker, *y)],
        (0.0, 3.0),
        start,
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
        events=feet,
        max_step=0.02,
        dense_output=True,
    )


def one_step_by_scipy(walker, start):
    """Find the heel strike with SciPy's event finder: both feet are on the slope, well after mid-swing."""

    def feet(t, y):
        return y[0] + y[1] + 2 * walker.slope if y[0] > y[1] + 0.05 else 1.0

    feet.terminal, feet.direction = True, -1
    solution = swing_by_scipy(walker, start, feet)
    return solution.t_events[0][0], solution.y_events[0][0], solution.sol


@pytest.mark.parametrize("walker", [ONE_DEGREE, ONE_DEGREE._replace(slope=np.deg2rad(4.0), c21_sign=AS_PRINTED)])
def test_step_agrees_with_scipy(walker):
    start = start_of(walker)
    time, before, motion = one_step_by_scipy(walker, start)
    walk = walked(walker, start, 1, 1e-12, sampled=True)
    assert walk.touch_time_s[0] == pytest.approx(time, abs=1e-10)
    assert walk.before[0] == pytest.approx(before, abs=1e-10)
    assert walk.after[0] == pytest.approx(impact(walker, *before), abs=1e-10)
    inside = walk.samples.time_s < walk.touch_time_s[0]
    assert walk.samples.state[inside] == pytest.approx(motion(walk.samples.time_s[inside]).T, abs=1e-10)


def test_mirrored_walker_walks_down_to_the_left():
    # Mirror image of a step, which SciPy finds with the mirrored guard.
    walker = ONE_DEGREE._replace(slope=-ONE_DEGREE.slope)

    def feet(t, y):
        return y[0] + y[1] + 2 * walker.slope if y[0] < y[1] - 0.05 else -1.0

    feet.terminal, feet.direction = True, 1
    start = [-value for value in start_of(ONE_DEGREE)]
    mirrored = swing_by_scipy(walker, start, feet)
    walk = walked(ONE_DEGREE, start_of(ONE_DEGREE), 1, 1e-12)
    assert mirrored.t_events[0][0] == pytest.approx(walk.touch_time_s[0], abs=1e-10)
    assert -np.array(impact(walker, *mirrored.y_events[0][0])) == pytest.approx(walk.after[0], abs=1e-10)


def test_energy_is_constant_within_a_swing():
    walk = walked(PAPER, GAIT, 10, 1e-12)
    assert walk.energy_drift <= 1e-11 * walk.mean_energy


def test_energy_drifts_within_a_swing_if_the_equations_are_used_as_printed():
    walk = walked(PAPER._replace(c21_sign=AS_PRINTED), start_of(PAPER), 10, 1e-12)
    assert walk.energy_drift == pytest.approx(0.13, abs=0.01)


def test_mean_energy_is_the_time_average_of_the_samples():
    walk = walked(PAPER._replace(c21_sign=AS_PRINTED), start_of(PAPER), 4, 1e-10, sampled=True)
    energy = energies(PAPER, walk.samples.state).sum(axis=1)
    mean = np.trapezoid(energy, walk.samples.time_s) / walk.samples.time_s[-1]
    # error of the trapezoidal rule at 64 samples a unit of time
    assert walk.mean_energy == pytest.approx(mean, rel=1e-6)


def test_extremes_agree_with_the_samples():
    walk = walked(ONE_DEGREE, GAIT, 4, sampled=True)
    force = reactions(ONE_DEGREE, walk.samples.state)
    assert walk.min_normal_force == pytest.approx(force[:, 1].min(), rel=1e-3)
    assert walk.max_friction_ratio == pytest.approx((np.abs(force[:, 0]) / force[:, 1]).max(), rel=1e-3)
    heights = [swing_foot_height(ONE_DEGREE, *state[:2]) for state in walk.samples.state]
    assert walk.max_scuff_depth == pytest.approx(-min(heights), rel=1e-2)


def test_extremes_do_not_depend_on_the_solver_step():
    """They are computed inside the solver steps. The maximum over samples alone would be too low by up to a
    thousandth.
    """
    long, short = (walked(ONE_DEGREE, GAIT, 2, rtol=rtol) for rtol in (1e-8, 1e-13))
    assert long.work.accepted < 0.5 * short.work.accepted
    for name in ("max_scuff_depth", "min_normal_force", "max_friction_ratio"):
        # States of the looser walk are off by several times its tolerance, and extremes by no more.
        assert getattr(long, name) == pytest.approx(getattr(short, name), rel=2e-6), name


@pytest.mark.parametrize(("degrees", "millimetres"), [(1.0, 0.37), (3.0, 3.6), (4.0, 6.3)])
def test_scuff_depth_is_reported(degrees, millimetres):
    gait = find_gaits(ONE_DEGREE._replace(slope=np.deg2rad(degrees))).gait
    assert 1e3 * gait.max_scuff_depth == pytest.approx(millimetres, rel=0.02)


def test_energies_and_forces_of_many_states_equal_those_of_each_state():
    states = np.array([GAIT, (0.1, -0.2, 0.3, -0.4)])
    for state, energy, force in zip(states, energies(PAPER, states), reactions(PAPER, states), strict=True):
        parts = kinetic_energy(PAPER, *state), potential_energy(PAPER, *state[:2])
        assert tuple(energy) == pytest.approx(parts, rel=1e-14)
        assert tuple(force) == pytest.approx(ground_reaction(PAPER, *state), rel=1e-14)


def test_sample_times_increase_and_include_both_sides_of_heel_strikes():
    steps = STEPS_AT_ONCE + 3
    walk = walked(PAPER, GAIT, steps, sampled=True)
    time, state = walk.samples.time_s, walk.samples.state
    assert (np.diff(time) > 0.0).all()
    assert time[0] == 0.0
    assert tuple(state[0]) == GAIT
    for strike, before, after in zip(walk.touch_time_s, walk.before, walk.after, strict=True):
        at = np.searchsorted(time, strike)
        assert time[at] == strike
        assert (state[at] == after).all()
        assert (state[at - 1] == before).all()
        assert strike - time[at - 1] < 1e-12 * strike
    assert (np.diff(walk.samples.step) >= 0).all()
    assert walk.samples.step[-1] == steps


def test_walk_in_pieces_equals_the_whole_walk():
    steps = STEPS_AT_ONCE + 3
    taken = []
    whole = walked(PAPER, start_of(PAPER), steps, 1e-12, advance=taken.append)
    assert taken == [STEPS_AT_ONCE, 3]
    first = walked(PAPER, start_of(PAPER), STEPS_AT_ONCE, 1e-12)
    second = walked(PAPER, first.final_state, 3, 1e-12)
    assert whole.final_state == pytest.approx(second.final_state, abs=1e-11)
    assert whole.touch_time_s[-1] == pytest.approx(first.touch_time_s[-1] + second.touch_time_s[-1], abs=1e-10)


def test_stable_walk_settles_on_the_gait():
    walk = walked(PAPER, start_of(PAPER, (0.16, -0.55, -0.87)), 60, 1e-11)
    assert walk.outcome is Outcome.WALKED
    assert walk.final_state == pytest.approx(GAIT, abs=1e-9)


def test_slow_walker_falls():
    walk = walked(PAPER, start_of(PAPER, (0.1674, -0.4, -0.5)), 10, sampled=True)
    assert walk.outcome is Outcome.FELL
    assert walk.steps == 0
    assert walk.final_state == walk.start
    # The last sample is at the fall, where the hip height is half a leg.
    assert np.cos(walk.samples.state[-1, 1] + PAPER.slope) == pytest.approx(0.5, abs=0.03)


def test_lying_walker_is_rejected():
    walk = walked(PAPER, start_of(PAPER, (1.5, 0.0, 0.0)), 10)
    assert walk.outcome is Outcome.REJECTED
    assert walk.steps == 0
    assert walk.mean_energy == pytest.approx(energies(PAPER, np.array([walk.start])).sum())


def test_walk_that_needs_a_pulling_ground_is_reported_as_lifting_off():
    walker = PAPER._replace(slope=np.deg2rad(20.0))
    walk = walked(walker, start_of(walker, (0.0953848, 0.7024719, -1.8681666)), 1)
    assert walk.steps == 1
    assert walk.min_normal_force < 0.0
    assert walk.outcome is Outcome.LIFTED_OFF


def test_standing_with_legs_together_is_not_a_heel_strike():
    # Both legs are vertical, with the hip exactly above the feet.
    walker = PAPER._replace(slope=0.0)
    walk = walked(walker, (0.0, 0.0, 0.0, 0.0), 2)
    assert walk.outcome is Outcome.NO_HEEL_STRIKE


def test_samples_near_events_are_excluded():
    times = np.array([0.0, 0.99, 1.0, 1.02, 2.0, 3.5])
    assert are_far_from(times, np.array([1.0, 2.01]), 0.015).tolist() == [True, False, False, True, False, True]
    assert are_far_from(times, np.zeros(0), 1.0).all()


def test_as_state_returns_plain_floats():
    assert all(type(value) is float for value in as_state(np.array(GAIT)))
