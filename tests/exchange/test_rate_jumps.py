"""Tests of heel strikes found by jumps of the rates, in recordings with an unknown slope or offset."""

import math
from pathlib import Path

import numpy as np
import pytest

from walkerlab.config.loader import load
from walkerlab.config.reads import restrict
from walkerlab.config.recording import Recorded
from walkerlab.exchange.columns import as_walk
from walkerlab.exchange.recording import TIME, Recording
from walkerlab.exchange.touches import MOST_FOUND, squares_around, sums_at_jumps
from walkerlab.exchange.walk_in_steps import divide_into_steps
from walkerlab.physics.mechanics.rigid_model import feet_on_slope
from walkerlab.pipeline.plan.graph import PIPELINE
from walkerlab.pipeline.progress import Silent
from walkerlab.pipeline.stages import fixedpoint, simulate
from walkerlab.scene.rigid import rigid_walker

NOISE = 2e-3
RATE_HZ = 100.0


def found_gait(config):
    return {"fixedpoint": fixedpoint.run(restrict(config, PIPELINE["fixedpoint"].takes), {}, Silent())}


def recorded(name, strides=4):
    """Return the walker of a config, with times and noisy angles (samples, 2) of its gait."""
    config = load(Path(name), (f"strides={strides}",)).config
    trajectory = simulate.run(restrict(config, PIPELINE["simulate"].takes), found_gait(config), Silent()).groups[
        "trajectory"
    ]
    rising = np.append(True, np.diff(trajectory["time"]) > 0.0)
    time, angle = trajectory["time"][rising], trajectory["angle"][rising]
    even = np.arange(0.0, time[-1], 1.0 / RATE_HZ)
    noise = NOISE * np.random.default_rng(3).standard_normal((even.size, 2))
    return rigid_walker(config), even, np.column_stack([np.interp(even, time, leg) for leg in angle.T]) + noise


def total(walker):
    return lambda angles: feet_on_slope(walker, *angles.T)


@pytest.mark.parametrize("name", ["paper", "kneed", "torso"])
@pytest.mark.parametrize("offset", [0.0, 0.02, -0.04])
def test_rates_jump_where_the_feet_meet(name, offset):
    walker, time, angle = recorded(name)
    sums = sums_at_jumps(time, angle + offset, total(walker))
    assert min(abs(each - 2.0 * offset) for each in sums) < 0.015


def test_smooth_angles_have_few_jumps():
    time = np.linspace(0.0, 6.0, 600)
    swing = 0.2 * np.sin(2.0 * math.pi * time / 1.4)
    sums = sums_at_jumps(time, np.column_stack((swing, -swing)), lambda angles: angles.sum(axis=1))
    assert len(sums) <= MOST_FOUND


def test_heel_strikes_are_found_with_offset_angles():
    walker, time, angle = recorded("paper")
    columns = {TIME: time, "angle 1": angle[:, 0] + 0.05, "angle 2": angle[:, 1] + 0.05}
    units = {TIME: "s", "angle 1": "rad", "angle 2": "rad"}
    walk = as_walk(Recording(Path("film.csv"), columns, units), Recorded())
    steps = divide_into_steps(walk, walker, "film.csv", touch_sum_rad=0.1)
    assert steps.touch_time_s.size >= 7
    assert np.diff(steps.touch_time_s) == pytest.approx(0.7036, abs=0.01)


def test_sums_of_squares_around_an_instant_equal_those_of_a_direct_fit():
    rng = np.random.default_rng(5)
    time = np.sort(rng.uniform(-1.0, 1.0, 80))
    angle = np.column_stack((np.sin(3.0 * time), np.abs(time))) + 1e-3 * rng.standard_normal((80, 2))
    instants = np.array([-1.2, -0.97, -0.3, 0.0, 0.41, 0.96])
    direct = []
    for instant in instants:
        columns = [np.ones(80)]
        for side in (time < instant, time >= instant):
            degree = min(5, 1 + int(side.sum()) // 3)
            columns += [np.where(side, time - instant, 0.0) ** power for power in range(1, degree + 1)]
        basis = np.column_stack(columns)
        direct.append(np.sum((angle - basis @ np.linalg.lstsq(basis, angle)[0]) ** 2))
    assert squares_around([(time, angle)], instants[None], 5, 3)[0] == pytest.approx(direct, rel=1e-6)
