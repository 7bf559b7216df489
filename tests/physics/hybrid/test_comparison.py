"""Tests of the differences of two walks: in time, in phase, and of their orbits."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.distance import directed_hausdorff

from walkerlab.physics.hybrid.comparison import (
    IMPACT_PHASE,
    Motion,
    add_strike_samples,
    difference_in_phase,
    difference_in_time,
    hausdorff,
    orbit_distances,
    phase_plane,
    smooth_phases,
)

PERIOD, STEPS, KINK = 0.7, 6, 0.05
PHASES = np.linspace(0.0, 1.0, 101)


def legs_at(u, side):
    """Return the angles after u periods, and their derivative by u on one side of the kinks at whole numbers."""
    wave = np.sign(np.sin(np.pi * (u + 1e-9 * side)))
    lean = KINK * np.abs(np.sin(np.pi * u))
    angle = np.column_stack((0.2 * np.cos(np.pi * u) + lean, -0.2 * np.cos(np.pi * u) + lean))
    slope = KINK * np.pi * wave * np.cos(np.pi * u)
    rate = np.column_stack((-0.2 * np.pi * np.sin(np.pi * u) + slope, 0.2 * np.pi * np.sin(np.pi * u) + slope))
    return angle, rate


def walk(period=PERIOD, steps=STEPS, interval=0.004, shift=0.0):
    """Return a walk that begins after `shift` periods and has a sample on either side of each kink."""
    strikes = period * np.arange(1, steps + 1)
    grid = np.arange(0.0, strikes[-1] - 1e-6, interval)
    grid = grid[np.abs(grid[:, None] - strikes).min(axis=1) > 1e-6]
    time = np.concatenate((grid, np.nextafter(strikes, 0.0), strikes))
    side = np.concatenate((np.ones(grid.size), -np.ones(steps), np.ones(steps)))
    order = np.argsort(time)
    time, side = time[order], side[order]
    angle, rate = legs_at(np.where(side < 0, np.round(time / period), time / period) + shift, side)
    return Motion(time, angle, rate / period, strikes)


def test_walk_does_not_differ_from_itself():
    _, in_time = difference_in_time(walk(), walk())
    in_phase = difference_in_phase(walk(), walk(), PHASES)
    for difference in (in_time, in_phase):
        assert not difference.angle.any()
        assert not difference.velocity.any()
    assert orbit_distances(walk(), walk()).max() < 1e-15


def test_angles_of_a_stretched_copy_differ_in_time_but_not_in_phase():
    copy = walk(period=1.01 * PERIOD)
    _, in_time = difference_in_time(copy, walk())
    in_phase = difference_in_phase(copy, walk(), PHASES)
    assert max(in_phase.largest("angle")) < 1e-7  # The error is of fourth order in the sampling interval.
    assert min(in_time.largest("angle")) > 0.5 * (STEPS * 0.01) * np.pi * 0.2


def test_velocities_of_a_stretched_copy_differ_by_the_stretch():
    in_phase = difference_in_phase(walk(period=1.01 * PERIOD), walk(), PHASES)
    assert_allclose(in_phase.largest("velocity"), (1 - 1 / 1.01) * np.abs(walk().velocity).max(axis=0), rtol=1e-2)


def test_difference_at_equal_times_grows_from_step_to_step():
    time, difference = difference_in_time(walk(period=1.01 * PERIOD), walk())
    each = [np.abs(difference.angle[(time > k * PERIOD) & (time < (k + 1) * PERIOD)]).max() for k in range(STEPS)]
    assert (np.diff(each) > 0).all()


def test_constant_offset_of_one_angle_is_found_in_time_and_phase():
    plain = walk()
    leaning = Motion(plain.time, plain.angle + np.array([0.0, 0.01]), plain.velocity, plain.step_ends)
    for difference in (difference_in_time(leaning, plain)[1], difference_in_phase(leaning, plain, PHASES)):
        assert_allclose(difference.largest("angle"), [0.0, 0.01], atol=1e-15)
        assert_allclose(difference.largest("velocity"), 0.0, atol=1e-15)


def test_late_heel_strike_makes_velocities_differ_by_the_jump():
    _, difference = difference_in_time(walk(period=PERIOD * (1 + 1e-4), steps=1), walk(steps=1))
    assert_allclose(difference.largest("velocity"), 2 * KINK * np.pi / PERIOD, rtol=1e-3)


@pytest.mark.parametrize("step", range(STEPS))
def test_step_begins_after_its_impact_and_ends_before_the_next(step):
    angle, velocity = walk().values_during(step, np.array([0.0, 1.0]))
    assert_allclose(angle[0], legs_at(np.array([float(step)]), 1.0)[0][0], atol=1e-12)
    assert_allclose(velocity[0], legs_at(np.array([float(step)]), 1.0)[1][0] / PERIOD, atol=1e-9)
    assert_allclose(velocity[1], legs_at(np.array([step + 1.0]), -1.0)[1][0] / PERIOD, atol=1e-9)


def test_only_steps_that_both_walks_completed_are_compared():
    assert difference_in_phase(walk(steps=4), walk(), PHASES).angle.shape == (4, PHASES.size, 2)


def test_phase_and_orbit_comparisons_reject_walks_without_a_full_step_or_stride():
    plain = walk()
    cut = Motion(plain.time[:50], plain.angle[:50], plain.velocity[:50], plain.step_ends[:0])
    with pytest.raises(ValueError, match="no step"):
        difference_in_phase(cut, plain, PHASES)
    with pytest.raises(ValueError, match="no stride"):
        orbit_distances(walk(steps=1), plain)


def rough(interval, impact):
    """Return a walk without samples at the end of a step. Its velocity falls until the strike, then rises from -1 to 1
    within `impact`.
    """
    time = np.arange(0.0, 1.0, interval)
    after = np.maximum(time - 0.5, 0.0)
    angle = np.where(time < 0.5, -(time**2), -(0.5**2) + after)
    velocity = np.where(after < impact, -1.0 + 2.0 * after / impact, 1.0)
    velocity = np.where(time < 0.5, -2.0 * time, velocity)
    return Motion(time, np.column_stack((angle, angle)), np.column_stack((velocity, velocity)), np.array([0.5 + 1e-13]))


def test_touch_between_samples_is_extrapolated_from_before_the_impact():
    motion = rough(interval=0.003, impact=1e-4)
    smeared = motion.values_during(0, np.array([1.0]))[1]
    whole = add_strike_samples(motion).values_during(0, np.array([1.0]))[1]
    assert_allclose(whole, -1.0, atol=1e-9)
    assert abs(smeared + 1.0).min() > 0.1


def test_samples_at_heel_strikes_need_no_extrapolation():
    motion = walk()
    assert add_strike_samples(motion) is motion


@pytest.mark.parametrize("shift", [2.0, 4.0])
def test_orbit_of_a_time_shifted_copy_is_the_same(shift):
    # The error is of second order in the interval.
    assert orbit_distances(walk(shift=shift), walk(interval=0.0037)).max() < 1e-3


def test_orbit_distance_between_circles_is_relative_to_the_range():
    def circle(radius):
        time = np.linspace(0.0, 2.0, 2001)
        ring = radius * np.cos(np.pi * time), radius * np.sin(np.pi * time)
        pair = [np.column_stack((axis, axis)) for axis in ring]
        return Motion(time, pair[0], 10.0 * pair[1], np.array([1.0, 2.0]))

    assert_allclose(orbit_distances(circle(1.1), circle(1.0)), 0.1 / 2.0, rtol=1e-3)


def test_distance_of_polylines_equals_that_of_points_sampled_densely_on_them():
    rng = np.random.default_rng(3)
    for _ in range(5):
        one, other = (np.cumsum(rng.normal(size=(12, 2)), axis=0) for _ in range(2))
        dense = [
            np.column_stack([np.interp(np.linspace(0, 11, 4001), np.arange(12), x) for x in c.T]) for c in (one, other)
        ]
        expected = max(directed_hausdorff(*dense)[0], directed_hausdorff(*dense[::-1])[0])
        assert hausdorff(one, other) == pytest.approx(expected, abs=5e-3)


def test_phase_plane_shows_angle_and_velocity_of_the_leg():
    motion = walk()
    assert_allclose(phase_plane(motion, 1), np.column_stack((motion.angle[:, 1], motion.velocity[:, 1])))


def locking(at, interval=0.003):
    """Return a walk of one step whose velocity jumps from -1 to 1 at a knee strike between samples."""
    time = np.append(np.arange(0.0, 1.0, interval), 1.0)
    angle, velocity = np.abs(time - at), np.sign(time - at)
    return Motion(
        time, np.column_stack((angle, angle)), np.column_stack((velocity, velocity)), time[-1:], np.array([at])
    )


def test_knee_strike_between_samples_is_not_smeared():
    motion = add_strike_samples(locking(0.5005))
    times = np.linspace(0.49, 0.51, 400)
    angle, velocity = motion.values_at(times)
    assert_allclose(angle[:, 0], np.abs(times - 0.5005), atol=1e-9)
    assert_allclose(velocity[:, 0], np.where(times < 0.5005, -1.0, 1.0), atol=1e-9)


def test_extrapolation_to_a_strike_stops_at_the_previous_one():
    late = replace(locking(0.9975), step_ends=np.array([0.9985]))
    assert not np.isin([0.9975, 0.9985], add_strike_samples(late).time).any()
    apart = replace(locking(0.9), step_ends=np.array([0.9985]))
    assert np.isin([0.9, 0.9985], add_strike_samples(apart).time).all()


def test_slightly_different_knee_lock_times_are_not_a_difference():
    one, other = (add_strike_samples(locking(at)) for at in (0.5045, 0.5155))
    apart = difference_in_phase(one, other, PHASES)
    smooth = smooth_phases(one, other, PHASES)
    assert max(apart.largest("velocity")) == pytest.approx(2.0)
    assert np.abs(apart.velocity[smooth]).max() < 1e-9
    assert (~smooth).sum() == (PHASES < IMPACT_PHASE).sum() + ((PHASES >= 0.5045) & (PHASES <= 0.5155)).sum()
