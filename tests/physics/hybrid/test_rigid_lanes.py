"""Check that walks in lanes have the same ends, steps and heel strikes as single walks at a tight tolerance."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from walkerlab.evidence.paper.appendix_a import CORRECTED, RigidWalker, assembled
from walkerlab.outcome import Outcome
from walkerlab.physics.hybrid.endings import GOES_ON, WALKED
from walkerlab.physics.hybrid.recorded_walk import take_walk
from walkerlab.physics.hybrid.rigid_lanes import new_fates, new_lane_memory, record_strike, two_legs, walk_lanes
from walkerlab.physics.solvers.registry import Tolerances

STEPS = 10
ONE_DEGREE = RigidWalker(1.0, 0.5, 5.0, 10.0, 0.0, 9.81, np.deg2rad(1.0), CORRECTED)
STEEP = ONE_DEGREE._replace(slope=np.deg2rad(5.3))
SMALL = RigidWalker(0.01, 0.004, 1e-3, 3e-3, 1e-9, 1.6, 0.02, CORRECTED)
# state after ten steps from x_p at one degree, on which two tools agree
START, TENTH_STATE = (
    (0.1674, -0.60, -0.84),
    (-0.204388204282412, 0.169481619242526, -0.606147299375954, -0.861660164829674),
)
TENTH_TIME = 7.025036761059791


class Strikes(NamedTuple):
    """Observer that keeps every heel strike, and ends a walk when there is no room for more."""

    times: Any  # (n, steps) s
    after: Any  # (n, steps, 4) states just after them


@record_strike.case(Strikes)
def keep_strike(observer, walk, step, t, y):
    observer.times[walk, step] = t
    for i in range(4):
        observer.after[walk, step, i] = y[i]
    return WALKED if step + 1 == observer.times.shape[1] else GOES_ON


def on_slope(walker, z):
    z = np.atleast_2d(z)
    return np.column_stack([-2.0 * walker.slope - z[:, 0], z])


def in_lanes(walker, starts, rtol=1e-9, steps=STEPS):
    return model_in_lanes(assembled(walker), starts, rtol, steps)


def model_in_lanes(model, starts, rtol, steps=STEPS):
    strikes = Strikes(np.zeros((len(starts), steps)), np.zeros((len(starts), steps, 4)))
    fates = new_fates(len(starts))
    walk_lanes(two_legs(model), new_lane_memory(rtol, 1e-2 * rtol), strikes, starts, fates)
    return fates, strikes


def random_starts(walker, n, seed=0):
    generator = np.random.default_rng(seed)
    rate = np.sqrt(walker.gravity / walker.leg_length)
    lowest, highest = np.array([-0.2, -1.0 * rate, -1.0 * rate]), np.array([1.2, 0.6 * rate, 0.2 * rate])
    return on_slope(walker, generator.uniform(lowest, highest, (n, 3)))


@pytest.mark.parametrize(("rtol", "error"), [(2e-6, 1e-6), (1e-8, 1e-8), (1e-11, 1e-10)])
def test_ten_steps_end_at_the_reference_state(rtol, error):
    _, strikes = in_lanes(ONE_DEGREE, on_slope(ONE_DEGREE, START), rtol)
    assert strikes.after[0, -1] == pytest.approx(TENTH_STATE, abs=error)
    assert strikes.times[0, -1] == pytest.approx(TENTH_TIME, abs=10 * error)


@pytest.mark.parametrize("walker", [ONE_DEGREE, STEEP, SMALL], ids=["paper", "steep", "small"])
def test_random_starts_end_the_same_way_in_lanes_as_in_single_walks(walker):
    starts = random_starts(walker, 200)
    fates, strikes = in_lanes(walker, starts, 1e-11)  # On the steep slope errors grow with every step.
    tolerances = Tolerances("dop853", 1e-12, 1e-14, 10**7)
    time = np.sqrt(walker.leg_length / walker.gravity)
    for i, start in enumerate(starts.tolist()):
        walk = take_walk(assembled(walker), tolerances, tuple(start), STEPS)
        walked = walk.steps == STEPS  # A rigid walk does not end if the ground would have to pull.
        assert (fates.outcome[i], fates.steps[i]) == (0 if walked else walk.outcome, walk.steps)
        assert strikes.times[i, : walk.steps] == pytest.approx(walk.touch_time_s, abs=1e-6 * time)
    assert {Outcome.FELL, Outcome.REJECTED} <= set(fates.outcome.tolist())


def test_starts_near_a_gait_give_the_same_walks_in_lanes_and_one_by_one():
    generator = np.random.default_rng(3)
    starts = on_slope(ONE_DEGREE, np.array(START) * generator.uniform(0.8, 1.2, (64, 3)))
    fates, strikes = in_lanes(ONE_DEGREE, starts)
    tolerances = Tolerances("dop853", 1e-11, 1e-13, 10**7)
    walks = [take_walk(assembled(ONE_DEGREE), tolerances, tuple(start), STEPS) for start in starts.tolist()]
    assert [walk.steps for walk in walks] == fates.steps.tolist()
    assert 10 < np.count_nonzero(fates.steps == STEPS) < 60
    for i, walk in enumerate(walks):
        assert strikes.after[i, : walk.steps] == pytest.approx(walk.after, abs=1e-6)


def test_walk_does_not_depend_on_the_other_lanes():
    starts = random_starts(ONE_DEGREE, 60)
    together, _ = in_lanes(ONE_DEGREE, starts)
    backwards, _ = in_lanes(ONE_DEGREE, starts[::-1].copy())
    _, strikes = in_lanes(ONE_DEGREE, on_slope(ONE_DEGREE, [START] * 3))
    assert together.steps.tolist() == backwards.steps[::-1].tolist()
    assert (strikes.after[0] == strikes.after[2]).all()


def test_walker_that_stands_still_has_no_heel_strike():
    shallow = ONE_DEGREE._replace(slope=0.0)
    fates, _ = in_lanes(shallow, on_slope(shallow, (0.0, 0.0, 0.0)))
    assert Outcome(int(fates.outcome[0])) is Outcome.NO_HEEL_STRIKE


def test_overflow_ends_the_walk():
    fates, _ = in_lanes(ONE_DEGREE, on_slope(ONE_DEGREE, (0.1, 1e200, -1e200)))
    assert Outcome(int(fates.outcome[0])) in (Outcome.SOLVER_FAILED, Outcome.BUDGET_EXHAUSTED)


def test_driven_walks_in_lanes_equal_single_walks():
    driven = assembled(ONE_DEGREE).changed(hip=(5.0, 0.1, 0.5), push_off=1.0)
    starts = on_slope(ONE_DEGREE, np.array(START) * np.random.default_rng(4).uniform(0.95, 1.05, (16, 3)))
    fates, strikes = model_in_lanes(driven, starts, 1e-10)
    walks = [take_walk(driven, Tolerances("dop853", 1e-11, 1e-13, 10**7), tuple(start), STEPS) for start in starts]
    assert [walk.steps for walk in walks] == fates.steps.tolist()
    assert np.count_nonzero(fates.steps) > 8
    for i, walk in enumerate(walks):
        assert strikes.after[i, : walk.steps] == pytest.approx(walk.after, abs=1e-6)
